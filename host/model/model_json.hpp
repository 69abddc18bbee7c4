#pragma once

// Models as JSON values, and model files as bytes (docs/model-file.md).

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "btfield/models.hpp"
#include "host/model/json_reading.hpp"

namespace btfield::detail {

inline constexpr const char* texture_format = "btfield";
inline constexpr const char* compound_format = "btfield-compound";
inline constexpr const char* btf_format = "btfield-btf";

[[nodiscard]] nlohmann::ordered_json size_value(Size size);
[[nodiscard]] nlohmann::ordered_json provenance_value(const Provenance& provenance);
/// 1.1 where the file has keys that 1.0 did not have.
/// \param meaning  whether it has names or spaces of planes
[[nodiscard]] nlohmann::ordered_json version_value(bool meaning, const Provenance& provenance);
/// `names` and `plane_colour_spaces`, where there are any.
void put_plane_meanings(nlohmann::ordered_json& value, const std::vector<std::string>& names,
                        const std::vector<ColourSpace>& spaces);
[[nodiscard]] nlohmann::ordered_json model_value(const TextureModel& model);
/// JSON text for people: objects indented, arrays of numbers on one line.
[[nodiscard]] std::string printed(const nlohmann::ordered_json& value);

/// Checks format and version, and notes in the context whether the file may hold more than is known.
/// \throws InputError
void read_version(json_reading::Object& object, const std::string& expected, json_reading::Context& context);
[[nodiscard]] Provenance read_provenance(const nlohmann::json& value, const std::string& where,
                                         const json_reading::Context& context);
/// Of the optional key `names`.
[[nodiscard]] std::vector<std::string> read_names(json_reading::Object& object, int planes,
                                                  const json_reading::Context& context);
/// Of the optional key `plane_colour_spaces`.
[[nodiscard]] std::vector<ColourSpace> read_plane_spaces(json_reading::Object& object, int planes,
                                                         const json_reading::Context& context);
/// \param place of the model in its file, for messages
/// \throws InputError
[[nodiscard]] TextureModel model_from(const nlohmann::json& value, const std::string& place,
                                      json_reading::Context context);

/// All of a file.
/// \throws InputError when it cannot be read or is too large for a model
[[nodiscard]] std::string model_bytes(const std::filesystem::path& path, const std::string& asked,
                                      const std::string& learner = "'btfield fit' or 'btfield compound fit'");
/// Whether models of this name are CBOR.
[[nodiscard]] bool is_cbor_name(const std::filesystem::path& path);
/// JSON, or CBOR when the name asks for it; the file appears complete or not at all.
/// \throws InputError
void write_model_value(const std::filesystem::path& path, const nlohmann::ordered_json& value,
                       const std::string& asked);

}  // namespace btfield::detail

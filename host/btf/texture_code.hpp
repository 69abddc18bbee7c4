#pragma once

// Many textures in few bytes: what they have in common stands once, and the numbers of each in single
// precision where that loses nothing (docs/model-file.md).

#include <nlohmann/json.hpp>
#include <vector>

#include "btfield/models.hpp"
#include "host/model/json_reading.hpp"

namespace btfield::detail {

/// The model with its numbers in single precision, but for bases; as it was where that makes it unsound, as
/// Markov models, whose coefficients are bound to each other.
[[nodiscard]] TextureModel single_precision(const TextureModel& model);

/// \return {"forms": models without their numbers, "textures": list of [form, bytes]}
[[nodiscard]] nlohmann::ordered_json textures_value(const std::vector<TextureModel>& textures, bool binary);
/// Bytes of a texture in there, besides its form.
[[nodiscard]] std::size_t coded_bytes(const TextureModel& model);

/// Of one texture, without anything in common.
[[nodiscard]] nlohmann::ordered_json texture_value(const TextureModel& model);
/// Inverse.
/// \throws InputError
[[nodiscard]] TextureModel texture_from(const nlohmann::json& value, const std::string& place,
                                        const json_reading::Context& context);

/// \throws InputError
[[nodiscard]] std::vector<TextureModel> textures_from(const nlohmann::json& value, const std::string& place,
                                                      const json_reading::Context& context);

}  // namespace btfield::detail

#pragma once

/// \file
/// A model as `fit` and `info` show it.

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "btfield/models.hpp"
#include "host/cli/report.hpp"

namespace btfield::cli {

/// Size of a model file; 0 of a pipe, which has none.
[[nodiscard]] std::uintmax_t model_file_bytes(const std::filesystem::path& path);

/// {`valid`, `min_singular`, `variance_ratio`, `zeros`}.
[[nodiscard]] Json certificate_json(const Certificate& certificate);

/// ", srgb", ", linear grey", ", srgb in planes 0, 1, 2"; empty: nothing is known.
[[nodiscard]] std::string spaces_text(ColourSpace space, const std::vector<ColourSpace>& of_planes);
/// "planes 400nm, 460nm, ..." as a line; nothing where planes have no names.
[[nodiscard]] std::string names_text(const std::vector<std::string>& names);
/// {name, role, planes, type} of each map of a material, and of heights their scale.
[[nodiscard]] Json maps_json(const std::vector<MaterialMap>& maps);
/// Types of values in the files that the model was fitted to: "uint8", or where maps differ "uint8, uint16 of
/// height.png".
[[nodiscard]] std::string types_text(const Provenance& provenance);
/// "maps colour albedo.png, height disp.png"; empty: there are none.
[[nodiscard]] std::string maps_text(const std::vector<MaterialMap>& maps);
/// Bytes of pixels to a byte of the file; NaN where nobody knows how large the picture was.
[[nodiscard]] double compression_ratio(const Provenance& provenance, std::uintmax_t bytes);

/// The JSON object that docs/command-line.md promises for `fit` and `info`, without `seconds` and `reasons`.
/// \param bytes size of the model file
[[nodiscard]] Json model_json(const TextureModel& model, const std::filesystem::path& path,
                              std::uintmax_t bytes);

/// The same for people: picture, model, one line per level, size.
[[nodiscard]] std::string model_text(const TextureModel& model, std::uintmax_t bytes);

/// Levels whose certificate fails, as "level 1 (12 zeros of det Λ), level 3 (…)"; empty when all
/// certify.
[[nodiscard]] std::string uncertified_levels(const TextureModel& model);

}  // namespace btfield::cli

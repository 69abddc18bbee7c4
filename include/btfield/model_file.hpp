#pragma once

/// \file
/// Models on disk: JSON, or the same schema as CBOR for names that end in .btfm (docs/model-file.md).

#include <filesystem>
#include <string>

#include "btfield/api.hpp"
#include "btfield/models.hpp"

namespace btfield {

/// Major version of the schema that this library writes and the newest that it reads.
inline constexpr int model_format_version = 1;

/// Reads and checks a model. Numbers come back bit for bit as they were written.
/// \throws InputError for a missing, empty, truncated or malformed file, an unknown major version, a missing
///     key, a non-finite number, a wrong array size, or whatever check() refuses
[[nodiscard]] BTFIELD_API TextureModel read_model(const std::filesystem::path& path);

/// Writes a model; the file appears complete or not at all.
/// \throws InputError when check() refuses the model or the file cannot be written
BTFIELD_API void write_model(const std::filesystem::path& path, const TextureModel& model);

/// \throws what write_model would throw for this name, before any work is done: folder missing or unwritable
BTFIELD_API void check_model_writable(const std::filesystem::path& path);

/// The schema without a file, as JSON text.
[[nodiscard]] BTFIELD_API std::string to_json(const TextureModel& model);
/// Inverse of to_json; takes the bytes of a CBOR model too.
/// \param source what to call the text in error messages
/// \throws InputError as read_model
[[nodiscard]] BTFIELD_API TextureModel from_json(const std::string& text,
                                                 const std::string& source = "model");

}  // namespace btfield

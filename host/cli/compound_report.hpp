#pragma once

/// \file
/// A compound model as `compound` and `info` show it.

#include <cstdint>
#include <filesystem>
#include <string>

#include "btfield/compound.hpp"
#include "host/cli/report.hpp"

namespace btfield::cli {

/// The JSON object that docs/command-line.md promises for `compound fit`, without `seconds`.
/// \param bytes size of the model file
[[nodiscard]] Json compound_json(const CompoundModel& model, const std::filesystem::path& path,
                                 std::uintmax_t bytes);

/// The same for people: picture, what was chosen, one line per region, size.
[[nodiscard]] std::string compound_text(const CompoundModel& model, std::uintmax_t bytes);

/// Regions with a certificate that fails, as "region 1 level 0 (2 zeros)"; empty when all certify.
[[nodiscard]] std::string uncertified_regions(const CompoundModel& model);

}  // namespace btfield::cli

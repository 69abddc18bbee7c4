#pragma once

#include <optional>
#include <string>
#include <vector>

#include "btfield/roller.hpp"
#include "host/roller/block_search.hpp"

namespace btfield::detail {

/// Tiles with interchangeable borders (theory 17.5).
/// \param overlap 2 to half of a side of the size, or of the sample where none is given
/// \param asked first part of the messages
/// \throws InputError when the sample does not hold them
[[nodiscard]] std::vector<SourceMap> make_tiles(const Features& features, BlockSearch& search, int count,
                                                std::optional<Size> size, int overlap, std::uint64_t seed,
                                                double tolerance, const std::string& asked);

}  // namespace btfield::detail

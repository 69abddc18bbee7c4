#pragma once

/// \file
/// Tables for people.

#include <string>
#include <string_view>
#include <vector>

namespace btfield::detail {

/// Columns as wide as their widest cell; the first row is the heading.
/// \param alignment 'l' or 'r' per column; the last letter holds for all columns that follow
[[nodiscard]] std::string table(const std::vector<std::vector<std::string>>& rows,
                                std::string_view alignment);

}  // namespace btfield::detail

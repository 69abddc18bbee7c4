#pragma once

// Zip archives, written without the library that reads them.

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

namespace btfield::test {

/// An archive of these files: name and content.
/// \param deflated  packed, else stored
[[nodiscard]] std::string zip_bytes(const std::vector<std::pair<std::string, std::string>>& files,
                                    bool deflated);

/// Gives the entries of a changed archive the checksums and sizes of what they hold now, as far as they can
/// be found and unpacked.
void repair_zip(std::uint8_t* bytes, std::size_t size);

}  // namespace btfield::test

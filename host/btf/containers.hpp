#pragma once

// UTIA's containers: TBIG 2, BIG 3 and MIF, all pictures in one file.

#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string_view>

#include "btfield/btf_output.hpp"
#include "btfield/btf_set.hpp"

namespace btfield::detail {

enum class Container { tbig, big, mif };

/// By the first 16 bytes and the number of bytes of a file; nothing where it is none.
[[nodiscard]] std::optional<Container> container_of(std::string_view head, std::uint64_t bytes);

/// \throws InputError when it ends too early, contradicts itself, or holds what is not known
[[nodiscard]] std::shared_ptr<const BtfSource> open_container(const std::filesystem::path& file,
                                                              Container kind);

/// Writes linear light as half or float, view by view. XYZ is stored with white 100; in a MIF all colours are
/// XYZ.
/// \param next  told how many pictures are written
/// \throws InputError as write_btf()
void write_container(const std::filesystem::path& file, Container kind, const BtfSet& set, PixelType type,
                     const std::function<void(std::uint64_t)>& next);

}  // namespace btfield::detail

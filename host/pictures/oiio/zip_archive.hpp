#pragma once

/// \file
/// Zip archives, in which sets of many pictures come. Through libzip, in the module of the codecs: it brings
/// libraries that a program without archives need not load.

#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <vector>

namespace btfield::detail {

struct ZipEntry {
    std::string name;
    std::uint64_t index = 0, bytes = 0;  ///< bytes of its content, unpacked
};

/// An open archive, for any number of threads.
class ZipArchive {
  public:
    virtual ~ZipArchive() = default;
    /// Files, without folders.
    [[nodiscard]] virtual const std::vector<ZipEntry>& entries() const = 0;
    /// \throws InputError when it is damaged, encrypted, or packed as libzip does not know
    [[nodiscard]] virtual std::string read(const ZipEntry& entry, const std::string& asked) const = 0;
};

/// \throws InputError when it is no archive, or claims more than could be packed in it
[[nodiscard]] std::unique_ptr<ZipArchive> open_zip(const std::filesystem::path& path,
                                                   const std::string& asked);

/// Writes files as they are, without packing them again, to an open file.
/// \param content  of file i, asked for once, in their order
/// \throws InputError when the disk is full; what content throws
void write_zip(int descriptor, const std::vector<std::string>& names,
               const std::function<std::string(std::size_t)>& content, const std::string& asked);

}  // namespace btfield::detail

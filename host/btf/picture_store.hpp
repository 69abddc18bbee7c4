#pragma once

// Where the pictures of a set lie: in folders, or in a zip archive.

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "btfield/image_io.hpp"

namespace btfield::detail {

struct StoredFile {
    std::filesystem::path name;  ///< a path; in an archive, within it
    std::uint64_t bytes = 0;
};

/// For any number of threads.
class PictureStore {
  public:
    virtual ~PictureStore() = default;
    /// By their names, in order.
    [[nodiscard]] const std::vector<StoredFile>& files() const { return files_; }
    /// \throws InputError as read_picture()
    [[nodiscard]] virtual Picture read(std::size_t file, const ReadOptions& options) const = 0;
    /// All bytes of a small file.
    [[nodiscard]] virtual std::string content(std::size_t file) const = 0;
    /// Of the file, or the archive: file_stamp().
    [[nodiscard]] virtual std::string stamp(std::size_t file) const = 0;
    /// A file beside which pictures, or folders of them, lie: the one closest to the top. −1: there is none.
    [[nodiscard]] int find(const std::string& file_name) const;

  protected:
    std::vector<StoredFile> files_;
};

/// \throws InputError when it cannot be listed
[[nodiscard]] std::unique_ptr<PictureStore> open_store(const std::filesystem::path& path,
                                                       const std::string& asked);

}  // namespace btfield::detail

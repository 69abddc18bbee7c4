#pragma once

// Textures of pictures that a fit has finished, kept until all are (theory 22.3).

#include <cstddef>
#include <filesystem>
#include <map>
#include <mutex>
#include <string>

#include "btfield/btf_textures.hpp"
#include "host/base/file_output.hpp"
#include "host/btf/picture_texture.hpp"

namespace btfield::detail {

/// A file of records, each with its length and a checksum: whenever a process ends, at most the record that
/// it was writing is lost. Locked while it is open.
class EachPart {
  public:
    /// Reads what the file holds, and cuts off a record that is not complete.
    /// \param path  empty: nothing is kept
    /// \throws InputError when the file is of another set or other options, in use, or cannot be written
    EachPart(const std::filesystem::path& path, const BtfSet& set, const BtfTexturesOptions& options);

    /// By pair, numbered as shown.
    [[nodiscard]] std::map<std::size_t, PictureTexture> take() { return std::move(done_); }
    /// Any number of threads at a time.
    /// \throws InputError
    void add(std::size_t pair, const PictureTexture& texture);

  private:
    void read(const std::string& header);

    std::string asked_;
    Descriptor file_;
    std::mutex writing_;
    std::map<std::size_t, PictureTexture> done_;
};

}  // namespace btfield::detail

#pragma once

// Textures of pictures that a fit has finished, kept until all are (theory 22.3).

#include <cstddef>
#include <filesystem>
#include <map>
#include <vector>

#include "btfield/btf_textures.hpp"
#include "host/btf/part_file.hpp"
#include "host/btf/picture_texture.hpp"

namespace btfield::detail {

/// The part of a shard, I of N, and those that lie beside a part, by name.
[[nodiscard]] std::filesystem::path shard_part(const std::filesystem::path& part, int shard, int shards);
[[nodiscard]] std::vector<std::filesystem::path> shard_parts(const std::filesystem::path& part);

/// A part of which each record is a texture.
class EachPart {
  public:
    /// \param path  empty: nothing is kept
    /// \throws InputError as PartFile
    EachPart(const std::filesystem::path& path, const BtfSet& set, const BtfTexturesOptions& options);

    /// By pair, numbered as shown.
    [[nodiscard]] std::map<std::size_t, PictureTexture> take() { return std::move(done_); }
    /// Any number of threads at a time.
    /// \throws InputError
    void add(std::size_t pair, const PictureTexture& texture);

  private:
    PartFile file_;
    std::map<std::size_t, PictureTexture> done_;
};

}  // namespace btfield::detail

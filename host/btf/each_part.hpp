#pragma once

// Textures of pictures that a fit has finished, kept until all are (theory 22.3).

#include <cstddef>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "btfield/btf_textures.hpp"
#include "host/btf/part_file.hpp"
#include "host/btf/picture_texture.hpp"

namespace btfield::detail {

/// The part of a shard, I of N, and those that lie beside a part, by name.
[[nodiscard]] std::filesystem::path shard_part(const std::filesystem::path& part, int shard, int shards);
[[nodiscard]] std::vector<std::filesystem::path> shard_parts(const std::filesystem::path& part);
/// What of the pictures is missing where shards have left parts: which shards, as far as they are of one
/// number, left none, or not all of theirs. Empty where no shard left any, or nothing is missing.
/// \param shards  their parts
/// \param missing  of so many pictures, by number
[[nodiscard]] std::string missing_text(const std::vector<std::filesystem::path>& shards,
                                       const std::vector<std::size_t>& missing);

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

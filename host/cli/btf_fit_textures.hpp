#pragma once

/// \file
/// `btf fit` by the methods that have textures, and their models as `btf info` shows them.

#include <cstdint>
#include <optional>
#include <string>

#include "btfield/btf_textures.hpp"
#include "host/cli/options.hpp"
#include "host/cli/report.hpp"

namespace btfield::cli {

struct TexturesFitArguments {
    std::string set, output, device;
    BtfOptions reading;
    BtfTexturesOptions fit;
    std::optional<Shard> shard;  ///< of each: no model is written
    bool overwrite = false, json = false;
};

/// Keeps what is done of `each` beside the model, in a file whose name ends in .part, until the model is
/// there. Ranks of mpirun are shards of it, which rank 0 joins.
void run_textures_fit(const TexturesFitArguments& options);

[[nodiscard]] Json textures_json(const BtfTextures& model, std::uintmax_t bytes);
[[nodiscard]] std::string textures_text(const BtfTextures& model, std::uintmax_t bytes);

}  // namespace btfield::cli

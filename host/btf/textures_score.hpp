#pragma once

// How far statistics of pictures are off that a fit was not shown (theory 22.4).

#include <functional>
#include <vector>

#include "btfield/btf_textures.hpp"

namespace btfield::detail {

[[nodiscard]] BtfTexturesScore score_textures(Device& device, const BtfSet& set, const BtfTextures& model,
                                              const std::vector<BtfPair>& left_out,
                                              const std::function<void(double)>& told);

}  // namespace btfield::detail

#pragma once

// How far pictures are off that a fit was not shown (theory 21.4).

#include <vector>

#include "btfield/btf_model.hpp"

namespace btfield::detail {

[[nodiscard]] BtfScore score(Device& device, const BtfSet& set, const BtfFit& fit,
                             const std::vector<BtfPair>& left_out);

}  // namespace btfield::detail

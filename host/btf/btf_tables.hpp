#pragma once

// From weights of views to the tables of a model.

#include <vector>

#include "btfield/btf_model.hpp"
#include "host/btf/joint_planes.hpp"

namespace btfield::detail {

/// IEEE half precision, as the model's file has means; of numbers from 0 on.
[[nodiscard]] std::uint16_t half_of(float value);
[[nodiscard]] float of_half(std::uint16_t bits);

[[nodiscard]] bool height_varies(const Image& height);

/// Pairs and tables of the model.
/// \param lights  that the fit was shown, by view of the set
void fill_tables(BtfModel& model, const BtfSet& set, const std::vector<std::vector<int>>& lights,
                 const std::vector<JointView>& views, const JointPlanes& planes);

}  // namespace btfield::detail

#pragma once

// From weights of views to the tables of a model.

#include <functional>
#include <vector>

#include "btfield/btf_model.hpp"
#include "host/btf/joint_planes.hpp"

namespace btfield::detail {

/// A mean as the model's file has it: of half precision, from 0 to the largest.
[[nodiscard]] float kept_mean(double mean);

[[nodiscard]] bool height_varies(const Image& height);

/// Pairs and tables of the model.
/// \param lights  that the fit was shown, by view of the set
/// \param bound   of the model's table_error; 0 keeps all pairs
void fill_tables(BtfModel& model, const BtfSet& set, const std::vector<std::vector<int>>& lights,
                 const std::vector<JointView>& views, const JointPlanes& planes, double bound,
                 const std::function<void(double share)>& progress);

}  // namespace btfield::detail

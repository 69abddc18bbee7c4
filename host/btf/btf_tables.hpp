#pragma once

// From weights of views to the tables of a model.

#include <functional>
#include <vector>

#include "btfield/btf_model.hpp"
#include "host/btf/joint_planes.hpp"

namespace btfield::detail {

/// Means as the model's file has them: of half precision, but where it is too narrow for the brightest.
void round_means(std::vector<float>& means);

[[nodiscard]] bool height_varies(const Image& height);

/// Pairs and tables of the model.
/// \param lights  that the fit was shown, by view of the set
/// \param bound   of the model's table_error; 0 keeps all pairs
void fill_tables(BtfModel& model, const BtfSet& set, const std::vector<std::vector<int>>& lights,
                 const std::vector<JointView>& views, const JointPlanes& planes, double bound,
                 const std::function<void(double share)>& progress);

}  // namespace btfield::detail

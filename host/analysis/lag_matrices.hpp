#pragma once

// Lag covariances as matrices.

#include "btfield/lag_covariance.hpp"
#include "host/base/eigen.hpp"

namespace btfield::detail {

/// C(0), symmetric to the last bit.
[[nodiscard]] Eigen::MatrixXd lag_zero(const LagCovariance& statistic);

/// C(s). Precondition: the statistic's box holds s.
[[nodiscard]] Eigen::MatrixXd lag_matrix(const LagCovariance& statistic, Offset s);

}  // namespace btfield::detail

#pragma once

#include "host/base/eigen.hpp"

namespace btfield::detail {

/// min ‖A x − b‖ over x >= 0 (Lawson and Hanson's active sets).
[[nodiscard]] Eigen::VectorXd non_negative_least_squares(const Eigen::MatrixXd& a, const Eigen::VectorXd& b);

}  // namespace btfield::detail

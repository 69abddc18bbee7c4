#pragma once

// What the kernels that work in the picture's own domain need of a linear field.

#include <span>
#include <vector>

#include "btfield/models.hpp"
#include "host/base/eigen.hpp"

namespace btfield::detail {

/// Lower triangular L with L Lᵀ = Σ and a diagonal that is not negative; Σ may be singular.
/// \throws InputError when Σ has an eigenvalue below −1e-9 of its largest
[[nodiscard]] Eigen::MatrixXd noise_root(const LinearField& field);

/// The fields of one plane each that a 2D model consists of, where no coefficient and no noise couples two
/// planes; else the field as it is.
[[nodiscard]] std::vector<LinearField> independent_planes(const LinearField& field);

/// The other way: fields that share nothing as one of all their planes, on every offset that any of them has.
[[nodiscard]] LinearField joined_planes(std::span<const Model> models);

}  // namespace btfield::detail

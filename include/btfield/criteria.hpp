#pragma once

/// \file
/// How alike two textures are.

#include <array>
#include <vector>

#include "btfield/image.hpp"

namespace btfield {

/// First- and second-order statistics of B held against those of the reference A.
struct Comparison {
    struct Plane {
        std::array<double, 2> mean{}, std{};
        double std_ratio = 0.0;  ///< B / A
    };
    std::vector<Plane> planes;
    /// Mean over planes i and lags s of |C_ii^A(s) − C_ii^B(s)| / C_ii^A(0), s from probe_lags of both sizes.
    double lag_covariance_error = 0.0;
    /// ‖C^A(0) − C^B(0)‖_F / ‖C^A(0)‖_F.
    double spectral_covariance_error = 0.0;
};

/// Sizes may differ, planes may not.
/// \throws InputError when the numbers of planes differ or a plane of A is constant.
[[nodiscard]] Comparison compare(const Image& a, const Image& b);

}  // namespace btfield

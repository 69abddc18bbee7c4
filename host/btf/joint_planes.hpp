#pragma once

// Planes of a surface that all pictures of a BTF are made of, seen through its relief (theory 21.2).

#include <array>
#include <cstddef>
#include <functional>
#include <string_view>
#include <vector>

#include "host/btf/reduced_view.hpp"
#include "host/btf/view_rays.hpp"

namespace btfield::detail {

struct JointView {
    int index = 0;                      ///< of the set's view
    std::array<double, 3> direction{};  ///< to the viewer
    ReducedView reduced;
};

struct JointPlanes {
    /// T, [pixel][plane]: mean 0, variance 1, uncorrelated, those that explain most first. As many as asked
    /// for, or as the view with most of them has.
    RowMajorMatrix planes;
    /// Of each view, for each of its rows: U, [row][plane], and the constant beside U S T.
    std::vector<RowMajorMatrix> weights;
    std::vector<std::vector<double>> offsets;
    double unexplained = 0.0;  ///< share of the variance of z
};

struct JointOptions {
    int planes = 16;
    bool periodic = false;
    int passes = 4;  ///< over U and T
    int steps = 8;   ///< of conjugate gradients on T in each
    std::function<void(double share)> progress;
};

/// Bytes that fit_joint_planes() takes at most beside the views.
/// \param rank  of the views at most
[[nodiscard]] double joint_planes_bytes(std::size_t pixels, std::size_t views, int planes, int rank);

/// Alternates between U, a least squares fit of each view, and T, conjugate gradients in picture space.
[[nodiscard]] JointPlanes fit_joint_planes(const RelievedSurface& surface,
                                           const std::vector<JointView>& views, const JointOptions& options);

}  // namespace btfield::detail

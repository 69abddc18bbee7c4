#pragma once

/// \file
/// How alike two textures are.

#include <array>
#include <vector>

#include "btfield/api.hpp"
#include "btfield/image.hpp"

namespace btfield {

/// First- and second-order statistics of B held against those of the reference A (theory 15.3), in the units
/// of the pictures' values.
struct Comparison {
    struct Plane {
        std::array<double, 2> mean{}, std{};
        double std_ratio = 0.0;  ///< B / A; NaN where A is constant
    };
    std::vector<Plane> planes;
    /// Mean over planes i that vary in A and lags s of |C_ii^A(s) − C_ii^B(s)| / C_ii^A(0), s from
    /// probe_lags of both sizes.
    double lag_covariance_error = 0.0;
    /// ‖C^A(0) − C^B(0)‖_F / ‖C^A(0)‖_F.
    double spectral_covariance_error = 0.0;
};

/// Sizes may differ, planes may not.
/// \throws InputError when a picture is empty, the numbers of planes differ or A is constant
[[nodiscard]] BTFIELD_API Comparison compare(const Image& a, const Image& b);

/// How far the histograms are apart: per plane the root mean square over u in (0, 1) of q_A(u) − q_B(u), q
/// the quantile functions, in units of A's standard deviation (theory 15.4). 0 where both planes hold the
/// same values in the same proportions; NaN where A is constant. Sizes may differ.
/// \throws InputError as compare() does
[[nodiscard]] BTFIELD_API std::vector<double> quantile_errors(const Image& a, const Image& b);

/// What covariances and histograms do not see (theory 15.5): how far the 8 × 8 patches of the pictures are
/// apart, at three scales as far as 16 pixels a side remain, in A's deviations. 0 for the same picture;
/// halves of one texture have 0.02 to 0.1, random fields of pictures with shapes 0.1 to 0.3. Planes that are
/// constant in A do not count. Sizes may differ. NaN where a side is below 8.
/// \throws InputError as compare() does
[[nodiscard]] BTFIELD_API double structure_distance(const Image& a, const Image& b);

/// Spectral decorrelation criterion κ(c) = det(Σ) / cⁿ (theory 15.1; P4 eq. 49), n = d planes, Σ the spectral
/// covariance in units where white is c.
struct Kappa {
    double kappa = 0.0;
    double cmax = 256.0;
    double white = 1.0;
    /// Largest κ with which 2D models suffice (P4 3.1).
    static constexpr double threshold = 3.0;
    /// κ <= threshold: 2D models on KLT planes lose no colour to speak of.
    [[nodiscard]] bool two_dimensional() const { return kappa <= threshold; }
    /// White level at which κ meets the threshold: κ falls with white⁻²ⁿ, so that the verdict is 3D below and
    /// 2D from here on. 0 when κ is 0.
    double white_at_threshold = 0.0;
    /// Σ, [plane][plane], mean over all pixels, in units where white is c.
    std::vector<double> covariance;
};

/// \param cmax  c, the largest value of a plane in the units of Σ
/// \param white value in the picture that is c: 1 for pictures in [0, 1], the white level for HDR
/// \throws InputError when the picture is empty, a value is NaN or infinite, or cmax or white is not a
///     positive number
[[nodiscard]] BTFIELD_API Kappa kappa(const Image& image, double cmax = 256.0, double white = 1.0);

}  // namespace btfield

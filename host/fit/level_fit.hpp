#pragma once

// One pyramid level: estimate, certificate, likelihood.

#include <cstddef>
#include <functional>
#include <string_view>
#include <vector>

#include "btfield/fit.hpp"
#include "host/fit/analysed_picture.hpp"

namespace btfield::detail {

struct FittedLevel {
    LevelModel level;
    /// Side of a frequency grid over which sums over the level's spectrum are integrals, as
    /// Examination::grid.
    int grid = 0;
    /// Smallest correlation among the kept offsets; FitOptions::correlated only.
    double weakest_kept = 0.0;
};

/// I_r of the options' model: the family's own neighbourhood unless told, with the centre for moving
/// averages. With FitOptions::correlated, the candidates among which correlated_support() chooses.
/// \throws InputError when the model cannot have the neighbourhood
[[nodiscard]] Support support_of(const FitOptions& options);

/// Offsets that a level's equations will have: those of the support, or fewer of them with
/// FitOptions::correlated.
[[nodiscard]] std::size_t offset_count(const Support& support, const FitOptions& options);

/// \param candidates support_of(options)
[[nodiscard]] FittedLevel fit_level(AnalysedLevel& data, const FitOptions& options,
                                    const Support& candidates);

/// Plane p alone: C_pp.
[[nodiscard]] LagCovariance plane_statistic(const LagCovariance& statistic, int p);
/// Plane p alone.
[[nodiscard]] Image plane_image(const Image& image, int p);

}  // namespace btfield::detail

#pragma once

// What the tables of a model say of any direction (theory 21.3).

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "btfield/btf_model.hpp"
#include "btfield/image.hpp"
#include "host/btf/direction_interpolation.hpp"
#include "host/btf/plane_moments.hpp"

namespace btfield::detail {

/// What makes a picture of planes.
struct PictureWeights {
    std::vector<double> mean;  ///< [colour]
    /// [colour] and [colour][plane]: I_c = mean_c (offset_c + Σ_k weight_ck T_k)².
    std::vector<double> offsets, weights;
    std::vector<double> contrast{};  ///< [colour]: standard deviation as a share of the mean
};

/// z = offset + slope t.
struct PlaneTone {
    double offset = 1.0, slope = 0.0;
};
/// Mean of z² 1, and z² of this contrast: what t has these moments.
[[nodiscard]] PlaneTone plane_tone(const PlaneMoments& moments, double contrast);

/// Some pixels of a surface's planes.
class SampledPlanes {
  public:
    /// \param surface  height, then planes
    explicit SampledPlanes(const Image& surface);
    /// Of weighted sums of the planes.
    [[nodiscard]] PlaneMoments moments(std::span<const double> weights) const;

  private:
    std::size_t planes_;
    std::vector<float> values_;  ///< [pixel][plane]
};

/// y for which (1 + y t)² has this contrast.
/// \param skewness, kurtosis  of t, which has mean 0 and variance 1; 0 and 3 where it is normally distributed
/// \return the y of the largest contrast where none has so much
[[nodiscard]] double depth_of_contrast(double contrast, double skewness, double kurtosis);

/// A contrast as the tables have it.
[[nodiscard]] std::int8_t kept_contrast(double contrast, double length);

[[nodiscard]] BtfDirection light_of(const BtfMeasured& model, std::size_t pair);
/// Directions of the model's pairs.
[[nodiscard]] std::vector<DirectionPair> direction_pairs(const BtfMeasured& model);

/// The pairs of a model, and what is known of all of them.
class MeasuredDirections {
  public:
    explicit MeasuredDirections(const BtfMeasured& model);
    [[nodiscard]] const DirectionPoints& points() const { return points_; }
    /// Light between pairs: the logarithm of what it would be of a matt surface that has it everywhere.
    /// \param of     DirectionPoints::interpolate()
    /// \param light  where it is asked for
    /// \param table  [pair][values], from 0 on
    [[nodiscard]] std::vector<double> light(const std::vector<PairWeight>& of, const BtfDirection& light,
                                            const std::vector<float>& table) const;

  private:
    double white_;
    std::vector<DirectionPair> pairs_;
    DirectionPoints points_;
};

class DirectionTable {
  public:
    /// \param model    is to outlive it
    /// \param surface  that contrasts are for; without one, of normally distributed planes
    explicit DirectionTable(const BtfModel& model, const Image* surface = nullptr);
    [[nodiscard]] PictureWeights weights(const BtfDirection& view, const BtfDirection& light) const;
    /// Σ_k U_k² of each colour.
    [[nodiscard]] std::vector<double> squared_lengths(const DirectionPair& at) const;
    /// Where means and contrasts are known.
    [[nodiscard]] const DirectionPoints& measured() const { return measured_.points(); }

  private:
    /// U, [colour][plane].
    [[nodiscard]] std::vector<double> interpolated(const DirectionPair& at) const;

    const BtfModel* model_;
    MeasuredDirections measured_;
    DirectionPoints kept_;
    std::optional<SampledPlanes> planes_;
};

}  // namespace btfield::detail

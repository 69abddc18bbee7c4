#pragma once

// What the tables of a model say of any direction (theory 21.3).

#include <cstdint>
#include <vector>

#include "btfield/btf_model.hpp"
#include "host/btf/direction_interpolation.hpp"
#include "host/btf/plane_tone.hpp"
#include "host/btf/seen_planes.hpp"

namespace btfield::detail {

/// What makes a picture of planes.
struct PictureWeights {
    std::vector<double> mean;  ///< [colour]
    /// [colour] and [colour][plane]: I_c = mean_c max(0, offset_c + Σ_k weight_ck T_k)².
    std::vector<double> offsets, weights;
    std::vector<double> contrast{};  ///< [colour]: standard deviation as a share of the mean
};

/// A contrast as the tables have it.
[[nodiscard]] std::int8_t kept_contrast(double contrast, double length);

[[nodiscard]] BtfDirection light_of(const BtfMeasured& model, std::size_t pair);
/// Directions of the model's pairs.
[[nodiscard]] std::vector<DirectionPair> direction_pairs(const BtfMeasured& model);

/// θ of the outermost ring of views.
[[nodiscard]] double steepest_view(const BtfMeasured& model);

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
    std::vector<DirectionPair> pairs_;
    DirectionPoints points_;
};

class DirectionTable {
  public:
    /// \param model  is to outlive it, as are the planes
    /// \param seen   that contrasts are for; without them, normally distributed ones
    explicit DirectionTable(const BtfModel& model, const SeenPlanes* seen = nullptr);
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
    const SeenPlanes* seen_;
    PlaneDistribution normal_;
};

}  // namespace btfield::detail

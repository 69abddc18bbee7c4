#pragma once

// What a table says between its directions (theory 21.3).

#include <array>
#include <cstddef>
#include <vector>

#include "btfield/btf_model.hpp"

namespace btfield::detail {

/// Of a view and a light: discs of θ and of tan θ, and the half vector. Values of surfaces are smooth in it.
using DirectionPoint = std::array<double, 6>;

struct TableWeight {
    std::size_t pair = 0;
    double weight = 0.0;
};

/// What makes a picture of planes: I_c = μ_c (m_c + Σ_k U_ck T_k)².
struct PictureWeights {
    std::vector<double> mean, offsets, weights;  ///< [colour], [colour], [colour][plane]
};

class DirectionTable {
  public:
    /// \param model  is to outlive it
    explicit DirectionTable(const BtfModel& model);
    /// Thin plates through the nearest pairs; a measured direction is itself. Directions beyond the outermost
    /// ring are those of the ring.
    [[nodiscard]] std::vector<TableWeight> interpolate(BtfDirection view, BtfDirection light) const;
    /// The nearest pairs, nearest first, and their distances.
    [[nodiscard]] std::vector<TableWeight> nearest(const BtfDirection& view, const BtfDirection& light,
                                                   std::size_t count) const;
    [[nodiscard]] PictureWeights weights(const BtfDirection& view, const BtfDirection& light) const;
    [[nodiscard]] BtfDirection view_of(std::size_t pair) const;
    [[nodiscard]] BtfDirection light_of(std::size_t pair) const;
    /// Theta of the outermost rings.
    [[nodiscard]] double steepest_view() const { return steepest_view_; }
    [[nodiscard]] double steepest_light() const { return steepest_light_; }

  private:
    [[nodiscard]] DirectionPoint point(const BtfDirection& view, const BtfDirection& light) const;

    const BtfModel* model_;
    double steepest_view_ = 0.0, steepest_light_ = 0.0;  ///< θ
    std::vector<DirectionPoint> points_;
};

}  // namespace btfield::detail

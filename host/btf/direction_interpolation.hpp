#pragma once

// Values between directions at which they are known (theory 21.3).

#include <array>
#include <cstddef>
#include <vector>

#include "btfield/btf_set.hpp"

namespace btfield::detail {

/// Of a view and a light: discs of θ and of tan θ, and the half vector. Values of surfaces are smooth in it.
using DirectionPoint = std::array<double, 6>;

struct PairWeight {
    std::size_t pair = 0;
    double weight = 0.0;
};

struct DirectionPair {
    BtfDirection view, light;
};

/// Where values of pairs are known.
class DirectionPoints {
  public:
    /// \param pairs  at least one
    explicit DirectionPoints(const std::vector<DirectionPair>& pairs);
    /// Thin plates through the nearest pairs; a pair that is there is itself. Directions beyond the outermost
    /// ring are those of the ring.
    [[nodiscard]] std::vector<PairWeight> interpolate(DirectionPair at) const;
    /// The nearest pairs, nearest first, and their distances.
    [[nodiscard]] std::vector<PairWeight> nearest(const DirectionPair& at, std::size_t count) const;
    [[nodiscard]] const std::vector<DirectionPoint>& points() const { return points_; }
    /// θ of the outermost rings.
    [[nodiscard]] double steepest_view() const { return steepest_view_; }
    [[nodiscard]] double steepest_light() const { return steepest_light_; }

  private:
    double steepest_view_ = 0.0, steepest_light_ = 0.0;  ///< θ
    std::vector<DirectionPoint> points_;
};

[[nodiscard]] double squared_distance(const DirectionPoint& a, const DirectionPoint& b);

}  // namespace btfield::detail

#pragma once

// How deep weighted sums of planes make a picture (theory 21.3).

#include <cstddef>
#include <span>
#include <vector>

namespace btfield::detail {

/// z = max(0, offset + slope t).
struct PlaneTone {
    double offset = 1.0, slope = 0.0;
};

/// How values t are distributed: their mean and deviation, and their shape in groups.
class PlaneDistribution {
  public:
    /// The normal one, mean 0 and deviation 1.
    PlaneDistribution();
    explicit PlaneDistribution(std::span<const float> values);

    /// The tone whose z² has mean 1 and this standard deviation; the deepest where none has so much. Values
    /// that are as good as constant have a tone of depth 0.
    [[nodiscard]] PlaneTone tone(double contrast) const { return tone(contrast, mean_, deviation_); }
    /// The same of values of this shape with another mean and deviation.
    [[nodiscard]] PlaneTone tone(double contrast, double mean, double deviation) const;

  private:
    struct Group {
        double value, share;  ///< of values with mean 0 and deviation 1
    };
    struct Powers {
        double second, fourth;  ///< of max(0, 1 + y t)
    };
    [[nodiscard]] Powers powers(double y) const;

    double mean_ = 0.0, deviation_ = 1.0;
    std::vector<Group> groups_;
};

}  // namespace btfield::detail

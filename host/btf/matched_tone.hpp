#pragma once

// Grown pictures with the mean and contrast of others (theory 22.2).

#include <span>
#include <vector>

namespace btfield::detail {

/// I' = factor · I^exponent.
struct Tone {
    double factor = 1.0, exponent = 1.0;
};

/// One colour of a grown picture, ready for any mean and deviation.
class TonedPlane {
  public:
    /// \param values  from 0 on
    explicit TonedPlane(std::span<const float> values);
    /// The curve with which the picture has this mean and deviation, the latter as far as a power from 1/16
    /// to 16 goes. A constant one stays so; a black one stays black.
    [[nodiscard]] Tone tone(double mean, double deviation) const;

  private:
    std::vector<double> quantiles_;  ///< of equally many values each
    double mean_ = 0.0, deviation_ = 0.0;
};

void tone_plane(std::span<float> values, const Tone& tone);

}  // namespace btfield::detail

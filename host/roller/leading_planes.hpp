#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "host/roller/features.hpp"

namespace btfield::detail {

/// The sample's planes turned such that the first ones hold nearly all of its variance, which leaves
/// distances of pixels as they are: planes of colour are much alike, those of a grey picture in RGB the same.
class LeadingPlanes {
  public:
    /// Keeps as few as leave at most `share` of the variance out.
    /// \param features outlive them
    LeadingPlanes(const Features& features, double share);

    [[nodiscard]] int kept() const { return kept_; }
    [[nodiscard]] bool all() const { return kept_ == features_->planes; }
    void keep_one_more();

    /// What is kept of a pixel, as to[0], to[stride], …
    /// \return Σ squares of what is left out, to a 10⁻¹²th of the pixel's
    double turn(const std::int16_t* pixel, float* to, std::size_t stride) const;

  private:
    const Features* features_;
    std::vector<double> axes_;  ///< [turned plane][plane], orthonormal, largest variance first
    int kept_ = 0;
};

}  // namespace btfield::detail

#pragma once

#include <cstddef>
#include <span>
#include <utility>
#include <vector>

#include "host/roller/canvas.hpp"

namespace btfield::detail {

/// Terms of lower bounds of weighted squared differences, [row][column] of positions:
///     weights (energies + known + score_scale · scores + rest_scale · rests)
struct BoundTerms {
    const float* scores = nullptr;  ///< its rows begin `pitch` values apart
    std::size_t pitch = 0;
    const float *energies = nullptr, *weights = nullptr;
    const float* rests = nullptr;  ///< or null, for 0
    float known = 0.0F, score_scale = 0.0F, rest_scale = 0.0F;
};

/// Lower bounds of one query's differences. They are computed anew when they are looked at: memory is slower.
class DifferenceBounds {
  public:
    using Entry = std::pair<float, std::size_t>;  ///< a bound and its position, in raster order

    /// \param excluded centres; positions nearer than `radius` along both axes are left out, unless these are
    /// all that there are
    DifferenceBounds(const BoundTerms& terms, int rows, int columns, std::span<const Position> excluded,
                     int radius);

    [[nodiscard]] float least() const;
    /// Those that are not above the limit, in order of position.
    [[nodiscard]] std::vector<Entry> up_to(float limit) const;

  private:
    void find_least();
    void write_row(int r, float* to) const;

    BoundTerms terms_;
    int rows_, columns_;
    std::span<const Position> excluded_;
    int radius_;
    std::vector<float> least_;  ///< of each row
};

}  // namespace btfield::detail

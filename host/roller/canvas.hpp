#pragma once

// A torus that fills up with patches of a sample (theory 17.2).

#include <cstdint>
#include <vector>

#include "btfield/roller.hpp"
#include "host/roller/features.hpp"

namespace btfield::detail {

/// Widths of the strips of a patch in which something lies already.
struct Strips {
    int top = 0, left = 0, bottom = 0, right = 0;
    auto operator<=>(const Strips&) const = default;
    [[nodiscard]] bool any() const { return top + left + bottom + right > 0; }
};

struct Position {
    int row = 0, column = 0;
    friend bool operator==(const Position&, const Position&) = default;
};

/// Cuts, and the pixels along them.
struct Cost {
    std::int64_t sum = 0, length = 0;
    Cost& operator+=(const Cost& other) {
        sum += other.sum;
        length += other.length;
        return *this;
    }
    /// Of the two pixels beside a cut.
    [[nodiscard]] double mean() const {
        return length > 0 ? static_cast<double>(sum) / (2.0 * static_cast<double>(length)) : 0.0;
    }
};

class Canvas {
  public:
    static constexpr std::uint32_t nothing = 0xffffffffU;

    /// Empty.
    /// \param features outlive the canvas
    Canvas(const Features& features, Size size)
        : features_(&features), size_(size), source_(area(size), nothing) {}
    Canvas(const Features& features, Size size, std::vector<std::uint32_t> source)
        : features_(&features), size_(size), source_(std::move(source)) {}

    /// What lies in the strips of a patch whose first pixel is at `origin`: [row][column][plane], 0 outside.
    [[nodiscard]] std::vector<std::int16_t> known(Position origin, Size patch, const Strips& strips) const;

    /// Lays the sample's patch at `from` over what is there, along minimum cuts through the strips. Patches
    /// that do not touch each other may be laid at the same time.
    Cost lay(Position origin, Size patch, const Strips& strips, Position from);

    /// \param cost of all cuts
    [[nodiscard]] SourceMap finished(const Cost& cost) &&;

  private:
    /// Of a pixel not farther beyond the lower and the right border than the torus is large.
    [[nodiscard]] std::size_t index(int row, int column) const {
        const auto height = static_cast<std::size_t>(size_.height),
                   width = static_cast<std::size_t>(size_.width);
        const auto r = static_cast<std::size_t>(row), c = static_cast<std::size_t>(column);
        return (r < height ? r : r - height) * width + (c < width ? c : c - width);
    }
    [[nodiscard]] double seam(const std::vector<std::uint32_t>& source) const;

    const Features* features_;
    Size size_;
    std::vector<std::uint32_t> source_;
};

}  // namespace btfield::detail

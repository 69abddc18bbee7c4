#pragma once

// A sample as the roller compares it (theory 17.1).

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "btfield/image.hpp"

namespace btfield::detail {

inline constexpr int smallest_rolled_side = 16, largest_rolled_side = 16384;

/// Σ of squared differences of integers from −1023 to 1023.
[[nodiscard]] std::int64_t squared_difference(const std::int16_t* a, const std::int16_t* b,
                                              std::size_t count);

/// The sample in integers, [row][column][plane], in −1023 … 1023.
struct Features {
    Size size;
    int planes = 0;
    std::vector<std::int16_t> values;
    double variance = 0.0;  ///< of all planes together

    [[nodiscard]] const std::int16_t* at(int row, int column) const {
        return values.data() + (static_cast<std::size_t>(row) * static_cast<std::size_t>(size.width) +
                                static_cast<std::size_t>(column)) *
                                   static_cast<std::size_t>(planes);
    }
    /// Squared distance of two pixels.
    [[nodiscard]] std::int64_t distance(std::size_t a, std::size_t b) const {
        const auto d = static_cast<std::size_t>(planes);
        const std::int16_t *first = values.data() + a * d, *second = values.data() + b * d;
        const auto square = [&](std::size_t p) {
            const int difference = first[p] - second[p];
            return difference * difference;
        };
        if (d == 3)
            return std::int64_t{square(0) + square(1) + square(2)};  // of most samples, without a loop
        std::int64_t sum = 0;
        for (std::size_t p = 0; p < d; ++p) sum += square(p);
        return sum;
    }
};

/// All planes of the pictures; variances of pictures and of unlike kinds of planes count alike, and those of
/// a picture's planes of one kind as they are.
/// \throws InputError as Roller's constructor says
[[nodiscard]] Features features_of(std::span<const Image> sample);

/// First lag at which the sample's correlation along its rows, or along its columns, falls below 0.2; half of
/// the side where it does not.
[[nodiscard]] int correlation_length(const Features& features, bool along_rows);

/// A random number of (seed, number): the finalisation of SplitMix64 (Steele, Lea and Flood 2014).
[[nodiscard]] std::uint64_t draw(std::uint64_t seed, std::uint64_t number);

}  // namespace btfield::detail

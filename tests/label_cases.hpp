#pragma once

// Control fields for tests: patches of regions, and single pixels among them.

#include <cstdint>
#include <random>
#include <utility>
#include <vector>

#include "btfield/control_field.hpp"

namespace btfield::test {

/// Two ragged patches of every region on the torus, and among them single pixels of any: lanes of one vector
/// are of one region in some places, of several in others. Every region has a pixel where there are enough.
inline ControlField patchy_labels(Size size, int regions, unsigned seed = 3) {
    std::mt19937 generator(seed);
    const auto below = [&](int n) { return static_cast<int>(generator() % static_cast<unsigned>(n)); };
    std::vector<std::pair<int, int>> centres;
    for (int patch = 0; patch < 2 * regions; ++patch) {
        // One after the other: compilers are free to draw arguments in any order.
        const int column = below(size.width), row = below(size.height);
        centres.emplace_back(row, column);
    }
    const auto distance = [](int a, int b, int side) {
        const int d = a < b ? b - a : a - b;
        return d < side - d ? d : side - d;
    };
    ControlField field{size, regions, {}};
    for (int r = 0; r < size.height; ++r)
        for (int c = 0; c < size.width; ++c) {
            int nearest = 0, least = 1 << 30;
            for (int patch = 0; patch < 2 * regions; ++patch) {
                const auto [row, column] = centres[static_cast<std::size_t>(patch)];
                const int dr = distance(r, row, size.height), dc = distance(c, column, size.width);
                const int d = dr * dr + dc * dc + below(3);
                if (d < least) {
                    least = d;
                    nearest = patch;
                }
            }
            const int label = below(16) == 0 ? below(regions) : nearest % regions;
            field.labels.push_back(static_cast<std::uint8_t>(label));
        }
    const std::size_t pixels = area(size);
    for (int k = 0; k < regions && pixels >= static_cast<std::size_t>(regions); ++k)
        field.labels[static_cast<std::size_t>(k) * (pixels / static_cast<std::size_t>(regions))] =
            static_cast<std::uint8_t>(k);
    return field;
}

}  // namespace btfield::test

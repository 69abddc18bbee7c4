#include "host/compound/cluster_sample.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numeric>
#include <span>

#include "host/base/parallel.hpp"
#include "host/roller/features.hpp"

namespace btfield::detail {
namespace {

using std::size_t;

/// Parts 2^halvings.
constexpr int halvings = 12;
constexpr size_t most_halved = size_t{1} << 18, pixels_judged_by = 512;
/// The same for all seeds, which then agree about most pictures.
constexpr std::uint64_t lattice_seed = 1;

/// Place of a cell's pixel along a side of `count` pixels with `cells` cells.
size_t place_in_cell(size_t cell, size_t cells, size_t count, std::uint64_t random) {
    const size_t first = cell * count / cells, end = (cell + 1) * count / cells;
    return first + random % (end - first);
}

/// One pixel of each cell.
PixelPlanes spread_pixels(const PixelPlanes& planes, Size size) {
    const auto height = static_cast<size_t>(size.height), width = static_cast<size_t>(size.width);
    const double share = static_cast<double>(most_halved) / static_cast<double>(planes.pixels);
    const auto wanted = static_cast<size_t>(std::sqrt(share) * static_cast<double>(height));
    const size_t rows = std::clamp<size_t>(wanted, 1, std::min(height, most_halved)),
                 columns = std::min(most_halved / rows, width);
    PixelPlanes spread(planes.planes, rows * columns);
    for (size_t r = 0, to = 0; r < rows; ++r)
        for (size_t c = 0; c < columns; ++c, ++to) {
            const std::uint64_t random = draw(lattice_seed, to);
            const size_t from = place_in_cell(r, rows, height, random >> 32) * width +
                                place_in_cell(c, columns, width, random & 0xffffffffU);
            for (int p = 0; p < planes.planes; ++p) spread.plane(p)[to] = planes.plane(p)[from];
        }
    return spread;
}

/// The plane in which some of the pixels spread most.
const float* widest_plane(const PixelPlanes& planes, std::span<const std::uint32_t> pixels) {
    const size_t step = pixels.size() / pixels_judged_by | 1;  // odd, as patterns seldom are
    const float* widest = planes.plane(0);
    double largest = -1.0;
    for (int p = 0; p < planes.planes; ++p) {
        const float* plane = planes.plane(p);
        const auto first = static_cast<double>(plane[pixels.front()]);
        double sum = 0.0, squares = 0.0, count = 0.0;
        for (size_t i = 0; i < pixels.size(); i += step, ++count) {
            const double v = static_cast<double>(plane[pixels[i]]) - first;
            sum += v;
            squares += v * v;
        }
        const double spread = squares - sum * sum / count;
        if (!(spread > largest)) continue;
        largest = spread;
        widest = plane;
    }
    return widest;
}

}  // namespace

PixelPlanes cluster_sample(const PixelPlanes& planes, Size size) {
    constexpr size_t parts = size_t{1} << halvings;
    if (planes.pixels <= 2 * parts) return planes;
    if (planes.pixels > most_halved) {
        const PixelPlanes spread = spread_pixels(planes, size);
        return cluster_sample(spread, {1, static_cast<int>(spread.pixels)});
    }
    std::vector<std::uint32_t> pixels(planes.pixels);
    std::iota(pixels.begin(), pixels.end(), 0U);
    const auto part_of = [&](int part, int level) {
        const auto p = static_cast<size_t>(part);
        const size_t first = p * pixels.size() >> level, end = (p + 1) * pixels.size() >> level;
        return std::span(pixels).subspan(first, end - first);
    };
    for (int level = 0; level < halvings; ++level)
        for_each_block(1 << level, [&](int part) {
            const std::span<std::uint32_t> whole = part_of(part, level);
            const auto half = static_cast<std::ptrdiff_t>(part_of(2 * part, level + 1).size());
            const float* plane = widest_plane(planes, whole);
            std::nth_element(whole.begin(), whole.begin() + half, whole.end(),
                             [&](std::uint32_t a, std::uint32_t b) { return plane[a] < plane[b]; });
        });
    PixelPlanes means(planes.planes, parts);
    for_each_block(static_cast<int>(parts), [&](int part) {
        const std::span<const std::uint32_t> own = part_of(part, halvings);
        for (int p = 0; p < planes.planes; ++p) {
            double sum = 0.0;
            for (const std::uint32_t i : own) sum += static_cast<double>(planes.plane(p)[i]);
            means.plane(p)[part] = static_cast<float>(sum / static_cast<double>(own.size()));
        }
    });
    return means;
}

}  // namespace btfield::detail

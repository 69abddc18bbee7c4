#include "host/compound/k_means.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <limits>
#include <numeric>
#include <span>
#include <utility>

#include "host/base/parallel.hpp"
#include "host/base/wide.hpp"
#include "host/base/work_part.hpp"
#include "host/roller/features.hpp"

namespace btfield::detail {
namespace {

using std::size_t;

constexpr int starts = 6, common_starts = 4, most_iterations = 50;
/// Of the common starts' best inertia: what another must be below to be preferred.
constexpr double clearly_less = 0.99;
/// Tries for each further centre: the one that leaves the least is taken.
constexpr int seeding_tries = 3;
constexpr std::uint8_t no_label = 255;
constexpr size_t block_pixels = 4096, chunk = 256;
static_assert(std::has_single_bit(static_cast<unsigned>(most_regions)) && most_means < no_label);

/// Last bits of a distance that the region has: as many as most_regions takes, more where there are more.
std::int32_t key_bits(int regions) {
    return static_cast<std::int32_t>(std::bit_ceil(static_cast<unsigned>(std::max(regions, most_regions)))) -
           1;
}
constexpr float far_away = std::numeric_limits<float>::max();

/// A squared distance, its last bits those of the region: the least of such numbers tells both.
[[gnu::always_inline]] inline std::int32_t keyed(float distance, std::int32_t bits, int region) {
    return (std::bit_cast<std::int32_t>(distance) & ~bits) | region;
}

float distance_of(std::int32_t key, std::int32_t bits) {
    return std::bit_cast<float>(key & ~bits);
}

/// The least keys of `count` <= chunk pixels from `first` on.
BTFIELD_WIDE void nearest_centres(const float* __restrict first, size_t stride, int planes,
                                  const float* centres, int regions, std::int32_t bits, size_t count,
                                  std::int32_t* __restrict keys) {
    float sums[chunk];
    for (size_t i = 0; i < count; ++i) keys[i] = std::numeric_limits<std::int32_t>::max();
    for (int k = 0; k < regions; ++k, centres += planes) {
        if (planes == 3) {  // without a detour through the memory
            const float a = centres[0], b = centres[1], c = centres[2];
            for (size_t i = 0; i < count; ++i) {
                const float x = first[i] - a, y = first[stride + i] - b, z = first[2 * stride + i] - c;
                keys[i] = std::min(keys[i], keyed(x * x + y * y + z * z, bits, k));
            }
            continue;
        }
        for (size_t i = 0; i < count; ++i) sums[i] = 0.0F;
        for (int p = 0; p < planes; ++p) {
            const float* __restrict plane = first + static_cast<size_t>(p) * stride;
            for (size_t i = 0; i < count; ++i) sums[i] += (plane[i] - centres[p]) * (plane[i] - centres[p]);
        }
        for (size_t i = 0; i < count; ++i) keys[i] = std::min(keys[i], keyed(sums[i], bits, k));
    }
}

/// What remains of distances with one more centre.
BTFIELD_WIDE void nearer_distances(const float* first, size_t stride, int planes, const float* centre,
                                   size_t count, const float* __restrict old, float* __restrict nearest) {
    for (size_t i = 0; i < count; ++i) nearest[i] = 0.0F;
    for (int p = 0; p < planes; ++p) {
        const float* __restrict plane = first + static_cast<size_t>(p) * stride;
        for (size_t i = 0; i < count; ++i) nearest[i] += (plane[i] - centre[p]) * (plane[i] - centre[p]);
    }
    for (size_t i = 0; i < count; ++i) nearest[i] = nearest[i] < old[i] ? nearest[i] : old[i];
}

/// Of pixels that were given to their nearest centres.
struct RegionSums {
    std::vector<double> values;  ///< [region][plane]
    std::vector<size_t> counts;  ///< [region]
    double inertia = 0.0;
    bool changed = false;
    std::vector<std::pair<float, size_t>> farthest;  ///< of each block: distance and pixel
};

/// Adds pixels to the sums of their regions.
/// \param planes  that many, which the compiler knows if Planes is above 0
template <int Planes>
void add_pixels(const float* first, size_t stride, size_t planes, const std::int32_t* keys, std::int32_t bits,
                size_t count, RegionSums& sums) {
    if constexpr (Planes > 0) planes = Planes;
    for (size_t i = 0; i < count; ++i) {
        const auto region = static_cast<size_t>(keys[i] & bits);
        double* sum = sums.values.data() + region * planes;
        for (size_t p = 0; p < planes; ++p) sum[p] += static_cast<double>(first[p * stride + i]);
        ++sums.counts[region];
        sums.inertia += static_cast<double>(distance_of(keys[i], bits));
    }
}

/// Labels of the pixels [first, end), and what they add to sums of their own.
RegionSums label_block(const PixelPlanes& planes, const std::vector<float>& centres, int regions,
                       std::uint8_t* labels, size_t first, size_t end) {
    const auto d = static_cast<size_t>(planes.planes);
    RegionSums sums;
    sums.values.assign(static_cast<size_t>(regions) * d, 0.0);
    sums.counts.assign(static_cast<size_t>(regions), 0);
    std::pair<float, size_t> farthest{-1.0F, first};
    std::array<std::int32_t, chunk> keys;
    const std::int32_t bits = key_bits(regions);
    for (; first < end; first += chunk) {
        const size_t count = std::min(chunk, end - first);
        const float* pixels = planes.plane(0) + first;
        nearest_centres(pixels, planes.pixels, planes.planes, centres.data(), regions, bits, count,
                        keys.data());
        if (d == 3)
            add_pixels<3>(pixels, planes.pixels, d, keys.data(), bits, count, sums);
        else
            add_pixels<0>(pixels, planes.pixels, d, keys.data(), bits, count, sums);
        for (size_t i = 0; i < count; ++i) {
            const auto label = static_cast<std::uint8_t>(keys[i] & bits);
            sums.changed |= label != labels[first + i];
            labels[first + i] = label;
        }
        const auto last = std::max_element(keys.begin(), keys.begin() + static_cast<std::ptrdiff_t>(count));
        if (distance_of(*last, bits) > farthest.first)
            farthest = {distance_of(*last, bits), first + static_cast<size_t>(last - keys.begin())};
    }
    sums.farthest.push_back(farthest);
    return sums;
}

RegionSums label_pixels(const PixelPlanes& planes, const std::vector<float>& centres, int regions,
                        std::span<std::uint8_t> labels, bool parallel) {
    const auto blocks = (planes.pixels + block_pixels - 1) / block_pixels;
    std::vector<RegionSums> parts(blocks);
    const auto work = [&](int block) {
        const auto b = static_cast<size_t>(block);
        parts[b] = label_block(planes, centres, regions, labels.data(), b * block_pixels,
                               std::min(planes.pixels, (b + 1) * block_pixels));
    };
    if (parallel)
        for_each_block(static_cast<int>(blocks), work);
    else
        for (size_t b = 0; b < blocks; ++b) work(static_cast<int>(b));
    RegionSums sums = std::move(parts.front());
    for (size_t b = 1; b < blocks; ++b) {
        for (size_t i = 0; i < sums.values.size(); ++i) sums.values[i] += parts[b].values[i];
        for (size_t k = 0; k < sums.counts.size(); ++k) sums.counts[k] += parts[b].counts[k];
        sums.inertia += parts[b].inertia;
        sums.changed = sums.changed || parts[b].changed;
        sums.farthest.push_back(parts[b].farthest.front());
    }
    return sums;
}

std::vector<float> colour_at(const PixelPlanes& planes, size_t pixel) {
    std::vector<float> colour(static_cast<size_t>(planes.planes));
    for (int p = 0; p < planes.planes; ++p) colour[static_cast<size_t>(p)] = planes.plane(p)[pixel];
    return colour;
}

/// Centres of empty regions go to the pixels farthest from theirs.
/// \return whether one did
bool fill_empty_regions(const PixelPlanes& planes, RegionSums& sums, std::vector<float>& centres) {
    std::ranges::sort(sums.farthest, [](const auto& a, const auto& b) { return a.first > b.first; });
    size_t next = 0;
    for (size_t k = 0; k < sums.counts.size(); ++k) {
        if (sums.counts[k] > 0 || next == sums.farthest.size() || !(sums.farthest[next].first > 0.0F))
            continue;
        std::ranges::copy(colour_at(planes, sums.farthest[next++].second),
                          centres.begin() + static_cast<std::ptrdiff_t>(k) * planes.planes);
    }
    return next > 0;
}

void move_centres(const PixelPlanes& planes, RegionSums& sums, std::vector<float>& centres) {
    const auto d = static_cast<size_t>(planes.planes);
    for (size_t k = 0; k < sums.counts.size(); ++k)
        for (size_t p = 0; p < d && sums.counts[k] > 0; ++p)
            centres[k * d + p] =
                static_cast<float>(sums.values[k * d + p] / static_cast<double>(sums.counts[k]));
    fill_empty_regions(planes, sums, centres);
}

/// Random numbers of one start.
class Dice {
  public:
    explicit Dice(std::uint64_t seed) : seed_(seed) {}
    /// In [0, 1).
    double roll() { return static_cast<double>(draw(seed_, next_++) >> 11) * 0x1p-53; }

  private:
    std::uint64_t seed_, next_ = 0;
};

/// Pixel where the sum of the weights reaches a share of their total.
size_t weighted_choice(const std::vector<float>& weights, double total, double share) {
    double sum = 0.0;
    size_t last = 0;  // never one of weight 0, whatever the rounding
    for (size_t i = 0; i < weights.size(); ++i) {
        if (!(weights[i] > 0.0F)) continue;
        sum += static_cast<double>(weights[i]);
        last = i;
        if (sum > share * total) break;
    }
    return last;
}

double left_with(const PixelPlanes& sample, const std::vector<float>& centre, const std::vector<float>& old,
                 std::vector<float>& nearest) {
    double total = 0.0;
    for (size_t first = 0; first < sample.pixels; first += chunk) {
        const size_t count = std::min(chunk, sample.pixels - first);
        nearer_distances(sample.plane(0) + first, sample.pixels, sample.planes, centre.data(), count,
                         old.data() + first, nearest.data() + first);
        total = std::accumulate(nearest.begin() + static_cast<std::ptrdiff_t>(first),
                                nearest.begin() + static_cast<std::ptrdiff_t>(first + count), total);
    }
    return total;
}

/// k-means++ (Arthur and Vassilvitskii 2007), each centre the best of a few.
std::vector<float> seeded_centres(const PixelPlanes& sample, int regions, Dice& dice) {
    const auto pixel = static_cast<size_t>(dice.roll() * static_cast<double>(sample.pixels));
    std::vector<float> centres = colour_at(sample, pixel), distances(sample.pixels, far_away);
    double total = left_with(sample, centres, distances, distances);
    std::vector<float> tried(sample.pixels), best_distances(sample.pixels);
    for (int k = 1; k < regions; ++k) {
        std::vector<float> best;
        double least = std::numeric_limits<double>::infinity();
        for (int attempt = 0; attempt < seeding_tries; ++attempt) {
            const std::vector<float> centre =
                colour_at(sample, weighted_choice(distances, total, dice.roll()));
            const double left = left_with(sample, centre, distances, tried);
            if (!(left < least)) continue;
            least = left;
            best = centre;
            best_distances.swap(tried);
        }
        distances.swap(best_distances);
        total = least;
        centres.insert(centres.end(), best.begin(), best.end());
    }
    return centres;
}

struct Start {
    std::vector<float> centres;
    double inertia = 0.0;
};

Start finished_start(const PixelPlanes& sample, int regions, Dice& dice) {
    Start start{seeded_centres(sample, regions, dice)};
    std::vector<std::uint8_t> labels(sample.pixels, no_label);
    for (int iteration = 0; iteration < most_iterations; ++iteration) {
        work_nearer(share_of_step);
        RegionSums sums = label_pixels(sample, start.centres, regions, labels, false);
        start.inertia = sums.inertia;
        if (!sums.changed) break;
        move_centres(sample, sums, start.centres);
    }
    return start;
}

}  // namespace

std::vector<float> k_means_centres(const PixelPlanes& sample, int regions, std::uint64_t seed) {
    std::array<Start, starts> tried;
    for_each_part(starts, [&](int start) {
        Dice dice(draw(start < common_starts ? 0 : seed, static_cast<std::uint64_t>(start)));
        tried[static_cast<size_t>(start)] = finished_start(sample, regions, dice);
    });
    const auto least = [](const Start& a, const Start& b) { return a.inertia < b.inertia; };
    Start& common = *std::min_element(tried.begin(), tried.begin() + common_starts, least);
    Start& other = *std::min_element(tried.begin() + common_starts, tried.end(), least);
    return std::move((other.inertia < clearly_less * common.inertia ? other : common).centres);
}

std::vector<std::uint8_t> k_means_labels(const PixelPlanes& planes, std::vector<float> centres, int regions,
                                         int iterations) {
    std::vector<std::uint8_t> labels(planes.pixels, no_label);
    bool settled = false;
    for (int iteration = 0; iteration < iterations && !settled; ++iteration) {
        RegionSums sums = label_pixels(planes, centres, regions, labels, true);
        settled = !sums.changed;
        if (!settled) move_centres(planes, sums, centres);
    }
    for (int round = 0; round <= regions; ++round) {
        RegionSums sums = label_pixels(planes, centres, regions, labels, true);
        if (!fill_empty_regions(planes, sums, centres)) break;
    }
    return labels;
}

}  // namespace btfield::detail

#include "host/roller/block_search.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "host/base/parallel.hpp"
#include "host/base/wide.hpp"

namespace btfield::detail {
namespace {

using std::size_t;

/// to ← weights (energies + known + scale · scores)
BTFIELD_WIDE void weighted_differences(const float* scores, const float* energies, const float* weights,
                                       float known, float scale, size_t count, float* to) {
    for (size_t i = 0; i < count; ++i) to[i] = weights[i] * (energies[i] + known + scale * scores[i]);
}

BTFIELD_WIDE float least_of(const float* values, size_t count) {
    constexpr size_t lanes = 32;
    float least[lanes];
    std::fill_n(least, lanes, std::numeric_limits<float>::infinity());
    size_t i = 0;
    for (; i + lanes <= count; i += lanes)
        for (size_t l = 0; l < lanes; ++l) least[l] = values[i + l] < least[l] ? values[i + l] : least[l];
    for (; i < count; ++i) least[0] = std::min(least[0], values[i]);
    return *std::min_element(least, least + lanes);
}

/// Places of the values that are not above the limit, few of many.
BTFIELD_WIDE void not_above(const float* values, size_t count, float limit, std::vector<size_t>& places) {
    constexpr size_t block = 64;
    limit = std::min(limit, std::numeric_limits<float>::max());  // what is excluded is infinite
    for (size_t begin = 0; begin < count; begin += block) {
        const size_t end = std::min(count, begin + block);
        int found = 0;
        for (size_t i = begin; i < end; ++i) found += values[i] <= limit ? 1 : 0;
        if (found == 0) continue;
        for (size_t i = begin; i < end; ++i)
            if (values[i] <= limit) places.push_back(i);
    }
}

/// Makes positions around the centres the worst, unless these are all that there are.
void exclude(const std::vector<Position>& centres, int radius, int rows, int columns,
             std::span<float> scores) {
    std::vector<std::pair<size_t, float>> kept;
    for (const Position& centre : centres)
        for (int r = std::max(0, centre.row - radius + 1); r < std::min(rows, centre.row + radius); ++r)
            for (int c = std::max(0, centre.column - radius + 1);
                 c < std::min(columns, centre.column + radius); ++c) {
                const size_t i =
                    static_cast<size_t>(r) * static_cast<size_t>(columns) + static_cast<size_t>(c);
                if (scores[i] == std::numeric_limits<float>::infinity()) continue;
                kept.emplace_back(i, scores[i]);
                scores[i] = std::numeric_limits<float>::infinity();
            }
    if (kept.size() < scores.size()) return;
    for (const auto& [i, score] : kept) scores[i] = score;
}

}  // namespace

BlockSearch::BlockSearch(DeviceImpl& device, const Features& features)
    : device_(&device),
      features_(&features),
      lattice_{next_fft_size(features.size.height), next_fft_size(features.size.width)},
      squares_(features.size, [&](int r, int c) {
          const std::int16_t* pixel = features.at(r, c);
          std::int64_t sum = 0;
          for (int p = 0; p < features.planes; ++p) sum += std::int64_t{pixel[p]} * pixel[p];
          return sum;
      }) {
    const auto h = static_cast<size_t>(features.size.height), w = static_cast<size_t>(features.size.width),
               d = static_cast<size_t>(features.planes);
    const auto lw = static_cast<size_t>(lattice_.width);
    std::vector<float> planes(d * area(lattice_));
    for (size_t r = 0; r < h; ++r)
        for (size_t c = 0; c < w; ++c)
            for (size_t p = 0; p < d; ++p)
                planes[p * area(lattice_) + r * lw + c] = features.values[(r * w + c) * d + p];
    norm_ = std::sqrt(static_cast<double>(squares_.sum(0, 0, features.size.height, features.size.width)));
    const Buffer pixels = device.upload(planes);
    const size_t bytes = sizeof(float) * spectrum_floats(lattice_, features.planes);
    spectrum_ = {device.buffer(bytes), device.buffer(bytes)};
    device.ffts()
        .plan(device, lattice_, device.options().fft)
        .forward(device, pixels, spectrum_, features.planes);
    device.finish();
}

const BlockSearch::Energy& BlockSearch::energy(Size patch, const Strips& strips) {
    const auto [found, is_new] = energies_.try_emplace({patch.height, patch.width, strips});
    Energy& result = found->second;
    if (!is_new) return result;
    const Size size = features_->size;
    const int rows = size.height - patch.height + 1, columns = size.width - patch.width + 1;
    result.values.resize(static_cast<size_t>(rows) * static_cast<size_t>(columns));
    for (int r = 0; r < rows; ++r)
        for (int c = 0; c < columns; ++c) {
            const std::int64_t all = squares_.sum(r, c, r + patch.height, c + patch.width);
            const std::int64_t inside =
                squares_.sum(r + strips.top, c + strips.left, r + patch.height - strips.bottom,
                             c + patch.width - strips.right);
            const auto value = static_cast<float>(all - inside);
            result.values[static_cast<size_t>(r) * static_cast<size_t>(columns) + static_cast<size_t>(c)] =
                value;
            result.largest = std::max(result.largest, value);
        }
    return result;
}

std::int64_t BlockSearch::difference(const BlockQuery& query, Size patch, Position at) const {
    const Strips& s = query.strips;
    const auto d = static_cast<size_t>(features_->planes);
    const auto width = static_cast<size_t>(patch.width) * d;
    std::int64_t sum = 0;
    for (int r = 0; r < patch.height; ++r) {
        const std::int16_t* known = query.known.data() + static_cast<size_t>(r) * width;
        const std::int16_t* here = features_->at(at.row + r, at.column);
        if (r < s.top || r >= patch.height - s.bottom) {
            sum += squared_difference(known, here, width);
            continue;
        }
        sum += squared_difference(known, here, static_cast<size_t>(s.left) * d);
        const size_t right = width - static_cast<size_t>(s.right) * d;
        sum += squared_difference(known + right, here + right, width - right);
    }
    return sum;
}

Position BlockSearch::choose(const BlockQuery& query, Size patch, int radius, double tolerance,
                             const Energy& energy, const PositionWeights& weights,
                             std::span<const float> scores, std::span<float> differences) const {
    const int rows = features_->size.height - patch.height + 1,
              columns = features_->size.width - patch.width + 1;
    const auto place = [&](size_t position) {
        return Position{static_cast<int>(position / static_cast<size_t>(columns)),
                        static_cast<int>(position % static_cast<size_t>(columns))};
    };
    double known = 0.0;
    for (const std::int16_t v : query.known) known += static_cast<double>(v) * static_cast<double>(v);

    // Squared differences about as they are, in order of position.
    const size_t count = static_cast<size_t>(rows) * static_cast<size_t>(columns);
    for (int r = 0; r < rows; ++r) {
        const size_t to = static_cast<size_t>(r) * static_cast<size_t>(columns);
        weighted_differences(scores.data() + static_cast<size_t>(r) * static_cast<size_t>(lattice_.width),
                             energy.values.data() + to, weights.values.data() + to, static_cast<float>(known),
                             -2.0F / static_cast<float>(area(lattice_)), static_cast<size_t>(columns),
                             differences.data() + to);
    }
    exclude(query.excluded, radius, rows, columns, differences);

    // Rounding of a correlation by transforms: Gentleman and Sande (1966), as in the tests of the transform,
    // three of them one after the other; then that of sums in float32.
    const double unit = std::numeric_limits<float>::epsilon();
    const double bound =
        static_cast<double>(weights.largest) *
        (6.0 * unit * (4.0 + std::log2(static_cast<double>(area(lattice_)))) * norm_ * std::sqrt(known) +
         8.0 * unit * (static_cast<double>(energy.largest) + known));
    const auto exact = [&](size_t position) {
        return static_cast<double>(weights.values[position]) *
               static_cast<double>(difference(query, patch, place(position)));
    };

    // The least is not above this, so neither is what the tolerance admits.
    const double least = static_cast<double>(least_of(differences.data(), count)) + bound;
    std::vector<size_t> candidates;
    not_above(differences.data(), count, static_cast<float>((1.0 + tolerance) * least + bound), candidates);
    double best = std::numeric_limits<double>::infinity();
    for (const size_t i : candidates)
        if (best > 0.0 && static_cast<double>(differences[i]) <= least + bound)
            best = std::min(best, exact(i));
    const double most = (1.0 + tolerance) * best;

    // Those that may be within the tolerance, in the order that the key gives: the first that is.
    std::vector<std::pair<std::uint64_t, size_t>> order;
    for (const size_t i : candidates)
        if (static_cast<double>(differences[i]) <= most + bound) order.emplace_back(draw(query.key, i), i);
    std::sort(order.begin(), order.end());
    for (const auto& [number, position] : order)
        if (exact(position) <= most) return place(position);
    return place(order.front().second);  // not reached: the best is among them
}

std::vector<Position> BlockSearch::find(std::span<const BlockQuery> queries, Size patch, int radius,
                                        double tolerance, const PositionWeights* weights) {
    std::vector<Position> found(queries.size());
    const int rows = features_->size.height - patch.height + 1,
              columns = features_->size.width - patch.width + 1;
    const auto positions = static_cast<size_t>(rows) * static_cast<size_t>(columns);
    const size_t values = area(patch) * static_cast<size_t>(features_->planes);
    PositionWeights ones;
    if (weights == nullptr) {
        ones.values.assign(positions, 1.0F);
        weights = &ones;
    }
    const std::lock_guard lock(mutex_);
    constexpr size_t kept_bytes = size_t{256} << 20;
    if (energies_.size() * positions * sizeof(float) > kept_bytes) energies_.clear();
    std::vector<const Energy*> energies(queries.size());
    for (size_t i = 0; i < queries.size(); ++i) energies[i] = &energy(patch, queries[i].strips);

    // As many at a time as keep memory in bounds; each takes about this for every plane and for its scores.
    constexpr size_t batch_bytes = size_t{64} << 20;
    const size_t bytes = sizeof(float) * (2 * area(lattice_) + values);
    const size_t batch =
        std::clamp<size_t>(std::min(batch_bytes, device_->largest_allocation() / 8) / bytes, 1, 16);
    for (size_t start = 0; start < queries.size(); start += batch) {
        const size_t n = std::min(batch, queries.size() - start);
        std::vector<float> known(n * values);
        for_each_block(static_cast<int>(n), [&](int i) {
            const auto d = static_cast<size_t>(features_->planes);
            const std::vector<std::int16_t>& from = queries[start + static_cast<size_t>(i)].known;
            float* to = known.data() + static_cast<size_t>(i) * values;
            for (size_t p = 0; p < d; ++p)
                for (size_t r = 0; r < area(patch); ++r) to[p * area(patch) + r] = from[r * d + p];
        });
        const Buffer patches = device_->upload(known);
        Buffer scores = device_->buffer(sizeof(float) * n * area(lattice_));
        device_->ffts()
            .plan(*device_, lattice_, device_->options().fft)
            .correlate(*device_, patches, patch, static_cast<int>(n), features_->planes, spectrum_, scores);
        differences_.resize(std::max(differences_.size(), n * positions));
        const auto choose_all = [&](const std::byte* bytes_there) {
            const std::span<const float> there(reinterpret_cast<const float*>(bytes_there),
                                               n * area(lattice_));
            for_each_block(static_cast<int>(n), [&](int i) {
                const size_t at = start + static_cast<size_t>(i);
                if (!queries[at].strips.any()) {
                    const size_t position = draw(queries[at].key, 0) % positions;
                    found[at] = {static_cast<int>(position / static_cast<size_t>(columns)),
                                 static_cast<int>(position % static_cast<size_t>(columns))};
                    return;
                }
                found[at] =
                    choose(queries[at], patch, radius, tolerance, *energies[at], *weights,
                           there.subspan(static_cast<size_t>(i) * area(lattice_), area(lattice_)),
                           std::span(differences_).subspan(static_cast<size_t>(i) * positions, positions));
            });
        };
        device_->look(scores, 0, sizeof(float) * n * area(lattice_), choose_all);
    }
    return found;
}

}  // namespace btfield::detail

#include "host/roller/block_search.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "host/base/parallel.hpp"
#include "host/base/wide.hpp"
#include "host/roller/difference_bounds.hpp"

namespace btfield::detail {
namespace {

using std::size_t;

/// Samples are correlated in as many planes as leave at most this part of their variance out: of bounds that
/// are off by it, one or two are below the least of the differences (theory 17.3).
constexpr double share_left_out = 0.04;
/// One more plane costs as much as to compare about so many positions of a query in integers.
constexpr std::int64_t most_compared = 256, queries_of_start = 32;
/// Of squares that are left out, summed in integers.
constexpr double rest_unit = 1.0 / 16.0;

BTFIELD_WIDE std::int64_t sum_of_squares(const std::int16_t* values, size_t count) {
    std::int64_t sum = 0;
    for (size_t i = 0; i < count; ++i) sum += static_cast<std::int64_t>(std::int32_t{values[i]} * values[i]);
    return sum;
}

/// Heaps with the least on top.
struct Later {
    template <class Key>
    bool operator()(const std::pair<Key, size_t>& a, const std::pair<Key, size_t>& b) const {
        return a > b;
    }
};

}  // namespace

BlockSearch::BlockSearch(DeviceImpl& device, const Features& features)
    : device_(&device),
      features_(&features),
      lattice_{next_fft_size(features.size.height), next_fft_size(features.size.width)},
      squares_(features.size,
               [&](int r, int c) {
                   return sum_of_squares(features.at(r, c), static_cast<size_t>(features.planes));
               }),
      planes_(features, share_left_out) {
    norm_ = std::sqrt(static_cast<double>(squares_.sum(0, 0, features.size.height, features.size.width)));
    transform_sample();
}

void BlockSearch::transform_sample() {
    const Size size = features_->size;
    const auto width = static_cast<size_t>(size.width);
    std::vector<float> planes(static_cast<size_t>(planes_.kept()) * area(lattice_));
    std::vector<std::int64_t> rests(area(size));
    for_each_block(size.height, [&](int r) {
        const auto row = static_cast<size_t>(r);
        for (size_t c = 0; c < width; ++c) {
            const double rest =
                planes_.turn(features_->at(r, static_cast<int>(c)),
                             planes.data() + row * static_cast<size_t>(lattice_.width) + c, area(lattice_));
            rests[row * width + c] = static_cast<std::int64_t>(std::ceil(rest / rest_unit));
        }
    });
    rests_ = planes_.all() ? SummedArea() : SummedArea(size, [&](int r, int c) {
        return rests[static_cast<size_t>(r) * width + static_cast<size_t>(c)];
    });
    energies_.clear();
    const Buffer pixels = device_->upload(planes);
    const size_t bytes = sizeof(float) * spectrum_floats(lattice_, planes_.kept());
    spectrum_ = {device_->buffer(bytes), device_->buffer(bytes)};
    device_->ffts()
        .plan(*device_, lattice_, device_->options().fft)
        .forward(*device_, pixels, spectrum_, planes_.kept());
    device_->finish();
}

const BlockSearch::Energy& BlockSearch::energy(Size patch, const Strips& strips) {
    const auto [found, is_new] = energies_.try_emplace({patch.height, patch.width, strips});
    Energy& result = found->second;
    if (!is_new) return result;
    const Size size = features_->size;
    const int rows = size.height - patch.height + 1, columns = size.width - patch.width + 1;
    const size_t positions = static_cast<size_t>(rows) * static_cast<size_t>(columns);
    const auto in_strips = [&](const SummedArea& of, int r, int c) {
        return of.sum(r, c, r + patch.height, c + patch.width) - of.sum(r + strips.top, c + strips.left,
                                                                        r + patch.height - strips.bottom,
                                                                        c + patch.width - strips.right);
    };
    result.values.resize(positions);
    if (!planes_.all()) result.rests.resize(positions);
    for_each_block(rows, [&](int r) {
        const size_t at = static_cast<size_t>(r) * static_cast<size_t>(columns);
        for (int c = 0; c < columns; ++c)
            result.values[at + static_cast<size_t>(c)] = static_cast<float>(in_strips(squares_, r, c));
        if (result.rests.empty()) return;
        for (int c = 0; c < columns; ++c)
            result.rests[at + static_cast<size_t>(c)] =
                static_cast<float>(std::sqrt(rest_unit * static_cast<double>(in_strips(rests_, r, c))));
    });
    result.largest = *std::max_element(result.values.begin(), result.values.end());
    return result;
}

std::int64_t BlockSearch::difference(const BlockQuery& query, Size patch, Position at, double most) const {
    const Strips& s = query.strips;
    const auto d = static_cast<size_t>(features_->planes);
    const auto width = static_cast<size_t>(patch.width) * d;
    std::int64_t sum = 0;
    for (int r = 0; r < patch.height && static_cast<double>(sum) <= most; ++r) {
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

BlockSearch::Known BlockSearch::write_known(const BlockQuery& query, Size patch, float* to) const {
    Known result;
    const auto d = static_cast<size_t>(features_->planes);
    const Strips& s = query.strips;
    std::fill_n(to, static_cast<size_t>(planes_.kept()) * area(patch), 0.0F);
    for (int r = 0; r < patch.height; ++r) {
        const bool row_known = r < s.top || r >= patch.height - s.bottom;
        for (int c = 0; c < patch.width; ++c) {
            if (!row_known && c == s.left) c = patch.width - s.right;
            if (c == patch.width) break;
            const size_t i =
                static_cast<size_t>(r) * static_cast<size_t>(patch.width) + static_cast<size_t>(c);
            result.rest += planes_.turn(query.known.data() + i * d, to + i, area(patch));
        }
    }
    result.energy = static_cast<double>(sum_of_squares(query.known.data(), query.known.size()));
    result.rest += 1e-12 * result.energy;  // what turn() may be off by
    return result;
}

BlockSearch::Choice BlockSearch::choose(const BlockQuery& query, const Known& known, const Request& request,
                                        const Energy& energy, const float* scores) const {
    const auto place = [&](size_t position) {
        const auto columns = static_cast<size_t>(request.columns);
        return Position{static_cast<int>(position / columns), static_cast<int>(position % columns)};
    };
    if (!query.strips.any())
        return {place(draw(query.key, 0) %
                      (static_cast<size_t>(request.rows) * static_cast<size_t>(request.columns))),
                0};
    // What is left out differs by at least this: (√ energies of both, subtracted)².
    const BoundTerms terms{.scores = scores,
                           .pitch = static_cast<size_t>(lattice_.width),
                           .energies = energy.values.data(),
                           .weights = request.weights->values.data(),
                           .rests = energy.rests.empty() ? nullptr : energy.rests.data(),
                           .known = static_cast<float>(known.energy),
                           .score_scale = -2.0F / static_cast<float>(area(lattice_)),
                           .rest_scale = static_cast<float>(-2.0 * std::sqrt(known.rest))};
    const DifferenceBounds bounds(terms, request.rows, request.columns, query.excluded, request.radius);

    // Rounding of a correlation by transforms: Gentleman and Sande (1966), as in the tests of the transform,
    // three of them one after the other, and of the planes; then that of sums in float32.
    const double unit = std::numeric_limits<float>::epsilon();
    const double bound = static_cast<double>(request.weights->largest) *
                         (6.0 * unit * (5.0 + std::log2(static_cast<double>(area(lattice_)))) * norm_ *
                              std::sqrt(known.energy) +
                          12.0 * unit * (static_cast<double>(energy.largest) + known.energy));
    Choice choice;
    const auto exact = [&](size_t position, double most) {
        ++choice.compared;
        const auto weight = static_cast<double>(request.weights->values[position]);
        return weight * static_cast<double>(difference(query, request.patch, place(position), most / weight));
    };

    // The least of all is among those whose bounds are not above the least so far, from the lowest bound on.
    const float lowest = bounds.least();
    constexpr double any = std::numeric_limits<double>::infinity();
    size_t best_position = bounds.up_to(lowest).front().second;
    double best = exact(best_position, any);
    std::vector<DifferenceBounds::Entry> candidates =
        bounds.up_to(static_cast<float>((1.0 + request.tolerance) * best + bound));
    std::make_heap(candidates.begin(), candidates.end(), Later());
    for (auto end = candidates.end(); best > 0.0 && end != candidates.begin(); --end) {
        const auto [value, position] = candidates.front();
        if (static_cast<double>(value) > best + bound) break;
        const double found = exact(position, best);
        if (found < best) {
            best = found;
            best_position = position;
        }
        std::pop_heap(candidates.begin(), end, Later());
    }
    const double most = (1.0 + request.tolerance) * best;

    // Those that may be within the tolerance, in the order that the key gives: the first that is.
    std::vector<std::pair<std::uint64_t, size_t>> order;
    for (const auto& [value, position] : candidates)
        if (static_cast<double>(value) <= most + bound)
            order.emplace_back(draw(query.key, position), position);
    std::make_heap(order.begin(), order.end(), Later());
    choice.at = place(best_position);
    for (auto end = order.end(); end != order.begin(); --end) {
        const size_t position = order.front().second;
        if (exact(position, most) <= most) {
            choice.at = place(position);
            break;
        }
        std::pop_heap(order.begin(), end, Later());
    }
    return choice;
}

std::vector<Position> BlockSearch::find(std::span<const BlockQuery> queries, Size patch, int radius,
                                        double tolerance, const PositionWeights* weights) {
    const Request request{.patch = patch,
                          .rows = features_->size.height - patch.height + 1,
                          .columns = features_->size.width - patch.width + 1,
                          .radius = radius,
                          .tolerance = tolerance,
                          .weights = weights};
    const auto positions = static_cast<size_t>(request.rows) * static_cast<size_t>(request.columns);
    if (weights == nullptr) {
        PositionWeights ones;
        ones.values.assign(positions, 1.0F);
        return find(queries, patch, radius, tolerance, &ones);
    }
    const std::lock_guard lock(mutex_);
    constexpr size_t kept_bytes = size_t{256} << 20;
    if (energies_.size() * positions * 2 * sizeof(float) > kept_bytes) energies_.clear();

    std::vector<Position> found;
    while (found.size() < queries.size()) {
        // As many at a time as keep memory in bounds; each takes about this for its planes and its scores.
        constexpr size_t batch_bytes = size_t{64} << 20;
        const size_t values = area(patch) * static_cast<size_t>(planes_.kept());
        const size_t bytes = sizeof(float) * (2 * area(lattice_) + values);
        const size_t batch =
            std::clamp<size_t>(std::min(batch_bytes, device_->largest_allocation() / 8) / bytes, 1, 16);
        const auto some = queries.subspan(found.size(), std::min(batch, queries.size() - found.size()));
        const size_t n = some.size();
        std::vector<const Energy*> energies(n);
        for (size_t i = 0; i < n; ++i) energies[i] = &energy(patch, some[i].strips);
        std::vector<Known> known(n);
        Buffer patches = device_->buffer(sizeof(float) * n * values);
        device_->fill(patches, [&](std::byte* to) {
            for_each_block(static_cast<int>(n), [&](int i) {
                const auto at = static_cast<size_t>(i);
                known[at] = write_known(some[at], patch, reinterpret_cast<float*>(to) + at * values);
            });
        });
        Buffer scores = device_->buffer(sizeof(float) * n * area(lattice_));
        device_->ffts()
            .plan(*device_, lattice_, device_->options().fft)
            .correlate(*device_, patches, patch, static_cast<int>(n), planes_.kept(), spectrum_,
                       {request.rows, request.columns}, scores);
        std::vector<Choice> choices(n);
        device_->look(scores, 0, sizeof(float) * n * area(lattice_), [&](const std::byte* there) {
            for_each_block(static_cast<int>(n), [&](int i) {
                const auto at = static_cast<size_t>(i);
                choices[at] = choose(some[at], known[at], request, *energies[at],
                                     reinterpret_cast<const float*>(there) + at * area(lattice_));
            });
        });
        for (const Choice& choice : choices) {
            found.push_back(choice.at);
            compared_ += choice.compared;
        }
        queries_ += static_cast<std::int64_t>(n);
        if (!planes_.all() && compared_ > most_compared * (queries_ + queries_of_start)) {
            planes_.keep_one_more();
            transform_sample();
            compared_ = queries_ = 0;
        }
    }
    return found;
}

}  // namespace btfield::detail

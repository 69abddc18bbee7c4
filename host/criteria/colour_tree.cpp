#include "host/criteria/colour_tree.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cstring>
#include <type_traits>
#include <utility>

#include "host/base/parallel.hpp"

namespace btfield::detail {
namespace {

using std::size_t;

constexpr size_t lanes = ColourTreeArrays::lanes;
constexpr float infinity = std::numeric_limits<float>::infinity();

/// Finds equal colours: open addressing over the pixels seen so far.
class ColourTable {
  public:
    explicit ColourTable(const Colours& colours)
        : colours_(&colours), mask_(std::bit_ceil(2 * colours.pixels()) - 1), cells_(mask_ + 1, empty) {}

    /// Pixels from this one on will be asked for soon.
    void prefetch(size_t pixel) {
        const size_t end = std::min(pixel + ahead, colours_->pixels());
        for (size_t k = pixel; k < end; ++k) {
            hashes_[k - pixel] = hash(colours_->at(k)) & mask_;
            __builtin_prefetch(&cells_[hashes_[k - pixel]], 1);
        }
    }

    /// Number of the pixel's colour, in order of first appearance; `next` for a new one. Pixels are asked for
    /// in order.
    std::uint32_t number(size_t pixel, std::uint32_t next, const std::vector<float>& distinct) {
        if (pixel % ahead == 0) prefetch(pixel);
        const float* const colour = colours_->at(pixel);
        const auto d = static_cast<size_t>(colours_->planes);
        for (size_t cell = hashes_[pixel % ahead];; cell = (cell + 1) & mask_) {
            std::uint32_t& found = cells_[cell];
            if (found == empty) return found = next;
            if (std::equal(colour, colour + d, distinct.data() + d * found)) return found;
        }
    }

  private:
    static constexpr std::uint32_t empty = ColourTree::none;
    static constexpr size_t ahead = 16;
    [[nodiscard]] size_t hash(const float* colour) const {
        std::uint64_t mixed = 0;
        for (int i = 0; i < colours_->planes; ++i) {
            mixed = (mixed ^ std::bit_cast<std::uint32_t>(colour[i])) * 0x9e3779b97f4a7c15ULL;
            mixed ^= mixed >> 29;
        }
        return static_cast<size_t>(mixed ^ mixed >> 32);
    }
    std::array<size_t, ahead> hashes_{};
    const Colours* colours_;
    size_t mask_;
    std::vector<std::uint32_t> cells_;
};

/// Orders colours such that every aligned run of 16, 32, 64, … of them is compact: halves at the median of
/// the widest plane, the left half always a full run.
class Arrangement {
  public:
    Arrangement(const std::vector<float>& distinct, int planes)
        : distinct_(&distinct),
          d_(static_cast<size_t>(planes)),
          rows_(distinct.size() / static_cast<size_t>(planes)) {
        for (size_t k = 0; k < rows_.size(); ++k) {
            for (size_t i = 0; i < std::min(d_, inside); ++i)
                rows_[k].value[i] = ascending(distinct[d_ * k + i]);
            rows_[k].colour = static_cast<std::uint32_t>(k);
        }
    }

    /// \return the colours in their order
    std::vector<std::uint32_t> run() {
        std::vector<std::pair<size_t, size_t>> parts{{0, rows_.size()}};
        // A few parts for each thread first, then every part to its end.
        bool halved = true;
        while (halved && parts.size() < 16) {
            std::vector<std::pair<size_t, size_t>> halves;
            for (const auto& [begin, end] : parts) {
                const size_t middle = split(begin, end);
                halves.emplace_back(begin, middle);
                if (middle < end) halves.emplace_back(middle, end);
            }
            halved = halves.size() > parts.size();
            parts = std::move(halves);
        }
        if (halved)
            for_each_block(static_cast<int>(parts.size()), [&](int part) {
                const auto& [begin, end] = parts[static_cast<size_t>(part)];
                arrange(begin, end);
            });
        std::vector<std::uint32_t> order(rows_.size());
        for (size_t k = 0; k < order.size(); ++k) order[k] = rows_[k].colour;
        return order;
    }

  private:
    /// Planes that a row has with it. Of colours with more, the plane to split at is fetched.
    static constexpr size_t inside = 3;
    struct Row {
        std::array<std::int32_t, inside> value{};
        std::uint32_t colour = 0;
    };

    /// A number that orders as the float does.
    static std::int32_t ascending(float value) {
        const auto bits = std::bit_cast<std::int32_t>(value);
        return bits < 0 ? bits ^ 0x7fffffff : bits;
    }

    void arrange(size_t begin, size_t end) {
        const size_t middle = split(begin, end);
        if (middle == end) return;
        arrange(begin, middle);
        arrange(middle, end);
    }

    /// \return where the right part begins; `end` when the run is not worth splitting
    size_t split(size_t begin, size_t end) {
        const size_t blocks = (end - begin + lanes - 1) / lanes;
        if (blocks < 2) return end;
        const size_t middle = begin + lanes * std::bit_ceil(blocks) / 2;
        const auto halve = [&]<size_t plane>(std::integral_constant<size_t, plane>) {
            const auto at = [&](size_t k) { return rows_.begin() + static_cast<std::ptrdiff_t>(k); };
            std::nth_element(at(begin), at(middle), at(end),
                             [](const Row& a, const Row& b) { return a.value[plane] < b.value[plane]; });
        };
        size_t plane = widest(begin, end);
        if (d_ > inside) {
            for (size_t k = begin; k < end; ++k)
                rows_[k].value[0] = ascending((*distinct_)[d_ * rows_[k].colour + plane]);
            plane = 0;
        }
        if (plane == 0) halve(std::integral_constant<size_t, 0>());
        if (plane == 1) halve(std::integral_constant<size_t, 1>());
        if (plane == 2) halve(std::integral_constant<size_t, 2>());
        return middle;
    }

    [[nodiscard]] size_t widest(size_t begin, size_t end) const {
        size_t plane = 0;
        float width = -1.0F;
        const auto consider = [&](size_t i, float low, float high) {
            if (high - low > width) {
                width = high - low;
                plane = i;
            }
        };
        if (d_ <= inside) {
            Row low = rows_[begin], high = low;
            for (size_t k = begin; k < end; ++k)
                for (size_t i = 0; i < inside; ++i) {
                    low.value[i] = std::min(low.value[i], rows_[k].value[i]);
                    high.value[i] = std::max(high.value[i], rows_[k].value[i]);
                }
            const auto value = [](std::int32_t number) {
                return std::bit_cast<float>(number < 0 ? number ^ 0x7fffffff : number);
            };
            for (size_t i = 0; i < d_; ++i) consider(i, value(low.value[i]), value(high.value[i]));
            return plane;
        }
        for (size_t i = 0; i < d_; ++i) {
            float low = infinity, high = -infinity;
            for (size_t k = begin; k < end; ++k) {
                const float value = (*distinct_)[d_ * rows_[k].colour + i];
                low = std::min(low, value);
                high = std::max(high, value);
            }
            consider(i, low, high);
        }
        return plane;
    }

    const std::vector<float>* distinct_;
    size_t d_;
    std::vector<Row> rows_;
};

}  // namespace

ColourTree::ColourTree(const Colours& colours, Metric metric)
    : search_(colour_searches(metric, colours.planes).front()),
      tighten_(box_updates().front()),
      left_(colours.pixels()) {
    const auto d = static_cast<size_t>(colours.planes);
    arrays_.planes = colours.planes;
    std::vector<std::uint32_t> number(left_);
    std::vector<float> distinct;
    std::vector<std::uint32_t> ends;  // number of pixels of each colour, then where they end
    distinct.reserve(colours.values.size());
    ends.reserve(left_);
    ColourTable table(colours);
    for (size_t pixel = 0; pixel < left_; ++pixel) {
        const auto next = static_cast<std::uint32_t>(ends.size());
        number[pixel] = table.number(pixel, next, distinct);
        if (number[pixel] == next) {
            distinct.insert(distinct.end(), colours.at(pixel), colours.at(pixel) + d);
            ends.push_back(0);
        }
        ++ends[number[pixel]];
    }

    const std::vector<std::uint32_t> order = Arrangement(distinct, colours.planes).run();

    queues_.resize(order.size());
    std::vector<std::uint32_t> slot_of(order.size());
    std::uint32_t at = 0;
    for (size_t slot = 0; slot < order.size(); ++slot) {
        queues_[slot] = {at, at};
        at += ends[order[slot]];
        slot_of[order[slot]] = static_cast<std::uint32_t>(slot);
    }
    pixels_.resize(left_);
    for (size_t pixel = 0; pixel < left_; ++pixel)
        pixels_[queues_[slot_of[number[pixel]]].end++] = static_cast<std::uint32_t>(pixel);
    build(distinct, order);
}

void ColourTree::build(const std::vector<float>& distinct, const std::vector<std::uint32_t>& order) {
    const auto d = static_cast<size_t>(arrays_.planes);
    size_t blocks = (order.size() + lanes - 1) / lanes;
    arrays_.points.assign(blocks * lanes * d, infinity);
    arrays_.first.assign(blocks * lanes, none);
    for (size_t slot = 0; slot < order.size(); ++slot) {
        for (size_t i = 0; i < d; ++i)
            arrays_.points[(slot / lanes * d + i) * lanes + slot % lanes] = distinct[d * order[slot] + i];
        arrays_.first[slot] = pixels_[queues_[slot].at];
    }
    arrays_.level_begin = {0};
    for (size_t below = blocks; below > 1; below = (below + lanes - 1) / lanes)
        arrays_.level_begin.push_back(arrays_.level_begin.back() + (below + lanes - 1) / lanes);
    const size_t boxes = arrays_.level_begin.back();
    arrays_.boxes.resize(boxes * lanes * 2 * d);
    for (size_t block = 0; block < boxes; ++block) {
        float* const lows = arrays_.boxes.data() + block * lanes * 2 * d;
        std::fill(lows, lows + lanes * d, infinity);
        std::fill(lows + lanes * d, lows + lanes * 2 * d, -infinity);
    }
    arrays_.lowest.assign(boxes * lanes, none);
    for (int level = 0; level < arrays_.levels(); ++level) {
        for (size_t block = 0; block < blocks; ++block) tighten_(arrays_, level, block);
        blocks = (blocks + lanes - 1) / lanes;
    }
}

void ColourTree::take(std::uint32_t slot) {
    const auto d = static_cast<size_t>(arrays_.planes);
    Queue& queue = queues_[slot];
    ++queue.at;
    --left_;
    size_t block = slot / lanes;
    if (queue.at < queue.end) {
        arrays_.first[slot] = pixels_[queue.at];
    } else {
        arrays_.first[slot] = none;
        for (size_t i = 0; i < d; ++i) arrays_.points[(block * d + i) * lanes + slot % lanes] = infinity;
    }
    if (noting_ && !noted_[slot]) {
        noted_[slot] = true;
        changes_.push_back(slot);
    }
    for (int level = 0; level < arrays_.levels() && tighten_(arrays_, level, block); ++level) block /= lanes;
}

void ColourTree::clear_changes() {
    if (!noting_) {
        noting_ = true;
        noted_.assign(arrays_.first.size(), false);
    }
    for (const std::uint32_t slot : changes_) noted_[slot] = false;
    changes_.clear();
}

}  // namespace btfield::detail

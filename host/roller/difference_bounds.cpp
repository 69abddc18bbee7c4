#include "host/roller/difference_bounds.hpp"

#include <algorithm>
#include <cstdlib>
#include <limits>

#include "host/base/parallel.hpp"
#include "host/base/wide.hpp"

namespace btfield::detail {
namespace {

using std::size_t;

constexpr float left_out = std::numeric_limits<float>::infinity();

BTFIELD_WIDE void write_bounds(const BoundTerms& of, size_t count, float* to) {
    if (of.rests == nullptr)
        for (size_t i = 0; i < count; ++i)
            to[i] = of.weights[i] * (of.energies[i] + of.known + of.score_scale * of.scores[i]);
    else
        for (size_t i = 0; i < count; ++i)
            to[i] = of.weights[i] *
                    (of.energies[i] + of.known + of.score_scale * of.scores[i] + of.rest_scale * of.rests[i]);
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

}  // namespace

DifferenceBounds::DifferenceBounds(const BoundTerms& terms, int rows, int columns,
                                   std::span<const Position> excluded, int radius)
    : terms_(terms),
      rows_(rows),
      columns_(columns),
      excluded_(excluded),
      radius_(radius),
      least_(static_cast<size_t>(rows)) {
    find_least();
    if (least() < left_out) return;
    excluded_ = {};
    find_least();
}

float DifferenceBounds::least() const {
    return *std::min_element(least_.begin(), least_.end());
}

std::vector<DifferenceBounds::Entry> DifferenceBounds::up_to(float limit) const {
    limit = std::min(limit, std::numeric_limits<float>::max());
    std::vector<Entry> result;
    std::vector<float> row(static_cast<size_t>(columns_));
    for (int r = 0; r < rows_; ++r) {
        if (least_[static_cast<size_t>(r)] > limit) continue;
        write_row(r, row.data());
        constexpr size_t part = 64;  // few rows have more than one that holds any
        for (size_t begin = 0; begin < row.size(); begin += part) {
            const size_t end = std::min(row.size(), begin + part);
            if (least_of(row.data() + begin, end - begin) > limit) continue;
            for (size_t c = begin; c < end; ++c)
                if (row[c] <= limit) result.emplace_back(row[c], static_cast<size_t>(r) * row.size() + c);
        }
    }
    return result;
}

void DifferenceBounds::find_least() {
    constexpr int rows_of_block = 64;
    for_each_block((rows_ + rows_of_block - 1) / rows_of_block, [&](int block) {
        std::vector<float> row(static_cast<size_t>(columns_));
        for (int r = block * rows_of_block; r < std::min(rows_, (block + 1) * rows_of_block); ++r) {
            write_row(r, row.data());
            least_[static_cast<size_t>(r)] = least_of(row.data(), row.size());
        }
    });
}

void DifferenceBounds::write_row(int r, float* to) const {
    const size_t at = static_cast<size_t>(r) * static_cast<size_t>(columns_);
    BoundTerms row = terms_;
    row.scores += static_cast<size_t>(r) * row.pitch;
    row.energies += at;
    row.weights += at;
    if (row.rests != nullptr) row.rests += at;
    write_bounds(row, static_cast<size_t>(columns_), to);
    const int reach = radius_ - 1;
    for (const Position& centre : excluded_) {
        const int begin = std::max(0, centre.column - reach),
                  end = std::min(columns_, centre.column + reach + 1);
        if (std::abs(centre.row - r) <= reach && begin < end) std::fill(to + begin, to + end, left_out);
    }
}

}  // namespace btfield::detail

#include "host/roller/canvas.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "host/base/parallel.hpp"
#include "host/roller/minimum_cut.hpp"

namespace btfield::detail {

using std::size_t;

std::vector<std::int16_t> Canvas::known(Position origin, Size patch, const Strips& strips) const {
    const auto d = static_cast<size_t>(features_->planes);
    std::vector<std::int16_t> values(area(patch) * d, 0);
    for (int r = 0; r < patch.height; ++r) {
        const bool row_known = r < strips.top || r >= patch.height - strips.bottom;
        for (int c = 0; c < patch.width; ++c) {
            if (!row_known && c >= strips.left && c < patch.width - strips.right) continue;
            const std::int16_t* from =
                features_->values.data() + d * source_[index(origin.row + r, origin.column + c)];
            std::copy(from, from + d,
                      values.data() + d * (static_cast<size_t>(r) * static_cast<size_t>(patch.width) +
                                           static_cast<size_t>(c)));
        }
    }
    return values;
}

Cost Canvas::lay(Position origin, Size patch, const Strips& strips, Position from) {
    const auto source = [&](int r, int c) {
        return static_cast<std::uint32_t>((from.row + r) * features_->size.width + from.column + c);
    };
    const auto error = [&](int r, int c) {
        return features_->distance(source_[index(origin.row + r, origin.column + c)], source(r, c));
    };
    const int bottom = patch.height - 1, right = patch.width - 1;
    Cost cost;
    const auto cut = [&](int rows, int columns, auto error_at) {
        if (columns == 0) return std::vector<int>(static_cast<size_t>(rows), 0);
        std::vector<std::int64_t> errors(static_cast<size_t>(rows) * static_cast<size_t>(columns));
        std::int64_t* to = errors.data();
        for (int r = 0; r < rows; ++r)
            for (int c = 0; c < columns; ++c) *to++ = error_at(r, c);
        BoundaryCut found = minimum_cut(errors, rows, columns);
        cost += {found.cost, rows};
        return found.cut;
    };
    const auto from_left = cut(patch.height, strips.left, error);
    const auto from_right =
        cut(patch.height, strips.right, [&](int r, int c) { return error(r, right - c); });
    const auto from_top = cut(patch.width, strips.top, [&](int c, int r) { return error(r, c); });
    const auto from_bottom =
        cut(patch.width, strips.bottom, [&](int c, int r) { return error(bottom - r, c); });
    for (int r = 0; r < patch.height; ++r) {
        const auto row = static_cast<size_t>(r);
        // Cuts stay inside of their strips.
        const bool crossed = r < strips.top || bottom - r < strips.bottom;
        for (int c = from_left[row]; c <= right - from_right[row]; ++c) {
            const auto column = static_cast<size_t>(c);
            if (!crossed || (r >= from_top[column] && bottom - r >= from_bottom[column]))
                source_[index(origin.row + r, origin.column + c)] = source(r, c);
        }
    }
    return cost;
}

SourceMap Canvas::finished(const Cost& cost) && {
    const double of_seam = seam(source_);
    return {size_, features_->size, std::move(source_), cost.mean() / features_->variance, of_seam};
}

double Canvas::seam(const std::vector<std::uint32_t>& source) const {
    struct Steps {
        double across = 0.0, inside = 0.0;
        std::int64_t cuts = 0, others = 0;
    };
    std::vector<Steps> of_row(static_cast<size_t>(size_.height));
    const auto width = static_cast<std::uint32_t>(features_->size.width);
    for_each_block(size_.height, [&](int r) {
        Steps& steps = of_row[static_cast<size_t>(r)];
        const auto add = [&](std::uint32_t a, std::uint32_t b, bool neighbours) {
            const double step = std::sqrt(static_cast<double>(features_->distance(a, b)));
            (neighbours ? steps.inside : steps.across) += step;
            ++(neighbours ? steps.others : steps.cuts);
        };
        for (int c = 0; c < size_.width; ++c) {
            const std::uint32_t a = source[index(r, c)];
            const std::uint32_t right = source[index(r, c + 1)], below = source[index(r + 1, c)];
            add(a, right, right == a + 1 && right % width != 0);
            add(a, below, below == a + width);
        }
    });
    Steps all;
    for (const Steps& steps : of_row) {
        all.across += steps.across;
        all.inside += steps.inside;
        all.cuts += steps.cuts;
        all.others += steps.others;
    }
    if (all.cuts == 0 || all.others == 0 || all.inside == 0.0) return 0.0;
    return all.across / static_cast<double>(all.cuts) / (all.inside / static_cast<double>(all.others));
}

}  // namespace btfield::detail

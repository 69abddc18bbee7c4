#include "host/roller/quilt.hpp"

#include <algorithm>
#include <cstdlib>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "host/base/parallel.hpp"
#include "host/base/wide.hpp"
#include "host/base/work_part.hpp"

namespace btfield::detail {
namespace {

using std::size_t;

/// Patches along one side of a torus.
struct Row {
    int length = 0, side = 0;
    std::vector<int> begins;

    Row(int torus, int block, int overlap) : length(torus) {
        const int count = std::max(2, (torus + block - overlap - 1) / (block - overlap));
        for (int i = 0; i < count; ++i)
            begins.push_back(static_cast<int>(static_cast<std::int64_t>(i) * torus / count));
        // A strip of a patch belongs to one neighbour only.
        side = std::min({block, torus, 2 * (torus / count)});
    }
    [[nodiscard]] int count() const { return static_cast<int>(begins.size()); }
    /// From patch i − 1 to patch i, on the torus.
    [[nodiscard]] int step(int i) const {
        const int n = count(), at = (i + n) % n;
        return at > 0 ? begins[static_cast<size_t>(at)] - begins[static_cast<size_t>(at) - 1]
                      : length - begins.back();
    }
    /// Pixels that patch i shares with the one before.
    [[nodiscard]] int overlap(int i) const { return side - step(i); }
};

struct Block {
    int row = 0, column = 0;
};

/// Blocks of a grid on a torus, in turns: those of a turn do not touch each other, and each finds its upper
/// neighbours, and the left one, as if all were laid one after the other.
std::vector<std::vector<Block>> turns(int rows, int columns) {
    std::vector<Block> order;
    for (int r = 0; r < rows; ++r)
        for (int c = 0; c < columns; ++c) order.push_back({r, c});
    std::stable_sort(order.begin(), order.end(),
                     [](Block a, Block b) { return 2 * a.row + a.column < 2 * b.row + b.column; });
    std::vector<std::vector<Block>> result;
    std::vector<int> turn_of(static_cast<size_t>(rows) * static_cast<size_t>(columns), -1);
    for (const Block b : order) {
        int turn = 0;
        for (int r = b.row - 1; r <= b.row + 1; ++r)
            for (int c = b.column - 1; c <= b.column + 1; ++c)
                turn = std::max(
                    turn, 1 + turn_of[static_cast<size_t>((r + rows) % rows) * static_cast<size_t>(columns) +
                                      static_cast<size_t>((c + columns) % columns)]);
        turn_of[static_cast<size_t>(b.row) * static_cast<size_t>(columns) + static_cast<size_t>(b.column)] =
            turn;
        if (static_cast<size_t>(turn) == result.size()) result.emplace_back();
        result[static_cast<size_t>(turn)].push_back(b);
    }
    return result;
}

size_t index(const Row& right, Block b) {
    return static_cast<size_t>(b.row) * static_cast<size_t>(right.count()) + static_cast<size_t>(b.column);
}
Position origin(const Row& down, const Row& right, Block b) {
    return {down.begins[static_cast<size_t>(b.row)], right.begins[static_cast<size_t>(b.column)]};
}

/// What lies where the block goes, and where its neighbours would go on.
BlockQuery query(const Canvas& canvas, const Row& down, const Row& right,
                 const std::vector<std::optional<Position>>& chosen, Block b) {
    const auto neighbour = [&](int rows, int columns) -> const std::optional<Position>& {
        return chosen[index(right, {(b.row + rows + down.count()) % down.count(),
                                    (b.column + columns + right.count()) % right.count()})];
    };
    BlockQuery result;
    if (neighbour(-1, 0)) result.strips.top = down.overlap(b.row);
    if (neighbour(0, -1)) result.strips.left = right.overlap(b.column);
    if (neighbour(1, 0)) result.strips.bottom = down.overlap(b.row + 1);
    if (neighbour(0, 1)) result.strips.right = right.overlap(b.column + 1);
    for (int r = -1; r <= 1; ++r)
        for (int c = -1; c <= 1; ++c)
            if (const auto& at = neighbour(r, c); at && (r != 0 || c != 0))
                result.excluded.push_back(
                    {at->row - (r < 0 ? -down.step(b.row) : r * down.step(b.row + 1)),
                     at->column - (c < 0 ? -right.step(b.column) : c * right.step(b.column + 1))});
    result.known = canvas.known(origin(down, right, b), {down.side, right.side}, result.strips);
    return result;
}

/// What a position costs whose pixels are in as many patches as the average one plus one, in squared
/// differences: of 0, 1, 4 and 10, 4 is the first that keeps the sample's patches (theory 17.3).
constexpr double usage_price = 4.0;

/// to ← to + factor · values, of integers.
BTFIELD_WIDE void add_multiple(double factor, const double* values, size_t count, double* to) {
    for (size_t i = 0; i < count; ++i) to[i] += factor * values[i];
}

/// How often the sample's pixels are in patches. The positions that fit best are those where little happens:
/// without a price on what was taken before, they would take over (theory 17.3).
class Usage {
  public:
    Usage(Size sample, Size patch)
        : sample_(sample),
          patch_(patch),
          rows_(sample.height - patch.height + 1),
          columns_(sample.width - patch.width + 1),
          shared_(static_cast<size_t>(rows_) * static_cast<size_t>(columns_), 0.0) {
        for (int lag = 1 - patch.width; lag < patch.width; ++lag)
            widths_.push_back(patch.width - std::abs(lag));
        weights_.values.assign(shared_.size(), 1.0F);
    }

    void add(std::span<const Position> places) {
        patches_ += static_cast<std::int64_t>(places.size());
        const double pixels = static_cast<double>(area(patch_));
        const double mean = static_cast<double>(patches_) * pixels / static_cast<double>(area(sample_));
        const double scale = usage_price / (pixels * (1.0 + mean));
        constexpr int rows_of_block = 32;
        std::vector<double> most(static_cast<size_t>((rows_ + rows_of_block - 1) / rows_of_block));
        for_each_block(static_cast<int>(most.size()), [&](int block) {
            std::vector<double> largest(static_cast<size_t>(columns_), 0.0);
            for (int r = block * rows_of_block; r < std::min(rows_, (block + 1) * rows_of_block); ++r) {
                const size_t row = static_cast<size_t>(r) * static_cast<size_t>(columns_);
                double* shared = shared_.data() + row;
                for (const Position& at : places) add_shared(at, r, shared);
                float* to = weights_.values.data() + row;
                for (size_t c = 0; c < largest.size(); ++c) {
                    largest[c] = largest[c] < shared[c] ? shared[c] : largest[c];
                    to[c] = static_cast<float>(1.0 + scale * shared[c]);
                }
            }
            most[static_cast<size_t>(block)] = *std::max_element(largest.begin(), largest.end());
        });
        weights_.largest = static_cast<float>(1.0 + scale * *std::max_element(most.begin(), most.end()));
    }

    [[nodiscard]] const PositionWeights& weights() const { return weights_; }

  private:
    /// What the patch at a place has in common with those of a row of positions.
    void add_shared(Position at, int row, double* shared) const {
        const int height = patch_.height - std::abs(at.row - row);
        if (height <= 0) return;
        const int begin = std::max(0, at.column - patch_.width + 1),
                  end = std::min(columns_, at.column + patch_.width);
        add_multiple(height, widths_.data() + (begin - at.column + patch_.width - 1),
                     static_cast<size_t>(end - begin), shared + begin);
    }

    Size sample_, patch_;
    int rows_, columns_;  ///< of positions
    std::vector<double>
        shared_;  ///< pixels that a patch at a position has in common with those laid, integers
    std::vector<double> widths_;  ///< columns that two patches have in common, by lag
    PositionWeights weights_;
    std::int64_t patches_ = 0;
};

/// Blocks of this many correlation lengths hold structure and leave a choice (theory 17.4).
constexpr int block_lengths = 4, usual_block = 96;

}  // namespace

int usual_block_of(const Features& features) {
    const int side = std::min(features.size.height, features.size.width);
    const int length = std::max(correlation_length(features, false), correlation_length(features, true));
    return std::max(smallest_block,
                    std::clamp(block_lengths * length, std::min(usual_block, 3 * side / 16), side / 4));
}

SourceMap make_quilt(const Features& features, BlockSearch& search, Size size, int block, int overlap,
                     const RollerOptions& options, QuiltPlan* plan) {
    const Row down(size.height, block, overlap), right(size.width, block, overlap);
    const Size patch{down.side, right.side};
    if (plan != nullptr) *plan = {size, patch, {}};
    Canvas canvas(features, size);
    std::vector<std::optional<Position>> chosen(static_cast<size_t>(down.count()) *
                                                static_cast<size_t>(right.count()));
    Usage usage(features.size, patch);
    Cost cost;
    size_t laid = 0;
    for (const std::vector<Block>& turn : turns(down.count(), right.count())) {
        std::vector<BlockQuery> queries(turn.size());
        for_each_block(static_cast<int>(turn.size()), [&](int i) {
            const auto n = static_cast<size_t>(i);
            queries[n] = query(canvas, down, right, chosen, turn[n]);
            queries[n].key = draw(options.seed, index(right, turn[n]));
        });
        const std::vector<Position> found =
            search.find(queries, patch, std::max(1, block / 4), options.tolerance, &usage.weights());
        std::vector<Cost> costs(turn.size());
        for_each_block(static_cast<int>(turn.size()), [&](int i) {
            const auto n = static_cast<size_t>(i);
            costs[n] = canvas.lay(origin(down, right, turn[n]), patch, queries[n].strips, found[n]);
        });
        for (size_t n = 0; n < turn.size(); ++n) {
            chosen[index(right, turn[n])] = found[n];
            cost += costs[n];
        }
        if (plan != nullptr) {
            std::vector<Placement>& placements = plan->turns.emplace_back();
            for (size_t n = 0; n < turn.size(); ++n)
                placements.push_back({origin(down, right, turn[n]), found[n], queries[n].strips});
        }
        laid += turn.size();
        if (laid < chosen.size()) usage.add(found);
        const double share = static_cast<double>(laid) / static_cast<double>(chosen.size());
        work_done(share);
        if (options.progress) options.progress(share);
    }
    return std::move(canvas).finished(cost);
}

SourceMap lay_finer(const Features& features, const QuiltPlan& plan, int scale) {
    const auto scaled = [&](Position at) { return Position{scale * at.row, scale * at.column}; };
    const Size patch{scale * plan.patch.height, scale * plan.patch.width};
    Canvas canvas(features, {scale * plan.size.height, scale * plan.size.width});
    Cost cost;
    for (const std::vector<Placement>& turn : plan.turns) {
        std::vector<Cost> costs(turn.size());
        for_each_block(static_cast<int>(turn.size()), [&](int i) {
            const auto n = static_cast<size_t>(i);
            const Strips& strips = turn[n].strips;
            costs[n] = canvas.lay(
                scaled(turn[n].origin), patch,
                {scale * strips.top, scale * strips.left, scale * strips.bottom, scale * strips.right},
                scaled(turn[n].from));
        });
        for (const Cost& own : costs) cost += own;
    }
    return std::move(canvas).finished(cost);
}

}  // namespace btfield::detail

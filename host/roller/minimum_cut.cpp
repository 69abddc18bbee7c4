#include "host/roller/minimum_cut.hpp"

#include <algorithm>
#include <cstddef>
#include <limits>

#include "host/base/stop.hpp"
namespace btfield::detail {
namespace {

using std::size_t;

constexpr std::int64_t unreachable = std::numeric_limits<std::int64_t>::max() / 4;

/// Least costs to each place of a row, and where they come from.
class CutTable {
  public:
    CutTable(std::span<const std::int64_t> errors, int rows, int columns)
        : rows_(rows),
          places_(columns - 1),
          steps_(static_cast<size_t>(rows) * static_cast<size_t>(places_)) {
        own_.resize(steps_.size());
        for (int r = 0; r < rows; ++r) {
            const std::int64_t* row = errors.data() + static_cast<size_t>(r) * static_cast<size_t>(columns);
            for (int c = 0; c < places_; ++c) own_[at(r, c)] = row[c] + row[c + 1];
        }
    }

    /// Of the paths that begin at `first` to one place beside, or anywhere where it is −1, and end, where it
    /// is not, within one place of it.
    [[nodiscard]] BoundaryCut best(int first) {
        std::vector<std::int64_t> above(static_cast<size_t>(places_)), here(above.size());
        for (int c = 0; c < places_; ++c)
            above[static_cast<size_t>(c)] = first < 0 || c == first ? own_[at(0, c)] : unreachable;
        for (int r = 1; r < rows_; ++r) {
            for (int c = 0; c < places_; ++c) {
                int from = c;
                for (const int other : {c - 1, c + 1}) {
                    if (other < 0 || other >= places_) continue;
                    const auto a = above[static_cast<size_t>(other)], b = above[static_cast<size_t>(from)];
                    if (a < b || (a == b && other < from)) from = other;
                }
                steps_[at(r, c)] = from;
                here[static_cast<size_t>(c)] =
                    std::min(unreachable, above[static_cast<size_t>(from)] + own_[at(r, c)]);
            }
            std::swap(above, here);
        }
        const int begin = first < 0 ? 0 : std::max(0, first - 1);
        const int end = first < 0 ? places_ : std::min(places_, first + 2);
        int place =
            static_cast<int>(std::min_element(above.begin() + begin, above.begin() + end) - above.begin());
        BoundaryCut result{std::vector<int>(static_cast<size_t>(rows_)), above[static_cast<size_t>(place)]};
        for (int r = rows_ - 1; r >= 0; --r) {
            result.cut[static_cast<size_t>(r)] = place + 1;
            if (r > 0) place = steps_[at(r, place)];
        }
        return result;
    }

    [[nodiscard]] int places() const { return places_; }

  private:
    [[nodiscard]] size_t at(int row, int place) const {
        return static_cast<size_t>(row) * static_cast<size_t>(places_) + static_cast<size_t>(place);
    }
    int rows_, places_;
    std::vector<int> steps_;
    std::vector<std::int64_t> own_;
};

}  // namespace

BoundaryCut minimum_cut(std::span<const std::int64_t> errors, int rows, int columns, bool closed) {
    CutTable table(errors, rows, columns);
    if (!closed) return table.best(-1);
    BoundaryCut result{{}, unreachable};
    for (int first = 0; first < table.places(); ++first) {
        stop_if_asked();
        BoundaryCut found = table.best(first);
        if (found.cost < result.cost) result = std::move(found);
    }
    return result;
}

}  // namespace btfield::detail

#include "host/btf/kept_directions.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "host/base/parallel.hpp"

namespace btfield::detail {
namespace {

using Eigen::Index;

/// The first ones: one pair in so many. In each further round the number grows by this share.
constexpr std::size_t first_share = 16;
constexpr double growth = 0.2;
/// Below it thin plates have too few neighbours to tell anything, and nothing is saved.
constexpr std::size_t least_pairs = 96;

class Keeping {
  public:
    Keeping(const std::vector<DirectionPair>& pairs, const RowMajorMatrix& weights,
            const std::vector<double>& variance)
        : pairs_(&pairs),
          weights_(&weights),
          variance_(&variance),
          points_(DirectionPoints(pairs).points()),
          distance_(pairs.size(), std::numeric_limits<double>::infinity()),
          error_(pairs.size(), 0.0) {}

    void spread(std::size_t count);
    /// Mean over all pairs.
    double measure();
    /// \return whether there was one to add
    bool add_worst(std::size_t count);
    [[nodiscard]] const std::vector<std::uint32_t>& kept() const { return kept_; }

  private:
    void keep(std::size_t pair);

    const std::vector<DirectionPair>* pairs_;
    const RowMajorMatrix* weights_;
    const std::vector<double>* variance_;
    std::vector<DirectionPoint> points_;
    std::vector<std::uint32_t> kept_;
    std::vector<double> distance_;  ///< squared, to the nearest one that is kept
    std::vector<double> error_;
};

void Keeping::keep(std::size_t pair) {
    kept_.push_back(static_cast<std::uint32_t>(pair));
    for (std::size_t i = 0; i < points_.size(); ++i)
        distance_[i] = std::min(distance_[i], squared_distance(points_[i], points_[pair]));
}

/// Each the one that is furthest from those before.
void Keeping::spread(std::size_t count) {
    keep(0);
    while (kept_.size() < count)
        keep(static_cast<std::size_t>(std::ranges::max_element(distance_) - distance_.begin()));
}

double Keeping::measure() {
    std::ranges::sort(kept_);
    std::vector<DirectionPair> kept;
    for (const std::uint32_t pair : kept_) kept.push_back((*pairs_)[pair]);
    const DirectionPoints known(kept);
    constexpr int together = 64;
    const int all = static_cast<int>(points_.size());
    for_each_block((all + together - 1) / together, [&](int block) {
        Eigen::RowVectorXd found(weights_->cols());
        for (int i = block * together; i < std::min(all, (block + 1) * together); ++i) {
            const auto pair = static_cast<std::size_t>(i);
            error_[pair] = 0.0;
            if (distance_[pair] == 0.0) continue;
            found.setZero();
            for (const PairWeight& of : known.interpolate((*pairs_)[pair]))
                found += of.weight * weights_->row(static_cast<Index>(kept_[of.pair]));
            const double squared = (found - weights_->row(i)).squaredNorm();
            error_[pair] = (*variance_)[pair] > 0.0 ? squared / (*variance_)[pair] : 0.0;
        }
    });
    return std::accumulate(error_.begin(), error_.end(), 0.0) / static_cast<double>(error_.size());
}

/// Not two beside each other, as long as there are others: the first may mend the second.
bool Keeping::add_worst(std::size_t count) {
    std::vector<std::size_t> order(points_.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    std::ranges::stable_sort(order, [&](std::size_t a, std::size_t b) { return error_[a] > error_[b]; });
    const std::vector<double> before = distance_;
    const std::size_t old = kept_.size(), asked = old + count;
    for (const bool beside : {false, true})
        for (const std::size_t pair : order) {
            if (kept_.size() == asked) return true;
            if (distance_[pair] > 0.0 && (beside || distance_[pair] == before[pair])) keep(pair);
        }
    return kept_.size() > old;
}

}  // namespace

KeptDirections keep_directions(const std::vector<DirectionPair>& pairs, const RowMajorMatrix& weights,
                               const std::vector<double>& variance, double bound,
                               const std::function<void(double)>& progress) {
    KeptDirections all;
    all.pairs.resize(pairs.size());
    std::iota(all.pairs.begin(), all.pairs.end(), std::uint32_t{0});
    if (!(bound > 0.0) || pairs.size() <= least_pairs) return all;
    Keeping keeping(pairs, weights, variance);
    keeping.spread(std::max(least_pairs, pairs.size() / first_share));
    while (keeping.kept().size() < pairs.size()) {
        const double error = keeping.measure();
        if (error <= bound) return {keeping.kept(), error};
        if (progress) progress(std::min(1.0, bound / error));
        const auto more = static_cast<std::size_t>(growth * static_cast<double>(keeping.kept().size()));
        if (!keeping.add_worst(more + 1)) break;
    }
    return all;
}

}  // namespace btfield::detail

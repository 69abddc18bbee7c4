#include "host/fit/analysed_picture.hpp"

#include <algorithm>

#include "btfield/pyramid.hpp"

namespace btfield::detail {

const LagCovariance& AnalysedLevel::statistic(Offset box) {
    const std::lock_guard lock(*mutex_);
    if (statistics_.empty() || !statistics_.back().contains(box)) {
        const Offset before = statistics_.empty() ? Offset{} : statistics_.back().box();
        statistics_.push_back(
            lag_covariance(image_, {std::max(box.row, before.row), std::max(box.column, before.column)}));
    }
    return statistics_.back();
}

const FoldedPeriodogram& AnalysedLevel::periodogram() {
    const std::lock_guard lock(*mutex_);
    if (!periodogram_) periodogram_ = folded_periodogram(image_);
    return *periodogram_;
}

AnalysedLevel& AnalysedPicture::level(int factor, int count, int k) {
    const std::lock_guard lock(*mutex_);
    const auto last = std::pair{factor, count - 1};
    if (gaussian_.find(last) == gaussian_.end()) {
        if (count == 1) {
            gaussian_.emplace(last, AnalysedLevel(image_));
        } else {
            std::vector<Image> levels = decompose(*device_, image_, count, factor);
            gaussian_.emplace(last, AnalysedLevel(std::move(levels.back())));
            levels.pop_back();
            // Those of a smaller pyramid are the same, and may have their statistic already.
            for (std::size_t l = 0; l < levels.size(); ++l)
                laplacian_.emplace(std::pair{factor, static_cast<int>(l)},
                                   AnalysedLevel(std::move(levels[l])));
        }
    }
    return k == count - 1 ? gaussian_.at(last) : laplacian_.at({factor, k});
}

const std::vector<double>& AnalysedPicture::probe_covariances() {
    const std::lock_guard lock(*mutex_);
    if (probe_covariances_.empty()) probe_covariances_ = covariances_at(image_, probe_lags(image_.size()));
    return probe_covariances_;
}

}  // namespace btfield::detail

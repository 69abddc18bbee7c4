#pragma once

// What fits of one picture share: planes, pyramid levels and their lag covariances, computed when first asked
// for. Several fits may ask at a time.

#include <deque>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <utility>
#include <vector>

#include "btfield/device.hpp"
#include "btfield/image.hpp"
#include "btfield/lag_covariance.hpp"
#include "btfield/marginals.hpp"
#include "btfield/spectral_basis.hpp"
#include "host/fit/folded_periodogram.hpp"

namespace btfield::detail {

/// Which planes a model is fitted to.
enum class AnalysedPlanes {
    picture,   ///< Y as it is
    klt,       ///< T (Y − μ)
    gaussian,  ///< the KLT planes, each mapped to a standard normal one
};

/// A pyramid level with the statistic of every fit to it.
class AnalysedLevel {
  public:
    explicit AnalysedLevel(Image image) : image_(std::move(image)) {}
    /// With a statistic of its own, whose box holds what will be asked for.
    AnalysedLevel(Image image, LagCovariance statistic) : image_(std::move(image)) {
        statistics_.push_back(std::move(statistic));
    }
    [[nodiscard]] const Image& image() const { return image_; }
    /// Lag covariances of at least this box; computed again when a larger box is asked for.
    const LagCovariance& statistic(Offset box);
    const FoldedPeriodogram& periodogram();

  private:
    Image image_;
    std::unique_ptr<std::mutex> mutex_ = std::make_unique<std::mutex>();
    std::deque<LagCovariance> statistics_;  ///< of ever larger boxes: others may still read a smaller one
    std::optional<FoldedPeriodogram> periodogram_;
};

/// One kind of planes of the picture, and its pyramids.
class AnalysedPicture {
  public:
    AnalysedPicture(Device& device, Image image) : device_(&device), image_(std::move(image)) {}

    [[nodiscard]] const Image& image() const { return image_; }
    /// Level k of `count`: Laplacian but for the last, which is Gaussian.
    AnalysedLevel& level(int factor, int count, int k);
    /// covariances_at(image, probe_lags(size)).
    const std::vector<double>& probe_covariances();

  private:
    Device* device_;
    Image image_;
    std::unique_ptr<std::mutex> mutex_ = std::make_unique<std::mutex>();
    std::map<std::pair<int, int>, AnalysedLevel> laplacian_, gaussian_;  ///< [factor, k]
    std::vector<double> probe_covariances_;
};

}  // namespace btfield::detail

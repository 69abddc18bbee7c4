#include "btfield/theory.hpp"

#include <array>
#include <cmath>
#include <string>

#include "btfield/error.hpp"
#include "btfield/pyramid.hpp"
#include "host/analysis/expansion.hpp"
#include "host/analysis/marginal_moments.hpp"
#include "host/base/dense.hpp"
#include "host/base/text.hpp"
#include "host/spectrum/spectral_density.hpp"
#include "host/spectrum/theory.hpp"

namespace btfield {

using namespace detail;

std::vector<double> detail::modelled_covariance(const TextureModel& model, Size size,
                                                std::span<const Offset> lags) {
    const std::vector<Size> sizes = pyramid_sizes(size, static_cast<int>(model.levels.size()), model.factor);
    const auto d = static_cast<std::size_t>(modelled_planes(model));
    std::vector<double> total(lags.size() * d * d);
    for (std::size_t k = 0; k < model.levels.size(); ++k) {
        const LevelModel& level = model.levels[k];
        const int depth = static_cast<int>(k);
        const Offset box = expansion_box(model.factor, depth, lags);
        const LagCovariance own = level_covariance(level, sizes[k], box, model.factor, depth);
        const std::vector<double> seen = expanded_covariance(own, model.factor, depth, lags);
        for (std::size_t n = 0; n < total.size(); ++n) total[n] += level.gain * level.gain * seen[n];
    }
    return total;
}

std::vector<double> theoretical_covariance(const TextureModel& model, Size size,
                                           std::span<const Offset> lags) {
    const std::string asked = "covariances of a texture of " + text_of(size) + " pixels";
    if (size.height < 1 || size.width < 1) throw InputError(asked, "it has no pixel", "use positive sides");
    if (model.levels.empty()) throw InputError(asked, "the model has no level", "fit it anew");
    std::vector<Offset> wanted(lags.begin(), lags.end());
    wanted.emplace_back();  // the variances of what marginals map
    std::vector<double> covariance = modelled_covariance(model, size, wanted);
    const auto r = static_cast<std::size_t>(modelled_planes(model));
    if (!model.marginals.empty()) {
        using Matrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
        const auto side = static_cast<Eigen::Index>(r);
        const Eigen::Map<const Matrix> whitening(model.whitening.data(), side, side);
        for (std::size_t s = 0; s < wanted.size(); ++s) {
            Eigen::Map<Matrix> c(covariance.data() + s * r * r, side, side);
            c = congruent(whitening, c);
        }
        std::vector<double> variances;
        for (std::size_t i = 0; i < r; ++i) variances.push_back(covariance[lags.size() * r * r + i * r + i]);
        covariance = MappedCovariance(model.marginals, variances)(covariance);
    }
    covariance.resize(lags.size() * r * r);
    return model.basis.planes > 0 ? turned_back(model.basis, covariance) : covariance;
}

std::vector<double> theoretical_deviation(const TextureModel& model, Size size) {
    const std::array<Offset, 1> zero = {Offset{}};
    const std::vector<double> covariance = theoretical_covariance(model, size, zero);
    const auto d = static_cast<std::size_t>(model.planes);
    std::vector<double> deviation;
    for (std::size_t i = 0; i < d; ++i) deviation.push_back(std::sqrt(covariance[i * d + i]));
    return deviation;
}

}  // namespace btfield

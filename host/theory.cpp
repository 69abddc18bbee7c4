#include "btfield/theory.hpp"

#include <array>
#include <cmath>
#include <string>

#include "btfield/error.hpp"
#include "btfield/pyramid.hpp"
#include "host/level_gains.hpp"
#include "host/marginal_moments.hpp"
#include "host/spectral_density.hpp"

namespace btfield {

std::vector<double> theoretical_covariance(const TextureModel& model, Size size,
                                           std::span<const Offset> lags) {
    const std::string asked = "covariances of a texture of " + std::to_string(size.width) + " x " +
                              std::to_string(size.height) + " pixels";
    if (size.height < 1 || size.width < 1) throw InputError(asked, "it has no pixel", "use positive sides");
    if (model.levels.empty()) throw InputError(asked, "the model has no level", "fit it anew");
    const std::vector<Size> sizes = pyramid_sizes(size, static_cast<int>(model.levels.size()), model.factor);
    const auto d = static_cast<std::size_t>(modelled_planes(model));
    std::vector<Offset> wanted(lags.begin(), lags.end());
    wanted.emplace_back();  // the variances of what marginals map
    std::vector<double> total(wanted.size() * d * d);
    for (std::size_t k = 0; k < model.levels.size(); ++k) {
        const LevelModel& level = model.levels[k];
        const int depth = static_cast<int>(k);
        const Offset box = expansion_box(model.factor, depth, wanted);
        const LagCovariance own = level_covariance(level, sizes[k], box);
        const std::vector<double> seen = expanded_covariance(own, model.factor, depth, wanted);
        for (std::size_t n = 0; n < total.size(); ++n) total[n] += level.gain * level.gain * seen[n];
    }
    std::vector<double> variances;
    for (std::size_t i = 0; i < d; ++i) variances.push_back(total[lags.size() * d * d + i * d + i]);
    total.resize(lags.size() * d * d);
    if (!model.marginals.empty()) total = MappedCovariance(model.marginals, variances)(total);
    return model.basis.planes > 0 ? turned_back(model.basis, total) : total;
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

#include "host/compound/flat_regions.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <numbers>
#include <utility>
#include <variant>

#include "host/compound/regional_gains.hpp"
#include "host/fit/level_fit.hpp"
#include "host/spectrum/examination.hpp"
#include "host/spectrum/spectral_density.hpp"

namespace btfield::detail {

using std::size_t;

std::vector<bool> flat_regions(const Image& residual, const ControlField& field,
                               const std::vector<double>& deviations) {
    constexpr double least = 1e-3;  // a tenth of a grey level of 8 bits at most
    const std::vector<double> variances = regional_variances(residual, field.labels, field.regions);
    std::vector<bool> flat;
    for (auto own = variances.begin(); own != variances.end();
         own += static_cast<std::ptrdiff_t>(deviations.size()))
        flat.push_back(
            std::equal(deviations.begin(), deviations.end(), own, [](double deviation, double variance) {
                return variance <= least * least * deviation * deviation;
            }));
    return flat;
}

std::string flat_reason(const std::vector<bool>& flat) {
    std::string numbers;
    for (size_t k = 0; k < flat.size(); ++k)
        if (flat[k]) numbers += (numbers.empty() ? "" : ", ") + std::to_string(k);
    return numbers.empty() ? "" : "regions of one colour are white noise that does not show: " + numbers;
}

LevelModel white_level(Size size, const LagCovariance& statistic, const FitOptions& local,
                       const Support& support) {
    LevelModel level;
    level.size = size;
    level.log_likelihood = 0.0;
    level.certificate.valid = true;
    level.certificate.min_singular = std::numeric_limits<double>::infinity();
    const bool apart = is_2d(local.model);
    const size_t d = apart ? 1 : static_cast<size_t>(statistic.planes());
    for (int p = 0; p < (apart ? statistic.planes() : 1); ++p) {
        LinearField field;
        static_cast<Support&>(field) = support;
        field.planes = static_cast<int>(d);
        field.coefficients.assign(support.offsets.size() * d * d, 0.0);
        field.noise_covariance.assign(d * d, 0.0);
        for (size_t i = 0; i < d; ++i) {
            const int plane = apart ? p : static_cast<int>(i);
            const double variance = statistic(plane, plane, {});
            field.noise_covariance[i * d + i] = variance;
            level.log_likelihood -= 0.5 * (std::log(2.0 * std::numbers::pi * variance) + 1.0);
        }
        Model model = model_of(family(local.model), std::move(field));
        if (auto* const markov = std::get_if<MrfModel>(&model);
            markov != nullptr && family(local.model) == Family::pmrf)
            markov->form = MrfForm::pmrf;
        const Certificate certificate =
            examine(model, apart ? plane_statistic(statistic, p) : statistic).certificate;
        level.certificate.valid = level.certificate.valid && certificate.valid;
        level.certificate.min_singular = std::min(level.certificate.min_singular, certificate.min_singular);
        level.certificate.variance_ratio.insert(level.certificate.variance_ratio.end(),
                                                certificate.variance_ratio.begin(),
                                                certificate.variance_ratio.end());
        level.models.push_back(std::move(model));
    }
    return level;
}

}  // namespace btfield::detail

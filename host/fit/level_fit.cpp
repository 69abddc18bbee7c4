#include "host/fit/level_fit.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <utility>

#include "btfield/error.hpp"
#include "host/base/work_part.hpp"
#include "host/fit/correlated_support.hpp"
#include "host/fit/likelihood.hpp"
#include "host/fit/mrf_least_squares.hpp"
#include "host/fit/mrf_likelihood.hpp"
#include "host/fit/random_decrement.hpp"
#include "host/fit/sar_likelihood.hpp"
#include "host/spectrum/examination.hpp"

namespace btfield::detail {
namespace {

using std::size_t;

/// A model of all planes or of one, with what its estimator says.
struct Estimate {
    Model model;
    Estimator estimator = Estimator::least_squares;
    int iterations = 1;
    Examination examination;
};

Estimate least_squares(const LagCovariance& statistic, const FitOptions& options, const Support& support) {
    Estimate estimate;
    const auto take = [&](MrfEstimate markov) {
        estimate.model = std::move(markov.model);
        estimate.iterations = markov.iterations;
    };
    switch (family(options.model)) {
        case Family::msar:
            estimate.model = fit_sar(statistic, support, options.noise);
            break;
        case Family::mmrf:
            take(fit_mmrf(statistic, support, options.noise));
            break;
        case Family::pmrf:
            take(fit_pmrf(statistic, support, options.noise));
            break;
        default:
            estimate.model = fit_car(statistic, support, options.noise, options.prior);
    }
    estimate.examination = examine(estimate.model, statistic);
    return estimate;
}

/// \param level PMRF models of several planes read its periodogram
Estimate maximum_likelihood(AnalysedLevel& level, const LagCovariance& statistic, const FitOptions& options,
                            const Support& support) {
    Estimate estimate;
    estimate.estimator = Estimator::maximum_likelihood;
    const Family family_ = family(options.model);
    if (family_ == Family::msar || family_ == Family::car) {
        SarLikelihoodFit fitted = fit_sar_likelihood(statistic, support, options.noise);
        estimate.model = model_of(family_, std::move(static_cast<LinearField&>(fitted.model)));
        estimate.iterations = fitted.iterations;
        estimate.examination = std::move(fitted.examination);
        return estimate;
    }
    const bool pairs = family(options.model) == Family::pmrf && statistic.planes() > 1;
    MrfLikelihoodFit fitted = pairs ? fit_pmrf_ml(statistic, level.periodogram(), support, options.noise)
                                    : fit_mmrf_ml(statistic, support, options.noise);
    if (!pairs && family(options.model) == Family::pmrf) fitted.model.form = MrfForm::pmrf;
    estimate.model = std::move(fitted.model);
    estimate.iterations = fitted.iterations;
    estimate.examination =
        fitted.examination ? *std::move(fitted.examination) : examine(estimate.model, statistic);
    return estimate;
}

/// Whether least squares is as good as maximum likelihood. For symmetric supports it is inconsistent: where
/// it certifies with a variance that is not the data's, it is no better than where it does not certify. For
/// causal ones log |det Λ| is 0 on average where Λ has no zeros, and the two are the same.
bool trustworthy(Family family, const Certificate& certificate) {
    constexpr double lowest = 0.8, highest = 1.25;
    return certificate.valid &&
           (family == Family::car || std::ranges::all_of(certificate.variance_ratio, [](double ratio) {
                return ratio >= lowest && ratio <= highest;
            }));
}

Estimate estimate_part(AnalysedLevel& level, const LagCovariance& statistic, const FitOptions& options,
                       const Support& support) {
    const Family family_ = family(options.model);
    if (options.estimator == EstimatorChoice::least_squares)
        return least_squares(statistic, options, support);
    if (options.estimator == EstimatorChoice::automatic || family_ == Family::car) {
        try {
            Estimate estimate = least_squares(statistic, options, support);
            if (trustworthy(family_, estimate.examination.certificate)) return estimate;
        } catch (const InputError&) {
            // Planes that depend on each other exactly: what least squares cannot solve, likelihood may. CAR
            // has its prior against that; what stops it is asked wrongly.
            if (family_ == Family::car) throw;
        }
    }
    return maximum_likelihood(level, statistic, options, support);
}

Estimate estimate_moving_average(const Image& level, const LagCovariance& statistic,
                                 const FitOptions& options, const Support& support) {
    Estimate estimate;
    estimate.model = fit_ma(level, statistic, support, options.noise, options.moving_average);
    estimate.estimator = Estimator::random_decrement;
    estimate.examination = examine(estimate.model, statistic);
    return estimate;
}

/// Adds a part to its level: see LevelModel.
void add_part(FittedLevel& fitted, Estimate part, double log_likelihood) {
    LevelModel& level = fitted.level;
    Certificate& certificate = level.certificate;
    const Certificate& own = part.examination.certificate;
    if (level.models.empty()) {
        level.estimator = part.estimator;
        level.iterations = part.iterations;
        level.log_likelihood = log_likelihood;
        certificate = own;
    } else {
        if (part.estimator == Estimator::maximum_likelihood) level.estimator = part.estimator;
        level.iterations += part.iterations;
        level.log_likelihood += log_likelihood;
        certificate.valid = certificate.valid && own.valid;
        certificate.min_singular = std::min(certificate.min_singular, own.min_singular);
        certificate.zeros += own.zeros;
        certificate.variance_ratio.insert(certificate.variance_ratio.end(), own.variance_ratio.begin(),
                                          own.variance_ratio.end());
    }
    level.models.push_back(std::move(part.model));
    fitted.grid = std::max(fitted.grid, part.examination.grid);
}

}  // namespace

LagCovariance plane_statistic(const LagCovariance& statistic, int p) {
    const Offset box = statistic.box();
    LagCovariance own(1, statistic.size(), box);
    own.mean()[0] = statistic.mean()[static_cast<size_t>(p)];
    for (int row = 0; row <= box.row; ++row) {
        for (int column = -box.column; column <= box.column; ++column)
            own.set(0, 0, {row, column}, statistic(p, p, {row, column}));
    }
    return own;
}

Image plane_image(const Image& image, int p) {
    Image own(image.size(), 1);
    std::ranges::copy(image.plane(p), own.plane(0).begin());
    return own;
}

Support support_of(const FitOptions& options) {
    const Family family_ = family(options.model);
    const bool markov = family_ == Family::mmrf || family_ == Family::pmrf;
    Support support;
    support.active = options.active;
    support.kind = options.neighbourhood.value_or(family_ == Family::car ? NeighbourhoodKind::causal
                                                                         : NeighbourhoodKind::symmetric);
    if (markov && support.kind != NeighbourhoodKind::symmetric && support.kind != NeighbourhoodKind::custom) {
        throw InputError(
            "fit a " + std::string(name(options.model)) + " model",
            "Markov models have symmetric neighbourhoods, not a " + std::string(name(support.kind)) + " one",
            "use a symmetric neighbourhood, or a 3d-msar model");
    }
    if (options.correlated != 0) {
        support.offsets = correlated_candidates(support.kind, options.correlated);
    } else if (support.kind == NeighbourhoodKind::custom) {
        support.offsets = options.offsets;
    } else {
        support.offsets = neighbourhood(options.order, support.kind);
    }
    if (family_ == Family::ma && std::ranges::find(support.offsets, Offset{}) == support.offsets.end())
        support.offsets.insert(std::ranges::upper_bound(support.offsets, Offset{}), Offset{});
    return support;
}

std::size_t offset_count(const Support& support, const FitOptions& options) {
    if (options.correlated == 0) return support.offsets.size();
    return static_cast<size_t>(options.correlated) + (family(options.model) == Family::ma ? 1 : 0);
}

FittedLevel fit_level(AnalysedLevel& data, const FitOptions& options, const Support& candidates) {
    // The candidates' box holds those of all choices among them: one pass.
    const LagCovariance& statistic = data.statistic(difference_box(candidates.offsets));
    FittedLevel fitted;
    Support support = candidates;
    if (options.correlated != 0) {
        CorrelatedSupport chosen = correlated_support(statistic, candidates, options.correlated);
        support = std::move(chosen.support);
        fitted.weakest_kept = chosen.weakest_kept;
    }
    fitted.level.size = data.image().size();
    const int parts = is_2d(options.model) ? data.image().planes() : 1;
    struct Part {
        Estimate estimate;
        double likelihood = std::numeric_limits<double>::quiet_NaN();
    };
    std::vector<Part> fits(static_cast<size_t>(parts));
    for_each_part(parts, [&](int p) {
        const LagCovariance own = parts > 1 ? plane_statistic(statistic, p) : LagCovariance{};
        const LagCovariance& seen = parts > 1 ? own : statistic;
        auto& [part, likelihood] = fits[static_cast<size_t>(p)];
        if (family(options.model) == Family::ma) {
            part = estimate_moving_average(parts > 1 ? plane_image(data.image(), p) : data.image(), seen,
                                           options, support);
        } else {
            part = estimate_part(data, seen, options, support);
        }
        if (!part.examination.certificate.valid) return;
        likelihood = log_likelihood(
            part.model, seen, part.examination.log_determinant,
            [&]() -> const FoldedPeriodogram& { return data.periodogram(); }, p);
    });
    for (auto& [part, likelihood] : fits) add_part(fitted, std::move(part), likelihood);
    return fitted;
}

}  // namespace btfield::detail

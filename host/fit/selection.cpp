#include "host/fit/selection.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <limits>
#include <utility>

#include "btfield/criteria.hpp"
#include "btfield/error.hpp"
#include "host/base/text.hpp"
#include "host/fit/level_fit.hpp"
#include "host/fit/model_density.hpp"

namespace btfield::detail {
namespace {

using std::size_t;

constexpr int default_order = 5;
constexpr double unknown = std::numeric_limits<double>::quiet_NaN();

/// Lag covariance errors that levels may have: up to good_error, or no worse than the least by near_error.
constexpr double good_error = 0.05, near_error = 0.01;

struct Candidate {
    std::string name;  ///< "order 3"
    FitOptions options;
};

/// A candidate that could be fitted.
struct Fitted {
    Candidate candidate;
    TextureModel model;
    double bic = unknown;    ///< NaN where not certified or without likelihood
    double error = unknown;  ///< of lag covariances, where these decide
};

std::string text_of(double value, const char* format) {
    char text[48];
    std::snprintf(text, sizeof text, format, value);
    return text;
}

/// Those of the candidates that the picture supports, in their order.
std::vector<Fitted> fit_all(const std::vector<Candidate>& candidates, const SelectionSource& source,
                            FitDepth depth) {
    std::vector<Fitted> fitted;
    std::exception_ptr failure;
    for (const Candidate& candidate : candidates) {
        try {
            fitted.push_back({candidate, source.fit(candidate.options, depth), unknown, unknown});
        } catch (const InputError&) {
            if (!failure) failure = std::current_exception();
        }
    }
    if (fitted.empty()) std::rethrow_exception(failure);
    return fitted;
}

/// Place of the smallest value, the first among equals; values.size() when all are NaN.
size_t smallest(const std::vector<double>& values) {
    size_t best = values.size();
    for (size_t k = 0; k < values.size(); ++k) {
        if (std::isfinite(values[k]) && (best == values.size() || values[k] < values[best])) best = k;
    }
    return best;
}

/// Takes the smallest BIC, or error, and says so; nothing when all are NaN.
const Fitted* decide(const std::vector<Fitted>& fitted, double Fitted::*measure, const char* measure_name,
                     const char* format, std::string& why) {
    std::vector<double> values;
    values.reserve(fitted.size());
    for (const Fitted& one : fitted) values.push_back(one.*measure);
    const size_t best = smallest(values);
    if (best == values.size()) return nullptr;
    why += fitted[best].candidate.name + ": " + measure_name + " " + text_of(values[best], format);
    values[best] = unknown;
    const size_t second = smallest(values);
    why += second == values.size()
               ? ", the only one that can be compared"
               : " against " + text_of(values[second], format) + " of " + fitted[second].candidate.name;
    return &fitted[best];
}

/// FitOptions::levels of a fit by size, so that candidates are compared at the same K.
int settled_levels(const std::vector<Candidate>& candidates, const SelectionSource& source) {
    std::exception_ptr failure;
    for (const Candidate& candidate : candidates) {
        if (candidate.options.levels > 0) return candidate.options.levels;
        try {
            return static_cast<int>(source.fit(candidate.options, FitDepth::levels).levels.size());
        } catch (const InputError&) {
            if (!failure) failure = std::current_exception();
        }
    }
    std::rethrow_exception(failure);
}

void choose_model(Choices& choices, const SelectionSource& source) {
    const Image& image = *source.image;
    std::string why;
    bool flat = false;
    if (image.planes() == 1) {
        why = "one plane: 2D and 3D models are the same";
    } else {
        const Kappa criterion = kappa(image);
        flat = criterion.two_dimensional();
        why = "kappa(256) " + text_of(criterion.kappa, "%.4g") + (flat ? " <= 3: 2D" : " > 3: 3D");
    }
    // The Markov models of a single plane are one and the same.
    std::vector<ModelKind> kinds;
    if (flat) {
        kinds = {ModelKind::car2d, ModelKind::ma2d, ModelKind::msar2d, ModelKind::mmrf2d};
    } else {
        kinds = {ModelKind::car3d, ModelKind::ma3d, ModelKind::msar3d, ModelKind::mmrf3d};
        if (image.planes() > 1) kinds.push_back(ModelKind::pmrf3d);
    }
    std::vector<Candidate> candidates;
    for (const ModelKind kind : kinds) {
        FitOptions options = choices.options;
        options.model = kind;
        options.choose_model = options.choose_levels = false;
        if (options.order == 0) options.order = default_order;
        candidates.push_back({std::string(name(kind)), options});
    }
    const int levels = settled_levels(candidates, source);
    for (Candidate& candidate : candidates) candidate.options.levels = levels;
    std::vector<Fitted> fitted = fit_all(candidates, source, FitDepth::levels);
    for (Fitted& one : fitted) one.bic = level_bic(one.model);

    choices.options.choose_model = false;
    why += "; ";
    const Fitted* best = decide(fitted, &Fitted::bic, "BIC", "%.0f", why);
    if (best == nullptr) {
        best = &fitted.front();
        why += best->candidate.name + ": no family has a likelihood";
    }
    choices.options.model = best->candidate.options.model;
    if (!choices.options.choose_levels) choices.options.levels = levels;
    choices.reasons.push_back("model " + why);
}

void choose_levels(Choices& choices, const SelectionSource& source) {
    FitOptions& options = choices.options;
    const int most =
        options.levels > 0 ? options.levels : default_levels(source.image->size(), options.factor);
    options.choose_levels = false;
    std::vector<Candidate> candidates;
    for (int levels = 1; levels <= most; ++levels) {
        FitOptions settled = options;
        settled.levels = levels;
        if (settled.order == 0) settled.order = default_order;
        candidates.push_back({counted(levels, "level"), settled});
    }
    std::vector<Fitted> fitted = fit_all(candidates, source, FitDepth::complete);
    AnalysedPicture& planes = source.planes(options);
    const FoldedPeriodogram& periodogram = planes.level(options.factor, 1, 0).periodogram();
    const double pixels = static_cast<double>(area(source.image->size()));
    const std::vector<Offset> lags = probe_lags(source.image->size());
    const std::vector<double> data = covariances_at(*source.image, lags);
    for (Fitted& one : fitted) {
        if (!is_valid(one.model)) continue;
        one.bic = -2.0 * pixels * picture_log_likelihood(one.model, periodogram) +
                  static_cast<double>(parameter_count(one.model)) * std::log(pixels);
        one.error = lag_covariance_error(one.model, lags, data);
    }
    // The likelihood takes all frequencies alike, of which few are low: it may prefer a K that has lost them.
    std::vector<double> errors;
    errors.reserve(fitted.size());
    for (const Fitted& one : fitted) errors.push_back(one.error);
    const size_t least = smallest(errors);
    const double bound = least == errors.size() ? 0.0 : std::max(good_error, errors[least] + near_error);
    bool lost = false;
    for (Fitted& one : fitted) {
        if (!(one.error > bound)) continue;
        lost = lost || std::isfinite(one.bic);
        one.bic = unknown;
    }
    std::string why;
    const Fitted* best = decide(fitted, &Fitted::bic, "BIC", "%.0f", why);
    if (best == nullptr) best = decide(fitted, &Fitted::error, "lag covariance error", "%.4f", why);
    if (best != nullptr && lost) why += ", among lag covariance errors up to " + text_of(bound, "%.3f");
    if (best == nullptr) {
        best = &fitted.back();
        why = best->candidate.name + ": none is certified";
    }
    options.levels = best->candidate.options.levels;
    choices.reasons.push_back(why);
}

void choose_order(Choices& choices, const SelectionSource& source) {
    FitOptions& options = choices.options;
    std::vector<Candidate> candidates;
    // The largest first: the others read its lag covariances.
    for (int order = max_order; order >= 1; --order) {
        FitOptions settled = options;
        settled.order = order;
        candidates.push_back({"order " + std::to_string(order), settled});
    }
    if (options.levels == 0 && default_levels(source.image->size(), options.factor) > 1) {
        // The finest level is the same for any K > 1, and takes most of the time.
        const Offset box = difference_box(support_of(candidates.front().options).offsets);
        static_cast<void>(source.planes(options).level(options.factor, 2, 0).statistic(box));
    }
    // K of the default order, whichever orders that supports.
    std::vector<Candidate> by_nearness = candidates;
    std::ranges::stable_sort(by_nearness, {}, [](const Candidate& candidate) {
        return std::abs(candidate.options.order - default_order);
    });
    const int levels = settled_levels(by_nearness, source);
    for (Candidate& candidate : candidates) candidate.options.levels = levels;
    const bool moving_average = family(options.model) == Family::ma;
    std::vector<Fitted> fitted =
        fit_all(candidates, source, moving_average ? FitDepth::complete : FitDepth::levels);
    std::ranges::reverse(fitted);
    for (Fitted& one : fitted) one.bic = level_bic(one.model);

    std::string why;
    const Fitted* best = nullptr;
    const auto lacks_likelihood = [](const Fitted& one) {
        return is_valid(one.model) && !std::isfinite(one.bic);
    };
    if (moving_average && std::ranges::any_of(fitted, lacks_likelihood)) {
        const std::vector<Offset> lags = probe_lags(source.image->size());
        const std::vector<double> data = covariances_at(*source.image, lags);
        for (Fitted& one : fitted) {
            if (is_valid(one.model)) one.error = lag_covariance_error(one.model, lags, data);
        }
        best = decide(fitted, &Fitted::error, "lag covariance error", "%.4f", why);
        if (best != nullptr) why += ", as not every order has a likelihood";
    } else {
        best = decide(fitted, &Fitted::bic, "BIC", "%.0f", why);
    }
    if (best == nullptr) {
        best = &*std::ranges::min_element(fitted, {}, [](const Fitted& one) {
            return std::abs(one.candidate.options.order - default_order);
        });
        why = best->candidate.name + ": no order is certified";
    }
    options.order = best->candidate.options.order;
    options.levels = levels;
    choices.reasons.push_back(why);
}

}  // namespace

bool leaves_choices(const FitOptions& options) {
    return options.choose_model || options.choose_levels || options.order == 0;
}

double level_bic(const TextureModel& model) {
    double sum = 0.0;
    for (const LevelModel& level : model.levels) {
        const double pixels = static_cast<double>(area(level.size));
        sum += -2.0 * pixels * level.log_likelihood +
               static_cast<double>(parameter_count(level, model.noise)) * std::log(pixels);
    }
    return sum;
}

Choices choose(const FitOptions& options, const SelectionSource& source) {
    const bool custom = options.neighbourhood == NeighbourhoodKind::custom;
    if (options.order == 0 && (custom || options.correlated != 0)) {
        throw InputError("choose the order",
                         custom ? "a custom neighbourhood has no order"
                                : "the most correlated offsets take the place of an order",
                         "leave the order at its default, or drop the neighbourhood");
    }
    if (options.levels < 0) {
        throw InputError("choose from up to " + std::to_string(options.levels) + " levels",
                         "there is at least one level", "use 1 or more, or 0 for as many as the size allows");
    }
    Choices choices{options, {}};
    if (options.choose_model) choose_model(choices, source);
    if (options.choose_levels) choose_levels(choices, source);
    if (options.order == 0) choose_order(choices, source);
    return choices;
}

}  // namespace btfield::detail

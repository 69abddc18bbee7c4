#pragma once

// Choosing model, levels and order by what the picture says of them (theory 16, docs/selection.md).

#include <functional>
#include <string>
#include <vector>

#include "btfield/fit.hpp"
#include "host/fit/analysed_picture.hpp"

namespace btfield::detail {

/// How much of a model a comparison needs.
enum class FitDepth {
    levels,    ///< models of the levels alone
    complete,  ///< with gains and whitening
};

/// What there is to choose by.
struct SelectionSource {
    const Image* image = nullptr;
    std::function<AnalysedPicture&(const FitOptions&)> planes;     ///< that the options model
    std::function<TextureModel(const FitOptions&, FitDepth)> fit;  ///< of options without choices
};

/// The options with everything settled, and a sentence for each choice made.
struct Choices {
    FitOptions options;
    std::vector<std::string> reasons;
};

[[nodiscard]] bool leaves_choices(const FitOptions& options);

/// Model first, at order 5 where the order is open; then levels; then the order.
/// \throws InputError what the fit of the first candidate throws when none can be fitted
[[nodiscard]] Choices choose(const FitOptions& options, const SelectionSource& source);

/// −2 log L + p log N, summed over levels: log L of N pixels, p free parameters. NaN when a level has no
/// likelihood.
[[nodiscard]] double level_bic(const TextureModel& model);

}  // namespace btfield::detail

#include "host/cli/idle_options.hpp"

#include <functional>
#include <string_view>
#include <vector>

#include "host/cli/command.hpp"
#include "host/fit/fit_names.hpp"
#include "host/model/model_names.hpp"

namespace btfield::cli {
namespace {

/// An option, where it says nothing, and why.
struct IdleOption {
    std::string_view option;
    std::function<bool(const FitOptions& fit)> idle;
    std::string_view why;     ///< "3d-car ..."
    std::string_view remedy;  ///< beside leaving it out; "MODEL" is the option that names the model
};

bool averages(const FitOptions& fit) {
    return family(fit.model) == Family::ma;
}

const std::vector<IdleOption>& idle_options() {
    const auto no_averages = [](const FitOptions& fit) { return !averages(fit); };
    static const std::vector<IdleOption> all{
        {"--threshold", no_averages, "has no significant pixels, which are those of moving averages",
         "take MODEL 3d-ma or 2d-ma"},
        {"--significance", no_averages, "has no significant pixels, which are those of moving averages",
         "take MODEL 3d-ma or 2d-ma"},
        {"--averages", no_averages, "has no moving averages", "take MODEL 3d-ma or 2d-ma"},
        {"--order", [](const FitOptions& fit) { return fit.correlated != 0 && fit.order != 0; },
         "takes its most correlated offsets out of those of order 8",
         "leave out correlated:N of --neighbourhood"},
    };
    return all;
}

[[noreturn]] void refuse(std::string_view option, const std::string& found, std::string_view remedy) {
    throw UsageError(std::string(option) + ": " + found + "; leave it out, or " + std::string(remedy));
}

std::string with_chooser(std::string_view remedy, const std::string& chooser) {
    std::string text(remedy);
    constexpr std::string_view place = "MODEL";
    if (const std::size_t at = text.find(place); at != std::string::npos)
        text.replace(at, place.size(), chooser);
    return text;
}

bool given(const CLI::App& command, std::string_view option) {
    const CLI::Option* const found = command.get_option_no_throw(std::string(option));
    return found != nullptr && found->count() > 0;
}

}  // namespace

void refuse_idle_options(const CLI::App& command, const FitOptions& fit, const std::string& chooser) {
    for (const IdleOption& each : idle_options())
        if (given(command, each.option) && each.idle(fit))
            refuse(each.option,
                   "a model of kind " + std::string(name(fit.model)) + " " + std::string(each.why),
                   with_chooser(each.remedy, chooser));
}

void refuse_idle_options(const CLI::App& command, const CompoundOptions& compound, bool labels) {
    const bool roots = averages(compound.local) && compound.averages == AveragesEstimator::spectral_root;
    if (roots)
        for (const char* const option : {"--threshold", "--significance"})
            if (given(command, option))
                refuse(option, "roots of spectra (--averages sr) have no significant pixels",
                       "take --averages rd");
    refuse_idle_options(command, compound.local, "--local");
    if (roots && given(command, "--noise") && compound.local.noise == NoiseForm::diagonal)
        refuse("--noise", "roots of spectra (--averages sr) have no noise but white", "take --averages rd");
    for (const char* const option : {"--regions", "--cluster-on", "--seed"})
        if (labels && given(command, option))
            refuse(option, "with --labels there are no clusters to be found: they say what regions there are",
                   "leave out --labels");
}

}  // namespace btfield::cli

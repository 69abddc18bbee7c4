#include "host/cli/selection_options.hpp"

#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "host/cli/options.hpp"

namespace btfield::cli {
namespace {

constexpr std::string_view correlated = "correlated:";

/// A number in [1, highest], or "auto".
void add_int_or_auto(CLI::App& command, const std::string& name, int highest, int& value,
                     const std::function<void()>& choose, const std::string& help) {
    const auto read = [name, highest, &value, choose](const std::string& text) {
        if (text == "auto") {
            choose();
            return;
        }
        const auto number = parse_number(text, 1, static_cast<std::uint64_t>(highest));
        if (!number) {
            throw CLI::ValidationError(name, "'" + text + "' is neither a whole number from 1 to " +
                                                 std::to_string(highest) + " nor auto");
        }
        value = static_cast<int>(*number);
    };
    command.add_option_function<std::string>(name, read, help)->type_name("N|auto");
}

void add_model(CLI::App& command, FitOptions& fit) {
    std::string words;
    for (const ModelKind kind : model_kinds()) words += std::string(name(kind)) + "|";
    words += "auto";
    const auto read = [&fit, words](const std::string& text) {
        if (text == "auto") {
            fit.choose_model = true;
            return;
        }
        for (const ModelKind kind : model_kinds()) {
            if (name(kind) == text) {
                fit.model = kind;
                return;
            }
        }
        throw CLI::ValidationError("--model", "'" + text + "' is none of " + words);
    };
    command
        .add_option_function<std::string>("--model", read,
                                          "random field; see docs/models.md for which to choose; auto: 2D or "
                                          "3D by kappa, the rest by BIC (default: 3d-car)")
        ->type_name(words);
}

void add_neighbourhood(CLI::App& command, FitOptions& fit) {
    const std::vector<std::pair<std::string, NeighbourhoodKind>> kinds{
        {"causal", NeighbourhoodKind::causal},
        {"unilateral", NeighbourhoodKind::unilateral},
        {"symmetric", NeighbourhoodKind::symmetric},
        {"half", NeighbourhoodKind::half}};
    const std::string words = "causal|unilateral|symmetric|half|correlated:N";
    const auto read = [&fit, kinds, words](const std::string& text) {
        if (text.rfind(correlated, 0) == 0) {
            constexpr std::uint64_t most = 44;  // offsets of order 8
            const auto number = parse_number(text.substr(correlated.size()), 1, most);
            if (!number) {
                throw CLI::ValidationError("--neighbourhood",
                                           "'" + text + "' is not correlated: and a whole number from 1 to " +
                                               std::to_string(most) + ", such as correlated:12");
            }
            fit.correlated = static_cast<int>(*number);
            return;
        }
        for (const auto& [word, kind] : kinds) {
            if (word == text) {
                fit.neighbourhood = kind;
                return;
            }
        }
        throw CLI::ValidationError("--neighbourhood", "'" + text + "' is none of " + words);
    };
    command
        .add_option_function<std::string>(
            "--neighbourhood", read,
            "which offsets of the order; car takes the first two, mmrf and pmrf symmetric only; "
            "correlated:N, such as correlated:12: the N of order 8 that each level correlates with most "
            "(default: causal for car, symmetric for the others)")
        ->type_name(words);
}

}  // namespace

void add_selection(CLI::App& command, FitOptions& fit) {
    add_model(command, fit);
    add_int_or_auto(
        command, "--order", max_order, fit.order, [&fit] { fit.order = 0; },
        "order of the neighbourhood, 1 to 8; auto: by BIC (default: 5)");
    add_neighbourhood(command, fit);
    add_int_or_auto(
        command, "--levels", 30, fit.levels, [&fit] { fit.choose_levels = true; },
        "pyramid levels; 1 is no pyramid; auto: by BIC (default: by size, 5 at most)");
}

}  // namespace btfield::cli

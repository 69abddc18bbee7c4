#include "host/cli/selection_options.hpp"

#include <algorithm>
#include <array>
#include <string>
#include <string_view>

#include "host/analysis/neighbourhood_names.hpp"
#include "host/cli/options.hpp"
#include "host/model/model_names.hpp"

namespace btfield::cli {
namespace {

constexpr std::string_view correlated = "correlated:";
const std::string supports = "Neighbourhood and pyramid";

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
    command.add_option_function<std::string>(name, read, help)->type_name("N|auto")->group(supports);
}

/// Which command has what this word means, where --model has not; empty: none.
std::string other_command(const std::string& word) {
    if (word == "compound") return "'btfield compound fit' learns models with regions";
    if (word == "roll") return "'btfield roll' lays a picture's own patches and needs no model";
    return {};
}

void add_model(CLI::App& command, FitOptions& fit, const OtherModels& others) {
    std::string words = detail::words_of<ModelKind>("|") + "|auto";
    if (others.take) words += "|" + others.words;
    const auto read = [&fit, others, words](const std::string& text) {
        if (others.take && others.take(text)) return;
        if (text == "auto") {
            fit.choose_model = true;
            return;
        }
        const auto kind = detail::find_value<ModelKind>(text);
        const std::string other = kind ? "" : other_command(text);
        if (!other.empty())
            throw CLI::ValidationError("--model", "'" + text + "' is no random field: " + other);
        if (!kind) throw CLI::ValidationError("--model", "'" + text + "' is none of " + words);
        fit.model = *kind;
    };
    command
        .add_option_function<std::string>("--model", read,
                                          "random field; see docs/models.md for which to choose; auto: 2D or "
                                          "3D by kappa, the rest by BIC (default: 3d-car)")
        ->type_name(words);
}

void add_neighbourhood(CLI::App& command, FitOptions& fit) {
    // Those that an order can have.
    static constexpr std::array kinds{NeighbourhoodKind::causal, NeighbourhoodKind::unilateral,
                                      NeighbourhoodKind::symmetric, NeighbourhoodKind::half};
    std::string words;
    for (const NeighbourhoodKind kind : kinds) words += std::string(name(kind)) + "|";
    words += "correlated:N";
    const auto read = [&fit, words](const std::string& text) {
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
        const auto kind = detail::find_value<NeighbourhoodKind>(text);
        if (!kind || std::ranges::find(kinds, *kind) == kinds.end())
            throw CLI::ValidationError("--neighbourhood", "'" + text + "' is none of " + words);
        fit.neighbourhood = *kind;
    };
    command
        .add_option_function<std::string>(
            "--neighbourhood", read,
            "which offsets of the order; car takes the first two, mmrf and pmrf symmetric only; "
            "correlated:N, such as correlated:12: the N of order 8 that each level correlates with most "
            "(default: causal for car, symmetric for the others)")
        ->type_name(words)
        ->group(supports);
}

}  // namespace

void add_selection(CLI::App& command, FitOptions& fit, const OtherModels& others) {
    add_model(command, fit, others);
    add_int_or_auto(
        command, "--order", max_order, fit.order, [&fit] { fit.order = 0; },
        "order of the neighbourhood, 1 to 8; auto: by BIC (default: 5)");
    add_neighbourhood(command, fit);
    add_int_or_auto(
        command, "--levels", 30, fit.levels, [&fit] { fit.choose_levels = true; },
        "pyramid levels; 1 is no pyramid; auto: by BIC (default: by size, 5 at most)");
    add_int(command, "--factor", fit.factor, 2, 1024, "pyramid reduction factor (default: 2)")
        ->group(supports);
}

}  // namespace btfield::cli

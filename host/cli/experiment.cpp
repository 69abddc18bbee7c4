#include "host/cli/command.hpp"
#include "host/cli/command_text.hpp"
#include "host/cli/experiment_parts.hpp"

namespace btfield::cli {

std::vector<std::string> parts_of(const std::string& text) {
    std::vector<std::string> parts{""};
    for (const char c : text) {
        if (c == ',') {
            parts.emplace_back();
        } else {
            parts.back() += c;
        }
    }
    return parts;
}

void add_experiment(CLI::App& app, Action& action) {
    CLI::App* command = app.add_subcommand("experiment", "hold many models against many pictures");
    command->require_subcommand(1);
    add_experiment_run(*command, action);
    add_experiment_table(*command, action);
    add_experiment_merge(*command, action);
    add_experiment_report(*command, action);
    add_experiment_forget(*command, action);
    for (CLI::App* part : command->get_subcommands({})) part->fallthrough();
    set_guide(*command, {.usual = {{"btfield experiment run sand.json --out sand.db"},
                                   {"btfield experiment table sand.db"}},
                         .notes = {"'btfield experiment COMMAND --help' shows the options of a command."}});
}

}  // namespace btfield::cli

#include <memory>
#include <string>

#include "host/cli/btf_parts.hpp"
#include "host/cli/command_text.hpp"
#include "host/cli/options.hpp"
#include "host/cli/report.hpp"

namespace btfield::cli {
namespace {

struct InfoArguments {
    std::string set;
    BtfOptions reading;
    bool json = false;
};

void run_info(const InfoArguments& options) {
    const BtfSet set = open_told(options.set, options.reading);
    if (options.json)
        emit_json(set_json(set));
    else
        emit_text(set_text(set));
}

}  // namespace

void add_btf_info(CLI::App& parent, Action& action) {
    CLI::App* command = parent.add_subcommand("info", "tell what a BTF has: directions, size, colours");
    const auto options = std::make_shared<InfoArguments>();
    command->add_option("SET", options->set, "a BTF (docs/btf.md)")->required()->type_name("");
    add_btf_reading(*command, options->reading);
    add_json(*command, options->json);
    set_guide(*command, {.usual = {{"btfield btf info set/"}},
                         .more = {{"btfield btf info set/ --json"}},
                         .notes = {"Pictures without which the set is not complete are counted as missing. "
                                   "Two of the same directions are an error."}});
    command->callback([options, &action] { action = [options] { run_info(*options); }; });
}

}  // namespace btfield::cli

#include "host/cli/btf_parts.hpp"
#include "host/cli/command_text.hpp"

namespace btfield::cli {

void add_btf(CLI::App& app, Action& action) {
    CLI::App* command = app.add_subcommand("btf", "materials under any view and light");
    command->require_subcommand(1);
    set_guide(*command, {.usual = {{"btfield btf info set/"},
                                   {"btfield btf fit set/ -o rock.btfm"},
                                   {"btfield btf view rock.btfm -o rock.html"}}});
    add_btf_make(*command, action);
    add_btf_info(*command, action);
    add_btf_convert(*command, action);
    add_btf_fit(*command, action);
    add_btf_synth(*command, action);
    add_btf_render(*command, action);
    add_btf_view(*command, action);
    for (CLI::App* each : command->get_subcommands({})) each->fallthrough();
}

}  // namespace btfield::cli

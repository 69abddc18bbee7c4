// The command line: understands it, runs the subcommand, turns every exception into one line and an exit
// code.

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <new>
#include <sstream>

#include "btfield/error.hpp"
#include "host/cli/command.hpp"
#include "host/cli/command_text.hpp"
#include "host/cli/report.hpp"

namespace {

namespace cli = btfield::cli;

enum ExitCode { done = 0, refused = 1, wrong_usage = 2, device_failed = 3 };

int fail(ExitCode code, std::string text) {
    std::replace_if(
        text.begin(), text.end(), [](unsigned char c) { return c < 32 || c == 127; }, ' ');
    std::fprintf(stderr, "btfield: %s\n", text.c_str());
    return code;
}

/// A closed standard stream would let the next opened file take its number, and messages would land in that
/// file. A descriptor that cannot be used in the stream's direction keeps the number, so that writing fails
/// as it should.
void occupy_standard_streams() {
    constexpr std::array<int, 3> wrong_way{O_WRONLY, O_RDONLY, O_RDONLY};
    for (int descriptor = 0; descriptor < 3; ++descriptor) {
        if (::fcntl(descriptor, F_GETFD) == -1 &&
            ::open("/dev/null", wrong_way[static_cast<std::size_t>(descriptor)]) != descriptor) {
            std::exit(refused);
        }
    }
}

/// Broken pipes and file size limits become errors of the call that met them.
void ignore_write_signals() {
    std::signal(SIGPIPE, SIG_IGN);
    std::signal(SIGXFSZ, SIG_IGN);
}

/// Where help may be found: "btfield fit --help".
std::string help_of(const CLI::App& app) {
    const auto subcommands = app.get_subcommands();
    return "'btfield " + (subcommands.empty() ? std::string() : subcommands.front()->get_name() + " ") +
           "--help'";
}

int wrong(const CLI::App& app, const std::string& text) {
    const auto subcommands = app.get_subcommands();
    const auto unknown = app.remaining();
    std::string found = text;
    if (subcommands.empty() && !unknown.empty()) {
        const bool option = unknown.front().rfind('-', 0) == 0;
        found = "'" + unknown.front() + "' is no " + (option ? "option" : "command");
    }
    const std::string asked = subcommands.empty() ? "command line" : subcommands.front()->get_name();
    return fail(wrong_usage, asked + ": " + found + "; see " + help_of(app));
}

int device_failure(const btfield::DeviceError& error, bool verbose) {
    const bool hidden = !error.log().empty() && !verbose;
    fail(device_failed, error.what() + std::string(hidden ? " (--verbose shows the build log)" : ""));
    if (verbose && !error.log().empty()) std::fprintf(stderr, "%s\n", error.log().c_str());
    return device_failed;
}

int run(int argc, char** argv) {
    CLI::App app("fit random-field models to pictures of materials, grow new texture from them", "btfield");
    cli::Action action;
    bool verbose = false;
    try {
        app.formatter(std::make_shared<cli::HelpFormatter>());
        app.set_help_flag("-h,--help", "print this text");
        app.set_version_flag("--version", "btfield " BTFIELD_VERSION, "print the version")
            ->group(cli::general);
        app.add_flag("--verbose", verbose, "show the build log when a kernel does not compile")
            ->group(cli::general);
        app.require_subcommand(1);
        cli::set_guide(app,
                       {.usual = {{"btfield fit cork.png -o cork.json"},
                                  {"btfield synth cork.json -o cork-4x.png --size 1024x1024"},
                                  {"btfield compare cork.png cork-4x.png"}},
                        .notes = {"'btfield COMMAND --help' shows the options of a command.",
                                  "Exit codes: 0 done, 1 the request cannot be met, 2 wrong usage, 3 device "
                                  "failure.",
                                  "Environment: BTFIELD_DEVICE, the device where --device names none; "
                                  "BTFIELD_CACHE_DIR, where built kernels are kept (default: "
                                  "~/.cache/btfield)."}});
        cli::add_fit(app, action);
        cli::add_synth(app, action);
        cli::add_info(app, action);
        cli::add_compare(app, action);
        cli::add_kappa(app, action);
        cli::add_memd(app, action);
        cli::add_experiment(app, action);
        cli::add_devices(app, action);
        cli::add_completion(app, action);
        cli::add_manual(app, action);
        for (CLI::App* command : app.get_subcommands({})) command->fallthrough();
        try {
            app.parse(argc, argv);
        } catch (const CLI::Success& request) {  // --help, --version
            std::ostringstream text;
            app.exit(request, text, text);
            cli::emit_text(text.str());
            return done;
        }
        action();
        return done;
    } catch (const CLI::Error& error) {
        return wrong(app, error.what());
    } catch (const cli::UsageError& error) {
        return wrong(app, error.what());
    } catch (const btfield::DeviceError& error) {
        return device_failure(error, verbose);
    } catch (const btfield::Error& error) {
        return fail(refused, error.what());
    } catch (const std::bad_alloc&) {
        return fail(refused, "hold the data in memory: there is not enough; use a smaller picture or size");
    } catch (const std::exception& error) {
        return fail(refused,
                    std::string("finish the command: ") + error.what() + "; report this as a defect");
    }
}

}  // namespace

int main(int argc, char** argv) {
    occupy_standard_streams();
    ignore_write_signals();
    return run(argc, argv);
}

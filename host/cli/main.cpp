// The command line: understands it, runs the subcommand, turns every exception into one line and an exit
// code.

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <csignal>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <memory>
#include <new>
#include <sstream>
#include <string>
#include <string_view>
#include <system_error>

#include "btfield/error.hpp"
#include "host/base/limits.hpp"
#include "host/cli/citation_text.hpp"
#include "host/cli/command.hpp"
#include "host/cli/command_text.hpp"
#include "host/cli/ending.hpp"
#include "host/cli/near_misses.hpp"
#include "host/cli/options.hpp"
#include "host/cli/output_names.hpp"
#include "host/cli/report.hpp"

namespace {

namespace cli = btfield::cli;

enum ExitCode { done = 0, refused = 1, wrong_usage = 2, device_failed = 3 };

int fail(ExitCode code, std::string text) {
    text = cli::with_own_limits(std::move(text));
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

/// What the user of a word that is no command may have meant; empty where nothing suggests itself.
std::string suggestion(const std::string& word) {
    std::error_code error;
    if (!std::filesystem::is_regular_file(word, error)) return {};
    const std::filesystem::path path(word);
    const std::string extension = path.extension().string(), stem = path.stem().string();
    if (extension == ".json" || extension == ".btfm")
        return "'btfield synth " + word + " -o " + stem + ".png'";
    return "'btfield fit " + word + " -o " + stem + ".json'";
}

struct Misspelt {
    std::string word;
    std::string meant;  ///< the whole command; empty: none
};

/// Of the unknown words one that is a slip for a command. CLI11 takes what follows a word
/// that it does not know for a command of its own: `compond fit` for `fit`.
/// \param name  of the command that was understood
Misspelt misspelt_command(const CLI::App& app, const std::vector<std::string>& unknown,
                          const std::string& name) {
    std::error_code error;
    for (const std::string& word : unknown) {
        if (name.empty() && word != unknown.front()) break;
        if (word.starts_with('-') || std::filesystem::exists(word, error)) continue;
        const std::string group = cli::near_command(app, word);
        if (group.empty()) continue;
        if (name.empty()) return {word, group};
        const auto commands =
            app.get_subcommand(group)->get_subcommands([](const CLI::App*) { return true; });
        if (std::ranges::find(commands, name, &CLI::App::get_name) != commands.end())
            return {word, group + " " + name};
    }
    return {};
}

int wrong(const CLI::App& app, const std::string& text) {
    const CLI::App* command = &app;
    std::string name;  // "experiment run"
    while (!command->get_subcommands().empty()) {
        command = command->get_subcommands().front();
        name += (name.empty() ? "" : " ") + command->get_name();
    }
    const std::vector<std::string> unknown = app.remaining(true);
    std::string found = text;
    if (const std::size_t often = text.find(": At Most 1 required"); often != std::string::npos)
        found = text.substr(0, often) + " is given more than once";
    if (text == "A subcommand is required") {  // CLI11's words
        found = "a command is to follow:";
        for (const CLI::App* each : command->get_subcommands({}))
            found += (found.ends_with(':') ? " " : ", ") + each->get_name();
    }
    if (const Misspelt misspelt = misspelt_command(app, unknown, name); !misspelt.meant.empty())
        return fail(wrong_usage, "command line: '" + misspelt.word +
                                     "' is no command, did you mean 'btfield " + misspelt.meant +
                                     "'?; see 'btfield " + misspelt.meant + " --help'");
    if (!unknown.empty() && !command->get_subcommands({}).empty()) {
        const bool option = unknown.front().rfind('-', 0) == 0;
        found = "'" + unknown.front() + "' is no " + (option ? "option" : "command") +
                (name.empty() ? "" : " of " + name);
        const std::string meant = name.empty() && !option ? suggestion(unknown.front()) : "";
        if (!meant.empty()) found += ", did you mean " + meant + "?";
        const std::string near = name.empty() || option ? "" : cli::near_command(*command, unknown.front());
        if (!near.empty()) found += ", did you mean 'btfield " + name + " " + near + "'?";
        const auto commands = app.get_subcommands([](const CLI::App*) { return true; });
        if (!name.empty() &&
            std::ranges::find(commands, unknown.front(), &CLI::App::get_name) != commands.end())
            found += ", did you mean 'btfield " + unknown.front() + "'?";
    } else if (!unknown.empty()) {
        const std::string advice = cli::near_miss(*command, unknown);
        if (!advice.empty()) found += "; " + advice;
    }
    return fail(wrong_usage, (name.empty() ? "command line" : name) + ": " + found + "; see 'btfield " +
                                 name + (name.empty() ? "" : " ") + "--help'");
}

/// An empty word where a value is asked for is a slip, such as a variable that is not set.
void refuse_empty_values(const CLI::App& command) {
    for (const CLI::Option* option : command.get_options()) {
        for (const std::string& value : option->results()) {
            if (value.empty()) throw cli::UsageError(option->get_name() + ": the value is empty");
        }
    }
    for (const CLI::App* each : command.get_subcommands()) refuse_empty_values(*each);
}

int device_failure(const btfield::DeviceError& error, bool verbose) {
    const bool hidden = !error.log().empty() && !verbose;
    fail(device_failed, error.what() + std::string(hidden ? " (--verbose shows the build log)" : ""));
    if (verbose && !error.log().empty()) std::fprintf(stderr, "%s\n", error.log().c_str());
    return device_failed;
}

/// Options and commands; a command that is asked for puts its work into the action.
void describe(CLI::App& app, cli::Action& action, bool& verbose) {
    app.formatter(std::make_shared<cli::HelpFormatter>());
    app.set_help_flag("-h,--help", "print this text");
    app.set_version_flag("-V,--version", "btfield " BTFIELD_VERSION, "print the version")
        ->group(cli::general);
    app.add_flag_callback(
           "--cite",
           [] {
               const std::string_view text = btfield::detail::citation_text("CITATION.cff");
               throw CLI::CallForVersion(std::string(text.substr(0, text.find_last_not_of('\n') + 1)), 0);
           },
           "print how to cite btfield and its papers (CFF)")
        ->group(cli::general);
    app.add_flag("--verbose", verbose, "show the build log when a kernel does not compile")
        ->group(cli::general);
    app.add_flag_function(
           "-q,--quiet", [](std::int64_t) { cli::be_quiet(); },
           "no texts about files that were written, no progress; errors and warnings remain")
        ->group(cli::general);
    cli::add_limits(app);
    app.require_subcommand(1);
    cli::set_guide(app,
                   {.usual = {{"btfield fit cork.png -o cork.json"},
                              {"btfield synth cork.json -o cork-4x.png --size 1024x1024"},
                              {"btfield compare cork.png cork-4x.png"}},
                    .notes = {"'btfield COMMAND --help' shows the options of a command.",
                              "Documents that messages name as docs/NAME are in share/doc/btfield, below "
                              "the folder that btfield was installed into.",
                              "Exit codes: 0 done, 1 the request cannot be met, 2 wrong usage, 3 device "
                              "failure.",
                              "Environment: BTFIELD_DEVICE, the device where --device names none; "
                              "BTFIELD_THREADS and BTFIELD_MEMORY, in place of --threads and --memory; "
                              "BTFIELD_CACHE_DIR, where built kernels are kept (default: "
                              "btfield in XDG_CACHE_HOME, or in ~/.cache)."}});
    cli::add_fit(app, action);
    cli::add_synth(app, action);
    cli::add_roll(app, action);
    cli::add_compound(app, action);
    cli::add_relief(app, action);
    cli::add_btf(app, action);
    cli::add_info(app, action);
    cli::add_compare(app, action);
    cli::add_kappa(app, action);
    cli::add_memd(app, action);
    cli::add_experiment(app, action);
    cli::add_devices(app, action);
    cli::add_version(app, action);
    cli::add_completion(app, action);
    cli::add_manual(app, action);
    cli::add_help(app, action);
    for (CLI::App* command : app.get_subcommands({})) command->fallthrough();
}

int run(int argc, char** argv) {
    CLI::App app("fit random-field models to pictures of materials, grow new texture from them", "btfield");
    cli::Action action;
    bool verbose = false;
    try {
        describe(app, action, verbose);
        try {
            app.parse(argc, argv);
        } catch (const CLI::Success& request) {  // --help, --version
            std::ostringstream text;
            app.exit(request, text, text);
            cli::emit_text(text.str());
            return done;
        }
        refuse_empty_values(app);
        action();
        return done;
    } catch (const CLI::ExtrasError&) {
        std::string unknown;  // CLI11 lists them from the last to the first
        for (const std::string& word : app.remaining(true)) unknown += " " + word;
        return wrong(app, "not expected:" + unknown);
    } catch (const CLI::Error& error) {
        return wrong(app, error.what());
    } catch (const cli::UsageError& error) {
        return wrong(app, error.what());
    } catch (const btfield::DeviceError& error) {
        return device_failure(error, verbose);
    } catch (const btfield::Error& error) {
        return fail(refused, error.what());
    } catch (const std::bad_alloc&) {
        const std::string limit = btfield::detail::address_space_text();
        return fail(refused,
                    "hold the data in memory: there is not enough" +
                        (limit.empty() ? "" : " where " + limit) + "; use a smaller picture or size" +
                        (limit.empty() ? "" : ", or " + std::string(btfield::detail::more_address_space)));
    } catch (const std::exception& error) {
        return fail(refused,
                    std::string("finish the command: ") + error.what() + "; report this as a defect");
    }
}

}  // namespace

int main(int argc, char** argv) {
    occupy_standard_streams();
    ignore_write_signals();
    cli::watch_signals();
    cli::explain_crashes();
    const int code = run(argc, argv);
    if (code != done) cli::remove_empty_output_folders();
    return code;
}

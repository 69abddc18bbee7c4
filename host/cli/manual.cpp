// Manual pages: the texts of --help in roff.

#include <algorithm>
#include <array>
#include <cctype>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <filesystem>
#include <memory>

#include "host/base/file_output.hpp"
#include "host/cli/command.hpp"
#include "host/cli/command_text.hpp"
#include "host/cli/options.hpp"
#include "host/cli/report.hpp"

namespace btfield::cli {
namespace {

/// The code point at `at`, which moves behind it; texts of this program are valid UTF-8.
char32_t code_point(const std::string& text, std::size_t& at) {
    const auto byte = [&](std::size_t i) { return static_cast<unsigned char>(text[i]); };
    const unsigned char first = byte(at++);
    if (first < 0x80) return first;
    const int more = first >= 0xF0 ? 3 : first >= 0xE0 ? 2 : 1;
    char32_t code = first & (0x3FU >> more);
    for (int i = 0; i < more && at < text.size(); ++i) code = code << 6 | (byte(at++) & 0x3FU);
    return code;
}

/// Text as it stands: no character is a request, none changes its shape.
std::string roff(const std::string& text) {
    std::string result;
    for (std::size_t at = 0; at < text.size();) {
        const char32_t code = code_point(text, at);
        std::array<char, 16> glyph{};
        switch (code) {
            case '\\':
                result += "\\e";
                break;
            case '-':
                result += "\\-";
                break;
            case '\'':
                result += "\\(aq";
                break;
            case '`':
                result += "\\(ga";
                break;
            case '^':
                result += "\\(ha";
                break;
            case '~':
                result += "\\(ti";
                break;
            case '"':
                result += "\\(dq";
                break;
            default:
                if (code < 0x80) {
                    result += static_cast<char>(code);
                } else {
                    std::snprintf(glyph.data(), glyph.size(), "\\[u%04X]", static_cast<unsigned>(code));
                    result += glyph.data();
                }
        }
    }
    return result[0] == '.' ? "\\&" + result : result;
}

std::string bold(const std::string& text) {
    return "\\fB" + roff(text) + "\\fR";
}

std::string italic(const std::string& text) {
    return "\\fI" + roff(text) + "\\fR";
}

/// "btfield-experiment-run".
std::string page_name(const CommandText& command) {
    std::string name = command.name;
    for (char& c : name) c = c == ' ' ? '-' : c;
    return name;
}

/// Day of the build, or the one that reproducible builds are told.
std::string day() {
    std::time_t seconds = std::chrono::system_clock::to_time_t(std::chrono::system_clock::now());
    if (const char* const epoch = std::getenv("SOURCE_DATE_EPOCH")) {
        if (const auto told = parse_number(epoch, 0, 253402300799)) seconds = static_cast<std::time_t>(*told);
    }
    std::tm time{};
    std::array<char, 16> text{};
    ::gmtime_r(&seconds, &time);
    std::strftime(text.data(), text.size(), "%Y-%m-%d", &time);
    return text.data();
}

std::string entry(const std::string& name, const std::string& help) {
    return ".TP\n" + name + "\n" + roff(help) + "\n";
}

/// A line may break behind each of the words.
std::string value_text(const std::string& value) {
    std::string text;
    for (const char c : italic(value)) text += c == '|' ? "|\\:" : std::string(1, c);
    return text;
}

std::string option_title(const OptionText& option) {
    std::string name;
    for (const std::string& each : option.names) name += (name.empty() ? "" : ", ") + bold(each);
    return option.value.empty() ? name : name + " " + value_text(option.value);
}

std::string examples(const Guide& guide) {
    std::vector<Example> all = guide.usual;
    all.insert(all.end(), guide.more.begin(), guide.more.end());
    if (all.empty()) return {};
    std::string text = ".SH EXAMPLES\n.EX\n";
    for (const Example& example : all) {
        text += roff(example.line) + "\n";
        if (!example.effect.empty()) text += "    # " + roff(example.effect) + "\n";
    }
    return text + ".EE\n";
}

std::string synopsis_text(const CommandText& command) {
    std::string text;
    for (const std::string& part : synopsis(command)) {
        const std::size_t space = part.find(' ');
        if (text.empty()) {
            text = bold(part);
        } else if (part[0] == '-') {
            text += " " + bold(part.substr(0, space)) + " " + italic(part.substr(space + 1));
        } else {
            text += " " + italic(part);
        }
    }
    return text + "\n";
}

/// Pages of the command above and of those below.
std::string see_also(const CommandText& command) {
    std::vector<std::string> names;
    const std::string name = page_name(command);
    const std::size_t above = command.name.rfind(' ');
    if (above != std::string::npos) names.push_back(name.substr(0, above));
    for (const CommandText& each : command.commands) names.push_back(page_name(each));
    std::string text = names.empty() ? "" : ".SH SEE ALSO\n";
    for (const std::string& each : names)
        text += bold(each) + "(1)" + (&each == &names.back() ? "\n" : ",\n");
    return text;
}

std::string page(const CommandText& command) {
    std::string title = page_name(command);
    for (char& c : title) c = static_cast<char>(std::toupper(static_cast<unsigned char>(c)));
    std::string text = ".\\\" Made by `btfield man`.\n.TH " + roff(title) + " 1 " + day() +
                       " \"btfield " BTFIELD_VERSION "\" \"User Commands\"\n.SH NAME\n" +
                       roff(page_name(command)) + " \\- " + roff(command.purpose) + "\n.SH SYNOPSIS\n" +
                       synopsis_text(command);
    if (!command.commands.empty()) text += ".SH COMMANDS\n";
    for (const CommandText& each : command.commands)
        text += entry(bold(each.name.substr(command.name.size() + 1)), each.purpose);
    if (!command.arguments.empty()) text += ".SH ARGUMENTS\n";
    for (const OptionText& argument : command.arguments) text += entry(italic(argument.value), argument.help);
    text += ".SH OPTIONS\n";
    for (const OptionGroup& group : command.groups) {
        if (&group != &command.groups.front()) text += ".SS " + roff(group.title) + "\n";
        for (const OptionText& option : group.options) text += entry(option_title(option), option.help);
    }
    text += examples(command.guide);
    if (!command.guide.notes.empty()) text += ".SH NOTES\n";
    for (const std::string& note : command.guide.notes)
        text += (&note == &command.guide.notes.front() ? "" : ".PP\n") + roff(note) + "\n";
    return text + see_also(command);
}

void write_pages(const CommandText& command, const std::filesystem::path& folder) {
    const std::filesystem::path target = folder / (page_name(command) + ".1");
    detail::write_file(target, page(command), "write '" + target.string() + "'");
    for (const CommandText& each : command.commands) write_pages(each, folder);
}

const CommandText& named(const CommandText& root, const std::vector<std::string>& words) {
    const CommandText* command = &root;
    for (const std::string& word : words) {
        const auto found =
            std::find_if(command->commands.begin(), command->commands.end(),
                         [&](const CommandText& each) { return each.name == command->name + " " + word; });
        if (found == command->commands.end())
            throw UsageError("'" + word + "' is no command of " + command->name);
        command = &*found;
    }
    return *command;
}

}  // namespace

void add_manual(CLI::App& app, Action& action) {
    struct Options {
        std::vector<std::string> words;
        std::string folder;
    };
    CLI::App* command = app.add_subcommand("man", "print a manual page in roff");
    command->group("");
    const auto options = std::make_shared<Options>();
    command->add_option("COMMAND", options->words, "whose page (default: that of btfield)")->type_name("");
    command->add_option("--all", options->folder, "write the pages of all commands into this folder")
        ->type_name("FOLDER");
    set_guide(*command, {{{"btfield man fit | man -l -"}}});
    command->callback([options, &app, &action] {
        action = [options, &app] {
            if (!options->words.empty() && !options->folder.empty())
                throw UsageError("COMMAND and --all: give one of the two");
            const CommandText root = command_text(app);
            if (options->folder.empty()) {
                emit_text(page(named(root, options->words)));
            } else {
                write_pages(root, options->folder);
            }
        };
    });
}

}  // namespace btfield::cli

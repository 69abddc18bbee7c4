// What --help prints: the usual case, the most used options, then the others.

#include <algorithm>
#include <cctype>
#include <memory>

#include "host/cli/command.hpp"
#include "host/cli/command_text.hpp"
#include "host/cli/options.hpp"
#include "host/cli/report.hpp"

namespace btfield::cli {
namespace {

constexpr std::size_t page_width = 80;
constexpr std::size_t help_column = 22;

std::size_t width(std::string_view text) {
    return static_cast<std::size_t>(std::count_if(
        text.begin(), text.end(), [](char c) { return (static_cast<unsigned char>(c) & 0xC0) != 0x80; }));
}

std::vector<std::string> words_of(const std::string& text) {
    std::vector<std::string> words;
    std::size_t at = 0;
    while ((at = text.find_first_not_of(" \n", at)) != std::string::npos) {
        const std::size_t end = std::min(text.find_first_of(" \n", at), text.size());
        words.push_back(text.substr(at, end - at));
        at = end;
    }
    return words;
}

/// The words in lines; `start` is the beginning of the first, and what follows it is indented.
std::string lines(std::string start, const std::vector<std::string>& words, std::size_t indent) {
    std::string text, line = std::move(start);
    bool first = true;
    for (const std::string& word : words) {
        if (!first && width(line) + 1 + width(word) > page_width) {
            text += line + "\n";
            line = std::string(indent, ' ') + word;
        } else {
            line += (first ? "" : " ") + word;
        }
        first = false;
    }
    return text + line + "\n";
}

/// Choices a|b|c broken behind a bar, where they do not fit a line.
std::string folded(std::string text) {
    std::string before;
    while (width(text) > page_width) {
        const std::size_t bar = text.rfind('|', page_width - 1);
        if (bar == std::string::npos) break;
        before += text.substr(0, bar + 1) + "\n";
        text = std::string(6, ' ') + text.substr(bar + 1);
    }
    return before + text;
}

std::string entry(const std::string& name, const std::string& help, std::size_t column) {
    std::string start = "  " + name;
    std::string before;
    if (width(start) + 2 > column) {
        before = folded(start) + "\n";
        start.clear();
    }
    start.resize(start.size() + column - width(start), ' ');
    return before + lines(start, words_of(help), column);
}

std::string option_name(const OptionText& option) {
    std::string name;
    for (const std::string& each : option.names) name += (name.empty() ? "" : ",") + each;
    if (option.value.empty()) return name;
    return name.empty() ? option.value : name + " " + option.value;
}

std::string example_text(const Example& example) {
    if (example.effect.empty()) return "  " + example.line + "\n";
    const std::string effect = "# " + example.effect;
    const bool fits = 2 + width(example.line) + 3 + width(effect) <= page_width;
    return "  " + example.line + (fits ? "   " : "\n      ") + effect + "\n";
}

std::string capitalised(std::string text) {
    if (!text.empty()) text[0] = static_cast<char>(std::toupper(static_cast<unsigned char>(text[0])));
    return text;
}

std::string command_list(const CommandText& command) {
    std::size_t longest = 0;
    for (const CommandText& each : command.commands) longest = std::max(longest, each.name.size());
    const std::size_t prefix = command.name.size() + 1;
    std::string text = "\nCommands:\n";
    for (const CommandText& each : command.commands)
        text += entry(each.name.substr(prefix), each.purpose, longest - prefix + 4);
    return text;
}

std::string help_text(const CommandText& command) {
    std::string text = capitalised(command.purpose) + (command.guide.usual.empty() ? ".\n" : ":\n");
    for (const Example& example : command.guide.usual) text += example_text(example);
    text += "\n" + lines("Usage: ", synopsis(command), 9);
    if (!command.commands.empty()) text += command_list(command);
    if (!command.arguments.empty()) text += "\n";
    for (const OptionText& argument : command.arguments)
        text += entry(argument.value, argument.help, help_column);
    for (const OptionGroup& group : command.groups) {
        text += "\n" + group.title + ":\n";
        for (const OptionText& option : group.options)
            text += entry(option_name(option), option.help, help_column);
    }
    if (!command.guide.more.empty()) text += "\nMore examples:\n";
    for (const Example& example : command.guide.more) text += example_text(example);
    if (!command.guide.notes.empty()) text += "\n";
    for (const std::string& note : command.guide.notes) text += lines("", words_of(note), 0);
    return text;
}

}  // namespace

std::string HelpFormatter::make_help(const CLI::App* app, std::string /*name*/,
                                     CLI::AppFormatMode /*mode*/) const {
    return help_text(command_text(*app));
}

void add_help(CLI::App& app, Action& action) {
    CLI::App* command = app.add_subcommand("help", "print the help of a command");
    command->group("");
    const auto words = std::make_shared<std::vector<std::string>>();
    command->add_option("COMMAND", *words, "whose help (default: that of btfield)")->type_name("");
    command->callback([words, &app, &action] {
        action = [words, &app] {
            const CLI::App* of = &app;
            std::string name;
            for (const std::string& word : *words) {
                const auto commands = of->get_subcommands({});
                const auto found = std::find_if(commands.begin(), commands.end(), [&](const CLI::App* each) {
                    return each->get_name() == word;
                });
                if (found == commands.end())
                    throw UsageError("'" + word + "' is no command" + (name.empty() ? "" : " of " + name));
                of = *found;
                name += (name.empty() ? "" : " ") + word;
            }
            emit_text(help_text(command_text(*of)));
        };
    });
}

}  // namespace btfield::cli

#include "host/cli/command_text.hpp"

#include <algorithm>
#include <cctype>
#include <memory>
#include <utility>

namespace btfield::cli {
namespace {

std::vector<std::string> split(const std::string& text, char separator) {
    std::vector<std::string> parts{{}};
    for (const char c : text) {
        if (c == separator) {
            parts.emplace_back();
        } else {
            parts.back() += c;
        }
    }
    return parts;
}

bool is_upper(char c) {
    return std::isupper(static_cast<unsigned char>(c)) != 0;
}

/// Placeholders say what a value is: MODEL or RESULTS.db a file, FOLDER and DIR a folder, SPEC a device, a|b
/// one of two words, in which capitals stand for what the user knows: N, correlated:N. Other patterns (N,
/// WxH, I/N) are numbers.
ValueKind kind_of(const std::string& placeholder, bool argument) {
    using Is = ValueKind::Is;
    if (placeholder == "SPEC") return {Is::device};
    if (placeholder == "FOLDER" || placeholder == "DIR") return {Is::folder};
    if (placeholder.find('|') != std::string::npos) {
        ValueKind words{Is::words};
        for (std::string& word : split(placeholder, '|')) {
            word.erase(std::find_if(word.begin(), word.end(), is_upper), word.end());
            if (!word.empty()) words.words.push_back(std::move(word));
        }
        return words;
    }
    const std::string stem = placeholder.substr(0, placeholder.find('.'));
    const bool name = stem.size() > 1 && std::all_of(stem.begin(), stem.end(), is_upper);
    return {name || argument ? Is::file : Is::anything};
}

OptionText option_text(const CLI::Option& option) {
    OptionText text;
    for (const std::string& name : option.get_snames()) text.names.push_back("-" + name);
    for (const std::string& name : option.get_lnames()) text.names.push_back("--" + name);
    const bool argument = text.names.empty();
    const bool flag = option.get_items_expected_max() == 0;
    const std::string placeholder = flag ? std::string() : option.get_type_name();
    text.value = argument ? option.get_name(true) : placeholder;
    text.kind = kind_of(placeholder.empty() ? text.value : placeholder, argument);
    text.help = option.get_description();
    text.required = option.get_required();
    text.several = !flag && option.get_items_expected_max() > 1;
    return text;
}

/// The group's place: CLI11's own group, which commands leave the most used options in, `general` last,
/// others between as they come.
OptionGroup& group_of(std::vector<OptionGroup>& groups, const std::string& title) {
    const auto found = std::find_if(groups.begin(), groups.end(),
                                    [&](const OptionGroup& group) { return group.title == title; });
    if (found != groups.end()) return *found;
    const bool last = !groups.empty() && groups.back().title == general;
    return *groups.insert(groups.end() - (last ? 1 : 0), {title, {}});
}

}  // namespace

void set_guide(CLI::App& app, Guide guide) {
    std::dynamic_pointer_cast<HelpFormatter>(app.get_formatter())->guides[&app] = std::move(guide);
}

CommandText command_text(const CLI::App& app) {
    CommandText text;
    text.name = app.get_name();
    for (const CLI::App* parent = app.get_parent(); parent != nullptr; parent = parent->get_parent())
        text.name = parent->get_name() + " " + text.name;
    text.purpose = app.get_description();
    const auto formatter = std::dynamic_pointer_cast<HelpFormatter>(app.get_formatter());
    const auto guide = formatter->guides.find(&app);
    if (guide != formatter->guides.end()) text.guide = guide->second;
    for (const CLI::Option* option : app.get_options()) {
        if (option->get_group().empty()) continue;
        if (option->nonpositional()) {
            const bool help = option == app.get_help_ptr();
            group_of(text.groups, help ? general : option->get_group())
                .options.push_back(option_text(*option));
        } else {
            text.arguments.push_back(option_text(*option));
        }
    }
    // CLI11 has the help option first.
    for (OptionGroup& group : text.groups) {
        if (group.title == general)
            std::rotate(group.options.begin(), group.options.begin() + 1, group.options.end());
    }
    std::stable_partition(text.groups.begin(), text.groups.end(),
                          [](const OptionGroup& group) { return group.title == "Options"; });
    for (const CLI::App* command : app.get_subcommands([](const CLI::App*) { return true; })) {
        if (!command->get_group().empty()) text.commands.push_back(command_text(*command));
    }
    return text;
}

std::vector<std::string> synopsis(const CommandText& command) {
    std::vector<std::string> parts{command.name};
    if (!command.commands.empty()) parts.emplace_back("COMMAND");
    for (const OptionText& argument : command.arguments)
        parts.push_back((argument.required ? "" : "[") + argument.value + (argument.several ? "..." : "") +
                        (argument.required ? "" : "]"));
    for (const OptionGroup& group : command.groups) {
        for (const OptionText& option : group.options) {
            if (option.required) parts.push_back(option.names.front() + " " + option.value);
        }
    }
    parts.emplace_back("[OPTIONS]");
    return parts;
}

}  // namespace btfield::cli

// Completion scripts for bash, zsh and fish: what the options say of themselves, in each shell's words.

#include <algorithm>
#include <memory>
#include <utility>

#include "btfield/device.hpp"
#include "host/base/file_output.hpp"
#include "host/cli/command.hpp"
#include "host/cli/command_text.hpp"
#include "host/cli/options.hpp"
#include "host/cli/report.hpp"
#include "host/cli/run_files.hpp"
#include "host/cli/shell_names.hpp"

namespace btfield::cli {
namespace {

using Is = ValueKind::Is;

std::string replaced(const std::string& text, std::string_view characters, const std::string& before) {
    std::string result;
    for (const char c : text) {
        if (characters.find(c) != std::string_view::npos) result += before;
        result += c;
    }
    return result;
}

std::string joined(const std::vector<std::string>& words, const std::string& separator) {
    std::string text;
    for (const std::string& word : words) text += (text.empty() ? "" : separator) + word;
    return text;
}

/// What fits beside an option in a list: all before the first semicolon or parenthesis.
std::string brief(const std::string& help) {
    return help.substr(0, std::min(help.find(';'), help.find(" (")));
}

std::string last_word(const std::string& name) {
    return name.substr(name.rfind(' ') + 1);
}

/// A command and all below it, with the options of the program that work behind every command.
struct Completed {
    const CommandText* command;
    std::vector<OptionText> options;
};

void collect(const CommandText& command, const std::vector<OptionText>& common, std::vector<Completed>& all) {
    Completed completed{&command, {}};
    for (const OptionGroup& group : command.groups)
        completed.options.insert(completed.options.end(), group.options.begin(), group.options.end());
    completed.options.insert(completed.options.end(), common.begin(), common.end());
    all.push_back(std::move(completed));
    for (const CommandText& each : command.commands) collect(each, common, all);
}

std::vector<Completed> commands_of(const CommandText& root) {
    std::vector<OptionText> common;
    for (const OptionGroup& group : root.groups) {
        for (const OptionText& option : group.options) {
            const std::string& last = option.names.back();
            if (last != "--help" && last != "--version" && last != "--cite") common.push_back(option);
        }
    }
    std::vector<Completed> all;
    collect(root, {}, all);
    all.resize(1);
    for (const CommandText& each : root.commands) collect(each, common, all);
    return all;
}

// bash
// ---------------------------------------------------------------------------------------------------------

constexpr const char* bash_begin = R"bash(# Completion of btfield for bash, made by `btfield completion bash`.

_btfield() {
    # Words as they were typed, up to the cursor: bash cuts them at : and =, too.
    local typed=${COMP_LINE:0:COMP_POINT} words=() blank part i
    for ((i = 0; i <= COMP_CWORD; i++)); do
        blank=${typed%%[![:blank:]]*}
        typed=${typed#"$blank"}
        part=${COMP_WORDS[i]}
        ((i < COMP_CWORD)) || part=$typed
        typed=${typed#"$part"}
        if ((i > 0)) && [[ -z $blank ]]; then words[-1]+=$part; else words+=("$part"); fi
    done
    local value=${words[-1]} option=${words[-2]-} command=btfield word
    for word in "${words[@]:1:${#words[@]}-2}"; do
        case "$command $word" in
)bash";

constexpr const char* bash_middle = R"bash(        esac
    done
    if [[ $value == --*=* ]]; then
        option=${value%%=*}
        value=${value#*=}
    fi

    # What may stand here: words, or of a kind.
    local offer='' kind=''
    case "$command $option" in
)bash";

constexpr const char* bash_end = R"bash(        esac
        ;;
    esac

    case $kind in
    file) compopt -o default ;;
    folder) compopt -o dirnames ;;
    device) offer=$("${words[0]}" completion devices 2>/dev/null | cut -f 1) ;;
    esac
    mapfile -t COMPREPLY < <(compgen -W "$offer" -- "$value")
    [[ ${#COMPREPLY[@]} -eq 1 && ${COMPREPLY[0]} == *: ]] && compopt -o nospace
    # What bash replaces begins behind the last of its word breaks.
    if [[ $COMP_WORDBREAKS == *:* && $value == *:* ]]; then
        COMPREPLY=("${COMPREPLY[@]#"${value%"${value##*:}"}"}")
    elif [[ $COMP_WORDBREAKS != *=* && ${words[-1]} == --*=* ]]; then
        COMPREPLY=("${COMPREPLY[@]/#/"$option="}")
    fi
}
complete -F _btfield btfield
)bash";

std::string bash_offer(const ValueKind& kind) {
    switch (kind.is) {
        case Is::words:
            return "offer='" + joined(kind.words, " ") + "'";
        case Is::file:
            return "kind='file'";
        case Is::folder:
            return "kind='folder'";
        case Is::device:
            return "kind='device'";
        case Is::anything:
            break;
    }
    return ":";
}

std::string bash_patterns(const std::string& command, const std::vector<std::string>& names) {
    std::string patterns;
    for (const std::string& name : names)
        patterns += (patterns.empty() ? "'" : " | '") + command + " " + name + "'";
    return patterns;
}

std::string bash_script(const std::vector<Completed>& all) {
    std::string text = bash_begin;
    for (const auto& [command, options] : all) {
        for (const CommandText& each : command->commands)
            text += "        '" + each.name + "') command+=\" $word\" ;;\n";
    }
    // Behind what is no command, nothing fits.
    text += "        *)\n            case $command in\n            ";
    for (const auto& [command, options] : all) {
        if (!command->commands.empty())
            text += (command->name == all.front().command->name ? "'" : " | '") + command->name + "'";
    }
    text += ") [[ $word == -* ]] || command+=\" $word\" ;;\n            esac\n            ;;\n";
    text += bash_middle;
    for (const auto& [command, options] : all) {
        for (const OptionText& option : options) {
            if (!option.value.empty())
                text += "    " + bash_patterns(command->name, option.names) + ") " + bash_offer(option.kind) +
                        " ;;\n";
        }
    }
    text += "    *)\n        case \"$command:$value\" in\n";
    for (const auto& [command, options] : all) {
        std::vector<std::string> words;
        for (const OptionText& option : options)
            words.insert(words.end(), option.names.begin(), option.names.end());
        text += "        '" + command->name + ":-'*) offer='" + joined(words, " ") + "' ;;\n";
        words.clear();
        for (const CommandText& each : command->commands) words.push_back(last_word(each.name));
        if (!words.empty())
            text += "        '" + command->name + ":'*) offer='" + joined(words, " ") + "' ;;\n";
        if (!command->arguments.empty())
            text +=
                "        '" + command->name + ":'*) " + bash_offer(command->arguments.front().kind) + " ;;\n";
    }
    return text + bash_end;
}

// zsh
// ---------------------------------------------------------------------------------------------------------

constexpr const char* zsh_begin = R"zsh(#compdef btfield
# Completion of btfield for zsh, made by `btfield completion zsh`.

__btfield_words() {
    local -a whole=(${@:#*:}) open=(${(M)@:#*:})
    compadd -a whole
    compadd -S '' -a open
}

__btfield_devices() {
    local -a devices=(${(f)"$(_call_program devices btfield completion devices 2>/dev/null)"})
    devices=(${${devices//:/\\:}/$'\t'/:})
    _describe device devices
}
)zsh";

constexpr const char* zsh_end = R"zsh(
if [[ $funcstack[1] == _btfield ]]; then _btfield "$@"; else compdef _btfield btfield; fi
)zsh";

/// Inside of single quotes, in a part of _arguments that ends at a colon or bracket.
std::string zsh_text(const std::string& text) {
    std::string quoted;
    for (const char c : replaced(text, "\\:[]", "\\")) quoted += c == '\'' ? "'\\''" : std::string(1, c);
    return quoted;
}

std::string zsh_action(const ValueKind& kind) {
    switch (kind.is) {
        case Is::words:
            return " __btfield_words " + replaced(joined(kind.words, " "), ":", "\\");
        case Is::file:
            return "_files";
        case Is::folder:
            return "_files -/";
        case Is::device:
            return "__btfield_devices";
        case Is::anything:
            break;
    }
    return " ";
}

std::string zsh_option(const OptionText& option) {
    const bool flag = option.value.empty();
    std::string names, spec;
    for (const std::string& name : option.names) {
        names += (names.empty() ? "" : " ") + name;
        const char* const form = flag ? "" : name.rfind("--", 0) == 0 ? "=" : "+";
        spec += (spec.empty() ? "" : ",") + name + form;
    }
    spec = option.names.size() > 1 ? "'(" + names + ")'{" + spec + "}" : spec;
    spec += "'[" + zsh_text(brief(option.help)) + "]";
    if (!flag) spec += ":" + zsh_text(option.value) + ":" + zsh_action(option.kind);
    return spec + "'";
}

std::string zsh_function(std::string name) {
    for (char& c : name) c = c == ' ' ? '_' : c;
    return "_" + name;
}

std::string zsh_script(const std::vector<Completed>& all) {
    std::string text = zsh_begin;
    for (const auto& [command, options] : all) {
        text += "\n" + zsh_function(command->name) + "() {\n";
        const bool inner = command->commands.empty();
        text += inner ? "    _arguments -s"
                      : "    local state line\n    typeset -A opt_args\n    _arguments -C -s -A '-*'";
        for (const OptionText& option : options) text += " \\\n        " + zsh_option(option);
        for (std::size_t i = 0; i < command->arguments.size(); ++i) {
            const OptionText& argument = command->arguments[i];
            text += " \\\n        '" + (argument.several ? "*" : std::to_string(i + 1)) + ":" +
                    zsh_text(argument.value) + ":" + zsh_action(argument.kind) + "'";
        }
        if (!inner) {
            text +=
                " \\\n        '1:command:->command' '*::argument:->argument' && return\n    case $state in\n"
                "    command)\n        local -a commands=(";
            for (const CommandText& each : command->commands)
                text += "\n            '" + last_word(each.name) + ":" + zsh_text(each.purpose) + "'";
            text +=
                ")\n        _describe command commands\n        ;;\n    argument)\n        case $line[1] "
                "in\n";
            for (const CommandText& each : command->commands)
                text += "        " + last_word(each.name) + ") " + zsh_function(each.name) + " ;;\n";
            text += "        esac\n        ;;\n    esac";
        }
        text += "\n}\n";
    }
    return text + zsh_end;
}

// fish
// ---------------------------------------------------------------------------------------------------------

constexpr const char* fish_begin = R"fish(# Completion of btfield for fish, made by `btfield completion fish`.

# Whether the words before the cursor are those of this command; with --exactly, and no argument after it.
function __btfield_in
    argparse exactly -- $argv
    set -l words (commandline -opc)
    set -l words (string match --invert -- '-*' $words[2..])
    set -l count (count $argv)
    test (count $words) -ge $count; or return 1
    set -q _flag_exactly; and test (count $words) -ne $count; and return 1
    test $count -eq 0; or test "$words[1..$count]" = "$argv"
end

function __btfield_devices
    set -l words (commandline -opc)
    $words[1] completion devices 2>/dev/null
end

complete -c btfield -f
)fish";

std::string fish_text(const std::string& text) {
    return "'" + replaced(text, "\\'", "\\") + "'";
}

std::string fish_value(const ValueKind& kind) {
    switch (kind.is) {
        case Is::words:
            return " -x -a " + fish_text(joined(kind.words, " "));
        case Is::file:
            return " -r -F";
        case Is::folder:
            return " -x -a '(__fish_complete_directories (commandline -ct))'";
        case Is::device:
            return " -x -a '(__btfield_devices)'";
        case Is::anything:
            break;
    }
    return " -x";
}

std::string fish_script(const std::vector<Completed>& all) {
    std::string text = fish_begin;
    for (const auto& [command, options] : all) {
        const std::size_t space = command->name.find(' ');
        const std::string path = space == std::string::npos ? "" : command->name.substr(space);
        const std::string begin = "complete -c btfield -n '__btfield_in" + path + "'";
        const std::string exactly = "complete -c btfield -n '__btfield_in --exactly" + path + "'";
        text += "\n# " + command->name + "\n";
        for (const CommandText& each : command->commands)
            text += exactly + " -a " + last_word(each.name) + " -d " + fish_text(each.purpose) + "\n";
        for (const OptionText& option : options) {
            text += command->commands.empty() ? begin : exactly;
            for (const std::string& name : option.names)
                text += name.rfind("--", 0) == 0 ? " -l " + name.substr(2) : " -s " + name.substr(1);
            if (!option.value.empty()) text += fish_value(option.kind);
            text += " -d " + fish_text(brief(option.help)) + "\n";
        }
        for (const OptionText& argument : command->arguments) {
            if (argument.kind.is == Is::file) {
                text += begin + " -F\n";
                break;
            }
        }
    }
    return text;
}

/// What --device takes, each with the device's name behind a tab.
std::string device_words() {
    std::string text = "auto\ta GPU, else a CPU, else any\ncpu\tany CPU\ngpu\tany GPU\n";
    for (const DeviceInfo& device : list_devices()) {
        text += std::to_string(device.platform_index) + ":" + std::to_string(device.device_index) + "\t" +
                device.name + "\n";
    }
    return text;
}

std::string script(const CommandText& root, Shell shell) {
    switch (shell) {
        case Shell::bash:
            return bash_script(commands_of(root));
        case Shell::zsh:
            return zsh_script(commands_of(root));
        case Shell::fish:
            return fish_script(commands_of(root));
        case Shell::devices:
            break;
    }
    return device_words();
}

}  // namespace

void add_completion(CLI::App& app, Action& action) {
    struct Options {
        Shell shell = Shell::bash;
        std::string output;
    };
    CLI::App* command = app.add_subcommand("completion", "print a script that completes btfield in a shell");
    command->group("");
    const auto options = std::make_shared<Options>();
    add_choice(*command, "SHELL", options->shell,
               "which shell: bash, zsh or fish; devices: the words that --device takes")
        ->required();
    command->add_option("-o,--output", options->output, "file to write, in place of standard output")
        ->type_name("FILE");
    set_guide(*command,
              {{{"source <(btfield completion bash)", "in ~/.bashrc, where no package brings it"}}});
    command->callback([options, &app, &action] {
        action = [options, &app] {
            const std::string text = script(command_text(app), options->shell);
            if (options->output.empty()) {
                emit_text(text);
            } else {
                RunFiles(false, false).writes_text(options->output);
                detail::write_file(options->output, text, "write '" + options->output + "'");
            }
        };
    });
}

}  // namespace btfield::cli

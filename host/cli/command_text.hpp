#pragma once

/// \file
/// What a command says about itself: the one source of help, shell completions and manual pages.

#include <CLI/CLI.hpp>
#include <map>
#include <string>
#include <vector>

namespace btfield::cli {

/// A line to paste into a shell, and what it does where that does not show.
struct Example {
    std::string line;
    std::string effect{};
};

/// What is said beside the options.
struct Guide {
    std::vector<Example> usual;        ///< how the command is used most of the time; help begins with them
    std::vector<Example> more{};       ///< other uses
    std::vector<std::string> notes{};  ///< paragraphs
};

/// What a shell offers as a value.
struct ValueKind {
    enum class Is { anything, words, file, folder, device };
    Is is = Is::anything;
    std::vector<std::string> words{};  ///< one that ends in ':' goes on behind it
};

struct OptionText {
    std::vector<std::string> names;  ///< "-o", "--output"; none for an argument
    std::string value;               ///< "MODEL", "auto|ls|ml", an argument's name; empty for a flag
    ValueKind kind;
    std::string help;
    bool required = false;
    bool several = false;
};

struct OptionGroup {
    std::string title;
    std::vector<OptionText> options;
};

struct CommandText {
    std::string name;  ///< "btfield experiment run"
    std::string purpose;
    Guide guide;
    std::vector<OptionText> arguments;
    std::vector<OptionGroup> groups;  ///< the most used first, `general` last
    std::vector<CommandText> commands;
};

/// Title of the options that many commands have.
inline const std::string general = "General";

/// Keeps the guides of an App and of its subcommands, and prints their help.
class HelpFormatter : public CLI::FormatterBase {
  public:
    [[nodiscard]] std::string make_help(const CLI::App* app, std::string name,
                                        CLI::AppFormatMode mode) const override;
    std::map<const CLI::App*, Guide> guides;
};

/// For an App whose formatter is a HelpFormatter, as that of each of its subcommands then is.
void set_guide(CLI::App& app, Guide guide);

/// All that is not hidden.
[[nodiscard]] CommandText command_text(const CLI::App& app);

/// "btfield synth MODEL... -o IMAGE [OPTIONS]", in parts that stay whole.
[[nodiscard]] std::vector<std::string> synopsis(const CommandText& command);

}  // namespace btfield::cli

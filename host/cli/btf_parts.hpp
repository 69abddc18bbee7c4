#pragma once

/// \file
/// Commands below `btf`, a file for each, and what they have in common.

#include <CLI/CLI.hpp>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "btfield/btf_output.hpp"
#include "btfield/btf_set.hpp"
#include "host/cli/command.hpp"
#include "host/cli/report.hpp"

namespace btfield::cli {

void add_btf_info(CLI::App& parent, Action& action);
void add_btf_make(CLI::App& parent, Action& action);
void add_btf_fit(CLI::App& parent, Action& action);
void add_btf_synth(CLI::App& parent, Action& action);
void add_btf_render(CLI::App& parent, Action& action);
void add_btf_view(CLI::App& parent, Action& action);
void add_btf_convert(CLI::App& parent, Action& action);

/// --coding, --colour, --crop, --pixel-stride, --view-stride, --light-stride, of commands that read a set.
void add_btf_reading(CLI::App& app, BtfOptions& options);

/// Opens a set and warns of what may surprise.
[[nodiscard]] BtfSet open_told(const std::string& path, const BtfOptions& options);

/// [theta, phi] in degrees, to four decimals.
[[nodiscard]] Json degrees_json(const BtfDirection& direction);
/// format, size, planes, views, lights, pictures, missing, duplicates, colour, white, bytes.
[[nodiscard]] Json set_json(const BtfSet& set);
/// The same for people, several lines.
[[nodiscard]] std::string set_text(const BtfSet& set);

/// "THETA,PHI" in degrees, as --view and --light have them: theta from 0, below 90.
[[nodiscard]] std::optional<BtfDirection> parse_direction(const std::string& text);

/// Of bytes to those of a model's file; not a number where there are none.
[[nodiscard]] double compression_ratio(std::uint64_t of, std::uintmax_t bytes);

/// \throws InputError when the output is the input, by whatever name, or lies in it
void check_outside(const std::string& asked, const std::string& output, const std::string& input);

/// What commands that write a set are told.
struct BtfWritingArguments {
    std::string output;
    std::optional<BtfFormat> format;
    BtfWriteOptions how;
    std::optional<int> components;
    bool overwrite = false;
};
/// -o, --format, --type, --components, --exposure, --overwrite.
void add_btf_writing(CLI::App& app, BtfWritingArguments& arguments);
/// Chooses the format, by the output's extension where none is given; then refuses an output that is there
/// and not empty, unless it may be overwritten, one that is an input or lies in it, and what
/// check_btf_output() refuses.
void check_btf_writing(BtfWritingArguments& arguments, const std::vector<std::string>& inputs,
                       const BtfDescription& set);
/// With progress on a terminal.
[[nodiscard]] BtfWriteReport write_told(const BtfWritingArguments& arguments, const BtfSet& set);
/// components and relative_error of a .btf; nothing of others.
void put_components(const BtfWriteReport& report, Json& object);
/// The same, a line; empty of others.
[[nodiscard]] std::string components_text(const BtfWriteReport& report);

}  // namespace btfield::cli

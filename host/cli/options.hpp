#pragma once

/// \file
/// Options whose values are read strictly: the whole text must be the value, in decimal, in range.

#include <CLI/CLI.hpp>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>

#include "btfield/image_io.hpp"
#include "btfield/neighbourhood.hpp"
#include "host/base/names.hpp"

namespace btfield::cli {

/// The whole text as a decimal number in [lowest, highest]; nothing for any other text.
[[nodiscard]] std::optional<std::uint64_t> parse_number(const std::string& text, std::uint64_t lowest,
                                                        std::uint64_t highest);

/// "512x256", width first; "512" is 512 × 512.
[[nodiscard]] std::optional<Size> parse_size(const std::string& text);

/// "X,Y,W,H".
[[nodiscard]] std::optional<Crop> parse_crop(const std::string& text);

/// "X,Y", whole numbers of any sign.
[[nodiscard]] std::optional<Offset> parse_offset(const std::string& text);

CLI::Option* add_offset(CLI::App& app, const std::string& name, std::optional<Offset>& value,
                        const std::string& help);
CLI::Option* add_int(CLI::App& app, const std::string& name, int& value, int lowest, int highest,
                     const std::string& help);
/// As add_int, and says whether the option was there.
CLI::Option* add_int(CLI::App& app, const std::string& name, std::optional<int>& value, int lowest,
                     int highest, const std::string& help);
CLI::Option* add_uint64(CLI::App& app, const std::string& name, std::uint64_t& value,
                        const std::string& help);
/// One of several runs that share work: number `index`, from 1 to `count`.
struct Shard {
    int index = 1, count = 1;
};
/// --shard I/N.
CLI::Option* add_shard(CLI::App& app, std::function<void(Shard)> take, const std::string& help);
CLI::Option* add_size(CLI::App& app, const std::string& name, std::optional<Size>& value,
                      const std::string& help);
CLI::Option* add_crop(CLI::App& app, const std::string& name, std::optional<Crop>& value,
                      const std::string& help);
/// A finite number above 0.
CLI::Option* add_positive(CLI::App& app, const std::string& name, double& value, const std::string& help);
CLI::Option* add_positive(CLI::App& app, const std::string& name, std::optional<double>& value,
                          const std::string& help);
/// --white: the white level of pictures with float values.
CLI::Option* add_white(CLI::App& app, std::optional<double>& white);
/// Whether a white level means anything to the picture: 8-bit and 16-bit values are fractions of white
/// already.
[[nodiscard]] bool is_hdr(const Picture& picture);
/// The value that is white: `white` for pictures with float values (1 without one), 1 for others.
[[nodiscard]] double white_level(const Picture& picture, std::optional<double> white);
CLI::Option* add_device(CLI::App& app, std::string& spec);
/// The error's text, where it names $BTFIELD_MEMORY as a remedy and the environment had none: --memory does.
[[nodiscard]] std::string with_own_limits(std::string text);

/// --threads and --memory: what they say, the environment says from then on, and with it the library.
void add_limits(CLI::App& app);
CLI::Option* add_json(CLI::App& app, bool& json);
/// --overwrite: see RunFiles.
CLI::Option* add_overwrite(CLI::App& app, bool& overwrite);
/// Takes "-" for standard input or output.
void take_dash(CLI::Option* option, const std::string& stream);

/// One of the enumeration's words.
template <typename Value>
CLI::Option* add_choice(CLI::App& app, const std::string& name, Value& value, const std::string& help) {
    const std::string words = detail::words_of<Value>("|");
    const auto read = [name, &value, words](const std::string& text) {
        const auto found = detail::find_value<Value>(text);
        if (!found) throw CLI::ValidationError(name, "'" + text + "' is none of " + words);
        value = *found;
    };
    return app.add_option_function<std::string>(name, read, help)->type_name(words);
}
/// As above, and says whether the option was there.
template <typename Value>
CLI::Option* add_choice(CLI::App& app, const std::string& name, std::optional<Value>& value,
                        const std::string& help) {
    const std::string words = detail::words_of<Value>("|");
    const auto read = [name, &value, words](const std::string& text) {
        value = detail::find_value<Value>(text);
        if (!value) throw CLI::ValidationError(name, "'" + text + "' is none of " + words);
    };
    return app.add_option_function<std::string>(name, read, help)->type_name(words);
}

}  // namespace btfield::cli

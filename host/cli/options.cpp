#include "host/cli/options.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <system_error>

#include "host/base/limits.hpp"
#include "host/cli/command_text.hpp"
#include "host/cli/report.hpp"

namespace btfield::cli {
namespace {

constexpr std::uint64_t largest_side = std::numeric_limits<int>::max();

/// The parts between the separators, as numbers; nothing when there are not exactly N of them or one is out
/// of range.
template <std::size_t N>
std::optional<std::array<int, N>> parse_numbers(const std::string& text, char separator,
                                                const std::array<std::uint64_t, N>& lowest) {
    std::array<int, N> numbers{};
    std::size_t start = 0;
    for (std::size_t i = 0; i < N; ++i) {
        const std::size_t end = i + 1 < N ? text.find(separator, start) : text.size();
        if (end == std::string::npos) return std::nullopt;
        const auto number = parse_number(text.substr(start, end - start), lowest[i], largest_side);
        if (!number) return std::nullopt;
        numbers[i] = static_cast<int>(*number);
        start = end + 1;
    }
    return numbers;
}

template <typename Value, typename Parse>
CLI::Option* add_parsed(CLI::App& app, const std::string& name, Value& value, const std::string& help,
                        Parse parse, const std::string& expected) {
    const auto read = [name, &value, parse, expected](const std::string& text) {
        const auto parsed = parse(text);
        if (!parsed) throw CLI::ValidationError(name, "'" + text + "' is not " + expected);
        value = *parsed;
    };
    return app.add_option_function<std::string>(name, read, help);
}

std::optional<double> parse_positive(const std::string& text) {
    double number = 0.0;
    const char* const end = text.data() + text.size();
    const auto [stop, error] = std::from_chars(text.data(), end, number);
    // Pictures are of single precision.
    if (error != std::errc{} || stop != end || !(number >= 1e-30 && number <= 1e30)) return std::nullopt;
    return number;
}

template <typename Value>
CLI::Option* add_int_to(CLI::App& app, const std::string& name, Value& value, int lowest, int highest,
                        const std::string& help) {
    const auto parse = [lowest, highest](const std::string& text) -> std::optional<int> {
        const auto number =
            parse_number(text, static_cast<std::uint64_t>(lowest), static_cast<std::uint64_t>(highest));
        if (!number) return std::nullopt;
        return static_cast<int>(*number);
    };
    return add_parsed(app, name, value, help, parse,
                      "a whole number from " + std::to_string(lowest) + " to " + std::to_string(highest))
        ->type_name("N");
}

}  // namespace

std::optional<std::uint64_t> parse_number(const std::string& text, std::uint64_t lowest,
                                          std::uint64_t highest) {
    std::uint64_t number = 0;
    const char* const end = text.data() + text.size();
    const auto [stop, error] = std::from_chars(text.data(), end, number);
    if (error != std::errc{} || stop != end || number < lowest || number > highest) return std::nullopt;
    return number;
}

std::optional<Size> parse_size(const std::string& text) {
    if (const auto side = parse_number(text, 1, largest_side))
        return Size{static_cast<int>(*side), static_cast<int>(*side)};
    const auto numbers = parse_numbers<2>(text, 'x', {1, 1});
    if (!numbers) return std::nullopt;
    return Size{(*numbers)[1], (*numbers)[0]};
}

std::optional<Crop> parse_crop(const std::string& text) {
    const auto numbers = parse_numbers<4>(text, ',', {0, 0, 1, 1});
    if (!numbers) return std::nullopt;
    return Crop{(*numbers)[0], (*numbers)[1], (*numbers)[2], (*numbers)[3]};
}

std::optional<Offset> parse_offset(const std::string& text) {
    Offset offset;
    const char* const end = text.data() + text.size();
    const auto [comma, error] = std::from_chars(text.data(), end, offset.column);
    if (error != std::errc{} || comma == end || *comma != ',') return std::nullopt;
    const auto [stop, second] = std::from_chars(comma + 1, end, offset.row);
    if (second != std::errc{} || stop != end) return std::nullopt;
    return offset;
}

CLI::Option* add_offset(CLI::App& app, const std::string& name, std::optional<Offset>& value,
                        const std::string& help) {
    return add_parsed(app, name, value, help, parse_offset,
                      "X,Y in whole pixels from -2147483648 to 2147483647, such as 512,-256")
        ->type_name("X,Y");
}

CLI::Option* add_int(CLI::App& app, const std::string& name, int& value, int lowest, int highest,
                     const std::string& help) {
    return add_int_to(app, name, value, lowest, highest, help);
}

CLI::Option* add_int(CLI::App& app, const std::string& name, std::optional<int>& value, int lowest,
                     int highest, const std::string& help) {
    return add_int_to(app, name, value, lowest, highest, help);
}

CLI::Option* add_uint64(CLI::App& app, const std::string& name, std::uint64_t& value,
                        const std::string& help) {
    const auto parse = [](const std::string& text) {
        return parse_number(text, 0, std::numeric_limits<std::uint64_t>::max());
    };
    return add_parsed(app, name, value, help, parse, "a whole number from 0 to 18446744073709551615")
        ->type_name("N");
}

CLI::Option* add_shard(CLI::App& app, std::function<void(Shard)> take, const std::string& help) {
    const auto read = [take = std::move(take)](const std::string& text) {
        const std::size_t slash = text.find('/');
        constexpr std::uint64_t most = 1'000'000;
        const auto count =
            slash == std::string::npos ? std::nullopt : parse_number(text.substr(slash + 1), 1, most);
        const auto index = count ? parse_number(text.substr(0, slash), 1, *count) : std::nullopt;
        if (!index)
            throw CLI::ValidationError("--shard",
                                       "'" + text + "' is not I/N with I from 1 to N, such as 2/8");
        take({static_cast<int>(*index), static_cast<int>(*count)});
    };
    return app.add_option_function<std::string>("--shard", read, help)->type_name("I/N");
}

CLI::Option* add_size(CLI::App& app, const std::string& name, std::optional<Size>& value,
                      const std::string& help) {
    return add_parsed(app, name, value, help, parse_size,
                      "WIDTHxHEIGHT, such as 512x256, or one side of a square, with sides from 1 to " +
                          std::to_string(largest_side))
        ->type_name("WxH");
}

CLI::Option* add_crop(CLI::App& app, const std::string& name, std::optional<Crop>& value,
                      const std::string& help) {
    return add_parsed(app, name, value, help, parse_crop,
                      "X,Y,WIDTH,HEIGHT in whole pixels, such as 0,0,256,256")
        ->type_name("X,Y,W,H");
}

CLI::Option* add_positive(CLI::App& app, const std::string& name, double& value, const std::string& help) {
    return add_parsed(app, name, value, help, parse_positive, "a number above 0, from 1e-30 to 1e30")
        ->type_name("X");
}

CLI::Option* add_positive(CLI::App& app, const std::string& name, std::optional<double>& value,
                          const std::string& help) {
    return add_parsed(app, name, value, help, parse_positive, "a number above 0, from 1e-30 to 1e30")
        ->type_name("X");
}

CLI::Option* add_white(CLI::App& app, std::optional<double>& white) {
    return add_positive(app, "--white", white,
                        "value that is white in pictures with float values (default: 1); 8-bit and 16-bit "
                        "pictures have their own");
}

bool is_hdr(const Picture& picture) {
    return picture.type == PixelType::half || picture.type == PixelType::float32;
}

double white_level(const Picture& picture, std::optional<double> white) {
    return is_hdr(picture) ? white.value_or(1.0) : 1.0;
}

CLI::Option* add_device(CLI::App& app, std::string& spec) {
    return app
        .add_option("--device", spec,
                    "auto, cpu, gpu, PLATFORM:DEVICE or part of a name (default: $BTFIELD_DEVICE, else auto)")
        ->type_name("SPEC")
        ->group(general);
}

namespace {

bool memory_is_an_option = true;  ///< not the environment's

}  // namespace

std::string with_own_limits(std::string text) {
    constexpr std::string_view remedy = "($BTFIELD_MEMORY)";
    const std::size_t at = text.find(remedy);
    if (memory_is_an_option && at != std::string::npos) text.replace(at, remedy.size(), "(--memory)");
    return text;
}

void add_limits(CLI::App& app) {
    const char* const memory_before = std::getenv("BTFIELD_MEMORY");
    memory_is_an_option = memory_before == nullptr || *memory_before == '\0';
    const auto threads = [](const std::string& text) {
        if (!parse_number(text, 1, largest_side))
            throw CLI::ValidationError("--threads", "'" + text + "' is not a whole number from 1 to " +
                                                        std::to_string(largest_side));
        ::setenv("BTFIELD_THREADS", text.c_str(), 1);
        ::setenv("OPENIMAGEIO_THREADS", text.c_str(), 1);  // of the codecs
    };
    app.add_option_function<std::string>(
           "--threads", threads,
           "cores to take at most, a CPU device's included (default: $BTFIELD_THREADS, "
           "else all)")
        ->type_name("N")
        ->group(general);
    const auto memory = [](const std::string& text) {
        if (!detail::parse_bytes(text))
            throw CLI::ValidationError("--memory",
                                       "'" + text + "' is not a number of bytes, such as 500M or 4G");
        memory_is_an_option = true;
        ::setenv("BTFIELD_MEMORY", text.c_str(), 1);
    };
    app.add_option_function<std::string>(
           "--memory", memory,
           "device memory to plan with at most, such as 500M or 4G: what $BTFIELD_MEMORY says "
           "otherwise (default: that, else 70 % of a CPU device's, 90 % of another's)")
        ->type_name("BYTES")
        ->group(general);
}

CLI::Option* add_overwrite(CLI::App& app, bool& overwrite) {
    return app
        .add_flag("--overwrite", overwrite,
                  "write even where that replaces a file that is read, or the picture of a model")
        ->group(general);
}

void take_dash(CLI::Option* option, const std::string& stream) {
    option->transform([stream](const std::string& text) { return text == "-" ? stream : text; });
}

CLI::Option* add_json(CLI::App& app, bool& json) {
    const auto set = [&json](std::int64_t) {
        json = true;
        be_read_by_programs();
    };
    return app.add_flag_function("--json", set, "print one JSON object instead of plain text")
        ->group(general);
}

}  // namespace btfield::cli

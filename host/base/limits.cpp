#include "host/base/limits.hpp"

#include <sys/resource.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cstddef>
#include <cstdlib>
#include <string>
#include <system_error>

#include "btfield/error.hpp"
#include "host/base/text.hpp"

namespace btfield::detail {

std::string bytes_text(double bytes) {
    if (!(bytes >= 1000.0)) return counted(static_cast<long long>(std::max(bytes, 0.0)), "byte");
    constexpr std::array<const char*, 3> units{" kB", " MB", " GB"};
    std::size_t unit = 0;
    double size = bytes / 1000.0;
    for (; size >= 1000.0 && unit + 1 < units.size(); ++unit) size /= 1000.0;
    const auto tenths = static_cast<long long>(10.0 * size);
    return std::to_string(tenths / 10) + "." + std::to_string(tenths % 10) + units.at(unit);
}

std::optional<std::uint64_t> parse_bytes(std::string_view text) {
    if (!text.empty() && (text.back() == 'B' || text.back() == 'b')) text.remove_suffix(1);
    constexpr std::string_view suffixes = "KkMmGgTt";
    double unit = 1.0;
    if (!text.empty())
        if (const std::size_t at = suffixes.find(text.back()); at != std::string_view::npos) {
            for (std::size_t k = 0; k <= at / 2; ++k) unit *= 1000.0;
            text.remove_suffix(1);
        }
    double number = 0.0;
    const char* const end = text.data() + text.size();
    const auto [stop, error] = std::from_chars(text.data(), end, number, std::chars_format::fixed);
    if (error != std::errc{} || stop != end) return std::nullopt;
    const double bytes = number * unit;
    if (!(bytes >= 1.0) || !(bytes <= 9.2e18)) return std::nullopt;
    return static_cast<std::uint64_t>(bytes);
}

int threads_of_environment() {
    const char* const value = std::getenv("BTFIELD_THREADS");
    const std::string_view text = value ? value : "";
    if (text.empty()) return 0;
    int threads = 0;
    const char* const end = text.data() + text.size();
    const auto [stop, error] = std::from_chars(text.data(), end, threads);
    if (error == std::errc{} && stop == end && threads >= 1) return threads;
    throw InputError("use as many threads as $BTFIELD_THREADS says",
                     "it is '" + std::string(text) + "', no whole number from 1 on", "give one, or unset it");
}

std::uint64_t memory_of_environment() {
    const char* const value = std::getenv("BTFIELD_MEMORY");
    const std::string_view text = value ? value : "";
    if (text.empty()) return 0;
    if (const auto bytes = parse_bytes(text)) return *bytes;
    throw InputError("use as much memory as $BTFIELD_MEMORY says",
                     "it is '" + std::string(text) + "', no number of bytes",
                     "give one, such as 500M or 4G, or unset it");
}

std::string address_space_text() {
    ::rlimit limit{};
    if (::getrlimit(RLIMIT_AS, &limit) != 0 || limit.rlim_cur == RLIM_INFINITY) return {};
    return "the process may have " + bytes_text(static_cast<double>(limit.rlim_cur)) +
           " of addresses (ulimit -v)";
}

}  // namespace btfield::detail

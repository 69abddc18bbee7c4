#include "host/btf/file_stamp.hpp"

#include <chrono>

#include "btfield/version.hpp"

namespace btfield::detail {
namespace {

/// File systems count times in steps of up to two seconds.
constexpr std::chrono::seconds time_step{2};

std::chrono::nanoseconds nanoseconds_of(const timespec& time) {
    return std::chrono::seconds(time.tv_sec) + std::chrono::nanoseconds(time.tv_nsec);
}

}  // namespace

std::string file_stamp(const struct ::stat& status) {
    const std::chrono::nanoseconds written = nanoseconds_of(status.st_mtim),
                                   changed = nanoseconds_of(status.st_ctim);
    const auto now = std::chrono::system_clock::now().time_since_epoch();
    if (now - changed < time_step || now - written < time_step) return {};
    // Another version may read the same bytes as other values.
    return std::string(BTFIELD_VERSION) + " " + std::to_string(status.st_size) + " " +
           std::to_string(written.count()) + " " + std::to_string(changed.count());
}

std::string file_stamp(const std::filesystem::path& file) {
    struct ::stat status {};
    return ::stat(file.c_str(), &status) == 0 ? file_stamp(status) : std::string();
}

}  // namespace btfield::detail

#include "host/cl/pocl_cache.hpp"

#include <sys/statvfs.h>
#include <unistd.h>

#include <cstdlib>
#include <string_view>
#include <system_error>
#include <vector>

#include "btfield/error.hpp"
#include "host/base/file_output.hpp"
#include "host/base/temporary_names.hpp"

namespace btfield::detail {
namespace {

namespace fs = std::filesystem;

/// Empty where it is not set.
std::string_view variable(const char* name) {
    const char* const value = std::getenv(name);
    return value == nullptr ? std::string_view() : std::string_view(value);
}

/// Whether files can be made in it, and are not stopped by a full disk soon: all kernels take some 4 MiB.
bool usable(const fs::path& folder) {
    constexpr double least_bytes = 16.0 * (1 << 20);
    std::error_code error;
    fs::create_directories(folder, error);
    struct statvfs disk {};
    if (::statvfs(folder.c_str(), &disk) != 0) return false;
    if (static_cast<double>(disk.f_bavail) * static_cast<double>(disk.f_frsize) < least_bytes) return false;
    if (disk.f_files != 0 && disk.f_favail < 256) return false;
    try {
        const FileOutput probe(folder / "btfield-probe", "write");
        const std::string page(4096, 'x');
        return ::write(probe.descriptor(), page.data(), page.size()) == static_cast<ssize_t>(page.size());
    } catch (const InputError&) {
        return false;
    }
}

/// A folder that goes with the process.
class PrivateFolder {
  public:
    explicit PrivateFolder(const fs::path& parent) {
        std::string name = (parent / "btfield-pocl-XXXXXX").string();
        const TemporaryStep step;
        if (::mkdtemp(name.data()) == nullptr) return;
        path_ = name;
        step.note(path_);
    }
    PrivateFolder(PrivateFolder&& other) noexcept : path_(std::exchange(other.path_, {})) {}
    PrivateFolder& operator=(PrivateFolder&&) = delete;
    ~PrivateFolder() {
        if (path_.empty()) return;
        const TemporaryStep step;
        std::error_code ignored;
        fs::remove_all(path_, ignored);
        step.forget(path_);
    }
    [[nodiscard]] const fs::path& path() const { return path_; }

  private:
    fs::path path_;
};

std::vector<PrivateFolder> private_cache() {
    std::vector<PrivateFolder> result;
    if (usable(pocl_cache_folder())) return result;
    for (const std::string_view parent :
         {variable("TMPDIR"), std::string_view("/tmp"), std::string_view("/var/tmp"),
          std::string_view("/dev/shm"), variable("XDG_RUNTIME_DIR"), std::string_view(".")}) {
        std::error_code error;
        const fs::path absolute = parent.empty() ? fs::path() : fs::absolute(parent, error);
        if (absolute.empty() || error) continue;
        PrivateFolder folder(absolute);
        if (folder.path().empty() || !usable(folder.path())) continue;
        ::setenv("POCL_CACHE_DIR", folder.path().c_str(), 1);
        result.push_back(std::move(folder));
        break;
    }
    return result;
}

}  // namespace

fs::path pocl_cache_folder() {
    if (const auto named = variable("POCL_CACHE_DIR"); !named.empty()) return named;
    if (const auto caches = variable("XDG_CACHE_HOME"); !caches.empty())
        return fs::path(caches) / "pocl/kcache";
    if (const auto home = variable("HOME"); !home.empty()) return fs::path(home) / ".cache/pocl/kcache";
    return "/tmp/pocl/kcache";
}

void give_pocl_a_cache() {
    // Destroyed after what the driver itself does at the end, which is loaded later.
    static const std::vector<PrivateFolder> cache = private_cache();
    static_cast<void>(cache);
}

std::string pocl_cache_remedy() {
    return "free some space for PoCL's cache or remove it: '" + pocl_cache_folder().string() + "'";
}

}  // namespace btfield::detail

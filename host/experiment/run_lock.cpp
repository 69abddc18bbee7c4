#include "host/experiment/run_lock.hpp"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <system_error>

#include "btfield/error.hpp"

namespace btfield::detail {
namespace {

/// Whether the name still leads to the open file: the last holder removes it.
bool still_named(int descriptor, const std::filesystem::path& path) {
    struct stat open {
    }, named{};
    return ::fstat(descriptor, &open) == 0 && ::stat(path.c_str(), &named) == 0 &&
           open.st_ino == named.st_ino && open.st_dev == named.st_dev;
}

}  // namespace

RunLock::RunLock(const std::filesystem::path& file, const std::string& asked) : path_(file) {
    path_ += "-lock";
    for (;;) {
        descriptor_ = ::open(path_.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0666);
        if (descriptor_ < 0) {
            throw InputError(asked, std::generic_category().message(errno),
                             "choose a place that you may write to");
        }
        if (::flock(descriptor_, LOCK_EX | LOCK_NB) != 0) {
            const int code = errno;
            ::close(descriptor_);
            descriptor_ = -1;
            throw InputError(
                asked,
                code == EWOULDBLOCK ? "another run writes to it" : std::generic_category().message(code),
                "wait for that run to end, or choose another file (and `merge` them later)");
        }
        if (still_named(descriptor_, path_)) return;
        ::close(descriptor_);
    }
}

RunLock::~RunLock() {
    if (descriptor_ < 0) return;
    ::unlink(path_.c_str());  // before the lock goes: who opens it later makes a new one
    ::close(descriptor_);
}

}  // namespace btfield::detail

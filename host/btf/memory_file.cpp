#include "host/btf/memory_file.hpp"

#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

#include "btfield/error.hpp"

namespace btfield::detail {

MemoryFile::MemoryFile(const std::string& asked, std::string_view bytes)
    : file_(::memfd_create("btfield", MFD_CLOEXEC)),
      path_("/proc/self/fd/" + std::to_string(file_.get())),
      asked_(asked) {
    while (file_.get() >= 0 && !bytes.empty()) {
        const ssize_t done = ::write(file_.get(), bytes.data(), bytes.size());
        if (done < 0 && errno == EINTR) continue;
        if (done <= 0) break;
        bytes.remove_prefix(static_cast<std::size_t>(done));
    }
    if (file_.get() < 0 || !bytes.empty())
        throw InputError(asked_, std::string("it cannot be held in memory: ") + std::strerror(errno),
                         "free memory, or unpack the archive");
}

std::string MemoryFile::content() const {
    struct stat status {};
    if (::fstat(file_.get(), &status) != 0) status.st_size = 0;
    std::string bytes(static_cast<std::size_t>(status.st_size), '\0');
    std::size_t at = 0;
    while (at < bytes.size()) {
        const ssize_t got =
            ::pread(file_.get(), bytes.data() + at, bytes.size() - at, static_cast<off_t>(at));
        if (got < 0 && errno == EINTR) continue;
        if (got <= 0) throw InputError(asked_, "it cannot be read back from memory", "try again");
        at += static_cast<std::size_t>(got);
    }
    return bytes;
}

}  // namespace btfield::detail

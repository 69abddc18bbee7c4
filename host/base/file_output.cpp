#include "host/base/file_output.hpp"

#include <fcntl.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <cerrno>
#include <charconv>
#include <optional>
#include <system_error>

#include "btfield/error.hpp"
#include "host/base/temporary_names.hpp"

namespace btfield::detail {
namespace {

namespace fs = std::filesystem;

std::string quoted(const fs::path& path) {
    return "'" + path.string() + "'";
}

std::string reason(int code) {
    return std::generic_category().message(code);
}

[[noreturn]] void fail(const std::string& asked, int code, const fs::path& where) {
    const std::string found = reason(code) + " (" + quoted(where) + ")";
    switch (code) {
        case ENOENT:
        case ENOTDIR:
            throw InputError(asked, "the folder " + quoted(where) + " does not exist",
                             "make it or choose another");
        case EACCES:
        case EPERM:
        case EROFS:
            throw InputError(asked, found, "choose a place that you may write to");
        case ENOSPC:
        case EDQUOT:
        case EFBIG:
            throw InputError(asked, found, "free some space or choose another disk");
        default:
            throw InputError(asked, found, "choose another place");
    }
}

/// 0 or errno.
int write_all(int descriptor, std::string_view bytes) {
    while (!bytes.empty()) {
        const ssize_t written = ::write(descriptor, bytes.data(), bytes.size());
        if (written < 0 && errno == EINTR) continue;
        if (written < 0) return errno;
        bytes.remove_prefix(static_cast<std::size_t>(written));
    }
    return 0;
}

/// The file that a chain of links names, which need not exist.
fs::path follow_links(fs::path path, const std::string& asked) {
    constexpr int most_links = 40;  // as the kernel's own limit
    std::error_code error;
    for (int i = 0; i <= most_links; ++i) {
        if (!fs::is_symlink(fs::symlink_status(path, error))) return path;
        const fs::path next = fs::read_symlink(path, error);
        if (error) fail(asked, error.value(), path);
        path = next.is_absolute() ? next : path.parent_path() / next;
    }
    throw InputError(asked, "symbolic links go in a circle", "remove the link");
}

fs::path folder_of(const fs::path& path) {
    return path.has_parent_path() ? path.parent_path() : fs::path(".");
}

/// Not derived from the target's name, which may already be as long as a name can be.
fs::path hidden_name(const fs::path& folder) {
    static std::atomic<unsigned> count{0};
    return folder / (".btfield-" + std::to_string(::getpid()) + "-" + std::to_string(count++));
}

/// The open file that a name, or what it links to, stands for: 1 for "/dev/stdout", "/dev/fd/1" and
/// "/proc/self/fd/1".
std::optional<int> descriptor_named(const fs::path& path, int links = 40) {
    const std::string& name = path.native();
    if (name == "/dev/stdout") return STDOUT_FILENO;
    if (name == "/dev/stderr") return STDERR_FILENO;
    for (const std::string_view folder : {"/dev/fd/", "/proc/self/fd/"}) {
        if (!name.starts_with(folder)) continue;
        int number = 0;
        const char* const end = name.data() + name.size();
        const auto [stop, error] = std::from_chars(name.data() + folder.size(), end, number);
        if (error == std::errc{} && stop == end) return number;
    }
    std::error_code error;
    const fs::path next = links > 0 ? fs::read_symlink(path, error) : fs::path();
    if (error || next.empty()) return std::nullopt;
    return descriptor_named(next.is_absolute() ? next : path.parent_path() / next, links - 1);
}

/// A name of the open file that no other process or thread can make again once it is removed.
fs::path name_of(int descriptor) {
    return "/proc/self/fd/" + std::to_string(descriptor);
}

/// A file with a hidden name, noted for the end of the process; below 0 and errno where that fails.
int open_hidden(const fs::path& folder, fs::path& name) {
    for (;;) {
        name = hidden_name(folder);
        const TemporaryStep step;
        step.note(name);
        const int descriptor = ::open(name.c_str(), O_RDWR | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
        if (descriptor >= 0) return descriptor;
        const int code = errno;
        step.forget(name);
        errno = code;
        if (code != EEXIST) return descriptor;  // else it was left by a killed process of the same number
    }
}

}  // namespace

Descriptor::~Descriptor() {
    if (value_ >= 0) ::close(value_);
}

bool Descriptor::close() {
    return ::close(std::exchange(value_, -1)) == 0;
}

FileOutput::FileOutput(const fs::path& target, std::string asked, bool hidden) : asked_(std::move(asked)) {
    if (target.empty()) throw InputError(asked_, "the name is empty", "give a file name");
    if (const auto number = descriptor_named(target)) {
        const int flags = ::fcntl(*number, F_GETFL);
        if (flags < 0 || (flags & O_ACCMODE) == O_RDONLY) fail(asked_, EBADF, target);
        sink_ = Descriptor(::fcntl(*number, F_DUPFD_CLOEXEC, 3));
        special_ = true;
        target_ = target;
        open_in_memory();
        return;
    }
    std::error_code error;
    const fs::file_status status = fs::status(target, error);
    switch (status.type()) {
        case fs::file_type::directory:
            throw InputError(asked_, quoted(target) + " is a folder", "give a file name");
        case fs::file_type::block:
        case fs::file_type::socket:
            throw InputError(asked_, quoted(target) + " is a block device or a socket",
                             "give the name of a regular file");
        case fs::file_type::character:
        case fs::file_type::fifo:
            special_ = true;
            target_ = target;
            break;
        default:
            target_ = follow_links(target, asked_);
            if (!target_.has_filename()) {
                throw InputError(asked_, quoted(target) + " names a folder", "give a file name");
            }
    }
    replaces_ = status.type() == fs::file_type::regular;
    if ((special_ || replaces_) && ::faccessat(AT_FDCWD, target_.c_str(), W_OK, AT_EACCESS) != 0) {
        fail(asked_, errno, target_);
    }
    if (special_) {
        open_in_memory();
        return;
    }
    open_in(folder_of(target_), hidden);
    if (replaces_) {
        ::fchmod(file_.get(),
                 static_cast<mode_t>(status.permissions() & fs::perms::all));  // as far as allowed
    }
}

void FileOutput::open_in_memory() {
    file_ = Descriptor(::memfd_create("btfield", MFD_CLOEXEC));
    if (file_.get() < 0) fail(asked_, errno, target_);
    temporary_ = name_of(file_.get());
}

void FileOutput::open_in(const fs::path& folder, bool hidden) {
    // A file without a name is gone with the process, however that ends.
    if (!hidden) file_ = Descriptor(::open(folder.c_str(), O_TMPFILE | O_RDWR | O_CLOEXEC, 0666));
    if (file_.get() >= 0) {
        temporary_ = name_of(file_.get());
        if (::access(temporary_.c_str(), R_OK | W_OK) == 0) return;
        file_ = Descriptor();  // no /proc
    }
    file_ = Descriptor(open_hidden(folder, hidden_));
    if (file_.get() < 0) {
        const int code = errno;
        hidden_.clear();
        std::error_code error;
        if (!fs::is_directory(folder, error)) {
            throw InputError(asked_, "the folder " + quoted(folder) + " does not exist",
                             "make it or choose another");
        }
        fail(asked_, code, folder);
    }
    temporary_ = name_of(file_.get());
    if (::access(temporary_.c_str(), R_OK | W_OK) != 0) temporary_ = hidden_;
}

FileOutput::~FileOutput() noexcept {
    if (hidden_.empty()) return;
    const TemporaryStep step;
    ::unlink(hidden_.c_str());
    step.forget(hidden_);
}

void FileOutput::copy_to_target() {
    if (sink_.get() < 0) sink_ = Descriptor(::open(target_.c_str(), O_WRONLY | O_CLOEXEC));
    if (sink_.get() < 0) fail(asked_, errno, target_);
    std::array<char, 1 << 16> buffer;
    for (off_t at = 0;;) {
        const ssize_t got = ::pread(file_.get(), buffer.data(), buffer.size(), at);
        if (got < 0 && errno == EINTR) continue;
        if (got < 0) fail(asked_, errno, target_);
        if (got == 0) break;
        at += got;
        const int code = write_all(sink_.get(), {buffer.data(), static_cast<std::size_t>(got)});
        if (code != 0) fail(asked_, code, target_);
    }
    if (!sink_.close()) fail(asked_, errno, target_);
}

void FileOutput::begin_flush() const noexcept {
    static_cast<void>(::sync_file_range(file_.get(), 0, 0, SYNC_FILE_RANGE_WRITE));
}

void FileOutput::flush() const {
    if (::fsync(file_.get()) != 0 && errno != EINVAL && errno != ENOSYS) fail(asked_, errno, target_);
}

void FileOutput::commit(bool flushed) {
    if (special_) {
        copy_to_target();
        return;
    }
    // A disk may report that it is full only now; and a crash after the rename must not leave an empty file.
    if (flushed) flush();
    const TemporaryStep step;
    const fs::path unnamed = name_of(file_.get());
    if (hidden_.empty() && !replaces_) {
        if (::linkat(AT_FDCWD, unnamed.c_str(), AT_FDCWD, target_.c_str(), AT_SYMLINK_FOLLOW) == 0) return;
        if (errno != EEXIST) fail(asked_, errno, target_);  // else it was made meanwhile
    }
    while (hidden_.empty()) {
        fs::path name = hidden_name(folder_of(target_));
        step.note(name);
        if (::linkat(AT_FDCWD, unnamed.c_str(), AT_FDCWD, name.c_str(), AT_SYMLINK_FOLLOW) == 0) {
            hidden_ = std::move(name);
            break;
        }
        const int code = errno;
        step.forget(name);
        if (code != EEXIST) fail(asked_, code, target_);
    }
    if (::rename(hidden_.c_str(), target_.c_str()) != 0) fail(asked_, errno, target_);
    step.forget(hidden_);
    hidden_.clear();
}

void write_file(const fs::path& target, std::string_view bytes, const std::string& asked, bool flushed) {
    FileOutput output(target, asked);
    const int code = write_all(output.descriptor(), bytes);
    if (code != 0) fail(asked, code, target);
    output.commit(flushed);
}

void check_output(const fs::path& target, const std::string& asked) {
    const FileOutput output(target, asked);
}

}  // namespace btfield::detail

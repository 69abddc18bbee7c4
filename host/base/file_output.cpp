#include "host/base/file_output.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <cerrno>
#include <system_error>
#include <utility>

#include "btfield/error.hpp"

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

/// Closes on every way out; close() reports what a destructor could not.
class Descriptor {
  public:
    explicit Descriptor(int value) : value_(value) {}
    ~Descriptor() {
        if (value_ >= 0) ::close(value_);
    }
    Descriptor(const Descriptor&) = delete;
    Descriptor& operator=(const Descriptor&) = delete;
    [[nodiscard]] int get() const { return value_; }
    [[nodiscard]] bool close() { return ::close(std::exchange(value_, -1)) == 0; }

  private:
    int value_;
};

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
fs::path temporary_name(const fs::path& target) {
    static std::atomic<unsigned> count{0};
    fs::path extension = target.extension();
    if (extension.native().size() > 16) extension.clear();
    return ".btfield-" + std::to_string(::getpid()) + "-" + std::to_string(count++) + extension.string();
}

}  // namespace

FileOutput::FileOutput(const fs::path& target, std::string asked) : asked_(std::move(asked)) {
    if (target.empty()) throw InputError(asked_, "the name is empty", "give a file name");
    std::error_code error;
    // The status that follows links: /dev/stdout leads through /proc to a pipe that has no name of its own.
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
    const bool replaces = special_ || status.type() == fs::file_type::regular;
    if (replaces && ::faccessat(AT_FDCWD, target_.c_str(), W_OK, AT_EACCESS) != 0) {
        fail(asked_, errno, target_);
    }

    const fs::path folder = special_ ? fs::temp_directory_path(error) : folder_of(target_);
    if (special_ && error) fail(asked_, error.value(), "the folder for temporary files");
    for (;;) {
        fs::path name = folder / temporary_name(target_);
        const Descriptor file(::open(name.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666));
        if (file.get() < 0 && errno == EEXIST) continue;  // left by a killed process of the same number
        if (file.get() < 0) {
            const int code = errno;
            if (!fs::is_directory(folder, error)) {
                throw InputError(asked_, "the folder " + quoted(folder) + " does not exist",
                                 "make it or choose another");
            }
            fail(asked_, code, folder);
        }
        temporary_ = std::move(name);
        if (!special_ && replaces) {
            ::fchmod(file.get(),
                     static_cast<mode_t>(status.permissions() & fs::perms::all));  // as far as allowed
        }
        return;
    }
}

FileOutput::~FileOutput() noexcept {
    if (!temporary_.empty()) ::unlink(temporary_.c_str());
}

void FileOutput::commit() {
    Descriptor source(::open(temporary_.c_str(), O_RDONLY | O_CLOEXEC));
    if (source.get() < 0) fail(asked_, errno, temporary_);
    if (special_) {
        Descriptor sink(::open(target_.c_str(), O_WRONLY | O_CLOEXEC));
        if (sink.get() < 0) fail(asked_, errno, target_);
        std::array<char, 1 << 16> buffer;
        for (;;) {
            const ssize_t got = ::read(source.get(), buffer.data(), buffer.size());
            if (got < 0 && errno == EINTR) continue;
            if (got < 0) fail(asked_, errno, temporary_);
            if (got == 0) break;
            const int code = write_all(sink.get(), {buffer.data(), static_cast<std::size_t>(got)});
            if (code != 0) fail(asked_, code, target_);
        }
        if (!sink.close()) fail(asked_, errno, target_);
        return;  // the destructor removes the temporary file
    }
    // A disk may report that it is full only now; and a crash after the rename must not leave an empty file.
    if (::fsync(source.get()) != 0 && errno != EINVAL && errno != ENOSYS) fail(asked_, errno, target_);
    if (::rename(temporary_.c_str(), target_.c_str()) != 0) fail(asked_, errno, target_);
    temporary_.clear();
}

void write_file(const fs::path& target, std::string_view bytes, const std::string& asked) {
    FileOutput output(target, asked);
    Descriptor file(::open(output.temporary().c_str(), O_WRONLY | O_TRUNC | O_CLOEXEC));
    if (file.get() < 0) fail(asked, errno, output.temporary());
    const int code = write_all(file.get(), bytes);
    if (code != 0) fail(asked, code, target);
    if (!file.close()) fail(asked, errno, target);
    output.commit();
}

void check_output(const fs::path& target, const std::string& asked) {
    const FileOutput output(target, asked);
}

}  // namespace btfield::detail

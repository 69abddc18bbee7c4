#include "host/btf/byte_file.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <utility>

#include "btfield/error.hpp"
#include "host/base/half.hpp"
#include "host/btf/file_stamp.hpp"
#include "host/pictures/picture_format.hpp"

namespace btfield::detail {

ByteFile::ByteFile(const std::filesystem::path& path, std::string asked)
    : asked_(std::move(asked)), file_(::open(path.c_str(), O_RDONLY | O_CLOEXEC)) {
    struct stat status {};
    if (file_.get() < 0 || ::fstat(file_.get(), &status) != 0)
        throw InputError(asked_, std::string("it cannot be opened: ") + std::strerror(errno),
                         "check name and permissions");
    if (!S_ISREG(status.st_mode)) throw InputError(asked_, "it is no file", "give a file or a folder");
    size_ = static_cast<std::uint64_t>(status.st_size);
    stamp_ = file_stamp(status);
}

void ByteFile::read(std::uint64_t at, void* to, std::uint64_t bytes) const {
    if (at > size_ || bytes > size_ - at) refuse("the file ends too early");
    auto* place = static_cast<char*>(to);
    while (bytes > 0) {
        const ssize_t got =
            ::pread(file_.get(), place, static_cast<std::size_t>(std::min<std::uint64_t>(bytes, 1U << 30U)),
                    static_cast<off_t>(at));
        if (got < 0 && errno == EINTR) continue;
        if (got < 0) throw InputError(asked_, std::strerror(errno), "check the disk");
        if (got == 0) refuse("the file ends too early");
        place += got;
        at += static_cast<std::uint64_t>(got);
        bytes -= static_cast<std::uint64_t>(got);
    }
}

void ByteFile::refuse(const std::string& found) const {
    throw InputError(asked_, found, use_a_complete_file);
}

void ByteCursor::skip(std::uint64_t bytes, const char* what) {
    if (bytes > left()) file_->refuse(std::string("the file ends within ") + what);
    at_ += bytes;
}

void ByteCursor::skip(std::uint64_t count, std::uint64_t each, const char* what) {
    if (count > left() / each) file_->refuse(std::string("the file ends within ") + what);
    at_ += count * each;
}

std::string ByteCursor::text(std::uint64_t bytes, const char* what) {
    const std::vector<char> all = take<char>(bytes, what);
    // Of fixed length, ended by a zero.
    return {all.begin(), std::find(all.begin(), all.end(), '\0')};
}

Scalar scalar_of_bytes(std::uint64_t bytes, const ByteFile& file) {
    if (bytes != 2 && bytes != 4 && bytes != 8)
        file.refuse("its values have " + std::to_string(bytes) + " bytes, not 2, 4 or 8");
    return static_cast<Scalar>(bytes);
}

void read_scalars(const ByteFile& file, std::uint64_t at, Scalar scalar, float* to, std::uint64_t count) {
    constexpr std::uint64_t block = 1U << 14U;
    const auto width = static_cast<std::uint64_t>(scalar);
    std::vector<char> bytes(static_cast<std::size_t>(std::min(count, block) * width));
    for (std::uint64_t first = 0; first < count; first += block) {
        const std::uint64_t n = std::min(block, count - first);
        file.read(at + first * width, bytes.data(), n * width);
        for (std::uint64_t i = 0; i < n; ++i) {
            const char* from = bytes.data() + i * width;
            float value = 0.0F;
            if (scalar == Scalar::byte) {
                value = static_cast<float>(static_cast<unsigned char>(*from)) / 255.0F;
            } else if (scalar == Scalar::half) {
                std::uint16_t half = 0;
                std::memcpy(&half, from, sizeof half);
                value = float_of_half(half);
            } else if (scalar == Scalar::float32) {
                std::memcpy(&value, from, sizeof value);
            } else {
                double wide = 0.0;
                std::memcpy(&wide, from, sizeof wide);
                value = static_cast<float>(wide);
            }
            if (!std::isfinite(value)) file.refuse("a value is not a finite number");
            to[first + i] = value;
        }
    }
}

void ByteWriter::bytes(const void* from, std::size_t count) {
    const auto* at = static_cast<const char*>(from);
    while (count > 0) {
        const ssize_t done = ::write(descriptor_, at, count);
        if (done < 0 && errno == EINTR) continue;
        if (done <= 0) throw InputError(asked_, std::strerror(errno), "make room on the disk");
        at += done;
        count -= static_cast<std::size_t>(done);
    }
}

}  // namespace btfield::detail

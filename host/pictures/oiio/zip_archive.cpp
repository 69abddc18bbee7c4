#include "host/pictures/oiio/zip_archive.hpp"

#include <unistd.h>
#include <zip.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <exception>
#include <mutex>
#include <utility>

#include "btfield/error.hpp"
#include "host/pictures/picture_format.hpp"

namespace btfield::detail {
namespace {

/// Of one file: it is unpacked in memory, on trust.
constexpr std::uint64_t largest_content = std::uint64_t{1} << 29U;
/// Deflate packs 1032 times at best.
constexpr std::uint64_t tightest = 1100;

struct CloseZip {
    void operator()(zip_t* archive) const { zip_discard(archive); }
};
using ZipHandle = std::unique_ptr<zip_t, CloseZip>;

class OpenArchive : public ZipArchive {
  public:
    OpenArchive(const std::filesystem::path& path, const std::string& asked) {
        int code = 0;
        archive_.reset(zip_open(path.c_str(), ZIP_RDONLY, &code));
        if (archive_ == nullptr) {
            zip_error_t error;
            zip_error_init_with_code(&error, code);
            const std::string text = zip_error_strerror(&error);
            zip_error_fini(&error);
            throw InputError(asked, "it is no zip archive that can be read: " + text, use_a_complete_file);
        }
        const zip_int64_t count = zip_get_num_entries(archive_.get(), 0);
        for (zip_int64_t i = 0; i < count; ++i) list(static_cast<zip_uint64_t>(i), asked);
    }
    [[nodiscard]] const std::vector<ZipEntry>& entries() const override { return entries_; }
    [[nodiscard]] std::string read(const ZipEntry& entry, const std::string& asked) const override {
        const std::lock_guard lock(mutex_);
        const auto refuse = [&] {
            const std::string text = zip_strerror(archive_.get());
            throw InputError(asked, "the archive cannot be unpacked: " + text, use_a_complete_file);
        };
        const std::unique_ptr<zip_file_t, decltype(&zip_fclose)> file(
            zip_fopen_index(archive_.get(), entry.index, 0), &zip_fclose);
        if (file == nullptr) refuse();
        std::string bytes(static_cast<std::size_t>(entry.bytes), '\0');
        std::size_t at = 0;
        while (at < bytes.size()) {
            const zip_int64_t got = zip_fread(file.get(), bytes.data() + at, bytes.size() - at);
            if (got <= 0)
                throw InputError(asked, "the archive cannot be unpacked: it is damaged or ends too early",
                                 use_a_complete_file);
            at += static_cast<std::size_t>(got);
        }
        // The checksum is looked at behind the last byte.
        char more = 0;
        if (zip_fread(file.get(), &more, 1) != 0)
            throw InputError(asked, "the archive cannot be unpacked: its checksum is wrong",
                             use_a_complete_file);
        return bytes;
    }

  private:
    void list(zip_uint64_t index, const std::string& asked) {
        zip_stat_t stat;
        if (zip_stat_index(archive_.get(), index, 0, &stat) != 0 || (stat.valid & ZIP_STAT_NAME) == 0 ||
            (stat.valid & ZIP_STAT_SIZE) == 0 || (stat.valid & ZIP_STAT_COMP_SIZE) == 0)
            return;
        const std::string name = stat.name;
        if (name.empty() || name.back() == '/') return;
        if (stat.size > largest_content)
            throw InputError(asked,
                             "a file of it claims " + std::to_string(stat.size) + " bytes, above " +
                                 std::to_string(largest_content),
                             "unpack the archive and give the folder");
        if (stat.size > tightest * (stat.comp_size + 1))
            throw InputError(asked,
                             "a file of it claims " + std::to_string(stat.size) + " bytes, packed in " +
                                 std::to_string(stat.comp_size),
                             use_a_complete_file);
        entries_.push_back({name, index, stat.size});
    }

    ZipHandle archive_;
    std::vector<ZipEntry> entries_;
    mutable std::mutex mutex_;
};

/// What a callback says of its failure; the real reason is kept elsewhere.
zip_int64_t put_internal_error(void* data) {
    auto* codes = static_cast<int*>(data);
    codes[0] = ZIP_ER_INTERNAL;
    codes[1] = 0;
    return 2 * sizeof(int);
}

/// The file that libzip writes to.
struct ZipTarget {
    int descriptor = -1;
    off_t at = 0, end = 0;
    int code = 0;
};

zip_int64_t write_target(void* state, void* data, zip_uint64_t length, zip_source_cmd_t command) {
    auto& target = *static_cast<ZipTarget*>(state);
    switch (command) {
        case ZIP_SOURCE_SUPPORTS:
            return zip_source_make_command_bitmap(
                ZIP_SOURCE_OPEN, ZIP_SOURCE_READ, ZIP_SOURCE_CLOSE, ZIP_SOURCE_STAT, ZIP_SOURCE_ERROR,
                ZIP_SOURCE_FREE, ZIP_SOURCE_SEEK, ZIP_SOURCE_TELL, ZIP_SOURCE_BEGIN_WRITE, ZIP_SOURCE_WRITE,
                ZIP_SOURCE_SEEK_WRITE, ZIP_SOURCE_TELL_WRITE, ZIP_SOURCE_COMMIT_WRITE,
                ZIP_SOURCE_ROLLBACK_WRITE, ZIP_SOURCE_REMOVE, -1);
        case ZIP_SOURCE_STAT: {
            auto* stat = static_cast<zip_stat_t*>(data);
            zip_stat_init(stat);
            stat->size = 0;
            stat->valid = ZIP_STAT_SIZE;
            return sizeof *stat;
        }
        case ZIP_SOURCE_WRITE: {
            const ssize_t done =
                ::pwrite(target.descriptor, data, static_cast<std::size_t>(length), target.at);
            if (done < 0) {
                target.code = errno;
                return -1;
            }
            target.at += done;
            target.end = std::max(target.end, target.at);
            return done;
        }
        case ZIP_SOURCE_SEEK_WRITE: {
            const zip_int64_t to =
                zip_source_seek_compute_offset(static_cast<zip_uint64_t>(target.at),
                                               static_cast<zip_uint64_t>(target.end), data, length, nullptr);
            if (to < 0) return -1;
            target.at = to;
            return 0;
        }
        case ZIP_SOURCE_TELL_WRITE:
        case ZIP_SOURCE_TELL:
            return target.at;
        case ZIP_SOURCE_ERROR:
            return put_internal_error(data);
        default:
            return 0;
    }
}

/// One file of an archive under construction.
struct ZipContent {
    const std::function<std::string(std::size_t)>* make = nullptr;
    std::exception_ptr* failure = nullptr;
    std::size_t index = 0, at = 0;
    std::string bytes;
};

zip_int64_t read_content(void* state, void* data, zip_uint64_t length, zip_source_cmd_t command) {
    auto& content = *static_cast<ZipContent*>(state);
    switch (command) {
        case ZIP_SOURCE_SUPPORTS:
            return zip_source_make_command_bitmap(ZIP_SOURCE_OPEN, ZIP_SOURCE_READ, ZIP_SOURCE_CLOSE,
                                                  ZIP_SOURCE_STAT, ZIP_SOURCE_ERROR, ZIP_SOURCE_FREE, -1);
        case ZIP_SOURCE_OPEN:
            // libzip is C: exceptions wait until it has come back.
            try {
                content.bytes = (*content.make)(content.index);
                content.at = 0;
            } catch (...) {
                *content.failure = std::current_exception();
                return -1;
            }
            return 0;
        case ZIP_SOURCE_READ: {
            const std::size_t count =
                std::min(static_cast<std::size_t>(length), content.bytes.size() - content.at);
            std::memcpy(data, content.bytes.data() + content.at, count);
            content.at += count;
            return static_cast<zip_int64_t>(count);
        }
        case ZIP_SOURCE_CLOSE:
            content.bytes = {};
            return 0;
        case ZIP_SOURCE_STAT:
            zip_stat_init(static_cast<zip_stat_t*>(data));
            return sizeof(zip_stat_t);
        case ZIP_SOURCE_ERROR:
            return put_internal_error(data);
        default:
            return 0;
    }
}

}  // namespace

std::unique_ptr<ZipArchive> open_zip(const std::filesystem::path& path, const std::string& asked) {
    return std::make_unique<OpenArchive>(path, asked);
}

void write_zip(int descriptor, const std::vector<std::string>& names,
               const std::function<std::string(std::size_t)>& content, const std::string& asked) {
    ZipTarget target{descriptor, 0, 0, 0};
    std::exception_ptr failure;
    std::vector<ZipContent> contents(names.size());
    const auto refuse = [&](const char* text) {
        if (failure) std::rethrow_exception(failure);
        throw InputError(asked, target.code != 0 ? std::strerror(target.code) : text,
                         "make room on the disk");
    };
    zip_error_t error;
    zip_error_init(&error);
    zip_source_t* const to = zip_source_function_create(&write_target, &target, &error);
    ZipHandle archive(to != nullptr ? zip_open_from_source(to, ZIP_TRUNCATE, &error) : nullptr);
    if (archive == nullptr) {
        if (to != nullptr) zip_source_free(to);
        refuse("the archive cannot be begun");
    }
    for (std::size_t i = 0; i < names.size(); ++i) {
        contents[i].make = &content;
        contents[i].failure = &failure;
        contents[i].index = i;
        zip_source_t* const from = zip_source_function(archive.get(), &read_content, &contents[i]);
        const zip_int64_t at =
            from != nullptr ? zip_file_add(archive.get(), names[i].c_str(), from, ZIP_FL_ENC_UTF_8) : -1;
        if (at < 0) {
            if (from != nullptr) zip_source_free(from);
            refuse("a file cannot be added");
        }
        static_cast<void>(
            zip_set_file_compression(archive.get(), static_cast<zip_uint64_t>(at), ZIP_CM_STORE, 0));
        // The same files make the same archive at any time and in any time zone.
        constexpr zip_uint16_t first_of_january_1980 = (1U << 5U) | 1U;
        static_cast<void>(
            zip_file_set_dostime(archive.get(), static_cast<zip_uint64_t>(at), 0, first_of_january_1980, 0));
    }
    if (zip_close(archive.get()) != 0) refuse(zip_strerror(archive.get()));
    static_cast<void>(archive.release());  // closed
}

}  // namespace btfield::detail

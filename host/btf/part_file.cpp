#include "host/btf/part_file.hpp"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <string_view>
#include <utility>

#include "btfield/error.hpp"
#include "btfield/version.hpp"
#include "host/base/checksum.hpp"
#include "host/base/stop.hpp"
#include "host/base/strict_json.hpp"
#include "host/btf/btf_model_json.hpp"
#include "host/model/model_json.hpp"

namespace btfield::detail {

using nlohmann::json;
using nlohmann::ordered_json;

namespace {

/// Before each record: its length and a checksum of that length and the record.
using Head = std::array<std::uint64_t, 2>;
constexpr std::uint64_t unit = 8;  ///< places in the file are multiples of it
/// What is read or written at a time.
constexpr std::size_t block_bytes = std::size_t{1} << 20;
/// Of another part, where it is looked at to tell why it is refused.
constexpr std::size_t longest_header = std::size_t{1} << 20;

std::uint64_t padded(std::uint64_t bytes) {
    return (bytes + unit - 1) / unit * unit;
}

std::uint64_t checksum_of_text(std::string_view text) {
    return checksum(std::as_bytes(std::span(text)));
}

/// What tells a set from others: its description, and its first picture.
ordered_json fingerprint(const BtfSet& set) {
    const BtfDescription& what = set.description();
    ordered_json value;
    value["size"] = size_value(what.size);
    value["planes"] = what.planes;
    value["colour_space"] = name(what.space);
    value["names"] = what.names;
    value["white"] = what.white;
    std::string text = directions_value(what.views).dump() + directions_value(what.lights).dump();
    text += directions_value(what.true_lights).dump();
    text.append(what.present.begin(), what.present.end());
    value["directions"] = checksum_of_text(text);
    value["bytes"] = what.bytes;
    const BtfPair first = set.pictures().front();
    const Image picture = set.picture(first.view, first.light);
    value["picture"] = checksum(std::as_bytes(picture.values()));
    return value;
}

std::string header_of(const BtfSet& set, const ordered_json& options) {
    ordered_json value;
    value["format"] = "btfield-btf-part";
    value["software"] = "btfield " BTFIELD_VERSION;
    value["version"] = 2;
    value["set"] = fingerprint(set);
    value["options"] = options;
    std::string line = value.dump();
    line.resize(padded(line.size() + 1), ' ');
    line.back() = '\n';
    return line;
}

std::string reason() {
    return std::strerror(errno);  // NOLINT(concurrency-mt-unsafe): glibc's is not
}

constexpr const char* use_writable = "use a file that can be read and written";

}  // namespace

PartFile::PartFile(const std::filesystem::path& path, const BtfSet& set, const ordered_json& options)
    : asked_("go on with the part '" + path.string() + "'") {
    if (path.empty()) return;
    open(path);
    read(header_of(set, options));
}

void PartFile::open(const std::filesystem::path& path) {
    file_ = Descriptor(::open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0666));
    if (file_.get() < 0) throw InputError(asked_, reason(), "write the model where files can be made");
    if (::flock(file_.get(), LOCK_EX | LOCK_NB) == 0) return;
    if (errno == EWOULDBLOCK) throw InputError(asked_, "another fit is at it", "wait for that one to end");
    throw InputError(asked_, "it cannot be locked: " + reason(), "write the model where files can be locked");
}

void PartFile::read(const std::string& header) {
    struct stat status {};
    if (::fstat(file_.get(), &status) != 0 || !S_ISREG(status.st_mode))
        throw InputError(asked_, "it is no file", use_writable);
    // Between its opening and its lock.
    if (status.st_nlink == 0) throw InputError(asked_, "another fit has removed it", "run the fit again");
    const auto size = static_cast<std::uint64_t>(status.st_size);
    std::string begin(static_cast<std::size_t>(std::min<std::uint64_t>(size, header.size())), '\0');
    read_at(0, std::as_writable_bytes(std::span(begin)));
    if (!header.starts_with(begin)) check_header(header, size);
    end_ = header.size();
    // A process may have ended before the first line was complete.
    if (size < header.size()) {
        if (!write_at(0, std::as_bytes(std::span(header))))
            throw InputError(asked_, reason(), "make room, and run the fit again");
        return;
    }
    Head head{};
    const std::uint64_t head_bytes = sizeof head;
    while (size - end_ >= head_bytes) {
        read_at(end_, std::as_writable_bytes(std::span(head)));
        const PartRecord record{end_ + head_bytes, head[0]};
        const std::uint64_t left = size - record.at;
        if (record.bytes > left || padded(record.bytes) > left) break;
        if (sum_of(record) == head[1]) records_.push_back(record);
        end_ = record.at + padded(record.bytes);
    }
    if (end_ < size) cut(end_);
}

/// \throws InputError with what is wrong with it
void PartFile::check_header(const std::string& header, std::uint64_t size) const {
    const std::string remedy =
        "give the set and the options that it was begun with, or remove it and begin anew";
    std::string line(static_cast<std::size_t>(std::min<std::uint64_t>(size, longest_header)), '\0');
    read_at(0, std::as_writable_bytes(std::span(line)));
    line.resize(std::min(line.find('\n'), line.size()));
    json found;
    try {
        found = parse_strictly(line, asked_);
    } catch (const InputError&) {
        throw InputError(asked_, "it is no part of a BTF fit", remedy);
    }
    const json wanted = json::parse(header);
    const auto same = [&](const char* what) { return found.contains(what) && found[what] == wanted[what]; };
    throw InputError(asked_,
                     !same("format")                         ? "it is no part of a BTF fit"
                     : !same("software") || !same("version") ? "another version of btfield began it"
                     : !same("set")                          ? "it was begun with another set"
                                                             : "it was begun with other options",
                     remedy);
}

std::uint64_t PartFile::sum_of(const PartRecord& record) const {
    Checksum sum;
    sum.add(std::as_bytes(std::span(&record.bytes, 1)));
    std::vector<std::byte> block(
        static_cast<std::size_t>(std::min<std::uint64_t>(record.bytes, block_bytes)));
    for (std::uint64_t done = 0; done < record.bytes; done += block.size()) {
        stop_if_asked();
        const std::uint64_t left = record.bytes - done;
        const std::span<std::byte> part(
            block.data(), static_cast<std::size_t>(std::min<std::uint64_t>(left, block.size())));
        read_at(record.at + done, part);
        sum.add(part);
    }
    return sum.value();
}

void PartFile::read_at(std::uint64_t at, std::span<std::byte> to) const {
    while (!to.empty()) {
        const ssize_t got = ::pread(file_.get(), to.data(), to.size(), static_cast<off_t>(at));
        if (got < 0 && errno == EINTR) continue;
        if (got < 0) throw InputError(asked_, reason(), use_writable);
        if (got == 0)
            throw InputError(asked_, "something cuts it off meanwhile", "let nothing else write it");
        to = to.subspan(static_cast<std::size_t>(got));
        at += static_cast<std::uint64_t>(got);
    }
}

bool PartFile::write_at(std::uint64_t at, std::span<const std::byte> bytes) const {
    while (!bytes.empty()) {
        const ssize_t put =
            ::pwrite(file_.get(), bytes.data(), std::min(bytes.size(), block_bytes), static_cast<off_t>(at));
        if (put < 0 && errno == EINTR) continue;
        if (put < 0) return false;
        bytes = bytes.subspan(static_cast<std::size_t>(put));
        at += static_cast<std::uint64_t>(put);
    }
    return true;
}

void PartFile::cut(std::uint64_t size) const {
    if (::ftruncate(file_.get(), static_cast<off_t>(size)) != 0)
        throw InputError(asked_, reason(), use_writable);
}

MappedBytes PartFile::mapped(const PartRecord& record) const {
    if (record.bytes == 0) return {};
    const auto page = static_cast<std::uint64_t>(::sysconf(_SC_PAGESIZE));
    const std::uint64_t before = record.at % page;
    const auto size = static_cast<std::size_t>(before + record.bytes);
    void* const pages =
        ::mmap(nullptr, size, PROT_READ, MAP_SHARED, file_.get(), static_cast<off_t>(record.at - before));
    if (pages == MAP_FAILED)
        throw InputError(asked_, "it cannot be mapped: " + reason(), "allow more address space, or fit less");
    const std::shared_ptr<const void> owner(pages, [size](void* of) { ::munmap(of, size); });
    return {{owner, static_cast<const std::byte*>(pages) + before}, static_cast<std::size_t>(record.bytes)};
}

PartRecord PartFile::append(std::initializer_list<std::span<const std::byte>> pieces) {
    PartRecord record;
    for (const auto piece : pieces) record.bytes += piece.size();
    Checksum sum;
    sum.add(std::as_bytes(std::span(&record.bytes, 1)));
    for (const auto piece : pieces) sum.add(piece);
    const Head head{record.bytes, sum.value()};
    const std::array<std::byte, unit> zeros{};

    const std::lock_guard lock(writing_);
    record.at = end_ + sizeof head;
    bool done = write_at(end_, std::as_bytes(std::span(head)));
    std::uint64_t at = record.at;
    for (const auto piece : pieces) {
        done = done && write_at(at, piece);
        at += piece.size();
    }
    done = done && write_at(at, std::span(zeros).first(padded(record.bytes) - record.bytes));
    if (!done) {
        const std::string why = reason();
        cut(end_);
        throw InputError(asked_, why, "make room, and run the fit again: it goes on from here");
    }
    end_ = record.at + padded(record.bytes);
    return record;
}

}  // namespace btfield::detail

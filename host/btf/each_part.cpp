#include "host/btf/each_part.hpp"

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <bit>
#include <cerrno>
#include <cstring>
#include <span>
#include <string_view>
#include <utility>

#include "btfield/error.hpp"
#include "btfield/version.hpp"
#include "host/base/strict_json.hpp"
#include "host/btf/btf_model_json.hpp"
#include "host/btf/texture_code.hpp"
#include "host/model/model_json.hpp"

namespace btfield::detail {

using namespace json_reading;
using nlohmann::ordered_json;

namespace {

constexpr std::size_t head_bytes = 12;  ///< length and checksum of a record
constexpr std::size_t largest_part = std::size_t{4} << 30;

/// FNV-1a.
std::uint64_t checksum(std::string_view bytes) {
    std::uint64_t sum = 0xcbf29ce484222325U;
    for (const char byte : bytes) {
        sum ^= static_cast<unsigned char>(byte);
        sum *= 0x100000001b3U;
    }
    return sum;
}

std::uint64_t checksum(std::span<const float> values) {
    return checksum({reinterpret_cast<const char*>(values.data()), values.size_bytes()});
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
    value["directions"] = checksum(text);
    value["bytes"] = what.bytes;
    const BtfPair first = set.pictures().front();
    value["picture"] = checksum(set.picture(first.view, first.light).values());
    return value;
}

ordered_json fingerprint(const BtfTexturesOptions& options) {
    const FitOptions& field = options.field;
    ordered_json value;
    value["leave_out"] = options.leave_out;
    value["model"] = field.choose_model ? "auto" : std::string(name(field.model));
    value["order"] = field.order;
    value["neighbourhood"] =
        field.neighbourhood ? std::to_string(static_cast<int>(*field.neighbourhood)) : "default";
    ordered_json offsets = ordered_json::array();
    for (const Offset& offset : field.offsets) offsets.push_back({offset.row, offset.column});
    value["offsets"] = offsets;
    value["correlated"] = field.correlated;
    value["active"] = field.active;
    value["levels"] = field.levels;
    value["choose_levels"] = field.choose_levels;
    value["factor"] = field.factor;
    value["estimator"] = name(field.estimator);
    value["noise"] = name(field.noise);
    value["gains"] = name(field.gains);
    value["marginals"] = name(field.marginals);
    value["prior"] = {field.prior.strength, field.prior.beta0};
    value["moving_average"] = {field.moving_average.threshold, static_cast<int>(field.moving_average.rule)};
    return value;
}

std::string header_of(const BtfSet& set, const BtfTexturesOptions& options) {
    ordered_json value;
    value["format"] = "btfield-btf-part";
    value["software"] = "btfield " BTFIELD_VERSION;
    value["set"] = fingerprint(set);
    value["options"] = fingerprint(options);
    return value.dump() + "\n";
}

std::string reason() {
    return std::strerror(errno);  // NOLINT(concurrency-mt-unsafe): glibc's is not
}

std::string content(int file, const std::string& asked) {
    std::string bytes;
    std::string block(std::size_t{1} << 16, '\0');
    for (;;) {
        const ssize_t got = ::read(file, block.data(), block.size());
        if (got < 0 && errno == EINTR) continue;
        if (got < 0) throw InputError(asked, reason(), "use a file that can be read and written");
        if (got == 0) return bytes;
        bytes.append(block, 0, static_cast<std::size_t>(got));
        if (bytes.size() > largest_part)
            throw InputError(asked, "it is larger than a part can be", "remove it and fit again");
    }
}

void write_all(int file, std::string_view bytes, const std::string& asked) {
    while (!bytes.empty()) {
        const ssize_t put = ::write(file, bytes.data(), bytes.size());
        if (put < 0 && errno == EINTR) continue;
        if (put < 0)
            throw InputError(asked, reason(), "make room, and run the fit again: it goes on from here");
        bytes.remove_prefix(static_cast<std::size_t>(put));
    }
}

std::uint64_t number_at(std::string_view bytes, std::size_t count) {
    std::uint64_t number = 0;
    for (std::size_t i = 0; i < count; ++i)
        number |= static_cast<std::uint64_t>(static_cast<unsigned char>(bytes[i])) << (8 * i);
    return number;
}

std::string record_of(std::size_t pair, const PictureTexture& texture) {
    ordered_json value;
    value["pair"] = pair;
    value["mean"] = texture.moments.mean;
    value["deviation"] = texture.moments.deviation;
    value["texture"] = texture_value(texture.texture);
    std::string payload;
    ordered_json::to_cbor(value, payload);
    const std::uint64_t sum = checksum(payload);
    std::string record;
    for (unsigned i = 0; i < 4; ++i) record += static_cast<char>(payload.size() >> (8 * i) & 255U);
    for (unsigned i = 0; i < 8; ++i) record += static_cast<char>(sum >> (8 * i) & 255U);
    return record + payload;
}

void check_header(const std::string& bytes, const std::string& header, const std::string& asked) {
    if (bytes.starts_with(header)) return;
    const std::string remedy =
        "give the set and the options that it was begun with, or remove it and begin anew";
    const std::string_view line = std::string_view(bytes).substr(0, bytes.find('\n'));
    json found;
    try {
        found = parse_strictly(line, asked);
    } catch (const InputError&) {
        throw InputError(asked, "it is no part of a BTF fit", remedy);
    }
    const json wanted = json::parse(header);
    const auto same = [&](const char* what) { return found.contains(what) && found[what] == wanted[what]; };
    throw InputError(asked,
                     !same("format")     ? "it is no part of a BTF fit"
                     : !same("software") ? "another version of btfield began it"
                     : !same("set")      ? "it was begun with another set"
                                         : "it was begun with other options",
                     remedy);
}

}  // namespace

EachPart::EachPart(const std::filesystem::path& path, const BtfSet& set, const BtfTexturesOptions& options)
    : asked_("go on with the part '" + path.string() + "'") {
    if (path.empty()) return;
    file_ = Descriptor(::open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC | O_APPEND, 0666));
    if (file_.get() < 0) throw InputError(asked_, reason(), "write the model where files can be made");
    if (::flock(file_.get(), LOCK_EX | LOCK_NB) != 0)
        throw InputError(asked_, "another fit is at it", "wait for that one to end");
    read(header_of(set, options));
}

void EachPart::read(const std::string& header) {
    const std::string bytes = content(file_.get(), asked_);
    // A process may have ended before the first line was complete.
    if (header.starts_with(bytes)) {
        if (::ftruncate(file_.get(), 0) != 0)
            throw InputError(asked_, reason(), "use a file that can be written");
        write_all(file_.get(), header, asked_);
        return;
    }
    check_header(bytes, header, asked_);
    std::string_view rest = std::string_view(bytes).substr(header.size());
    while (rest.size() >= head_bytes) {
        const std::uint64_t length = number_at(rest, 4);
        if (rest.size() - head_bytes < length) break;
        const std::string_view payload = rest.substr(head_bytes, length);
        if (checksum(payload) != number_at(rest.substr(4), 8)) break;
        const json value = parse_strictly(payload, asked_);
        const Context context{asked_};
        Object object(value, "record", context);
        PictureTexture texture;
        const std::uint64_t pair = object.get("pair", natural);
        texture.moments.mean = object.get_list("mean", real);
        texture.moments.deviation = object.get_list("deviation", real);
        texture.texture = texture_from(object.member("texture"), "texture", context);
        done_.emplace(pair, std::move(texture));
        rest.remove_prefix(head_bytes + length);
    }
    if (!rest.empty() && ::ftruncate(file_.get(), static_cast<off_t>(bytes.size() - rest.size())) != 0)
        throw InputError(asked_, reason(), "use a file that can be written");
}

void EachPart::add(std::size_t pair, const PictureTexture& texture) {
    if (file_.get() < 0) return;
    const std::string record = record_of(pair, texture);
    const std::lock_guard lock(writing_);
    write_all(file_.get(), record, asked_);
}

}  // namespace btfield::detail

#include "host/cli/run_files.hpp"

#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <fstream>
#include <set>
#include <string_view>
#include <system_error>
#include <utility>

#include "btfield/error.hpp"
#include "btfield/model_file.hpp"
#include "host/base/text.hpp"
#include "host/cli/command.hpp"
#include "host/cli/output_names.hpp"
#include "host/cli/report.hpp"

namespace btfield::cli {
namespace {

namespace fs = std::filesystem;

/// A file on disk under two names, or a pipe or terminal: not /dev/null, which takes anything.
bool same_file(const fs::path& a, const fs::path& b) {
    std::error_code error;
    return fs::is_regular_file(a, error) && fs::equivalent(a, b, error);
}

/// Where a name leads, links followed as far as files exist.
fs::path place_of(const fs::path& file) {
    std::error_code error;
    fs::path place = fs::weakly_canonical(file, error);
    if (error || place.empty()) return fs::absolute(file, error).lexically_normal();
    return place.is_absolute() ? place : fs::absolute(place, error);
}

bool is_picture_name(const fs::path& path) {
    static const std::set<std::string> extensions{
        ".png", ".jpg", ".jpeg", ".jpe",  ".tif",  ".tiff", ".exr", ".hdr", ".rgbe", ".pic", ".pgm", ".pbm",
        ".ppm", ".pnm", ".bmp",  ".webp", ".heic", ".heif", ".gif", ".psd", ".jp2",  ".tga", ".dds"};
    return extensions.contains(lower_extension(path));
}

/// By its first bytes; formats that btfield does not read are pictures too.
bool holds_picture(const fs::path& path) {
    using namespace std::string_view_literals;
    std::error_code error;
    if (!fs::is_regular_file(path, error)) return false;
    std::ifstream file(path, std::ios::binary);
    std::array<char, 16> bytes{};
    file.read(bytes.data(), bytes.size());
    const std::string_view head(bytes.data(), static_cast<std::size_t>(file.gcount()));
    for (const auto magic :
         {"\x89PNG"sv, "\xff\xd8\xff"sv, "II*\0"sv, "MM\0*"sv, "II+\0"sv, "MM\0+"sv, "\x76\x2f\x31\x01"sv,
          "#?RADIANCE"sv, "#?RGBE"sv, "GIF8"sv, "8BPS"sv, "DDS "sv, "\0\0\0\x0cjP  "sv, "\xff\x0a"sv})
        if (head.starts_with(magic)) return true;
    const std::string_view kind = head.size() >= 12 ? head.substr(4, 4) : ""sv;
    if (kind == "ftyp"sv || (head.starts_with("RIFF"sv) && head.substr(8, 4) == "WEBP"sv)) return true;
    const auto is_space = [](char c) { return c == ' ' || (c >= '\t' && c <= '\r'); };
    return head.size() > 2 && head[0] == 'P' &&
           std::string_view("123456Ff").find(head[1]) != std::string_view::npos &&
           (is_space(head[2]) || head[2] == '#');
}

/// JSON models of this program: CBOR's name no text has.
bool holds_model(const fs::path& file) {
    std::error_code none;
    if (!fs::is_regular_file(file, none)) return false;
    std::array<char, 256> bytes{};
    std::ifstream stream(file, std::ios::binary);
    stream.read(bytes.data(), bytes.size());
    const std::string_view head(bytes.data(), static_cast<std::size_t>(stream.gcount()));
    return head.starts_with('{') && head.find("\"format\": \"btfield") != std::string_view::npos;
}

}  // namespace

bool is_standard_output(const fs::path& file) {
    for (const std::string_view name : {"/dev/stdout", "/dev/fd/1", "/proc/self/fd/1"})
        if (file == name) return true;
    struct stat named {
    }, out{};
    if (::stat(file.c_str(), &named) != 0 || ::fstat(STDOUT_FILENO, &out) != 0) return false;
    const bool same = named.st_dev == out.st_dev && named.st_ino == out.st_ino;
    return same && (!S_ISCHR(out.st_mode) || ::isatty(STDOUT_FILENO) == 1);
}

void RunFiles::reads(const fs::path& file, std::string told) {
    read_.push_back({file, std::move(told)});
}

void RunFiles::reads_model(const fs::path& file, const Provenance& provenance) {
    reads(file);
    if (!provenance.source.empty() && provenance.maps.empty())
        sources_.push_back({file, provenance.source, provenance.file_bytes});
    for (const MaterialMap& map : provenance.maps) sources_.push_back({file, map.name, map.file_bytes});
}

void RunFiles::check_replaced(const fs::path& file) const {
    std::error_code none;
    if (!fs::is_regular_file(file, none)) return;
    const std::string asked = "write '" + file.string() + "'";
    for (const Input& input : read_)
        if (same_file(input.file, file))
            throw InputError(asked, input.told, "name another output, or give --overwrite");
    for (const Source& source : sources_) {
        const fs::path beside = source.model.parent_path() / source.name;
        const fs::path near = file.parent_path() / source.name;
        std::error_code error;
        const bool same_name = detail::valid_utf8(file.filename().string()) == source.name;
        const bool same_size = source.bytes == 0 || fs::file_size(file, error) == source.bytes;
        if (same_file(beside, file) || (same_size && (same_name || same_file(near, file))))
            throw InputError(asked,
                             "that is '" + source.name + "', to which '" + source.model.string() +
                                 "' was fitted by its name",
                             "name another output, or give --overwrite");
    }
}

void RunFiles::writes(const fs::path& file) {
    struct stat there {};
    bool first = is_standard_output(file) ? true : places_.insert(place_of(file)).second;
    if (::stat(file.c_str(), &there) == 0 && S_ISREG(there.st_mode))
        first = files_.emplace(there.st_dev, there.st_ino).second && first;
    if (!first) throw UsageError("'" + file.string() + "' would be written twice");
    if (is_standard_output(file)) {
        if (json_)
            throw UsageError("--json: standard output has no place for both the object and '" +
                             file.string() + "'");
        report_to_standard_error();
    }
    if (!overwrite_) check_replaced(file);
}

void RunFiles::writes_text(const fs::path& file) {
    if (!overwrite_ && holds_model(file))
        throw InputError("write '" + file.string() + "'", "a model is there",
                         "name another output, or give --overwrite");
    if (!overwrite_ && holds_picture(file))
        throw InputError("write '" + file.string() + "'", "a picture is there",
                         "name another output, or give --overwrite");
    writes(file);
}

void RunFiles::writes_model(const fs::path& file) {
    const std::string asked = "write the model '" + file.string() + "'";
    for (const Input& input : read_)
        if (same_file(input.file, file) && holds_picture(file))
            throw InputError(asked, input.told, "give the model a name of its own");
    if (is_picture_name(file))
        throw InputError(asked, "that is the name of a picture", "end the name in .json or .btfm");
    if (holds_picture(file))
        throw InputError(asked, "a picture is there, which a model never replaces",
                         "give the model a name of its own");
    writes(file);
    check_model_writable(file);
}

}  // namespace btfield::cli

#include "btfield/light_set.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <charconv>
#include <cmath>
#include <fstream>
#include <iterator>
#include <map>
#include <numbers>
#include <optional>
#include <set>
#include <string_view>
#include <system_error>
#include <utility>

#include "btfield/error.hpp"
#include "host/base/eigen.hpp"
#include "host/base/strict_json.hpp"
#include "host/base/text.hpp"
#include "host/relief/light_directions.hpp"

namespace btfield {

using namespace detail;

namespace {

namespace fs = std::filesystem;
using Direction = std::array<double, 3>;

/// One line of a table: its number, what stands before its last numbers, and these.
struct TableLine {
    int number = 0;
    std::string name;
    std::vector<double> values;
};

std::string asked_of(const fs::path& file) {
    return "read the lights '" + file.string() + "'";
}

[[noreturn]] void refuse_line(const fs::path& file, int line, const std::string& found,
                              const std::string& remedy) {
    throw InputError(asked_of(file), "line " + std::to_string(line) + ": " + found, remedy);
}

std::string lower(std::string text) {
    for (char& c : text) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    return text;
}

std::string_view trimmed(std::string_view text) {
    constexpr std::string_view blank = " \t\r\f\v";
    const std::size_t first = text.find_first_not_of(blank);
    if (first == std::string_view::npos) return {};
    return text.substr(first, text.find_last_not_of(blank) - first + 1);
}

std::optional<double> number_of(std::string_view text) {
    if (text.starts_with('+')) text.remove_prefix(1);
    double value = 0.0;
    const auto [stop, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (text.empty() || error != std::errc{} || stop != text.data() + text.size()) return std::nullopt;
    return value;
}

std::vector<std::string> lines_of(const fs::path& file) {
    constexpr std::size_t most = 16U << 20U;
    std::ifstream stream(file, std::ios::binary);
    if (!stream) throw InputError(asked_of(file), "it cannot be opened", "check name and permissions");
    std::string text(most + 1, '\0');
    stream.read(text.data(), static_cast<std::streamsize>(text.size()));
    text.resize(static_cast<std::size_t>(stream.gcount()));
    if (text.size() > most || text.find('\0') != std::string::npos)
        throw InputError(asked_of(file), "it is no text of lights",
                         "give a .lp file or a folder of pictures");
    if (text.starts_with("\xef\xbb\xbf")) text.erase(0, 3);
    std::vector<std::string> lines(1);
    for (const char c : text) {
        if (c == '\n')
            lines.emplace_back();
        else
            lines.back() += c;
    }
    return lines;
}

/// The last word of a text and what is before it; commas and semicolons part words too.
std::pair<std::string_view, std::string_view> last_word(std::string_view text) {
    constexpr std::string_view between = " \t\r,;";
    const std::size_t end = text.find_last_not_of(between);
    if (end == std::string_view::npos) return {};
    text = text.substr(0, end + 1);
    const std::size_t before = text.find_last_of(between);
    const std::size_t begin = before == std::string_view::npos ? 0 : before + 1;
    return {text.substr(begin), text.substr(0, begin)};
}

/// Lines that are not blank and no comment, the last `count` words of each being numbers; all words where
/// count is 0.
std::vector<TableLine> table_of(const fs::path& file, std::size_t first_line, std::size_t count) {
    const std::vector<std::string> lines = lines_of(file);
    std::vector<TableLine> table;
    for (std::size_t i = first_line; i < lines.size(); ++i) {
        std::string_view rest = trimmed(lines[i]);
        if (rest.empty() || rest.front() == '#') continue;
        TableLine line{static_cast<int>(i) + 1, {}, {}};
        while (count == 0 ? !rest.empty() : line.values.size() < count) {
            const auto [word, before] = last_word(rest);
            const std::optional<double> value = number_of(word);
            if (!value || !std::isfinite(*value))
                refuse_line(file, line.number,
                            word.empty() ? "there are no " + std::to_string(count) + " numbers"
                                         : "'" + printable(word) + "' is no number",
                            "write a name and x, y, z on each line");
            line.values.insert(line.values.begin(), *value);
            rest = trimmed(before);
        }
        while (!rest.empty() && (rest.back() == ',' || rest.back() == ';'))
            rest = trimmed(rest.substr(0, rest.size() - 1));
        if (rest.size() > 1 && rest.front() == '"' && rest.back() == '"')
            rest = rest.substr(1, rest.size() - 2);
        line.name = rest;
        table.push_back(std::move(line));
    }
    return table;
}

/// Files of a folder by their names in small letters.
using Listing = std::map<std::string, fs::path>;

Listing list(const fs::path& folder) {
    Listing files;
    std::error_code error;
    for (fs::directory_iterator at(folder, error), end; !error && at != end; at.increment(error))
        if (at->is_regular_file(error)) files.emplace(lower(at->path().filename().string()), at->path());
    return files;
}

/// A picture that a table names: by its path from the folder, else by its last part.
fs::path find_picture(const fs::path& table, int line, std::string name, const fs::path& folder,
                      const Listing& files) {
    std::replace(name.begin(), name.end(), '\\', '/');
    std::error_code error;
    fs::path whole = folder / name;
    if (!name.empty() && fs::is_regular_file(whole, error)) return whole;
    const auto found = files.find(lower(fs::path(name).filename().string()));
    if (name.empty() || found == files.end())
        refuse_line(table, line, "there is no picture '" + printable(name) + "'", "put it beside the table");
    return found->second;
}

/// A light of a line, or nothing where it is left out.
std::optional<Direction> direction_of(const fs::path& table, const TableLine& line, const std::string& name,
                                      const LightSetOptions& options, LightSet& set) {
    Direction d{line.values[0], line.values[1], line.values[2]};
    const double length = std::hypot(d[0], d[1], d[2]);
    if (!(length > 0.0) || !std::isfinite(length))
        refuse_line(table, line.number, "the direction has no length", "write x, y, z to the light");
    if (!(d[2] > 0.0)) {
        if (!options.leave_out_behind)
            refuse_line(table, line.number,
                        "the light of '" + printable(name) + "' is behind the surface, its z is " +
                            std::to_string(d[2]),
                        "write z to the viewer above 0, or leave such lights out (--leave-out-behind)");
        set.remarks.push_back("the light of '" + printable(name) + "' is behind the surface and left out");
        return std::nullopt;
    }
    for (double& x : d) x /= length;
    return d;
}

bool is_picture(const fs::path& file) {
    static const std::set<std::string> extensions{".png", ".jpg", ".jpeg", ".tif", ".tiff", ".exr",
                                                  ".hdr", ".pgm", ".ppm",  ".pnm", ".webp"};
    return extensions.contains(lower(file.extension().string()));
}

/// Whether a comes before b, numbers in them by value: image9 before image10.
bool natural_less(const std::string& a, const std::string& b) {
    const auto digit = [](char c) { return c >= '0' && c <= '9'; };
    std::size_t i = 0, j = 0;
    while (i < a.size() && j < b.size()) {
        if (digit(a[i]) && digit(b[j])) {
            const auto run = [&](const std::string& text, std::size_t& at) {
                while (at + 1 < text.size() && text[at] == '0' && digit(text[at + 1])) ++at;
                const std::size_t begin = at;
                while (at < text.size() && digit(text[at])) ++at;
                return text.substr(begin, at - begin);
            };
            const std::string one = run(a, i), other = run(b, j);
            if (one.size() != other.size()) return one.size() < other.size();
            if (one != other) return one < other;
        } else {
            if (a[i] != b[j]) return a[i] < b[j];
            ++i, ++j;
        }
    }
    return a.size() - i < b.size() - j;
}

/// Numbers of light_intensities.txt, one line to a light.
void add_intensities(const fs::path& file, LightSet& set, std::size_t lines,
                     const std::vector<std::size_t>& kept) {
    const std::vector<TableLine> table = table_of(file, 0, 0);
    if (table.size() != lines)
        throw InputError(
            asked_of(file),
            "there are " + std::to_string(table.size()) + " lines for " + std::to_string(lines) + " lights",
            "write a line for each light");
    for (std::size_t i = 0; i < kept.size(); ++i) {
        const TableLine& line = table[kept[i]];
        for (const double value : line.values)
            if (!(value > 0.0))
                refuse_line(file, line.number, "an intensity is not above 0", "write what it is");
        set.lights[i].intensity = line.values;
    }
}

void add_mask(const fs::path& folder, LightSet& set) {
    std::error_code error;
    if (fs::is_regular_file(folder / "mask.png", error)) set.mask = folder / "mask.png";
}

/// The lights of a table's lines; returns which were taken.
std::vector<std::size_t> add_lights(const fs::path& table, const std::vector<TableLine>& lines,
                                    const std::vector<fs::path>& pictures, const LightSetOptions& options,
                                    LightSet& set) {
    std::vector<std::size_t> kept;
    std::map<std::string, int> lines_of_picture;
    for (std::size_t i = 0; i < lines.size(); ++i) {
        const auto [before, fresh] = lines_of_picture.emplace(pictures[i].string(), lines[i].number);
        if (!fresh)
            refuse_line(table, lines[i].number,
                        "'" + pictures[i].filename().string() + "' stands on line " +
                            std::to_string(before->second) + " too",
                        "name each picture once");
        const auto direction = direction_of(table, lines[i], pictures[i].filename().string(), options, set);
        if (!direction) continue;
        set.lights.push_back({pictures[i], *direction, {}});
        kept.push_back(i);
    }
    return kept;
}

/// Whether the folder is one of DiLiGenT.
bool is_diligent(const fs::path& folder) {
    std::error_code error;
    return fs::is_regular_file(folder / "light_directions.txt", error) &&
           fs::is_regular_file(folder / "filenames.txt", error);
}

void add_extras(const fs::path& folder, LightSet& set, std::size_t lines,
                const std::vector<std::size_t>& kept) {
    std::error_code error;
    if (fs::is_regular_file(folder / "light_intensities.txt", error))
        add_intensities(folder / "light_intensities.txt", set, lines, kept);
    add_mask(folder, set);
}

LightSet read_lp(const fs::path& file, const LightSetOptions& options) {
    const std::vector<std::string> all = lines_of(file);
    std::size_t first = 0;
    while (first < all.size() && trimmed(all[first]).empty()) ++first;
    std::size_t count = 0;
    const std::string_view head = first < all.size() ? trimmed(all[first]) : std::string_view();
    const auto [stop, error] = std::from_chars(head.data(), head.data() + head.size(), count);
    if (head.empty() || error != std::errc{} || stop != head.data() + head.size())
        refuse_line(file, static_cast<int>(std::min(first, all.size() - 1)) + 1,
                    "'" + printable(head) + "' is no number of lights",
                    "begin a .lp file with how many follow");
    const std::vector<TableLine> lines = table_of(file, first + 1, 3);
    if (lines.size() != count)
        throw InputError(
            asked_of(file),
            "it says " + std::to_string(count) + " lights and has " + std::to_string(lines.size()),
            "correct its first line, or add what is missing");
    const fs::path folder = file.parent_path();
    const Listing files = list(folder.empty() ? "." : folder);
    std::vector<fs::path> pictures;
    pictures.reserve(lines.size());
    for (const TableLine& line : lines)
        pictures.push_back(find_picture(file, line.number, line.name, folder, files));
    LightSet set;
    set.layout = "lp";
    const std::vector<std::size_t> kept = add_lights(file, lines, pictures, options, set);
    if (is_diligent(folder)) add_extras(folder, set, lines.size(), kept);
    return set;
}

LightSet read_diligent(const fs::path& folder, const LightSetOptions& options) {
    const fs::path table = folder / "light_directions.txt";
    const std::vector<TableLine> lines = table_of(table, 0, 3);
    const Listing files = list(folder);
    std::vector<fs::path> pictures;
    const std::vector<std::string> names = lines_of(folder / "filenames.txt");
    for (std::size_t i = 0; i < names.size(); ++i) {
        const std::string name(trimmed(names[i]));
        if (!name.empty())
            pictures.push_back(
                find_picture(folder / "filenames.txt", static_cast<int>(i) + 1, name, folder, files));
    }
    if (pictures.size() != lines.size())
        throw InputError(asked_of(folder),
                         "filenames.txt has " + std::to_string(pictures.size()) +
                             " names and light_directions.txt " + counted(lines.size(), "line"),
                         "write a line for each picture");
    LightSet set;
    set.layout = "diligent";
    add_extras(folder, set, lines.size(), add_lights(table, lines, pictures, options, set));
    return set;
}

LightSet read_table(const fs::path& table, const LightSetOptions& options) {
    const fs::path folder = table.parent_path();
    const Listing files = list(folder);
    const std::vector<std::string> text = lines_of(table);
    const std::string_view head = trimmed(text.front());
    // How many lights follow may stand on a line of its own.
    const bool counted_first = number_of(head).has_value();
    const std::vector<TableLine> lines = table_of(table, counted_first ? 1 : 0, 3);
    if (counted_first && *number_of(head) != static_cast<double>(lines.size()))
        throw InputError(asked_of(table),
                         "it says " + std::string(head) + " lights and has " + std::to_string(lines.size()),
                         "correct its first line, or add what is missing");
    std::vector<fs::path> pictures;
    if (std::ranges::any_of(lines, [](const TableLine& line) { return !line.name.empty(); })) {
        for (const TableLine& line : lines)
            pictures.push_back(find_picture(table, line.number, line.name, folder, files));
    } else {
        for (const auto& [name, file] : files)
            if (is_picture(file) && name != "mask.png") pictures.push_back(file);
        std::ranges::sort(pictures, [](const fs::path& a, const fs::path& b) {
            return natural_less(a.filename().string(), b.filename().string());
        });
        if (pictures.size() != lines.size())
            throw InputError(asked_of(table),
                             "it has " + counted(lines.size(), "line") + " for " +
                                 counted(pictures.size(), "picture") + " in its folder",
                             "write the names of pictures before the numbers");
    }
    LightSet set;
    set.layout = "table";
    add_extras(folder, set, lines.size(), add_lights(table, lines, pictures, options, set));
    return set;
}

/// Degrees behind two letters, as in "tl045".
std::optional<double> angle_of(const std::string& name, const char* letters) {
    const std::size_t at = name.find(letters);
    if (at == std::string::npos) return std::nullopt;
    double value = 0.0;
    const char* const begin = name.data() + at + 2;
    const auto [stop, error] =
        std::from_chars(begin, name.data() + name.size(), value, std::chars_format::fixed);
    if (error != std::errc{} || stop == begin) return std::nullopt;
    return value;
}

/// The view from above of a BTF in folders.
LightSet read_btf(const fs::path& folder, const LightSetOptions& options) {
    std::map<std::string, fs::path> found;
    std::error_code error;
    for (fs::recursive_directory_iterator at(folder, error), end; !error && at != end; at.increment(error)) {
        if (at.depth() > 2) at.disable_recursion_pending();
        if (at->is_regular_file(error) && is_picture(at->path()))
            found.emplace(at->path().string(), at->path());
    }
    LightSet set;
    set.layout = "btf";
    std::map<std::pair<double, double>, fs::path> directions;
    for (const auto& [text, file] : found) {
        const std::string name = lower(file.stem().string());
        const auto light = angle_of(name, "tl"), turn = angle_of(name, "pl"), view = angle_of(name, "tv");
        if (!light || !turn || !view || *view != 0.0) continue;
        const double theta = *light * std::numbers::pi / 180.0, phi = *turn * std::numbers::pi / 180.0;
        if (const auto [before, fresh] = directions.emplace(std::pair(*light, *turn), file); !fresh)
            throw InputError(asked_of(folder),
                             "'" + before->second.string() + "' and '" + text + "' have the same directions",
                             "keep one of them");
        if (!(std::cos(theta) > 1e-9) || *light >= 90.0) {
            if (!options.leave_out_behind)
                throw InputError(asked_of(folder), "the light of '" + text + "' is not above the surface",
                                 "leave such lights out (--leave-out-behind)");
            set.remarks.push_back("the light of '" + file.filename().string() + "' is left out");
            continue;
        }
        set.lights.push_back(
            {file, {std::sin(theta) * std::cos(phi), std::sin(theta) * std::sin(phi), std::cos(theta)}, {}});
    }
    return set;
}

LightSet read_folder(const fs::path& folder, const LightSetOptions& options) {
    if (is_diligent(folder)) return read_diligent(folder, options);
    const Listing files = list(folder);
    std::vector<fs::path> tables;
    for (const auto& [name, file] : files)
        if (name.ends_with(".lp")) tables.push_back(file);
    if (tables.size() == 1) return read_lp(tables.front(), options);
    if (tables.size() > 1)
        throw InputError(asked_of(folder), "there are " + std::to_string(tables.size()) + " .lp files in it",
                         "give one of them");
    for (const char* stem : {"light_directions", "directions", "lights"})
        for (const char* extension : {".txt", ".csv"})
            if (const auto found = files.find(std::string(stem) + extension); found != files.end())
                return read_table(found->second, options);
    LightSet set = read_btf(folder, options);
    if (set.lights.empty())
        throw InputError(
            asked_of(folder),
            "there is neither a .lp file, nor a table of directions, nor a BTF's view from above",
            "add dirs.lp: a count, then a picture's name and x, y, z to its light on each line");
    return set;
}

}  // namespace

namespace detail {

bool tell_normals(std::span<const Direction> directions) {
    Eigen::MatrixXd moments = Eigen::MatrixXd::Zero(3, 3);
    for (const Direction& d : directions)
        for (int i = 0; i < 3; ++i)
            for (int j = 0; j < 3; ++j)
                moments(i, j) += d[static_cast<std::size_t>(i)] * d[static_cast<std::size_t>(j)];
    const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> spectrum(moments, Eigen::EigenvaluesOnly);
    // A hundredth of the largest singular value: errors would grow a hundredfold.
    return spectrum.eigenvalues()[0] > 1e-4 * spectrum.eigenvalues()[2];
}

void check_directions(std::span<const Direction> directions, const std::string& asked) {
    if (directions.size() < 3)
        throw InputError(asked, "there are " + counted(directions.size(), "light"),
                         "a normal takes three or more, from all sides");
    if (!tell_normals(directions))
        throw InputError(asked, "all lights lie in one plane, or nearly so",
                         "a normal takes lights from all sides");
}

}  // namespace detail

LightSet read_light_set(const fs::path& lights, const LightSetOptions& options) {
    std::error_code error;
    if (!fs::exists(lights, error))
        throw InputError(asked_of(lights), "there is no such file or folder", "check the name");
    LightSet set = fs::is_directory(lights, error) ? read_folder(lights, options) : read_lp(lights, options);
    std::vector<Direction> directions;
    for (const LightPicture& light : set.lights) directions.push_back(light.direction);
    check_directions(directions, asked_of(lights));
    return set;
}

}  // namespace btfield

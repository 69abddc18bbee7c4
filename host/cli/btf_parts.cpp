#include "host/cli/btf_parts.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <filesystem>
#include <limits>
#include <numbers>
#include <system_error>

#include "btfield/error.hpp"
#include "host/base/text.hpp"
#include "host/btf/btf_names.hpp"
#include "host/cli/options.hpp"
#include "host/cli/output_names.hpp"
#include "host/pictures/picture_names.hpp"

namespace btfield::cli {
namespace {

namespace fs = std::filesystem;

std::string bytes_text(std::uintmax_t bytes) {
    const auto value = static_cast<double>(bytes);
    if (value >= 1e9) return number_text(value / 1e9) + " GB";
    if (value >= 1e6) return number_text(value / 1e6) + " MB";
    return number_text(value / 1e3) + " kB";
}

/// \throws InputError where the name is neither a folder's nor a set's
BtfFormat format_of_name(const fs::path& output, const std::string& asked) {
    const std::string extension = lower_extension(output);
    if (extension == ".tbig") return BtfFormat::tbig;
    if (extension == ".big") return BtfFormat::big;
    if (extension == ".mif") return BtfFormat::mif;
    if (extension == ".btf") return BtfFormat::fmf;
    std::error_code error;
    if (!extension.empty() && extension != ".zip" && !fs::is_directory(output, error))
        throw InputError(asked, "no file of a set ends in '" + extension + "'",
                         "use .tbig, .big, .mif, .btf or .zip; a folder's name may end in /");
    return BtfFormat::utia;
}

}  // namespace

void add_btf_reading(CLI::App& app, BtfOptions& options) {
    const std::string group = "Reading";
    add_choice(app, "--coding", options.coding,
               "what numbers of files mean (default: auto, gamma 2.2 for JPEG, sRGB for other whole numbers, "
               "linear for floats)")
        ->group(group);
    add_choice(app, "--colour", options.space,
               "what three planes of floats are, where files do not say (default: linear)")
        ->group(group);
    add_crop(app, "--crop", options.crop, "this rectangle of the pictures only")->group(group);
    add_int(app, "--pixel-stride", options.pixel_stride, 1, 1 << 16, "every n-th row and column only")
        ->group(group);
    add_int(app, "--view-stride", options.view_stride, 1, 1 << 16, "every n-th view only")->group(group);
    add_int(app, "--light-stride", options.light_stride, 1, 1 << 16, "every n-th light only")->group(group);
}

BtfSet open_told(const std::string& path, const BtfOptions& options) {
    preload_picture_formats();
    BtfSet set = BtfSet::open(path, options);
    for (const std::string& remark : set.description().remarks) warn(path + ": " + remark);
    return set;
}

Json degrees_json(const BtfDirection& direction) {
    const auto rounded = [](double radians) { return std::round(radians * 180e4 / std::numbers::pi) / 1e4; };
    return Json::array({rounded(direction.theta), rounded(direction.phi)});
}

Json set_json(const BtfSet& set) {
    const std::vector<BtfPair> missing = set.missing();
    Json object;
    object["format"] = set.format();
    object["size"] = size_json(set.size());
    object["planes"] = set.planes();
    object["views"] = set.views().size();
    object["lights"] = set.lights().size();
    object["pictures"] = set.views().size() * set.lights().size() - missing.size();
    object["missing"] = missing.size();
    // Enough to see what is wrong.
    Json examples = Json::array();
    for (std::size_t i = 0; i < std::min<std::size_t>(missing.size(), 20); ++i) {
        Json each;
        each["view"] = degrees_json(set.views()[static_cast<std::size_t>(missing[i].view)]);
        each["light"] = degrees_json(set.lights()[static_cast<std::size_t>(missing[i].light)]);
        examples.push_back(std::move(each));
    }
    object["missing_directions"] = std::move(examples);
    object["duplicates"] = 0;  // a set with duplicates is not opened
    object["colour"] = std::string(name(set.space()));
    object["white"] = number(set.white());
    object["height"] = set.description().height.planes() == 1;
    object["bytes"] = set.bytes();
    return object;
}

std::string set_text(const BtfSet& set) {
    const std::vector<BtfPair> missing = set.missing();
    const auto views = set.views().size(), lights = set.lights().size();
    std::string text = "format    " + set.format() + "\n";
    text += "pictures  " + std::to_string(views * lights - missing.size()) + ": " +
            detail::counted(views, "view") + " x " + detail::counted(lights, "light");
    if (!missing.empty()) text += ", " + std::to_string(missing.size()) + " missing";
    text += "\nsize      " + detail::text_of(set.size()) + " pixels, " +
            detail::counted(set.planes(), "plane") + "\n";
    text += "colour    " + std::string(name(set.space())) + ", white is " + number_text(set.white()) + "\n";
    if (set.description().height.planes() == 1) text += "height    in pixels, with the set\n";
    if (set.bytes() > 0) text += "bytes     " + bytes_text(set.bytes()) + "\n";
    return text;
}

std::optional<BtfDirection> parse_direction(const std::string& text) {
    double theta = 0.0, phi = 0.0;
    const char* const end = text.data() + text.size();
    const auto [comma, error] = std::from_chars(text.data(), end, theta);
    if (error != std::errc{} || comma == end || *comma != ',') return std::nullopt;
    const auto [stop, second] = std::from_chars(comma + 1, end, phi);
    if (second != std::errc{} || stop != end) return std::nullopt;
    if (!(theta >= 0.0 && theta < 90.0) || !std::isfinite(phi)) return std::nullopt;
    return BtfDirection{theta * std::numbers::pi / 180.0, phi * std::numbers::pi / 180.0};
}

void add_btf_writing(CLI::App& app, BtfWritingArguments& arguments) {
    app.add_option("-o,--output", arguments.output, "folder of the set, new or empty, or file of it")
        ->required()
        ->type_name("SET");
    add_choice(app, "--format", arguments.format,
               "folders of pictures: utia (PNG or EXR), ubo2003 (JPEG), atrium (Radiance), spectral (EXR); "
               "files: tbig, big, mif, ubo2014-fmf (default: by the output's extension, else utia)");
    add_choice(app, "--type", arguments.how.type,
               "storage of values (default: uint8 for utia, half for spectral and files)");
    add_int(app, "--components", arguments.components, 1, 65536,
            "of .btf: planes that stand for all pictures (default: 64)");
    add_positive(app, "--exposure", arguments.how.exposure,
                 "what linear light is multiplied by before it is stored; btf.json says so (default: 1)");
    app.add_flag("--overwrite", arguments.overwrite,
                 "write into a folder that is not empty, and replace files that have the same names");
}

namespace {

/// Whether it is `folder`, or in it.
bool lies_in(const fs::path& place, const fs::path& folder) {
    return std::mismatch(folder.begin(), folder.end(), place.begin(), place.end()).first == folder.end();
}

}  // namespace

double compression_ratio(std::uint64_t of, std::uintmax_t bytes) {
    return bytes > 0 && of > 0 ? static_cast<double>(of) / static_cast<double>(bytes)
                               : std::numeric_limits<double>::quiet_NaN();
}

void check_outside(const std::string& asked, const std::string& output, const std::string& input) {
    std::error_code error;
    const fs::path to = fs::weakly_canonical(output, error), from = fs::weakly_canonical(input, error);
    if (to == from || fs::equivalent(output, input, error))
        throw InputError(asked, "that is the input", "give the output another name");
    if (lies_in(to, from))
        throw InputError(asked, "it lies in the input '" + input + "'", "choose a place outside");
}

void check_btf_writing(BtfWritingArguments& arguments, const std::vector<std::string>& inputs,
                       const BtfDescription& set) {
    const std::string asked = "write the BTF '" + arguments.output + "'";
    arguments.how.format = arguments.format ? *arguments.format : format_of_name(arguments.output, asked);
    if (arguments.components) {
        if (arguments.how.format != BtfFormat::fmf)
            throw UsageError("--components: of .btf alone; " + std::string(name(arguments.how.format)) +
                             " keeps pictures as they are");
        arguments.how.components = *arguments.components;
    }
    std::error_code error;
    const fs::path output = fs::weakly_canonical(arguments.output, error);
    for (const std::string& input : inputs) {
        check_outside(asked, arguments.output, input);
        if (lies_in(fs::weakly_canonical(input, error), output))
            throw InputError(asked, "the input '" + input + "' lies in it", "choose another place");
    }
    if (fs::is_directory(arguments.output, error) && !fs::is_empty(arguments.output, error) &&
        !arguments.overwrite)
        throw InputError(asked, "the folder is not empty", "give a new one, or --overwrite");
    if (fs::is_regular_file(arguments.output, error) && !arguments.overwrite)
        throw InputError(asked, "the file exists", "give another name, or --overwrite");
    check_btf_output(arguments.output, set, arguments.how);
}

BtfWriteReport write_told(const BtfWritingArguments& arguments, const BtfSet& set) {
    Progress progress;
    const Stopwatch watch;
    BtfWriteOptions how = arguments.how;
    how.progress = [&](std::uint64_t done, std::uint64_t all) {
        const double share = static_cast<double>(done) / static_cast<double>(all), seconds = watch.seconds();
        progress.show(share, std::to_string(done) + " of " + std::to_string(all) + " pictures, " +
                                 number_text(static_cast<double>(done) / std::max(seconds, 1e-9)) + "/s, " +
                                 seconds_text(seconds * (1.0 - share) / share) + " left");
    };
    return write_btf(arguments.output, set, how);
}

void put_components(const BtfWriteReport& report, Json& object) {
    if (report.components == 0) return;
    object["components"] = report.components;
    object["relative_error"] = number(report.relative_error);
}

std::string components_text(const BtfWriteReport& report) {
    if (report.components == 0) return "";
    return detail::counted(report.components, "component") + (report.components == 1 ? " stands" : " stand") +
           " for all pictures, with an error of " + number_text(100.0 * report.relative_error) +
           " % (root mean square, to that of all values).\n";
}

}  // namespace btfield::cli

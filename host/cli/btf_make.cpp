#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <memory>
#include <numbers>
#include <optional>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "btfield/device.hpp"
#include "btfield/error.hpp"
#include "btfield/height.hpp"
#include "btfield/made_btf.hpp"
#include "btfield/material.hpp"
#include "host/base/srgb_curve.hpp"
#include "host/base/text.hpp"
#include "host/cli/btf_parts.hpp"
#include "host/cli/command_text.hpp"
#include "host/cli/options.hpp"
#include "host/cli/picture_options.hpp"
#include "host/cli/report.hpp"
#include "host/model/model_names.hpp"
#include "host/pictures/pixel_values.hpp"
#include "host/relief/relief_names.hpp"

namespace btfield::cli {
namespace {

namespace fs = std::filesystem;
using std::size_t;

constexpr const char* asked_make = "make a BTF";
/// Between directions: files tell whole degrees.
constexpr double least_apart = 0.51 * std::numbers::pi / 180.0;

struct MakeArguments {
    std::vector<std::string> maps;
    std::vector<MapRole> roles;
    std::optional<NormalConvention> convention;
    std::optional<double> relief;
    std::string directions = "utia", device;
    MadeBtfOptions made;
    std::optional<Crop> crop;
    int shrink = 1;
    BtfWritingArguments writing;
    bool json = false;
};

/// What the maps tell.
struct MadeFrom {
    BtfMaterial material;
    double scale = 0.0;  ///< pixels between black and white of the height map; 0: its values are pixels
};

Image shrunk(const Image& image, int by) {
    const Size size{image.height() / by, image.width() / by};
    Image result(size, image.planes(), image.space());
    for (int p = 0; p < image.planes(); ++p)
        for (int r = 0; r < size.height; ++r)
            for (int c = 0; c < size.width; ++c) {
                double sum = 0.0;
                for (int i = 0; i < by; ++i)
                    for (int k = 0; k < by; ++k)
                        sum += static_cast<double>(image.at(p, r * by + i, c * by + k));
                result.at(p, r, c) = static_cast<float>(sum / (static_cast<double>(by) * by));
            }
    return result;
}

Image linear_colours(Picture picture) {
    Image image = std::move(picture.image);
    const bool coded = !is_hdr(picture) || image.space() == ColourSpace::srgb;
    if (coded)
        for (float& value : image.values())
            value = static_cast<float>(detail::srgb_decoded(static_cast<double>(value)));
    image.set_space(image.planes() != 3                 ? ColourSpace::unspecified
                    : image.space() == ColourSpace::xyz ? ColourSpace::xyz
                                                        : ColourSpace::linear);
    return image;
}

/// One of each role, as far as they are there.
struct Maps {
    std::optional<Picture> colour, normal, height, roughness;
    bool directx = false;
};

Maps read_maps(const MakeArguments& options) {
    Maps maps;
    const std::vector<fs::path> files(options.maps.begin(), options.maps.end());
    const std::vector<MapRole> roles = options.roles.empty() ? roles_of_names(files) : options.roles;
    for (size_t i = 0; i < files.size(); ++i) {
        const fs::path& file = files[i];
        const MapRole role = roles[i];
        std::optional<Picture>* to = role == MapRole::colour      ? &maps.colour
                                     : role == MapRole::normal    ? &maps.normal
                                     : role == MapRole::height    ? &maps.height
                                     : role == MapRole::roughness ? &maps.roughness
                                                                  : nullptr;
        if (to == nullptr) {
            warn("'" + file.string() +
                 "' is neither colour, normal, height nor roughness by its name, and is "
                 "left out; --roles says what maps are");
            continue;
        }
        if (*to)
            throw InputError(asked_make,
                             "two maps are of the role " + std::string(detail::word_of(role)) +
                                 ", the second '" + file.string() + "'",
                             "give one of each; --roles says what maps are");
        ReadOptions reading;
        reading.crop = options.crop;
        reading.keep_values = role != MapRole::colour;
        *to = read_told(file, reading);
        if (role == MapRole::normal) maps.directx = says_directx(file);
    }
    if (!maps.colour)
        throw InputError(asked_make, "none of the maps is colour by its name",
                         "give a colour map; --roles says what maps are");
    if (!maps.normal && !maps.height)
        throw InputError(asked_make, "none of the maps is normal or height by its name",
                         "give one of them or both; --roles says what maps are");
    return maps;
}

/// Pixels between black and white of a height map.
double scale_of(const MakeArguments& options, const Image& height, const Image* slopes, bool floats) {
    if (options.relief) return *options.relief * height.width();
    if (floats) return 1.0;
    if (slopes == nullptr)
        throw InputError(asked_make, "nothing tells how high the height map is",
                         "give --relief, or a normal map too");
    const double scale = height_scale(*slopes, height, SurfaceEdges::periodic);
    if (!(scale > 0.0))
        throw InputError(asked_make, "the slopes of the height map are not those of the normal map",
                         "give --relief, or the right maps and --convention");
    return scale;
}

MadeFrom material_of(Device& device, const MakeArguments& options, Maps maps) {
    const int by = options.shrink;
    const Size whole = maps.colour->image.size();
    if (by > std::min(whole.height, whole.width))
        throw UsageError("--shrink: " + std::to_string(by) + " is more than the maps have, which are " +
                         detail::compact_text_of(whole));
    MadeFrom result;
    BtfMaterial& material = result.material;
    material.albedo = shrunk(linear_colours(std::move(*maps.colour)), by);
    std::optional<Image> slopes;
    if (maps.normal) {
        const NormalConvention convention =
            options.convention.value_or(maps.directx ? NormalConvention::directx : NormalConvention::opengl);
        // Slopes, not normals, are what averages.
        slopes = shrunk(slopes_of_normals(decode_normals(*maps.normal, convention)).slopes, by);
        material.normals = normals_of_slopes(*slopes);
    }
    if (maps.height) {
        if (maps.height->image.planes() != 1) {
            const Image& image = maps.height->image;
            const bool grey = image.planes() == 3 && std::ranges::equal(image.plane(0), image.plane(1)) &&
                              std::ranges::equal(image.plane(0), image.plane(2));
            if (!grey)
                throw InputError(asked_make, "the height map has " + detail::counted(image.planes(), "plane"),
                                 "give a grey picture");
            Image one(image.size(), 1);
            std::ranges::copy(image.plane(0), one.values().begin());
            maps.height->image = std::move(one);
        }
        const bool floats = is_hdr(*maps.height);
        material.height = shrunk(maps.height->image, by);
        if (slopes && slopes->size() != material.height.size())
            throw InputError(asked_make, "normal and height map differ in size", "give maps of one surface");
        result.scale = scale_of(options, material.height, slopes ? &*slopes : nullptr, floats);
        // Heights of floats are in pixels of their own.
        const double scale = floats && !options.relief ? 1.0 / by : result.scale;
        for (float& value : material.height.values()) value *= static_cast<float>(scale);
        if (!slopes)
            material.normals = normals_of_slopes(slopes_of_height(material.height, SurfaceEdges::periodic));
    } else {
        IntegrationOptions how;
        how.edges = SurfaceEdges::periodic;
        material.height = integrate(device, *slopes, how);
        if (options.relief)
            throw InputError(asked_make, "--relief is given and there is no height map", "give one");
    }
    if (maps.roughness) {
        const Image& image = maps.roughness->image;
        Image one(image.size(), 1);
        std::ranges::copy(image.plane(0), one.values().begin());
        material.roughness = shrunk(one, by);
    }
    return result;
}

[[noreturn]] void refuse_line(const std::string& file, int line, const std::string& found) {
    throw InputError("read the directions '" + file + "'", "line " + std::to_string(line) + ": " + found,
                     "write THETA PHI in degrees on each line, with 'view' or 'light' before them where it "
                     "is not both");
}

/// Lines of `[view|light] THETA PHI`.
void read_directions(const std::string& file, MadeBtfOptions& options) {
    std::ifstream stream(file);
    if (!stream)
        throw InputError("read the directions '" + file + "'", "it cannot be opened",
                         "give utia, ubo2014 or the name of a file");
    options.views.clear();
    options.lights.clear();
    std::string text;
    for (int number = 1; std::getline(stream, text); ++number) {
        if (number > 200000 || text.size() > 1000)
            refuse_line(file, number, "that is no table of directions");
        std::istringstream line(text.substr(0, text.find('#')));
        std::string word, first, second, more;
        line >> word;
        if (word.empty()) continue;
        const bool named = word == "view" || word == "light";
        if (named)
            line >> first >> second;
        else
            first = word, line >> second;
        const std::optional<BtfDirection> direction = parse_direction(first + "," + second);
        if (!direction || line >> more)
            refuse_line(file, number, "'" + detail::valid_utf8(text) + "' is no direction");
        const auto add = [&](std::vector<BtfDirection>& to) {
            // Sets that are read take those for one.
            for (const BtfDirection& other : to)
                if (angle_between(other, *direction) < least_apart)
                    refuse_line(file, number,
                                "'" + detail::valid_utf8(text) + "' is as good as one before it");
            to.push_back(*direction);
        };
        if (word != "light") add(options.views);
        if (word != "view") add(options.lights);
    }
    if (options.views.empty() || options.lights.empty())
        throw InputError("read the directions '" + file + "'", "there is no view or no light", "add some");
}

void choose_directions(const std::string& words, MadeBtfOptions& options) {
    if (words == "utia")
        options.views = options.lights = btf_directions_81();
    else if (words == "ubo2014")
        options.views = options.lights = btf_directions_151();
    else
        read_directions(words, options);
}

double range_of(const Image& image) {
    const auto [low, high] = std::ranges::minmax(image.values());
    return static_cast<double>(high) - static_cast<double>(low);
}

void run_make(const MakeArguments& given) {
    const Stopwatch total;
    MakeArguments options = given;
    if (!options.roles.empty() && options.roles.size() != options.maps.size())
        throw UsageError("--roles: there are " + std::to_string(options.roles.size()) + " for " +
                         std::to_string(options.maps.size()) + " maps");
    preload_picture_formats();
    choose_directions(options.directions, options.made);
    Maps maps = read_maps(options);
    Device device(options.device);
    std::optional<Progress> bar(std::in_place);
    bar->show(0.0, "material");
    const MadeFrom from = material_of(device, options, std::move(maps));
    const BtfSet set = make_btf(device, from.material, options.made);
    bar.reset();
    std::vector<std::string> inputs = options.maps;
    std::error_code error;
    if (std::filesystem::exists(options.directions, error)) inputs.push_back(options.directions);
    check_btf_writing(options.writing, inputs, set.description());
    const double set_up = total.seconds();
    const Stopwatch writing;
    const BtfWriteReport report = write_told(options.writing, set);
    const double seconds = writing.seconds(), range = range_of(from.material.height);
    const auto pixels = static_cast<double>(report.pictures) * static_cast<double>(area(set.size()));
    if (options.json) {
        Json object = set_json(set);
        object["output"] = options.writing.output;
        object["bytes"] = report.bytes;
        object["exposure"] = number(options.writing.how.exposure);
        object["clamped_pixels"] = report.clamped_pixels;
        put_components(report, object);
        object["relief"] = number(range);
        object["height_scale"] = number(from.scale);
        object["device"] = device.info().name;
        object["seconds"]["setup"] = set_up;
        object["seconds"]["write"] = seconds;
        object["seconds"]["total"] = total.seconds();
        emit_json(object);
        return;
    }
    std::string text = "wrote " + options.writing.output + ": " + std::to_string(report.pictures) +
                       " pictures of " + detail::text_of(set.size()) + " pixels, " +
                       detail::counted(set.views().size(), "view") + " x " +
                       detail::counted(set.lights().size(), "light") + ", in " + seconds_text(seconds) + "\n";
    text += "The surface is " + number_text(range) + " pixels high from its lowest point to its highest.\n";
    text += "Exposure " + number_text(options.writing.how.exposure) +
            ": a white surface that faces the light is " + number_text(options.writing.how.exposure) +
            " of white.";
    if (report.clamped_pixels > 0)
        text +=
            " " + number_text(100.0 * static_cast<double>(report.clamped_pixels) / pixels) +
            " % of all pixels are brighter and were clamped; a lower --exposure or --type half keeps them.";
    emit_result(text + "\n" + components_text(report));
}

}  // namespace

void add_btf_make(CLI::App& parent, Action& action) {
    CLI::App* command = parent.add_subcommand("make", "make the BTF of a material from its maps");
    const auto options = std::make_shared<MakeArguments>();
    command
        ->add_option("MAPS", options->maps, "colour, normal and height map, perhaps roughness; known by name")
        ->required()
        ->type_name("");
    add_btf_writing(*command, options->writing);
    const std::string words = detail::words_of<MapRole>("|");
    const auto read = [options, words](const std::vector<std::string>& texts) {
        options->roles.clear();
        for (const std::string& text : texts) {
            const auto role = detail::find_value<MapRole>(text);
            if (!role) throw CLI::ValidationError("--roles", "'" + text + "' is none of " + words);
            options->roles.push_back(*role);
        }
    };
    const std::string maps = "Maps";
    command
        ->add_option_function<std::vector<std::string>>(
            "--roles", read, "what the maps are, in their order (default: by their names)")
        ->delimiter(',')
        ->type_name("ROLE,...")
        ->group(maps);
    add_choice(*command, "--convention", options->convention,
               "which way green points in the normal map (default: by its name, else opengl)")
        ->group(maps);
    add_positive(
        *command, "--relief", options->relief,
        "how far black and white of the height map are apart, as a share of its width (default: found "
        "from the normals; of floats their values are pixels)")
        ->group(maps);
    add_crop(*command, "--crop", options->crop, "this rectangle of the maps only: it should tile")
        ->group(maps);
    add_int(*command, "--shrink", options->shrink, 1, 1024, "average this many rows and columns to one pixel")
        ->group(maps);
    const std::string looks = "Pictures";
    command
        ->add_option(
            "--directions", options->directions,
            "utia (81 views and lights), ubo2014 (151), or a file: lines of THETA PHI in degrees, with "
            "'view' or 'light' before them where it is not both (default: utia)")
        ->type_name("utia|ubo2014|FILE")
        ->group(looks);
    add_positive(*command, "--roughness", options->made.roughness,
                 "of the gloss, up to 1, where no map tells it (default: 0.45)")
        ->group(looks);
    command
        ->add_flag_callback(
            "--matt", [options] { options->made.reflectance = 0.0; }, "no gloss")
        ->group(looks);
    add_device(*command, options->device);
    add_json(*command, options->json);
    set_guide(
        *command,
        {.usual = {{"btfield btf make rock-albedo.png rock-normal.png rock-height.png -o rock/"}},
         .more = {{"btfield btf make albedo.jpg height.jpg -o set/ --relief 0.06 --shrink 4"},
                  {"btfield btf make albedo.png normal.png -o set/ --directions few.txt"}},
         .notes = {"The maps tile, and so do all pictures. Parallax, what hides behind other parts, and "
                   "shadows come from the height, shading from the normals. Without a normal map, "
                   "normals are those of the height; without a height map, the height is that of the "
                   "normals. The range map goes into the set too, height.exr, in pixels."}});
    command->callback([options, &action] { action = [options] { run_make(*options); }; });
}

}  // namespace btfield::cli

#include "host/cli/relief_render.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "btfield/error.hpp"
#include "btfield/relighting.hpp"
#include "host/base/srgb_curve.hpp"
#include "host/base/strict_json.hpp"
#include "host/base/text.hpp"
#include "host/cli/command_text.hpp"
#include "host/cli/options.hpp"
#include "host/cli/report.hpp"
#include "host/cli/run_files.hpp"
#include "host/relief/relief_names.hpp"

namespace btfield::cli {
namespace {

namespace fs = std::filesystem;

struct RenderArguments {
    std::string folder, output, score;
    std::optional<std::pair<double, double>> light;
    bool no_shadows = false, leave_out_behind = false, overwrite = false, json = false;
    std::optional<Crop> crop;
};

/// What `relief fit` left in a folder.
struct ReliefFolder {
    fs::path side, normals, albedo, height;
    Surface surface;
    LightCoding coding = LightCoding::linear;
    double gamma = 2.2;
};

std::string text_of_file(const fs::path& file) {
    std::ifstream stream(file, std::ios::binary);
    if (!stream)
        throw InputError("read '" + file.string() + "'", "it cannot be opened",
                         "give a folder that relief fit wrote");
    return {std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()};
}

/// A word of the side file that an enumeration has.
template <typename Value>
Value word_in(const nlohmann::json& object, const char* key, const std::string& asked) {
    const auto found = object.find(key);
    std::optional<Value> value;
    if (found != object.end() && found->is_string())
        value = detail::find_value<Value>(found->template get<std::string>());
    if (!value)
        throw InputError(asked, "its '" + std::string(key) + "' is none of " + detail::words_of<Value>(),
                         "give a folder that relief fit wrote");
    return *value;
}

double number_in(const nlohmann::json& object, const char* key, double otherwise) {
    const auto found = object.find(key);
    return found != object.end() && found->is_number() ? found->get<double>() : otherwise;
}

Image read_albedo(const fs::path& file, double scale) {
    const Picture picture = read_picture(file);
    Image albedo = picture.image;
    for (float& value : albedo.values()) {
        auto linear = static_cast<double>(value);
        if (!is_hdr(picture)) linear = detail::srgb_decoded(linear);
        value = static_cast<float>(linear * scale);
    }
    albedo.set_space(ColourSpace::linear);
    return albedo;
}

ReliefFolder read_folder(const RenderArguments& options) {
    const fs::path folder = options.folder;
    ReliefFolder read;
    read.side = folder / "relief.json";
    const std::string asked = "read '" + read.side.string() + "'";
    const nlohmann::json side = detail::parse_strictly(text_of_file(read.side), asked);
    if (!side.is_object())
        throw InputError(asked, "it holds no object", "give a folder that relief fit wrote");
    read.surface.edges = word_in<SurfaceEdges>(side, "edges", asked);
    read.coding = word_in<LightCoding>(side, "coding", asked);
    read.gamma = number_in(side, "gamma", 2.2);
    std::error_code error;
    read.normals = folder / "normal.png";
    read.height = folder / "height.exr";
    read.albedo = folder / (fs::exists(folder / "albedo.png", error) ? "albedo.png" : "albedo.exr");
    ReadOptions as_it_is;
    as_it_is.keep_values = true;
    read.surface.normals = decode_normals(read_picture(read.normals, as_it_is),
                                          word_in<NormalConvention>(side, "normals", asked));
    read.surface.albedo = read_albedo(read.albedo, number_in(side, "albedo_scale", 1.0));
    if (!options.no_shadows) read.surface.height = read_picture(read.height, as_it_is).image;
    return read;
}

double median_of(std::vector<LightScore> scores) {
    const auto middle = scores.begin() + static_cast<std::ptrdiff_t>(scores.size() / 2);
    std::ranges::nth_element(scores, middle, {}, &LightScore::error);
    return middle->error;
}

void run_render(const RenderArguments& options) {
    if (options.output.empty() != !options.light) throw UsageError("--light and --output go together");
    if (options.output.empty() && options.score.empty())
        throw UsageError("one of --light, for a picture, and --score is needed");
    if (options.score.empty() && (options.crop || options.leave_out_behind))
        throw UsageError("--crop and --leave-out-behind go with --score");
    const Stopwatch total;
    preload_picture_formats();
    const ReliefFolder read = read_folder(options);
    LightSet lights;
    LightSetOptions reading;
    reading.leave_out_behind = options.leave_out_behind;
    if (!options.score.empty()) lights = read_light_set(options.score, reading);
    if (!options.output.empty()) {
        RunFiles files(options.overwrite, options.json);
        for (const fs::path& file : {read.side, read.normals, read.albedo, read.height})
            files.reads(file, "that is a map of the surface");
        for (const LightPicture& light : lights.lights) files.reads(light.picture);
        files.writes(options.output);
        check_writable(options.output, read.surface.albedo.planes(), PixelType::uint8, {},
                       read.surface.albedo.size());
    }
    Json object;
    std::string text;
    if (!options.output.empty()) {
        const Image image =
            relight(read.surface, direction_of_angles(options.light->first, options.light->second));
        const WriteReport report = write_picture(options.output, image, PixelType::uint8);
        object["outputs"] = Json::array({options.output});
        object["light"] = Json::array({options.light->first, options.light->second});
        object["size"] = size_json(image.size());
        object["clamped_pixels"] = report.clamped_pixels;
        text += "wrote " + options.output + ", " + detail::text_of(image.size()) + " pixels\n";
    }
    if (!options.score.empty()) {
        const std::vector<LightScore> scores =
            score_lights(read.surface, lights, read.coding, read.gamma, options.crop);
        Json list = Json::array();
        for (const LightScore& score : scores) {
            Json each;
            each["picture"] = score.picture.filename().string();
            each["error"] = number(score.error);
            list.push_back(std::move(each));
        }
        object["score"]["error"] = number(median_of(scores));
        object["score"]["lights"] = std::move(list);
        text += "Of " + detail::counted(scores.size(), "light") + " the surface tells all but " +
                number_text(100.0 * median_of(scores)) + " % of what is seen (median), at worst " +
                number_text(100.0 * std::ranges::max_element(scores, {}, &LightScore::error)->error) +
                " %.\n";
    }
    object["seconds"]["total"] = total.seconds();
    options.json ? emit_json(object) : emit_result(text);
}

std::pair<double, double> parse_light(const std::string& text) {
    double theta = 0.0, phi = 0.0;
    const char* const end = text.data() + text.size();
    const auto [comma, first] = std::from_chars(text.data(), end, theta);
    const bool parted = first == std::errc{} && comma != end && *comma == ',';
    const auto [stop, second] =
        parted ? std::from_chars(comma + 1, end, phi) : std::from_chars_result{end, first};
    if (!parted || second != std::errc{} || stop != end || !(theta >= 0.0 && theta < 90.0) ||
        !std::isfinite(phi))
        throw CLI::ValidationError("--light", "'" + text +
                                                  "' is not T,P: degrees from the normal, below 90, and "
                                                  "counter-clockwise from the right");
    return {theta, phi};
}

}  // namespace

void add_relief_render(CLI::App& parent, Action& action) {
    CLI::App* command = parent.add_subcommand("render", "show a surface under a new light, and score lights");
    const auto options = std::make_shared<RenderArguments>();
    command->add_option("FOLDER", options->folder, "folder that relief fit wrote")->required()->type_name("");
    command
        ->add_option("-o,--output", options->output,
                     "picture of the surface under --light; EXR holds linear light")
        ->type_name("IMAGE");
    command
        ->add_option_function<std::string>(
            "--light", [options](const std::string& text) { options->light = parse_light(text); },
            "degrees from the normal, and counter-clockwise from the right")
        ->type_name("T,P");
    command->add_flag("--no-shadows", options->no_shadows,
                      "shade by normals alone: the height throws no shadows");
    command
        ->add_option(
            "--score", options->score,
            "lights, as relief fit takes them, whose pictures are compared with the surface under them")
        ->type_name("LIGHTS");
    add_crop(*command, "--crop", options->crop,
             "the rectangle of --score's pictures that the surface was fitted to");
    command->add_flag("--leave-out-behind", options->leave_out_behind,
                      "leave out lights of --score whose z is not above 0");
    add_overwrite(*command, options->overwrite);
    add_json(*command, options->json);
    set_guide(*command,
              {.usual = {{"btfield relief render relief/ -o left.png --light 60,180"},
                         {"btfield relief render relief/ --score stack/dirs.lp"}},
               .notes = {"Lambert's law with the shadows that the height throws: neither gloss nor light "
                         "from all around."}});
    command->callback([options, &action] { action = [options] { run_render(*options); }; });
}

}  // namespace btfield::cli

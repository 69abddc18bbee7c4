#include <algorithm>
#include <charconv>
#include <cmath>
#include <filesystem>
#include <memory>
#include <numbers>
#include <optional>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "btfield/btf_model.hpp"
#include "btfield/btf_renderer.hpp"
#include "btfield/btf_textures.hpp"
#include "btfield/device.hpp"
#include "btfield/error.hpp"
#include "btfield/image_io.hpp"
#include "host/base/text.hpp"
#include "host/cli/btf_parts.hpp"
#include "host/cli/command_text.hpp"
#include "host/cli/options.hpp"
#include "host/cli/output_names.hpp"
#include "host/cli/report.hpp"
#include "host/cli/run_files.hpp"
#include "host/rendering/rendering_names.hpp"

namespace btfield::cli {
namespace {

namespace fs = std::filesystem;

/// Directions of a series, one after the other; one that stays alone.
using Path = std::vector<BtfDirection>;

struct RenderArguments {
    std::string model, output, device;
    BtfScene scene;
    std::optional<Size> size, tile;
    Path view{{0.0, 0.0}}, light{{45.0 * std::numbers::pi / 180.0, 135.0 * std::numbers::pi / 180.0}};
    std::optional<int> frames;
    std::uint64_t seed = 0;
    double exposure = 1.0;
    std::optional<double> gamma;  ///< none: sRGB
    bool gamma_given = false, allow_invalid = false, overwrite = false, json = false;
};

std::optional<Path> parse_path(const std::string& text) {
    Path path;
    std::size_t from = 0;
    while (true) {
        const std::size_t to = text.find(':', from);
        const auto direction = parse_direction(text.substr(from, to - from));
        if (!direction) return std::nullopt;
        path.push_back(*direction);
        if (to == std::string::npos) return path;
        from = to + 1;
    }
}

/// Where a path that is taken at an even pace is in one of its frames. One that comes back to where it began
/// does not show that twice.
BtfDirection at_frame(const Path& path, int frame, int frames) {
    if (path.size() == 1) return path.front();
    const bool closed = angle_between(path.front(), path.back()) < 1e-6;
    const double along =
        static_cast<double>(path.size() - 1) * frame / std::max(closed ? frames : frames - 1, 1);
    const std::size_t leg = std::min(static_cast<std::size_t>(along), path.size() - 2);
    const double share = along - static_cast<double>(leg);
    const BtfDirection &a = path[leg], &b = path[leg + 1];
    return {a.theta + share * (b.theta - a.theta), a.phi + share * (b.phi - a.phi)};
}

bool is_linear(const std::string& output) {
    return lower_extension(output) == ".exr";
}

void check_arguments(const RenderArguments& options) {
    const bool moves = options.view.size() > 1 || options.light.size() > 1;
    if (moves && !options.frames)
        throw UsageError("a --view or --light of several directions is a path: say in how many --frames");
    if (options.frames && !moves)
        throw UsageError("--frames: nothing moves; give --light or --view a path, such as 60,0:60,360");
    if (options.gamma_given && is_linear(options.output))
        throw UsageError("--gamma: an EXR file holds linear light; leave it out, or write a PNG");
}

/// Exposed, and coded as the file is to have it.
WriteReport write(const fs::path& output, Image picture, const RenderArguments& options) {
    WriteOptions how;
    const auto exposure = static_cast<float>(options.exposure);
    for (float& value : picture.values()) value *= exposure;
    if (options.gamma) {
        how.keep_values = true;
        const auto power = static_cast<float>(1.0 / *options.gamma);
        for (float& value : picture.values()) value = std::pow(std::max(value, 0.0F), power);
    }
    return write_picture(output, picture, how);
}

Json direction_json(const BtfDirection& direction) {
    const auto rounded = [](double radians) {
        return std::round(radians * 180.0 / std::numbers::pi * 1e4) / 1e4;
    };
    return Json::array({rounded(direction.theta), rounded(direction.phi)});
}

std::vector<fs::path> plan(const RenderArguments& options, const BtfMeasured& model) {
    std::vector<fs::path> outputs;
    RunFiles files(options.overwrite, options.json);
    files.reads(options.model, "that is the model");
    const int frames = options.frames.value_or(1);
    outputs.reserve(static_cast<std::size_t>(frames));
    for (int i = 0; i < frames; ++i)
        outputs.push_back(options.frames ? numbered(options.output, i, frames) : fs::path(options.output));
    for (const fs::path& output : outputs) {
        files.writes(output);
        check_writable(output, model.colours, PixelType::uint8, {}, options.size);
    }
    if (options.gamma && model.space == ColourSpace::xyz)
        throw InputError("write '" + options.output + "' with --gamma", "the model's colours are XYZ",
                         "leave --gamma out, for sRGB, or write an EXR");
    return outputs;
}

BtfMethod method_of(const std::variant<BtfModel, BtfTextures>& model) {
    const auto* const textures = std::get_if<BtfTextures>(&model);
    return textures == nullptr ? BtfMethod::joint : textures->method;
}

void run_render(const RenderArguments& options) {
    const Stopwatch total;
    check_arguments(options);
    preload_picture_formats(options.output);
    const std::variant<BtfModel, BtfTextures> model = read_any_btf(options.model);
    const auto& measured = std::visit([](const auto& either) -> const BtfMeasured& { return either; }, model);
    const std::vector<fs::path> outputs = plan(options, measured);
    BtfScene scene = options.scene;
    if (options.size) scene.size = *options.size;
    scene.background /= options.exposure;  // what is beside the shape stays as it is
    Device device(options.device);
    const BtfRenderer renderer = std::visit(
        [&](const auto& either) {
            return BtfRenderer(device, either, options.tile.value_or(measured.size), options.seed,
                               options.allow_invalid);
        },
        model);
    if (!renderer.tileable())
        warn("a tile of " + detail::text_of(renderer.tile()) +
             " pixels does not continue at its edges; sides without factors above 13 do");
    const double set_up = total.seconds();
    double showing = 0.0, writing = 0.0;
    std::uintmax_t clamped = 0;
    Json object, views = Json::array(), lights = Json::array();
    object["outputs"] = Json::array();
    Progress progress;
    const int frames = static_cast<int>(outputs.size());
    for (int i = 0; i < frames; ++i) {
        const BtfDirection view = at_frame(options.view, i, frames),
                           light = at_frame(options.light, i, frames);
        const Stopwatch one;
        Image picture = renderer.picture(scene, view, light);
        showing += one.seconds();
        const fs::path& output = outputs[static_cast<std::size_t>(i)];
        const Stopwatch storing;
        clamped += write(output, std::move(picture), options).clamped_pixels;
        writing += storing.seconds();
        object["outputs"].push_back(output.string());
        views.push_back(direction_json(view));
        lights.push_back(direction_json(light));
        progress.show(static_cast<double>(i + 1) / frames,
                      std::to_string(i + 1) + " of " + std::to_string(frames) + " pictures");
    }
    if (options.json) {
        object["method"] = std::string(name(method_of(model)));
        object["shape"] = name(scene.shape);
        object["size"] = size_json(scene.size);
        object["views"] = std::move(views);
        object["lights"] = std::move(lights);
        object["tile"] = size_json(renderer.tile());
        object["tileable"] = renderer.tileable();
        object["tiles_around"] = scene.shape == BtfShape::sphere
                                     ? Json(tiles_around(scene, renderer.tile().width))
                                     : Json(nullptr);
        object["scale"] = scene.scale;
        object["seed"] = options.seed;
        object["exposure"] = options.exposure;
        object["gamma"] = is_linear(options.output) ? Json(1.0)
                          : options.gamma           ? Json(*options.gamma)
                                                    : Json("srgb");
        object["clamped_pixels"] = clamped;
        object["device"] = device.info().name;
        object["seconds"] = {{"setup", set_up},
                             {"per_picture", showing / frames},
                             {"write", writing},
                             {"total", total.seconds()}};
        emit_json(object);
        return;
    }
    std::string text = "wrote " +
                       (frames == 1 ? outputs.front().string()
                                    : outputs.front().string() + " to " + outputs.back().string()) +
                       ": " + detail::text_of(scene.size) + " pixels, " + std::string(name(scene.shape)) +
                       ", seed " + std::to_string(options.seed) + "\n";
    if (clamped > 0)
        text += detail::counted(clamped, "pixel") +
                " are brighter than white and were clamped; a lower --exposure keeps them.\n";
    emit_result(text);
}

void add_path(CLI::App& app, const std::string& name, Path& value, const std::string& help) {
    const auto read = [name, &value](const std::string& text) {
        const auto path = parse_path(text);
        if (!path)
            throw CLI::ValidationError(
                name, "'" + text +
                          "' is not THETA,PHI in degrees, theta from 0 to 89, nor several with ':' between");
        value = *path;
    };
    app.add_option_function<std::string>(name, read, help)->type_name("T,P[:T,P...]");
}

void read_gamma(const std::string& text, RenderArguments& options) {
    options.gamma_given = true;
    options.gamma.reset();
    if (text == "srgb") return;
    double value = 0.0;
    const auto [stop, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (error != std::errc{} || stop != text.data() + text.size() || !(value > 0.0 && value <= 10.0))
        throw CLI::ValidationError("--gamma",
                                   "'" + text + "' is neither srgb nor a number above 0, up to 10");
    options.gamma = value;
}

}  // namespace

void add_btf_render(CLI::App& parent, Action& action) {
    CLI::App* command = parent.add_subcommand("render", "show a material on a sphere or a plane");
    const auto options = std::make_shared<RenderArguments>();
    command->add_option("MODEL", options->model, "model that btf fit wrote")->required()->type_name("");
    command->add_option("-o,--output", options->output, "picture: sRGB, or linear light as EXR")
        ->required()
        ->type_name("IMAGE");
    add_choice(*command, "--shape", options->scene.shape, "what the material is on (default: sphere)");
    add_size(*command, "--size", options->size, "of the picture, WxH (default: 512x512)");
    add_path(*command, "--view", options->view, "direction to the camera, in degrees (default: 0,0)");
    add_path(*command, "--light", options->light, "direction to the light (default: 45,135)");
    add_int(*command, "--frames", options->frames, 1, 100000,
            "a series along --view and --light, each of which stays or is a path");
    add_positive(*command, "--scale", options->scene.scale,
                 "pixels of the picture that one of the material takes (default: 1)");
    add_size(*command, "--tile", options->tile,
             "of the material that is grown and repeated, WxH (default: that of the model)");
    add_uint64(*command, "--seed", options->seed,
               "another seed is another piece of the material (default: 0)");
    add_positive(*command, "--exposure", options->exposure,
                 "what light is multiplied by: at 1 white facing the light is white (default: 1)");
    command
        ->add_option_function<std::string>(
            "--gamma", [options](const std::string& text) { read_gamma(text, *options); },
            "how light is coded: srgb, or the power 1/G (default: srgb)")
        ->type_name("srgb|G");
    command->add_flag("--allow-invalid", options->allow_invalid, "grow a model although a certificate fails");
    add_overwrite(*command, options->overwrite);
    add_device(*command, options->device);
    add_json(*command, options->json);
    set_guide(*command,
              {.usual = {{"btfield btf render rock.btfm -o ball.png --light 60,120"}},
               .more = {{"btfield btf render rock.btfm -o flat.png --shape plane --view 50,270"},
                        {"btfield btf render rock.btfm -o turn.png --light 60,0:60,360 --frames 36",
                         "turn-00.png to turn-35.png, the light going round"}},
               .notes = {"The camera is orthographic, the light directional. Directions are those of the "
                         "shape: x right, y up, z to the camera that looks from 0,0."}});
    command->callback([options, &action] { action = [options] { run_render(*options); }; });
}

}  // namespace btfield::cli

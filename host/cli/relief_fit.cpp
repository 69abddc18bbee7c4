#include "host/cli/relief_fit.hpp"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "btfield/error.hpp"
#include "btfield/height.hpp"
#include "btfield/image_io.hpp"
#include "btfield/relief.hpp"
#include "btfield/relightable.hpp"
#include "host/base/file_output.hpp"
#include "host/base/text.hpp"
#include "host/cli/command_text.hpp"
#include "host/cli/options.hpp"
#include "host/cli/output_names.hpp"
#include "host/cli/relief_report.hpp"
#include "host/cli/report.hpp"
#include "host/cli/run_files.hpp"
#include "host/relief/relief_names.hpp"

namespace btfield::cli {
namespace {

namespace fs = std::filesystem;

struct ReliefArguments {
    std::string lights, output, mask, device;
    ReliefOptions relief;
    LightSetOptions reading;
    NormalConvention convention = NormalConvention::opengl;
    Flattening flattening = Flattening::plane;
    std::optional<double> pixel_size;  ///< millimetres
    bool relight = false, periodic = false, maps = false, overwrite = false, json = false;
};

/// Files in the folder that the run writes.
struct ReliefFiles {
    fs::path normals, height, height_pixels, albedo, side, residual, left_out;
    std::vector<fs::path> relight;  ///< info.json, and a picture for each coefficient
};

struct ReliefSeconds {
    double read = 0.0, fit = 0.0, integrate = 0.0, write = 0.0, total = 0.0;
};

/// PNG has room for one or three planes of whole numbers.
const char* albedo_name(const Picture& front) {
    const int planes = front.image.planes();
    return !is_hdr(front) && (planes == 1 || planes == 3) ? "albedo.png" : "albedo.exr";
}

/// What the viewers' format has room for.
void check_relightable(const LightSet& lights, const Picture& front) {
    const std::string asked = "export for relight";
    if (lights.lights.size() < 6)
        throw InputError(asked, "there are " + detail::counted(lights.lights.size(), "light"),
                         "give six or more, or leave out --export");
    if (const int planes = front.image.planes(); planes != 1 && planes != 3)
        throw InputError(asked, "the pictures have " + detail::counted(planes, "plane"),
                         "give pictures of one plane or three, or leave out --export");
}

/// EXR has no whole numbers.
PixelType albedo_type(const fs::path& file, PixelType pictures) {
    const bool whole = pictures == PixelType::uint8 || pictures == PixelType::uint16;
    return whole && lower_extension(file) == ".exr" ? PixelType::float32 : pictures;
}

ReliefFiles plan(const ReliefArguments& options, const LightSet& lights, const Picture& front) {
    (void)is_output_folder("--output", options.output, "several maps");
    const fs::path folder = options.output;
    ReliefFiles files{folder / "normal.png",
                      folder / "height.png",
                      folder / "height.exr",
                      folder / albedo_name(front),
                      folder / "relief.json",
                      {},
                      {},
                      {}};
    if (options.maps) {
        files.residual = folder / "residual.exr";
        files.left_out = folder / "left-out.exr";
    }
    RunFiles run(options.overwrite, options.json);
    run.reads(options.lights, "that says where the lights are");
    for (const LightPicture& light : lights.lights)
        run.reads(light.picture, "it is one of the pictures under lights");
    if (!lights.mask.empty()) run.reads(lights.mask, "that is the mask");
    if (!options.mask.empty()) run.reads(options.mask, "that is the mask");
    const auto check = [&](const fs::path& file, int planes, PixelType type) {
        if (file.empty()) return;
        run.writes(file);
        check_writable(file, planes, type, type, front.image.size());
    };
    check(files.normals, 3, PixelType::uint16);
    check(files.height, 1, PixelType::uint16);
    check(files.height_pixels, 1, PixelType::float32);
    check(files.albedo, front.image.planes(), albedo_type(files.albedo, front.type));
    check(files.residual, 1, PixelType::float32);
    check(files.left_out, 1, PixelType::float32);
    if (options.relight) {
        check_relightable(lights, front);
        const fs::path relight = folder / "relight";
        (void)is_output_folder("--output", relight.string(), "--export relight");
        files.relight = {relight / "info.json"};
        for (int t = 0; t < 6; ++t)
            check(files.relight.emplace_back(relight / ("plane_" + std::to_string(t) + ".jpg")), 3,
                  PixelType::uint8);
        run.writes_text(files.relight.front());
        detail::check_output(files.relight.front(), "write '" + files.relight.front().string() + "'");
    }
    run.writes_text(files.side);
    detail::check_output(files.side, "write '" + files.side.string() + "'");
    return files;
}

/// What albedo is divided by so that nearly all of it is below white: of whole numbers alone.
double albedo_scale(const Relief& relief, const fs::path& file) {
    if (lower_extension(file) != ".png") return 1.0;
    std::vector<float> values(relief.albedo.values().begin(), relief.albedo.values().end());
    const auto at = values.begin() + static_cast<std::ptrdiff_t>((values.size() - 1) * 999 / 1000);
    std::nth_element(values.begin(), at, values.end());
    return std::max(1.0, static_cast<double>(*at));
}

void write_data(const fs::path& file, const Image& image, PixelType type) {
    if (file.empty()) return;
    WriteOptions how;
    how.source = type;
    how.type = type;
    how.keep_values = true;
    write_picture(file, image, how);
}

void write_maps(const ReliefArguments& options, const ReliefFiles& files, const Relief& relief,
                const Image& height, double scale, double white) {
    write_data(files.normals, encode_normals(relief.normals, options.convention), PixelType::uint16);
    write_height(files.height, height, scale);
    write_height(files.height_pixels, height, scale);
    Image albedo = relief.albedo;
    for (float& value : albedo.values()) value /= static_cast<float>(white);
    WriteOptions how;
    how.source = relief.type;
    how.type = albedo_type(files.albedo, relief.type);
    write_picture(files.albedo, albedo, how);
    write_data(files.residual, relief.residual, PixelType::float32);
    write_data(files.left_out, relief.left_out, PixelType::float32);
}

/// info.json and pictures of coefficients, as the viewer Relight and OpenLIME read them.
LightPolynomial write_relight(Device& device, const ReliefArguments& options, const ReliefFiles& files,
                              const LightSet& lights, const Relief& relief) {
    ReliefOptions how = options.relief;
    how.coding = relief.coding;
    Progress bar;
    how.progress = [&](std::string_view, double share) { bar.show(share, "relight"); };
    LightPolynomial polynomial = fit_light_polynomial(device, lights, how);
    const RelightablePlanes planes = relightable_planes(polynomial);
    for (std::size_t t = 0; t < planes.pictures.size(); ++t)
        static_cast<void>(write_picture(files.relight[t + 1], planes.pictures[t], PixelType::uint8));
    Json info;
    info["width"] = polynomial.coefficients.width();
    info["height"] = polynomial.coefficients.height();
    info["format"] = "jpg";
    if (options.pixel_size) info["pixelSizeInMM"] = *options.pixel_size;
    info["type"] = "ptm";
    info["colorspace"] = "rgb";
    info["lights"] = Json::array();
    for (const LightPicture& light : lights.lights)
        for (const double x : light.direction) info["lights"].push_back(x);
    info["nplanes"] = planes.scale.size();
    info["quality"] = 98;
    info["materials"] = Json::array({Json{{"scale", planes.scale}, {"bias", planes.bias}}});
    write_side_file(files.relight.front(), info);
    return polynomial;
}

/// Keys of the report that the side file has too.
Json relief_json(const ReliefArguments& options, const Relief& relief, double white) {
    Json object;
    object["robust"] = std::string(detail::word_of(relief.rule));
    if (relief.rule == LightRule::lobe) object["roughness"] = number(relief.roughness);
    object["coding"] = std::string(detail::word_of(relief.coding));
    if (relief.coding == LightCoding::gamma) object["gamma"] = number(options.relief.gamma);
    object["lights"] = relief.lights;
    object["residual"] = number(relief.median_residual);
    object["left_out_error"] = number(relief.left_out_error);
    object["left_out_error_ls"] = number(relief.left_out_least_squares);
    object["shadowed"] = number(relief.shadowed);
    object["saturated"] = number(relief.saturated);
    object["albedo_scale"] = number(white);
    return object;
}

Json relight_json(const LightPolynomial& polynomial) {
    Json object;
    object["relight_error"] = number(polynomial.error);
    object["relight_white"] = number(polynomial.white);
    return object;
}

std::string percent_text(double share) {
    return std::isfinite(share) ? number_text(100.0 * share) + " %" : "unknown";
}

std::string relief_text(const ReliefArguments& options, const ReliefFiles& files, const Relief& relief,
                        const Image& height, double scale, const ReliefSeconds& seconds) {
    std::string text = "wrote " + files.normals.string() + ", height.png, height.exr, " +
                       files.albedo.filename().string() +
                       (options.maps ? ", residual.exr, left-out.exr" : "") + " and relief.json\n" +
                       detail::text_of(height.size()) + " pixels under " + std::to_string(relief.lights) +
                       " lights, values " + std::string(detail::word_of(relief.coding)) + "; rule " +
                       std::string(detail::word_of(relief.rule));
    if (relief.rule == LightRule::lobe) text += " with a gloss of roughness " + number_text(relief.roughness);
    text += "\nIt leaves " + percent_text(relief.median_residual) + " of the light unexplained";
    if (std::isfinite(relief.left_out_error))
        text += "; lights that it was not shown are " + percent_text(relief.left_out_error) +
                " of what is bright off, least squares " + percent_text(relief.left_out_least_squares);
    text += ".\nIn shadow " + percent_text(relief.shadowed) + " of the values, saturated " +
            percent_text(relief.saturated) + ".\nHeights over " + number_text(range_of(height)) +
            " pixels; black and white of height.png are " + number_text(scale) +
            " pixels apart, 32768 is the mean.\n";
    text += "read and fit " + seconds_text(seconds.read + seconds.fit) + ", integrate " +
            seconds_text(seconds.integrate) + ", write " + seconds_text(seconds.write) + ", total " +
            seconds_text(seconds.total) + "\n";
    return text;
}

void report(const ReliefArguments& options, const ReliefFiles& files, const Relief& relief,
            const Image& height, double scale, double white, const std::optional<LightPolynomial>& polynomial,
            const Device& device, const ReliefSeconds& seconds) {
    if (!options.json) {
        std::string text = relief_text(options, files, relief, height, scale, seconds);
        if (polynomial)
            text +=
                "wrote " + files.relight.front().string() +
                " and its pictures, for viewers of relightable pictures: " + percent_text(polynomial->error) +
                " of white off (root mean square)\n";
        emit_result(text);
        return;
    }
    Json object;
    object["normals"] = files.normals.string();
    object["height"] = files.height.string();
    object["height_pixels"] = files.height_pixels.string();
    object["albedo"] = files.albedo.string();
    object["side_file"] = files.side.string();
    if (options.maps) {
        object["residual_map"] = files.residual.string();
        object["left_out_map"] = files.left_out.string();
    }
    if (polynomial) {
        object["exports"] = Json::array();
        for (const fs::path& file : files.relight) object["exports"].push_back(file.string());
    }
    object["size"] = size_json(height.size());
    object.update(relief_json(options, relief, white));
    if (polynomial) object.update(relight_json(*polynomial));
    object["range"] = number(range_of(height));
    object["scale"] = number(scale);
    object["periodic"] = options.periodic;
    object["device"] = device.info().name;
    object["seconds"]["read"] = seconds.read;
    object["seconds"]["fit"] = seconds.fit;
    object["seconds"]["integrate"] = seconds.integrate;
    object["seconds"]["write"] = seconds.write;
    object["seconds"]["total"] = seconds.total;
    emit_json(object);
}

void run_fit(ReliefArguments options) {
    const Stopwatch total;
    preload_picture_formats();
    const LightSet lights = read_light_set(options.lights, options.reading);
    options.relief.mask = options.mask;
    ReadOptions reading;
    reading.crop = options.relief.crop;
    reading.keep_values = true;
    const Picture front = read_picture(lights.lights.front().picture, reading);
    const ReliefFiles files = plan(options, lights, front);
    for (const std::string& remark : lights.remarks) warn(remark);
    Device device(options.device);
    ReliefSeconds seconds;
    const Stopwatch fitting;
    Relief relief;
    std::optional<Progress> bar(std::in_place);
    {
        const StagesShown reads(*bar, 0.0, 1.0, "", {{"read", 0.0, 0.4}});
        options.relief.progress = [&](std::string_view stage, double share) {
            if (stage == "rule") seconds.read = fitting.seconds();
            if (stage != "read") bar->show(0.4 + 0.4 * share, stage);
        };
        relief = fit_relief(device, lights, options.relief, options.maps);
    }
    seconds.fit = fitting.seconds() - seconds.read;
    for (const std::string& remark : relief.remarks) warn(remark);

    const Stopwatch integrating;
    bar->show(0.8, "integrate");
    IntegrationOptions how;
    how.edges = options.periodic ? SurfaceEdges::periodic : SurfaceEdges::mirror;
    how.flattening = options.flattening;
    how.measured = true;
    const Image height = integrate(device, slopes_of_normals(relief.normals).slopes, how);
    seconds.integrate = integrating.seconds();

    const Stopwatch writing;
    bar->show(0.9, "write");
    const double scale = encoded_height_scale(height), white = albedo_scale(relief, files.albedo);
    write_maps(options, files, relief, height, scale, white);
    Json side = conventions_json(height, scale, how.edges);
    side["normals"] = std::string(detail::word_of(options.convention));
    side["flatten"] = std::string(detail::word_of(options.flattening));
    side.update(relief_json(options, relief, white));
    if (options.pixel_size) side["pixel_size_mm"] = *options.pixel_size;
    std::optional<LightPolynomial> polynomial;
    bar.reset();
    if (options.relight) {
        polynomial = write_relight(device, options, files, lights, relief);
        for (const std::string& remark : polynomial->remarks) warn(remark);
        side.update(relight_json(*polynomial));
    }
    write_side_file(files.side, side);
    seconds.write = writing.seconds();
    seconds.total = total.seconds();
    report(options, files, relief, height, scale, white, polynomial, device, seconds);
}

/// "ranks:35:85", in percent, or as parts of 1.
void parse_rule(const std::string& text, ReliefOptions& options) {
    const auto refuse = [&] {
        throw CLI::ValidationError(
            "--robust",
            "'" + text + "' is none of auto, ls, ranks:A:B (0 to 100, A below B), " + "huber, amb, lobe");
    };
    const std::size_t colon = text.find(':');
    const auto rule = detail::find_value<LightRule>(text.substr(0, colon));
    if (!rule || (colon != std::string::npos && *rule != LightRule::ranks)) refuse();
    options.rule = *rule;
    if (colon == std::string::npos) return;
    const std::size_t second = text.find(':', colon + 1);
    if (second == std::string::npos) refuse();
    const auto low = parse_number(text.substr(colon + 1, second - colon - 1), 0, 100),
               high = parse_number(text.substr(second + 1), 0, 100);
    if (!low || !high || *low >= *high) refuse();
    options.low = static_cast<double>(*low) / 100.0;
    options.high = static_cast<double>(*high) / 100.0;
}

/// "gamma:2.2".
void parse_coding(const std::string& text, ReliefOptions& options) {
    const std::size_t colon = text.find(':');
    const auto coding = detail::find_value<LightCoding>(text.substr(0, colon));
    bool good = coding.has_value() && (colon == std::string::npos) == (*coding != LightCoding::gamma);
    if (good && colon != std::string::npos) {
        const std::string number = text.substr(colon + 1);
        std::size_t used = 0;
        try {
            options.gamma = std::stod(number, &used);
        } catch (const std::exception&) {
            used = 0;
        }
        good = used > 0 && used == number.size() && options.gamma > 0.0 && std::isfinite(options.gamma);
    }
    if (!good)
        throw CLI::ValidationError("--coding", "'" + text + "' is none of auto, linear, srgb, gamma:X");
    options.coding = *coding;
}

void add_light_options(CLI::App& command, ReliefArguments& options) {
    const std::string group = "Lights";
    command
        .add_option_function<std::string>(
            "--coding", [&options](const std::string& text) { parse_coding(text, options.relief); },
            "what numbers of the pictures mean; auto: linear or sRGB, by what least squares leave (default: "
            "auto)")
        ->type_name("auto|linear|srgb|gamma:X")
        ->group(group);
    command
        .add_option("--mask", options.mask,
                    "picture that is above half of white where the surface is (default: mask.png of a "
                    "DiLiGenT folder)")
        ->type_name("IMAGE")
        ->group(group);
    command.add_flag("--no-mask", options.relief.ignore_mask, "all of the pictures, mask or not")
        ->group(group);
    command
        .add_flag("--leave-out-behind", options.reading.leave_out_behind,
                  "leave out lights whose z is not above 0, which else are errors")
        ->group(group);
}

}  // namespace

void add_relief_fit(CLI::App& parent, Action& action) {
    CLI::App* command =
        parent.add_subcommand("fit", "find normals, albedo and height from pictures under many lights");
    const auto options = std::make_shared<ReliefArguments>();
    command
        ->add_option(
            "LIGHTS", options->lights,
            "a .lp file, a folder with one or with a table of directions, one as DiLiGenT has them, or a "
            "BTF in folders, whose view from above is taken")
        ->required()
        ->type_name("");
    command
        ->add_option("-o,--output", options->output,
                     "folder for normal.png, height.png, height.exr, albedo and relief.json")
        ->required()
        ->type_name("FOLDER");
    command
        ->add_option_function<std::string>(
            "--robust", [options](const std::string& text) { parse_rule(text, options->relief); },
            "how normals follow from values: least squares, those of middling ranks (in percent), Huber's "
            "weights, with "
            "light from all around, with gloss; auto: as tells lights best that were left out (default: "
            "auto)")
        ->type_name("auto|ls|ranks:A:B|huber|amb|lobe");
    add_positive(*command, "--roughness", options->relief.roughness,
                 "lobe: how broad the gloss is, at most 1 (default: .3, .5 or .8, by lights left out)");
    command->add_flag("--periodic", options->periodic, "the sample tiles, and so does the height");
    add_choice(*command, "--flatten", options->flattening,
               "take nothing out of the height, the plane that fits best, or also waves longer than the "
               "shorter side "
               "(default: plane)");
    add_choice(*command, "--convention", options->convention,
               "where green of the normal map points (default: opengl, up)");
    command->add_flag(
        "--maps", options->maps,
        "also residual.exr and left-out.exr: the share of light that is not explained, of all lights and "
        "of those left out");
    command
        ->add_option_function<std::string>(
            "--export",
            [options](const std::string& text) {
                if (text != "relight")
                    throw CLI::ValidationError("--export", "'" + text + "' is not relight");
                options->relight = true;
            },
            "also a folder relight/ for the web viewers of relightable pictures Relight and OpenLIME: values "
            "of "
            "each pixel as a polynomial of the light")
        ->type_name("relight");
    add_positive(*command, "--pixel-size", options->pixel_size,
                 "how large a pixel is, in millimetres, where sizes are told")
        ->type_name("MM");
    add_crop(*command, "--crop", options->relief.crop, "this rectangle of the pictures only");
    add_light_options(*command, *options);
    add_device(*command, options->device);
    add_overwrite(*command, options->overwrite);
    add_json(*command, options->json);
    set_guide(
        *command,
        {.usual = {{"btfield relief fit stack/dirs.lp -o relief/"}},
         .more = {{"btfield relief fit stack/ -o relief/ --robust ranks:35:85 --coding srgb"},
                  {"btfield relief fit stack/dirs.lp -o relief/ --maps --crop 0,0,24,24"},
                  {"btfield relief fit stack/dirs.lp -o relief/ --export relight",
                   "and relief/relight/info.json, for a web page"}},
         .notes = {
             "Directions to lights are x right, y up, z to the viewer.",
             "A surface that shines like a mirror, or steps that hide from many lights, have no normals "
             "by this way: --maps shows where."}});
    command->callback([options, &action] {
        const LightRule rule = options->relief.rule;
        if (options->relief.roughness && rule != LightRule::lobe && rule != LightRule::automatic)
            throw UsageError("--roughness: the rule " + std::string(detail::word_of(rule)) +
                             " knows no gloss; leave it out, or take --robust lobe");
        action = [options] { run_fit(*options); };
    });
}

}  // namespace btfield::cli

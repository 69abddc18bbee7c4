#include <cmath>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "btfield/error.hpp"
#include "btfield/height.hpp"
#include "btfield/image_io.hpp"
#include "host/base/file_output.hpp"
#include "host/base/text.hpp"
#include "host/cli/command.hpp"
#include "host/cli/command_text.hpp"
#include "host/cli/material_files.hpp"
#include "host/cli/options.hpp"
#include "host/cli/picture_options.hpp"
#include "host/cli/relief_fit.hpp"
#include "host/cli/relief_render.hpp"
#include "host/cli/relief_report.hpp"
#include "host/cli/report.hpp"
#include "host/cli/run_files.hpp"
#include "host/relief/relief_names.hpp"

namespace btfield::cli {
namespace {

namespace fs = std::filesystem;

struct IntegrateArguments {
    std::string normals, output, coarse, device;
    NormalConvention convention = NormalConvention::opengl;
    bool periodic = false, overwrite = false, json = false;
    Flattening flattening = Flattening::none;
    std::optional<double> wavelength, coarse_scale;
    ReadOptions reading;
};

/// The coarse height in pixels, and how far apart its black and white are.
std::pair<CoarseHeight, double> coarse_height(const IntegrateArguments& options, const Image& slopes,
                                              SurfaceEdges edges) {
    ReadOptions reading;
    reading.crop = options.reading.crop;
    reading.keep_values = true;
    Picture picture = read_told(options.coarse, reading);
    const Image& map = picture.image;
    if (map.planes() != 1)
        throw InputError("take '" + options.coarse + "' as a height",
                         "it has " + detail::counted(map.planes(), "plane"), "give a grey picture");
    double scale = options.coarse_scale.value_or(1.0);
    if (!options.coarse_scale && !is_hdr(picture)) {
        scale = height_scale(slopes, map, edges);
        if (!(scale > 0.0))
            throw InputError("scale '" + options.coarse + "' by the normals",
                             "its slopes are not theirs: the best factor is " + number_text(scale),
                             "give its scale, or the right height and convention");
    }
    CoarseHeight coarse{std::move(picture.image), options.wavelength.value_or(64.0)};
    for (float& value : coarse.height.values()) value *= static_cast<float>(scale);
    return {std::move(coarse), scale};
}

void check_integrate(const IntegrateArguments& options) {
    if (options.coarse.empty() && (options.wavelength || options.coarse_scale))
        throw UsageError("--coarse-from and --coarse-scale go with --coarse");
    const bool pixels = holds_pixels("--output", options.output);
    RunFiles files(options.overwrite, options.json);
    files.reads(options.normals, "that is the normal map");
    if (!options.coarse.empty()) files.reads(options.coarse, "that is the coarse height");
    files.writes(options.output);
    const PixelType type = pixels ? PixelType::float32 : PixelType::uint16;
    check_writable(options.output, 1, type, type);
    files.writes_text(side_file(options.output));
    detail::check_output(side_file(options.output), "write '" + side_file(options.output).string() + "'");
}

std::string integrate_text(const IntegrateArguments& options, const Image& height, double scale) {
    const bool pixels = holds_pixels("--output", options.output);
    std::string text = "wrote " + options.output + " and " + side_file(options.output).filename().string() +
                       ": " + detail::text_of(height.size()) + " pixels, heights over " +
                       number_text(range_of(height)) + " pixels\n";
    text += pixels ? "Values are heights in pixels; the mean is 0.\n"
                   : "Black and white are " + number_text(scale) +
                         " pixels apart, 32768 is the mean: in Blender, Midlevel 0.5 and this Scale, in "
                         "pixels.\n";
    if (options.periodic) text += "Opposite edges continue each other: it tiles.\n";
    return text;
}

void run_integrate(const IntegrateArguments& options) {
    const Stopwatch total;
    check_integrate(options);
    preload_picture_formats();
    ReadOptions reading = options.reading;
    reading.keep_values = true;
    const Picture picture = read_told(options.normals, reading);
    warn_of_no_normals(options.normals, picture);
    const Image normals = decode_normals(picture, options.convention);
    const SlopeField field = slopes_of_normals(normals);
    IntegrationOptions how;
    how.edges = options.periodic ? SurfaceEdges::periodic : SurfaceEdges::mirror;
    how.flattening = options.flattening;
    std::optional<double> coarse_scale;
    if (!options.coarse.empty()) {
        auto [coarse, scale] = coarse_height(options, field.slopes, how.edges);
        how.coarse = std::move(coarse);
        coarse_scale = scale;
    }
    const double read = total.seconds();
    Device device(options.device);
    const Stopwatch watch;
    const Image height = integrate(device, field.slopes, how);
    const double integration = watch.seconds();
    const Stopwatch writing;
    const double scale = encoded_height_scale(height);
    write_height(options.output, height, scale);
    Json side = conventions_json(height, scale, how.edges);
    side["normals"] = fs::path(options.normals).filename().string();
    write_side_file(side_file(options.output), side);

    if (field.cut > 0)
        warn(detail::counted(field.cut, "normal") +
             " lie in the plane or point away from the viewer and count as slopes of 86 degrees");
    if (!options.json) {
        emit_result(integrate_text(options, height, scale));
        return;
    }
    Json object;
    object["height"] = options.output;
    object["side_file"] = side_file(options.output).string();
    object["size"] = size_json(height.size());
    object["range"] = number(range_of(height));
    object["scale"] = number(scale);
    object["periodic"] = options.periodic;
    if (coarse_scale) object["coarse_scale"] = number(*coarse_scale);
    object["device"] = device.info().name;
    object["seconds"]["read"] = read;
    object["seconds"]["integrate"] = integration;
    object["seconds"]["write"] = writing.seconds();
    object["seconds"]["total"] = total.seconds();
    emit_json(object);
}

void add_integrate(CLI::App& parent, Action& action) {
    CLI::App* command = parent.add_subcommand("integrate", "turn a normal map into a height map");
    const auto options = std::make_shared<IntegrateArguments>();
    command->add_option("NORMALS", options->normals, "normal map in tangent space")
        ->required()
        ->type_name("");
    command
        ->add_option("-o,--output", options->output,
                     "height map: PNG has 16 bits about the mean, EXR and TIFF have pixels; NAME.json beside "
                     "it tells the scale")
        ->required()
        ->type_name("IMAGE");
    command->add_flag("--periodic", options->periodic,
                      "the normal map tiles, and so does the height (default: mirrored at its edges)");
    add_choice(*command, "--convention", options->convention,
               "where green of a normal map points: up or down (default: opengl, up)");
    add_choice(*command, "--flatten", options->flattening,
               "take out nothing, the plane that fits best, or also waves longer than the shorter side "
               "(default: none)");
    add_crop(*command, "--crop", options->reading.crop, "this rectangle of the pictures only");
    const std::string coarse = "Coarse height";
    command
        ->add_option("--coarse", options->coarse,
                     "height map of the same size that is right in the large, where normals are not")
        ->type_name("IMAGE")
        ->group(coarse);
    add_positive(*command, "--coarse-from", options->wavelength,
                 "waves longer than this many pixels are its own (default: 64)")
        ->group(coarse);
    add_positive(*command, "--coarse-scale", options->coarse_scale,
                 "pixels between its black and white (default: found from the normals; of floats 1)")
        ->group(coarse);
    add_reading(*command, options->reading);
    add_device(*command, options->device);
    add_overwrite(*command, options->overwrite);
    add_json(*command, options->json);
    set_guide(*command,
              {.usual = {{"btfield relief integrate normal.png -o height.png"},
                         {"btfield relief integrate normal.png -o height.exr --periodic",
                          "of a map that tiles, in pixels"}},
               .more = {{"btfield relief integrate normal.png -o h.png --coarse displacement.png"}},
               .notes = {"x is right, y up, z to the viewer. The slopes of the height, as central "
                         "differences, are those of the normals as nearly as a height can have them."}});
    command->callback([options, &action] { action = [options] { run_integrate(*options); }; });
}

}  // namespace

void add_relief(CLI::App& app, Action& action) {
    CLI::App* command = app.add_subcommand("relief", "normals, height and albedo of a surface");
    command->require_subcommand(1);
    set_guide(*command, {.usual = {{"btfield relief fit stack/dirs.lp -o relief/"},
                                   {"btfield relief integrate normal.png -o height.png --periodic"}}});
    add_relief_fit(*command, action);
    add_integrate(*command, action);
    add_relief_render(*command, action);
    for (CLI::App* each : command->get_subcommands({})) each->fallthrough();
}

}  // namespace btfield::cli

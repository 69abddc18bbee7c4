#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "btfield/ceilings.hpp"
#include "btfield/compound.hpp"
#include "btfield/image_io.hpp"
#include "btfield/theory.hpp"
#include "host/base/text.hpp"
#include "host/cli/command.hpp"
#include "host/cli/command_text.hpp"
#include "host/cli/output_names.hpp"
#include "host/cli/profile_text.hpp"
#include "host/cli/report.hpp"
#include "host/cli/run_files.hpp"
#include "host/cli/synth_growing.hpp"
#include "host/cli/synth_job.hpp"
#include "host/relief/relief_names.hpp"
#include "host/synthesis/synthesis_names.hpp"

namespace btfield::cli {
namespace {

namespace fs = std::filesystem;

/// Why the edges of a texture do not meet, and which sides would.
std::string tiling_text(const SynthJob& job, SynthesisMethod method) {
    if (job.offset)
        return "Window at " + std::to_string(job.offset->column) + ", " + std::to_string(job.offset->row) +
               " of a plane without end that repeats after " + detail::text_of(job.plane) + ".";
    if (job.tileable) return "Opposite edges continue each other: it tiles.";
    if (method == SynthesisMethod::raster)
        return "It does not tile: a raster recursion has borders (--method torus has none).";
    if (job.lattice == job.size)
        return "It does not tile: the control field's edges do not continue each other.";
    std::string text = "It does not tile: ";
    text += detail::text_of(job.size) + " is cut out of " + detail::text_of(job.lattice);
    text += ", which would tile";
    const TextureModel* model = std::get_if<TextureModel>(&job.model);
    if (model == nullptr)  // regions of an edited model may differ in their number of levels
        for (const CompoundRegion& region : std::get<CompoundModel>(job.model).regions)
            if (model == nullptr || region.residual.levels.size() > model->levels.size())
                model = &region.residual;
    if (model->levels.size() > 1) {
        text += " (sides that tile are multiples of " + std::to_string(model->factor) + "^" +
                std::to_string(model->levels.size() - 1) + ")";
    }
    return text + ".";
}

/// A word about textures that are narrow against the reach of a model's correlations: frequencies of so few
/// rows or columns fall on the spectrum's peaks or beside them (theory 14.3).
std::optional<std::string> narrowness(const SynthJob& job, SynthesisMethod method) {
    const auto* const model = std::get_if<TextureModel>(&job.model);
    if (model == nullptr || method == SynthesisMethod::raster || !is_valid(*model)) return std::nullopt;
    constexpr double tolerated = 0.1;
    constexpr int wide_enough = 256;
    const int shorter = std::min(job.plane.height, job.plane.width);
    const int longer = std::min(std::max(job.plane.height, job.plane.width), wide_enough);
    const auto strip = [&](int side) {
        return job.plane.height < job.plane.width ? Size{side, longer} : Size{longer, side};
    };
    if (shorter >= wide_enough / 2 || 2 * shorter > longer) return std::nullopt;
    const std::vector<double> wanted = theoretical_deviation(*model, {wide_enough, wide_enough});
    const auto error = [&](int side) {
        const std::vector<double> found = theoretical_deviation(*model, strip(side));
        double worst = 0.0;
        for (std::size_t p = 0; p < wanted.size(); ++p)
            if (wanted[p] > 0.0) {
                const double off = found[p] / wanted[p] - 1.0;
                if (std::abs(off) > std::abs(worst)) worst = off;
            }
        return worst;
    };
    const double own = error(shorter);
    if (std::abs(own) <= tolerated) return std::nullopt;
    int right = shorter;
    while (right < wide_enough && std::abs(error(right)) > tolerated) right *= 2;
    return "'" + job.file + "': textures of " + detail::text_of(job.plane) + " pixels have about " +
           number_text(1.0 + own) +
           " times the contrast of large ones: the shorter side is narrow against the "
           "reach of the model's correlations; from about " +
           std::to_string(right) + " pixels on it is right: grow that and cut it";
}

Json job_json(const SynthJob& job, const Device& device) {
    Json outputs = Json::array();
    for (const fs::path& output : job.outputs) outputs.push_back(output.string());
    Json seconds;
    seconds["setup"] = job.setup;
    seconds["per_texture"] = job.synthesis / static_cast<double>(job.seeds.size());
    seconds["write"] = job.write;
    seconds["total"] = job.total;
    Json object;
    object["outputs"] = std::move(outputs);
    if (!job.exports.empty()) {
        Json exports = Json::array();
        for (const fs::path& file : job.exports) exports.push_back(file.string());
        object["exports"] = std::move(exports);
    }
    object["size"] = size_json(job.size);
    object["seeds"] = job.seeds;
    if (job.offset) {
        object["offset"] = Json::array({job.offset->row, job.offset->column});
        object["period"] = size_json(job.plane);
    }
    object["tileable"] = job.tileable;
    object["clamped_pixels"] = job.clamped_pixels;
    object["device"] = device.info().name;
    if (!job.shares.empty()) {
        Json each = Json::array();
        for (const double sum : job.shares) each.push_back(sum / static_cast<double>(job.seeds.size()));
        object["shares"] = std::move(each);
    }
    object["textures_per_second"] = job.rate;
    object["seconds"] = std::move(seconds);
    return object;
}

std::string job_text(const SynthJob& job, SynthesisMethod method, const Device& device) {
    const std::size_t count = job.seeds.size();
    std::string text = "wrote " + job.outputs.front().string();
    if (job.material)
        text += " to " + job.outputs.back().filename().string() + ", " +
                detail::counted(job.outputs.size(), "map");
    else if (count > 1)
        text += " to " + job.outputs.back().filename().string() + ", " + detail::counted(count, "texture");
    for (std::size_t i = 0; i < job.exports.size() / count; ++i)
        text += ", " + job.exports[i].filename().string();
    text += ": " + detail::text_of(job.size) + " pixels, " + detail::counted(planes_of(job), "plane") +
            ", seed " + std::to_string(job.seeds.front());
    if (count > 1) text += " to " + std::to_string(job.seeds.back());
    text += ", on " + device.info().name + "\n" + tiling_text(job, method) + "\n";
    if (job.clamped_pixels > 0) {
        const bool hdr = lower_extension(job.outputs.front()) == ".hdr";
        const double all = static_cast<double>(area(job.size)) * static_cast<double>(count);
        text += detail::counted(job.clamped_pixels, "pixel") + " (" +
                number_text(100.0 * static_cast<double>(job.clamped_pixels) / all) + " %) had values " +
                (hdr ? "below 0" : "outside of [0, 1]") + " and were clamped; EXR and float TIFF keep them\n";
    }
    text += "set-up " + seconds_text(job.setup) + ", " +
            seconds_text(job.synthesis / static_cast<double>(count)) + " per texture, write " +
            seconds_text(job.write) + ", total " + seconds_text(job.total) +
            (count > 1 ? "; " + number_text(job.rate) + " textures per second" : "") + "\n";
    return text;
}

void report_profile(Device& device) {
    const std::vector<ProfileEntry> profile = device.take_profile();
    std::fputs(profile_text(profile, measure_ceilings(device)).c_str(), stderr);
}

void run(const SynthArguments& options) {
    const Stopwatch total;
    const std::uint64_t last = static_cast<std::uint64_t>(options.count.value_or(1) - 1);
    if (options.seed > std::numeric_limits<std::uint64_t>::max() - last) {
        throw UsageError("--seed: the seed of the last texture is beyond 18446744073709551615");
    }
    std::vector<SynthJob> jobs = plan(options);
    // While the device opens.
    for (const SynthJob& job : jobs)
        for (const fs::path& output : job.outputs) preload_picture_formats(output);

    const Stopwatch setup;
    DeviceOptions device_options;
    device_options.profile = options.profile;
    Device device(options.device, device_options);
    jobs.front().setup = setup.seconds();
    jobs.front().total = total.seconds();
    {
        Progress bar;
        const double share = 1.0 / static_cast<double>(jobs.size());
        for (std::size_t i = 0; i < jobs.size(); ++i)
            about(options, jobs[i].file,
                  [&] { grow(device, options, jobs[i], bar, share * static_cast<double>(i), share); });
    }
    Json objects = Json::array();
    std::string text;
    for (const SynthJob& job : jobs) {
        if (!std::visit([](const auto& model) { return is_valid(model); }, job.model))
            warn("'" + job.file + "' is not certified; its textures may be far from the picture");
        if (const auto remark = narrowness(job, options.synthesis.method)) warn(*remark);
        job.remarks.tell();
        objects.push_back(job_json(job, device));
        text += job_text(job, options.synthesis.method, device);
    }
    if (options.profile) report_profile(device);
    emit_results(options.json, objects, "syntheses", text);
}

}  // namespace

void add_synth(CLI::App& app, Action& action) {
    CLI::App* command = app.add_subcommand("synth", "grow new texture from a model");
    const auto options = std::make_shared<SynthArguments>();
    take_dash(command->add_option("MODEL", options->models, "model file; - is standard input")
                  ->required()
                  ->type_name(""),
              "/dev/stdin");
    command
        ->add_option(
            "-o,--output", options->output,
            "picture; its extension says the format: png, jpg, tif, exr, hdr, ppm; a folder takes "
            "NAME.png of every model, NAME.exr where floats were analysed, NAME.tif where PNG has no "
            "room for the planes; of a material it is the folder of its maps")
        ->required()
        ->type_name("IMAGE");
    add_size(*command, "--size", options->size,
             "width and height in pixels (default: as the analysed picture)");
    add_offset(
        *command, "--offset", options->offset,
        "the window at this place of a plane without end: windows of one seed and period continue each "
        "other");
    add_size(*command, "--period", options->period,
             "after how many pixels that plane repeats, at least (default: --size)");
    add_uint64(*command, "--seed", options->seed, "which texture (default: 0)");
    add_int(*command, "--count", options->count, 1, 1000000,
            "this many textures, of seeds N, N + 1, ...; a zero-padded number goes before the extension");
    add_shard(
        *command, [options](Shard shard) { options->shard = shard; },
        "only part I of the N of that batch, with the names and seeds that it has there");
    const std::string synthesis = "Synthesis";
    add_choice(
        *command, "--method", options->synthesis.method,
        "solve in frequency, or run car models pixel after pixel, which does not tile (default: torus)")
        ->group(synthesis);
    add_choice(
        *command, "--noise-domain", options->synthesis.noise_domain,
        "where the white noise is drawn: spatial costs one more transform, or none of ma models with small "
        "supports; raster is always spatial (default: frequency)")
        ->group(synthesis);
    command
        ->add_flag("--allow-invalid", options->synthesis.allow_invalid,
                   "synthesise although the model's certificate fails")
        ->group(synthesis);
    command
        ->add_flag("--profile", options->profile,
                   "print the time of every kernel to standard error, and how near it came to what the "
                   "device can do")
        ->group(synthesis);
    add_choice(*command, "--convention", options->normals,
               "of materials: which way green points in the normal map, up or down (default: as it was read)")
        ->group(synthesis);
    add_exports(*command, options->exports);
    const std::string compound = "Compound models";
    command
        ->add_option(
            "--control", options->control,
            "grow on this control field: a picture whose values are labels, or whose colours are those "
            "of --save-labels")
        ->type_name("LABELS")
        ->group(compound);
    command
        ->add_option("--save-labels", options->labels_output,
                     "write the control field too, a PNG with a palette; numbered as textures are")
        ->type_name("LABELS")
        ->group(compound);
    add_writing(*command, options->writing, true);
    add_compression(*command, options->writing);
    add_device(*command, options->device);
    add_overwrite(*command, options->overwrite);
    add_json(*command, options->json);
    set_guide(
        *command,
        {.usual = {{"btfield synth cork.json -o cork-4x.png --size 1024x1024"},
                   {"btfield synth cork.json -o variant.png --count 16", "variant-00.png to variant-15.png"}},
         .more = {{"btfield synth cork.json -o variant.png --count 16 --shard 2/4",
                   "variant-04.png to variant-07.png"},
                  {"btfield synth models/*.json -o textures/"},
                  {"btfield synth bark.json -o bark/ --size 2048", "all maps of 'btfield fit --joint'"},
                  {"btfield synth bark.json -o bark/ --export blender,gltf --pixel-size 0.5",
                   "and bark.py, which builds the material in Blender, and bark.gltf"},
                  {"btfield synth bark.btfm -o bark.png --save-labels labels.png"},
                  {"btfield synth bark.btfm -o painted.png --control labels.png"},
                  {"btfield synth cork.json -o part.png --size 512 --offset 1536,0 --period 4096",
                   "the fourth window of a row of eight"},
                  {"btfield synth cork.json -o raster.png --method raster"},
                  {"btfield synth cork.json -o cork.exr --type float", "linear light, as EXR has it"},
                  {"btfield synth cork.json -o cork.exr --device gpu --profile"}}});
    command->callback([command, options, &action] {
        if (options->synthesis.method == SynthesisMethod::raster &&
            options->synthesis.noise_domain == NoiseDomain::frequency && command->count("--noise-domain") > 0)
            throw UsageError(
                "--noise-domain: noise of a raster recursion is drawn in space; leave it out, or "
                "take --method torus");
        action = [options] { run(*options); };
    });
}

}  // namespace btfield::cli

#include <algorithm>
#include <filesystem>
#include <limits>
#include <memory>
#include <optional>
#include <span>

#include "btfield/image_io.hpp"
#include "btfield/model_file.hpp"
#include "btfield/synthesis.hpp"
#include "host/cli/command.hpp"
#include "host/cli/options.hpp"
#include "host/cli/report.hpp"

namespace btfield::cli {
namespace {

namespace fs = std::filesystem;

struct Options {
    std::string model, output, device;
    std::optional<Size> size;
    std::uint64_t seed = 0;
    std::optional<int> count;
    SynthesisOptions synthesis;
    bool profile = false, json = false;
};

struct Result {
    std::vector<fs::path> outputs;
    std::vector<std::uint64_t> seeds;
    std::uintmax_t clamped_pixels = 0;
    double setup = 0.0, synthesis = 0.0, write = 0.0, total = 0.0;
};

/// "out.png" becomes "out-07.png" for texture 7 of 12: names sort as the seeds do.
fs::path numbered(const fs::path& path, int index, int count) {
    const std::string digits = std::to_string(index);
    const std::size_t width = std::to_string(count - 1).size();
    fs::path name = path.stem();
    name += "-" + std::string(width - digits.size(), '0') + digits;
    name += path.extension();
    return path.parent_path() / name;
}

Result plan(const Options& options, const TextureModel& model) {
    Result result;
    const int count = options.count.value_or(1);
    for (int i = 0; i < count; ++i) {
        result.outputs.push_back(options.count ? numbered(options.output, i, count)
                                               : fs::path(options.output));
        result.seeds.push_back(options.seed + static_cast<std::uint64_t>(i));
        check_writable(result.outputs.back(), model.planes, model.provenance.type);
    }
    return result;
}

void synthesise(Synthesiser& synthesiser, PixelType type, Result& result) {
    Progress bar;
    const std::size_t count = result.seeds.size();
    const auto batch = static_cast<std::size_t>(std::max(1, synthesiser.batch()));
    for (std::size_t start = 0; start < count; start += batch) {
        const std::size_t n = std::min(batch, count - start);
        bar.show(static_cast<double>(start) / static_cast<double>(count),
                 "texture " + std::to_string(start + 1) + " of " + std::to_string(count));
        const Stopwatch synthesis;
        const std::vector<Image> textures =
            synthesiser.synthesise(std::span<const std::uint64_t>(result.seeds).subspan(start, n));
        result.synthesis += synthesis.seconds();
        const Stopwatch writing;
        for (std::size_t i = 0; i < n; ++i) {
            result.clamped_pixels +=
                write_picture(result.outputs[start + i], textures[i], type).clamped_pixels;
        }
        result.write += writing.seconds();
    }
}

/// Why the edges of a texture do not meet, and which sides would.
std::string tiling_text(const Synthesiser& synthesiser, const TextureModel& model) {
    if (synthesiser.tileable()) return "Opposite edges continue each other: it tiles.";
    const Size lattice = synthesiser.lattice();
    std::string text = "It does not tile: ";
    text += size_text(synthesiser.size()) + " is cut out of " + size_text(lattice);
    text += ", which would tile";
    if (model.levels.size() > 1) {
        text += " (sides that tile are multiples of " + std::to_string(model.factor) + "^" +
                std::to_string(model.levels.size() - 1) + ")";
    }
    return text + ".";
}

void report_json(const Result& result, const Synthesiser& synthesiser, const Device& device) {
    Json outputs = Json::array();
    for (const fs::path& output : result.outputs) outputs.push_back(output.string());
    Json seconds;
    seconds["setup"] = result.setup;
    seconds["per_texture"] = result.synthesis / static_cast<double>(result.seeds.size());
    seconds["write"] = result.write;
    seconds["total"] = result.total;
    Json object;
    object["outputs"] = std::move(outputs);
    object["size"] = size_json(synthesiser.size());
    object["seeds"] = result.seeds;
    object["tileable"] = synthesiser.tileable();
    object["clamped_pixels"] = result.clamped_pixels;
    object["device"] = device.info().name;
    object["seconds"] = std::move(seconds);
    emit_json(object);
}

void report_text(const Result& result, const Synthesiser& synthesiser, const TextureModel& model,
                 const Device& device) {
    const std::size_t count = result.outputs.size();
    std::string text = "wrote " + result.outputs.front().string();
    if (count > 1)
        text +=
            " to " + result.outputs.back().filename().string() + ", " + std::to_string(count) + " textures";
    text += ": " + size_text(synthesiser.size()) + " pixels, " + std::to_string(model.planes) +
            (model.planes == 1 ? " plane" : " planes") + ", seed " + std::to_string(result.seeds.front());
    if (count > 1) text += " to " + std::to_string(result.seeds.back());
    text += ", on " + device.info().name + "\n" + tiling_text(synthesiser, model) + "\n";
    if (result.clamped_pixels > 0) {
        const double all = static_cast<double>(area(synthesiser.size())) * static_cast<double>(count);
        text += std::to_string(result.clamped_pixels) + " pixels (" +
                number_text(100.0 * static_cast<double>(result.clamped_pixels) / all) +
                " %) had values outside of [0, 1] and were clamped; EXR and float TIFF keep them\n";
    }
    text += "set-up " + seconds_text(result.setup) + ", " +
            seconds_text(result.synthesis / static_cast<double>(count)) + " per texture, write " +
            seconds_text(result.write) + ", total " + seconds_text(result.total) + "\n";
    emit_text(text);
}

void report_profile(const std::vector<ProfileEntry>& profile) {
    double all = 0.0;
    for (const ProfileEntry& entry : profile) all += entry.seconds;
    std::vector<std::vector<std::string>> rows{{"kernel", "launches", "milliseconds", "%"}};
    for (const ProfileEntry& entry : profile) {
        rows.push_back({entry.kernel, std::to_string(entry.launches), number_text(1e3 * entry.seconds),
                        number_text(100.0 * entry.seconds / all)});
    }
    std::fputs(table(rows, "lr").c_str(), stderr);
}

void run(const Options& options) {
    const Stopwatch total;
    const std::uint64_t last = static_cast<std::uint64_t>(options.count.value_or(1) - 1);
    if (options.seed > std::numeric_limits<std::uint64_t>::max() - last) {
        throw UsageError("--seed: the seed of the last texture is beyond 18446744073709551615");
    }
    const TextureModel model = read_model(options.model);
    Result result = plan(options, model);
    preload_picture_formats();  // while the device opens

    const Stopwatch setup;
    DeviceOptions device_options;
    device_options.profile = options.profile;
    Device device(options.device, device_options);
    Synthesiser synthesiser(device, model, options.size.value_or(model.size), options.synthesis);
    result.setup = setup.seconds();

    synthesise(synthesiser, model.provenance.type, result);
    result.total = total.seconds();
    if (!is_valid(model))
        warn("'" + options.model + "' is not certified; its textures may be far from the picture");
    if (options.profile) report_profile(device.take_profile());
    if (options.json) {
        report_json(result, synthesiser, device);
    } else {
        report_text(result, synthesiser, model, device);
    }
}

}  // namespace

void add_synth(CLI::App& app, Action& action) {
    CLI::App* command = app.add_subcommand("synth", "grow new texture from a model");
    const auto options = std::make_shared<Options>();
    command->add_option("MODEL", options->model, "model file")->required()->type_name("");
    command
        ->add_option("-o,--output", options->output,
                     "picture; its extension says the format: png, jpg, tif, exr, hdr, ppm")
        ->required()
        ->type_name("IMAGE");
    add_size(*command, "--size", options->size,
             "width and height in pixels (default: as the analysed picture)");
    add_uint64(*command, "--seed", options->seed, "which texture (default: 0)");
    add_int(*command, "--count", options->count, 1, 1000000,
            "this many textures, of seeds N, N + 1, ...; a zero-padded number goes before the extension");
    add_choice<NoiseDomain>(
        *command, "--noise-domain", options->synthesis.noise_domain,
        {{"frequency", NoiseDomain::frequency}, {"spatial", NoiseDomain::spatial}},
        "where the white noise is drawn; spatial costs one more transform (default: frequency)");
    command->add_flag("--allow-invalid", options->synthesis.allow_invalid,
                      "synthesise although the model's certificate fails");
    command->add_flag("--profile", options->profile, "print the time of every kernel to standard error");
    add_device(*command, options->device);
    add_json(*command, options->json);
    command->footer(
        "Examples:\n"
        "  btfield synth cork.json -o cork-4x.png --size 2048x2048\n"
        "  btfield synth cork.json -o variant.png --count 16 --seed 100     writes variant-00.png to "
        "variant-15.png\n"
        "  btfield synth cork.btfm -o cork.exr --device gpu --profile");
    command->callback([options, &action] { action = [options] { run(*options); }; });
}

}  // namespace btfield::cli

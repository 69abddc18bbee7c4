#include "btfield/memd.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "btfield/error.hpp"
#include "btfield/image_io.hpp"
#include "host/base/text.hpp"
#include "host/cli/command.hpp"
#include "host/cli/command_text.hpp"
#include "host/cli/error_map.hpp"
#include "host/cli/options.hpp"
#include "host/cli/picture_options.hpp"
#include "host/cli/report.hpp"
#include "host/cli/run_files.hpp"
#include "host/criteria/metric_names.hpp"

namespace btfield::cli {
namespace {

struct MemdArguments {
    std::string a, b, map, device;
    Metric metric = Metric::max;
    std::optional<double> white;
    ReadOptions reading;
    WritingArguments writing;
    bool both = false, overwrite = false;
    bool json = false;
};

Json value_json(const Memd& result) {
    Json object;
    object["memd"] = number(result.memd);
    object["memd_star"] = number(result.memd_star);
    return object;
}

void report_json(const MemdArguments& options, const MemdOptions& used, int planes, const Memd& forward,
                 const std::optional<Memd>& back, const std::string& device, const Stopwatch& total) {
    Json object = value_json(forward);
    object["metric"] = name(options.metric);
    object["largest"] = number(memd_max(options.metric, planes));
    object["pixels"] = Json::array({forward.pixels[0], forward.pixels[1]});
    object["white"] = Json::array({number(used.white[0]), number(used.white[1])});
    if (back) object["reverse"] = value_json(*back);
    if (!options.map.empty()) object["map"] = options.map;
    object["device"] = device;
    Json seconds;
    seconds["search"] = forward.search_seconds + (back ? back->search_seconds : 0.0);
    seconds["total"] = total.seconds();
    object["seconds"] = std::move(seconds);
    emit_json(object);
}

/// \param largest  that the metric can have
std::string value_text(const std::string& what, const Memd& result, double largest) {
    return what + " = " + number_text(result.memd) + " of " + number_text(largest) + " units, MEMD* " +
           number_text(result.memd_star) + " %\n";
}

void report_text(const MemdArguments& options, const MemdOptions& used, bool hdr, int planes,
                 const Memd& forward, const std::optional<Memd>& back) {
    const double largest = memd_max(options.metric, planes);
    std::string text = value_text("MEMD(A, B)", forward, largest);
    if (back) text += value_text("MEMD(B, A)", *back, largest);
    text += "metric " + std::string(name(options.metric)) + ", " +
            detail::counted(forward.pixels[0], "pixel") + " of A, " + std::to_string(forward.pixels[1]) +
            " of B, searched in " +
            seconds_text(forward.search_seconds + (back ? back->search_seconds : 0.0)) + "\n";
    if (hdr)
        text += "white level " + number_text(used.white[0]) + " in A, " + number_text(used.white[1]) +
                " in B" + (options.white ? "" : " (--white sets that of pictures with float values)") + "\n";
    emit_text(text);
}

void run(const MemdArguments& options) {
    const Stopwatch total;
    if (options.map.empty() && options.writing.type)
        throw UsageError("--type is of the file that --map names, and there is none");
    if (!options.map.empty()) {
        RunFiles files(options.overwrite, options.json);
        files.reads(options.a);
        files.reads(options.b);
        files.writes(options.map);
        check_error_map(options.map, options.writing.type);
    }
    const Picture a = read_told(options.a, options.reading), b = read_told(options.b, options.reading);
    if (!options.map.empty()) check_error_map(options.map, options.writing.type, a.image.size());
    warn_of_unlike_spaces(options.a, a.image, options.b, b.image);
    MemdOptions used;
    used.metric = options.metric;
    used.white = {white_level(a, options.white), white_level(b, options.white)};
    used.local_errors = !options.map.empty();
    Device device(options.device);
    const Memd forward = memd(device, a.image, b.image, used);
    std::optional<Memd> back;
    if (options.both) {
        MemdOptions turned = used;
        std::swap(turned.white[0], turned.white[1]);
        turned.local_errors = false;
        back = memd(device, b.image, a.image, turned);
    }
    if (!options.map.empty())
        write_error_map(options.map, a.image.size(), forward.local_errors, options.writing.type);
    if (options.json) {
        report_json(options, used, a.image.planes(), forward, back, device.info().name, total);
    } else {
        report_text(options, used, is_hdr(a) || is_hdr(b), a.image.planes(), forward, back);
    }
}

}  // namespace

void add_memd(CLI::App& app, Action& action) {
    CLI::App* command =
        app.add_subcommand("memd", "mean exhaustive minimum distance of the colours of two pictures");
    const auto options = std::make_shared<MemdArguments>();
    command->add_option("A", options->a, "reference picture, scanned in raster order")
        ->required()
        ->type_name("");
    command->add_option("B", options->b, "picture whose pixels are taken; its size may differ")
        ->required()
        ->type_name("");
    add_choice(
        *command, "--metric", options->metric,
        "distance of two colours, of d planes at most 255 (max), 255 d (l1) or 255 √d (l2), white being 255; "
        "MEMD* is the percentage of that (default: max)");
    add_white(*command, options->white);
    command->add_flag("--both", options->both, "also with A and B exchanged: the measure is not symmetric");
    command
        ->add_option(
            "--map", options->map,
            "write the local errors of A's pixels: EXR or TIFF as float units, -1 where B ran out of "
            "pixels; PNG in false colours, magenta where it did")
        ->type_name("FILE");
    add_reading(*command, options->reading);
    add_writing(*command, options->writing, false);
    add_device(*command, options->device);
    add_overwrite(*command, options->overwrite);
    add_json(*command, options->json);
    set_guide(*command,
              {.usual = {{"btfield memd cork.png cork-4x.png"}},
               .more = {{"btfield memd cork.png cork-4x.png --both"},
                        {"btfield memd material.exr grown.exr --white 12.5 --metric l2 --map errors.png"}}});
    command->callback([options, &action] { action = [options] { run(*options); }; });
}

}  // namespace btfield::cli

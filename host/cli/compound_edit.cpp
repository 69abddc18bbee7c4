#include "host/cli/compound_edit.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <system_error>
#include <variant>
#include <vector>

#include "btfield/compound.hpp"
#include "btfield/error.hpp"
#include "host/cli/command_text.hpp"
#include "host/cli/compound_report.hpp"
#include "host/cli/model_report.hpp"
#include "host/cli/options.hpp"
#include "host/cli/report.hpp"
#include "host/cli/run_files.hpp"

namespace btfield::cli {
namespace {

namespace fs = std::filesystem;

struct CompoundEditArguments {
    std::string model, output, from;
    std::optional<int> region;
    std::vector<double> colour;
    std::optional<double> contrast;
    bool overwrite = false, json = false;
};

/// "0.2,0.5,0.1", or "#336619".
std::vector<double> parse_colour(const std::string& text) {
    const auto refuse = [&] {
        throw CLI::ValidationError("--colour",
                                   "'" + text +
                                       "' is neither numbers with commas between them, as 0.2,0.5,0.1, "
                                       "nor six digits, as #336619");
    };
    std::vector<double> colour;
    if (text.front() == '#') {
        if (text.size() != 7) refuse();
        for (std::size_t at = 1; at < 7; at += 2) {
            int value = 0;
            if (text[at] == '-') refuse();
            const auto [stop, error] = std::from_chars(text.data() + at, text.data() + at + 2, value, 16);
            if (error != std::errc{} || stop != text.data() + at + 2) refuse();
            colour.push_back(value / 255.0);
        }
        return colour;
    }
    const char *at = text.data(), *const end = text.data() + text.size();
    for (;;) {
        double value = 0.0;
        const auto [stop, error] = std::from_chars(at, end, value);
        if (error != std::errc{} || !std::isfinite(value) || (stop != end && *stop != ',')) refuse();
        colour.push_back(value);
        if (stop == end) return colour;
        at = stop + 1;
    }
}

/// OTHER:J, or OTHER alone for a model without regions.
void take_from(CompoundModel& model, int region, const std::string& from, RunFiles& files) {
    const std::size_t colon = from.rfind(':');
    std::error_code error;
    const bool plain = fs::exists(from, error) || colon == std::string::npos;
    const std::string file = plain ? from : from.substr(0, colon);
    const std::variant<TextureModel, CompoundModel> other = read_any_model(file);
    std::visit([&](const auto& read) { files.reads_model(file, read.provenance); }, other);
    if (const auto* whole = std::get_if<TextureModel>(&other)) {
        if (!plain)
            throw InputError("take region " + from.substr(colon + 1) + " from '" + file + "'",
                             "that model has no regions", "give the file alone: all of it is taken");
        transplant(model, region, *whole);
        return;
    }
    if (plain)
        throw InputError("take a region from '" + from + "'", "it does not say which of the model's regions",
                         "append it: '" + from + ":0' is the first");
    const auto& regions = std::get<CompoundModel>(other);
    const auto number = parse_number(from.substr(colon + 1), 0, most_regions - 1);
    if (!number)
        throw UsageError("--from: '" + from.substr(colon + 1) + "' is no number of a region; '" + file +
                         "' has 0 to " + std::to_string(regions.regions.size() - 1));
    transplant(model, region, regions, static_cast<int>(*number));
}

void check_units(const CompoundModel& model, const std::vector<double>& colour) {
    const PixelType type = model.provenance.type;
    if (type == PixelType::half || type == PixelType::float32) return;
    if (std::ranges::all_of(colour, [](double v) { return v >= 0.0 && v <= 1.0; })) return;
    throw InputError("give a region this colour", "values of this picture are from 0 to 1",
                     "divide values of 8 bits by 255, or give them as #rrggbb");
}

void run_edit(const CompoundEditArguments& options) {
    if (!options.region && !(options.from.empty() && options.colour.empty()))
        throw UsageError("--from and --colour need --region");
    if (options.from.empty() && options.colour.empty() && !options.contrast)
        throw UsageError("nothing to edit: give --from, --colour or --contrast");
    CompoundModel model = read_compound(options.model);
    RunFiles files(options.overwrite, options.json);
    files.reads_model(options.model, model.provenance);
    if (!options.from.empty()) take_from(model, *options.region, options.from, files);
    files.writes_model(options.output);
    if (!options.colour.empty()) {
        check_units(model, options.colour);
        recolour(model, *options.region, options.colour);
        model.provenance.limits.clear();  // they were those of the picture's colours
    }
    if (options.contrast) {
        const int regions = static_cast<int>(model.regions.size());
        for (int k = options.region.value_or(0); k < (options.region ? *options.region + 1 : regions); ++k)
            scale_contrast(model, k, *options.contrast);
    }
    write_compound(options.output, model);
    const std::uintmax_t bytes = model_file_bytes(options.output);
    if (options.json)
        emit_json(compound_json(model, options.output, bytes));
    else
        emit_result(compound_text(model, bytes) + "wrote " + options.output + "\n");
}

}  // namespace

void add_compound_edit(CLI::App& parent, Action& action) {
    CLI::App* command = parent.add_subcommand("edit", "change regions of a compound model");
    const auto options = std::make_shared<CompoundEditArguments>();
    take_dash(command->add_option("MODEL", options->model, "compound model; - is standard input")
                  ->required()
                  ->type_name(""),
              "/dev/stdin");
    take_dash(command->add_option("-o,--output", options->output, "edited model; - is standard output")
                  ->required()
                  ->type_name("MODEL"),
              "/dev/stdout");
    add_int(*command, "--region", options->region, 0, most_regions - 1,
            "region to change, as info numbers them (default with --contrast: all)");
    command
        ->add_option("--from", options->from,
                     "take colour, contrast and model of region J of another compound model, or a model "
                     "without regions whole")
        ->type_name("OTHER:J");
    command
        ->add_option_function<std::string>(
            "--colour", [options](const std::string& text) { options->colour = parse_colour(text); },
            "mean colour, in values of the picture or as #rrggbb")
        ->type_name("R,G,B");
    add_positive(*command, "--contrast", options->contrast, "multiply deviations from the mean colour");
    add_overwrite(*command, options->overwrite);
    add_json(*command, options->json);
    set_guide(*command,
              {.usual = {{"btfield compound edit bark.btfm -o red.btfm --region 0 --colour .6,.2,.1"},
                         {"btfield compound edit bark.btfm -o flat.btfm --contrast 0.5"}},
               .more = {{"btfield compound edit bark.btfm -o mossy.btfm --region 0 --from moss.btfm:2"},
                        {"btfield compound edit bark.btfm -o moss.btfm --region 0 --from moss.json",
                         "all of a model without regions"}}});
    command->callback([options, &action] { action = [options] { run_edit(*options); }; });
}

}  // namespace btfield::cli

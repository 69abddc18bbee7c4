#include "btfield/compound.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <filesystem>
#include <map>
#include <memory>
#include <set>
#include <system_error>
#include <variant>
#include <vector>

#include "btfield/error.hpp"
#include "btfield/image_io.hpp"
#include "btfield/material.hpp"
#include "host/base/text.hpp"
#include "host/cli/command.hpp"
#include "host/cli/command_text.hpp"
#include "host/cli/compound_edit.hpp"
#include "host/cli/compound_report.hpp"
#include "host/cli/fit_verdict.hpp"
#include "host/cli/idle_options.hpp"
#include "host/cli/material_files.hpp"
#include "host/cli/model_report.hpp"
#include "host/cli/modelled_picture.hpp"
#include "host/cli/options.hpp"
#include "host/cli/output_names.hpp"
#include "host/cli/picture_options.hpp"
#include "host/cli/report.hpp"
#include "host/cli/run_files.hpp"
#include "host/compound/compound_names.hpp"
#include "host/fit/fit_names.hpp"
#include "host/model/model_names.hpp"

namespace btfield::cli {
namespace {

namespace fs = std::filesystem;

struct CompoundFitArguments {
    std::vector<std::string> pictures;
    std::string output, labels, labels_output, device;
    ReadOptions reading;
    JointArguments maps;
    CompoundOptions compound;
    Flattening flattening = Flattening::none;
    const CLI::Option* averages = nullptr;
    std::array<const CLI::Option*, 2> decrement{};  ///< of random decrement alone
    bool overwrite = false, json = false;
};

struct CompoundJob {
    fs::path picture, output;
    CompoundModel model;
    std::string verdict;
    double read = 0.0, analysis = 0.0, fit = 0.0, scoring = 0.0, total = 0.0;
};

std::vector<CompoundJob> plan_fits(const CompoundFitArguments& options) {
    refuse_folders(options.pictures);
    check_joint(options.maps, options.pictures.size());
    const bool several = options.pictures.size() > 1 && !options.maps.joint;
    if (several && !(options.labels.empty() && options.labels_output.empty()))
        throw UsageError("--labels and --save-labels go with one picture");
    RunFiles files(options.overwrite, options.json);
    if (!options.labels.empty()) files.reads(options.labels);
    for (const std::string& picture : options.pictures) files.reads(picture, "that is the picture");
    check_labels_output(options.labels_output);
    if (!options.labels_output.empty()) files.writes(options.labels_output);
    const bool folder = is_output_folder("--output", options.output, several ? "several pictures" : "",
                                         several ? remedy_for_one_model(options.pictures) : "");
    std::vector<CompoundJob> jobs;
    std::set<fs::path> outputs;
    for (const fs::path picture : options.pictures) {
        CompoundJob job;
        job.picture = picture;
        job.output = folder ? options.output / picture.stem().concat(".json") : fs::path(options.output);
        if (!outputs.insert(job.output).second)
            throw UsageError("two pictures would have the model '" + job.output.string() + "'");
        files.writes_model(job.output);
        jobs.push_back(std::move(job));
        if (options.maps.joint) break;  // one model of all
    }
    return jobs;
}

/// A palette with as many entries as there may be regions: labels are read by value.
std::vector<PaletteColour> any_labels() {
    std::vector<PaletteColour> colours;
    for (int k = 0; k < most_regions; ++k) {
        const auto value = static_cast<std::uint8_t>(k);
        colours.push_back({value, value, value});
    }
    return colours;
}

/// The colours of a picture from dark to bright; none where there are more than regions may be.
std::vector<PaletteColour> colours_of(const std::string& file) {
    const Image image = read_picture(file).image;
    if (image.planes() != 3) return {};
    std::map<int, std::set<PaletteColour>> by_brightness;
    std::set<PaletteColour> seen;
    for (std::size_t n = 0; n < area(image.size()) && seen.size() <= most_regions; ++n) {
        PaletteColour colour{};
        for (std::size_t p = 0; p < 3; ++p)
            colour[p] = static_cast<std::uint8_t>(std::lround(255.0F * image.plane(static_cast<int>(p))[n]));
        if (seen.insert(colour).second) by_brightness[colour[0] + colour[1] + colour[2]].insert(colour);
    }
    if (seen.size() > most_regions) return {};
    std::vector<PaletteColour> colours;
    for (const auto& [brightness, alike] : by_brightness)
        colours.insert(colours.end(), alike.begin(), alike.end());
    return colours;
}

/// By value, or, of colours without a palette, a region to each colour.
ControlField labels_of(const std::string& file) {
    ControlField field;
    try {
        field = read_labels(file, any_labels());
    } catch (const InputError&) {
        if (read_picture(file).image.planes() != 3) throw;
        const std::vector<PaletteColour> colours = colours_of(file);
        if (colours.empty())
            throw InputError("read the labels '" + file + "'",
                             "it has more than " + detail::counted(most_regions, "colour"),
                             "give a picture of the regions, a colour or a number to each, with hard edges");
        field = read_labels(file, colours);
    }
    field.regions = 1 + *std::max_element(field.labels.begin(), field.labels.end());
    return field;
}

void fit_one(Device& device, const CompoundFitArguments& options, CompoundJob& job, Progress& bar,
             double done, double share) {
    const Stopwatch reading;
    bar.show(done, "read " + job.picture.filename().string());
    JointPicture input;
    if (options.maps.joint) {
        input = read_joint(device, options.pictures, options.maps, options.reading);
    } else {
        input.picture = read_told(job.picture, options.reading);
        input.provenance = provenance_of(job.picture, input.picture);
    }
    const std::string flat = flatten_light(job.picture.string(), input.picture.image, options.flattening);
    job.read = reading.seconds();
    CompoundOptions compound = options.compound;
    if (!options.labels.empty()) compound.labels = labels_of(options.labels);
    const std::string name = job.picture.filename().string();
    compound.progress = [&](std::string_view stage, double seconds) {
        (stage == "regions" ? job.fit : job.analysis) += seconds;
    };
    const StagesShown stages(
        bar, done, share, name + ": ",
        {{"control field", 0.0, 0.1}, {"conditional mean", 0.1, 0.25}, {"regions", 0.25, 0.9}});
    job.model = fit_compound(device, input.picture.image, compound);
    bar.show(done + 0.9 * share, name + ": score");
    input.provenance.reasons = std::move(job.model.provenance.reasons);
    if (!flat.empty()) input.provenance.reasons.push_back(flat);
    job.model.provenance = std::move(input.provenance);
    std::vector<MaterialMap>& maps = job.model.provenance.maps;
    const auto grown = [&](Size size) { return CompoundSynthesiser(device, job.model, size).synthesise(0); };
    const bool valid = is_valid(job.model);
    if (options.maps.joint && valid)
        match_relief(device, maps, input.picture.image, grown(input.picture.image.size()));
    if (!options.json && valid) {
        const Stopwatch scoring;
        job.verdict = verdict_text(verdict_on(device, input.picture.image, job.model, grown), job.model);
        job.scoring = scoring.seconds();
    }
    job.total = reading.seconds();
}

Json fit_json(const CompoundJob& job) {
    Json object = compound_json(job.model, job.output, model_file_bytes(job.output));
    object["reasons"] = job.model.provenance.reasons;
    object["seconds"]["read"] = job.read;
    object["seconds"]["analysis"] = job.analysis;
    object["seconds"]["fit"] = job.fit;
    object["seconds"]["total"] = job.total;
    return object;
}

/// Deviation of the regions' colours where they have these shares, over that of the picture's.
double contrast_between(const CompoundModel& model, const std::vector<double>& shares_there) {
    double there = 0.0, picture = 0.0;
    for (std::size_t p = 0; p < static_cast<std::size_t>(model.planes); ++p) {
        std::array<double, 2> sum{}, squares{};
        for (std::size_t k = 0; k < model.regions.size(); ++k) {
            const double colour = model.regions[k].colour[p];
            const std::array<double, 2> share{shares_there[k], model.regions[k].share};
            for (std::size_t n = 0; n < share.size(); ++n) {
                sum[n] += share[n] * colour;
                squares[n] += share[n] * colour * colour;
            }
        }
        there += squares[0] - sum[0] * sum[0];
        picture += squares[1] - sum[1] * sum[1];
    }
    return picture > 0.0 ? std::sqrt(std::max(0.0, there) / picture) : 1.0;
}

/// First what people want to know, then the figures.
std::string fit_text(const CompoundJob& job) {
    return "wrote " + job.output.string() + " (read " + seconds_text(job.read) + ", analysis " +
           seconds_text(job.analysis) + ", fit " + seconds_text(job.fit) +
           (job.verdict.empty() ? "" : ", score " + seconds_text(job.scoring)) + ", total " +
           seconds_text(job.total) + ")\n" + job.verdict + (job.verdict.empty() ? "" : "\n") +
           compound_text(job.model, model_file_bytes(job.output));
}

/// A tile that is too small to hold the picture's regions in their proportions makes textures flat.
void tell_of_tile(const CompoundJob& job) {
    if (!job.model.periodic) return;
    const std::vector<double> kept = shares(job.model.control);
    const auto missing = static_cast<std::size_t>(std::ranges::count(kept, 0.0));
    const double contrast = contrast_between(job.model, kept);
    constexpr double least = 0.85;
    if (missing == 0 && contrast >= least) return;
    warn("'" + job.output.string() + "': the tile of " + detail::text_of(job.model.control.size) + " has " +
         (missing > 0 ? std::to_string(kept.size() - missing) + " of " +
                            detail::counted(kept.size(), "region") + " and "
                      : "") +
         number_text(std::round(100.0 * contrast)) +
         " % of the contrast between them, and so have textures; give a larger --tile, or none: then all of "
         "the control field is kept");
}

void run_fit(const CompoundFitArguments& options) {
    const Stopwatch watch;
    std::vector<CompoundJob> jobs = plan_fits(options);
    hint_at_joint(options.maps, options.pictures);
    // While the device opens.
    for (const auto& picture : options.pictures) preload_picture_formats(picture, PictureUse::read);
    Device device(options.device);
    const double opening = watch.seconds();
    {
        Progress bar;
        const double share = 1.0 / static_cast<double>(jobs.size());
        for (std::size_t i = 0; i < jobs.size(); ++i)
            fit_one(device, options, jobs[i], bar, share * static_cast<double>(i), share);
    }
    jobs.front().total += opening;
    Json objects = Json::array();
    std::string text;
    for (CompoundJob& job : jobs) {
        const Stopwatch writing;
        write_compound(job.output, job.model);
        if (!options.labels_output.empty()) {
            const ControlField& field = job.model.control;
            write_labels(options.labels_output, field, palette(job.model));
        }
        job.total += writing.seconds();
        tell_of_tile(job);
        if (!is_valid(job.model))
            warn("'" + job.output.string() + "' is not certified at " + uncertified_regions(job.model) +
                 ", and synth will refuse it; use --local 3d-ma, another --order, or synth --allow-invalid");
        objects.push_back(fit_json(job));
        text += fit_text(job);
    }
    emit_results(options.json, objects, "fits", text);
}

void add_regions(CLI::App& command, ClusterOptions& clusters) {
    const auto read = [&clusters](const std::string& text) {
        if (text == "auto") {
            clusters.regions.reset();
            return;
        }
        const auto number = parse_number(text, 1, most_regions);
        if (!number)
            throw CLI::ValidationError("--regions", "'" + text + "' is neither a whole number from 1 to " +
                                                        std::to_string(most_regions) + " nor auto");
        clusters.regions = static_cast<int>(*number);
    };
    command
        .add_option_function<std::string>("--regions", read,
                                          "regions of the control field; auto: as many as differ and have "
                                          "pixels enough, 12 at most (default: auto)")
        ->type_name("K|auto");
}

void add_control_options(CLI::App& command, CompoundFitArguments& options) {
    const std::string group = "Control field";
    add_choice(command, "--cluster-on", options.compound.clusters.space,
               "values that are clustered (default: auto, lab for colour pictures)")
        ->group(group);
    add_uint64(command, "--seed", options.compound.clusters.seed,
               "of the clusters' first centres (default: 0)")
        ->group(group);
    command
        .add_option(
            "--labels", options.labels,
            "the control field instead, of the picture's size: values from 0 on, or colours, darkest first")
        ->type_name("LABELS")
        ->group(group);
    command
        .add_option("--save-labels", options.labels_output,
                    "write the model's control field, a PNG with a palette")
        ->type_name("LABELS")
        ->group(group);
    add_size(command, "--tile", options.compound.tile,
             "keep a tile of the control field, for a smaller file (default: all of it)")
        ->group(group);
}

void add_local_options(CLI::App& command, CompoundFitArguments& options) {
    const std::string group = "Regional models";
    CompoundOptions& compound = options.compound;
    FitOptions& local = compound.local;
    add_choice(command, "--local", local.model, "random field of the regions (default: 3d-ma)")->group(group);
    add_int(command, "--order", local.order, 1, max_order, "order of its neighbourhood (default: 5)")
        ->group(group);
    add_int(command, "--levels", local.levels, 1, 30, "pyramid levels (default: 3, fewer of small pictures)")
        ->group(group);
    add_int(command, "--factor", local.factor, 2, 1024, "pyramid reduction factor (default: 2)")
        ->group(group);
    add_choice(command, "--estimator", local.estimator,
               "least squares, exact maximum likelihood, or the first where it is valid (default: auto)")
        ->group(group);
    add_choice(command, "--noise", local.noise, "form of the noise covariance (default: full)")->group(group);
    add_choice(command, "--gains", local.gains,
               "give the levels of each region the picture's proportions (default: match)")
        ->group(group);
    add_choice(command, "--marginals", local.marginals,
               "keep the regions' histograms, or model values as they are (default: match)")
        ->group(group);
    options.averages =
        add_choice(command, "--averages", compound.averages,
                   "ma: root of the region's spectrum, or P1's random decrement (default: sr, but rd with "
                   "one of the two below)")
            ->group(group);
    options.decrement[0] =
        add_positive(command, "--threshold", local.moving_average.threshold,
                     "rd: pixels this many standard deviations above the mean are significant (default: 0.5)")
            ->group(group);
    options.decrement[1] =
        add_choice(command, "--significance", local.moving_average.rule,
                   "rd: they need a neighbour below in both directions (p4) or in any (p1) (default: p4)")
            ->group(group);
}

/// What the options of moving averages say together: significant pixels are random decrement's.
void settle_averages(CompoundFitArguments& options) {
    if (options.averages->count() > 0) return;
    for (const CLI::Option* const option : options.decrement)
        if (option->count() > 0) options.compound.averages = AveragesEstimator::random_decrement;
}

void add_compound_fit(CLI::App& parent, Action& action) {
    CLI::App* command = parent.add_subcommand("fit", "fit a compound model to a picture");
    const auto options = std::make_shared<CompoundFitArguments>();
    command->add_option("IMAGE", options->pictures, "picture: PNG, JPEG, TIFF, EXR, HDR, PNM, WebP or HEIC")
        ->required()
        ->type_name("");
    take_dash(command
                  ->add_option("-o,--output", options->output,
                               "model file: JSON, or CBOR when the name ends in .btfm; - is standard output; "
                               "a folder takes NAME.json of every picture")
                  ->required()
                  ->type_name("MODEL"),
              "/dev/stdout");
    add_regions(*command, options->compound.clusters);
    add_choice(*command, "--borders", options->compound.borders,
               "what regional models describe: deviations from the conditional mean, or from regional means, "
               "with pixels swapped along borders or not (default: conditional)");
    add_control_options(*command, *options);
    add_local_options(*command, *options);
    add_crop(*command, "--crop", options->reading.crop, "fit this rectangle of the picture only");
    add_flattening(*command, options->flattening);
    add_reading(*command, options->reading);
    add_joint(*command, options->maps);
    add_device(*command, options->device);
    add_overwrite(*command, options->overwrite);
    add_json(*command, options->json);
    set_guide(*command,
              {.usual = {{"btfield compound fit bark.png -o bark.btfm"},
                         {"btfield synth bark.btfm -o bark-4x.png --size 1024x1024"}},
               .more = {{"btfield compound fit bark.png -o b5.btfm --regions 5 --save-labels b5.png"},
                        {"btfield compound fit bark.png -o own.json --labels b5.png"},
                        {"btfield compound fit bark.png -o p1.json --regions 5 --borders swap",
                         "P1's borders; docs/compound.md has all of its form"}}});
    command->callback([command, options, &action] {
        settle_averages(*options);
        refuse_idle_options(*command, options->compound, !options->labels.empty());
        action = [options] { run_fit(*options); };
    });
}

}  // namespace

void add_compound(CLI::App& app, Action& action) {
    CLI::App* command =
        app.add_subcommand("compound", "models with regions: a control field and a model to each region");
    command->require_subcommand(1);
    add_compound_fit(*command, action);
    add_compound_edit(*command, action);
    for (CLI::App* part : command->get_subcommands({})) part->fallthrough();
    set_guide(*command,
              {.usual = {{"btfield compound fit bark.png -o bark.btfm"},
                         {"btfield synth bark.btfm -o bark-4x.png --size 1024x1024"},
                         {"btfield compound edit bark.btfm -o red.btfm --region 0 --colour .6,.2,.1"}},
               .notes = {"'btfield compound COMMAND --help' shows the options of a command."}});
}

}  // namespace btfield::cli

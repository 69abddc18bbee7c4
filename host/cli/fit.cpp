#include "btfield/fit.hpp"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <filesystem>
#include <memory>
#include <set>
#include <span>

#include "btfield/error.hpp"
#include "btfield/image_io.hpp"
#include "btfield/material.hpp"
#include "btfield/model_file.hpp"
#include "btfield/synthesis.hpp"
#include "host/cli/command.hpp"
#include "host/cli/command_text.hpp"
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
#include "host/cli/selection_options.hpp"
#include "host/fit/fit_names.hpp"
#include "host/model/model_names.hpp"

namespace btfield::cli {
namespace {

namespace fs = std::filesystem;

struct FitArguments {
    std::vector<std::string> pictures;
    std::string output, all, device;
    ReadOptions reading;
    JointArguments maps;
    FitOptions fit;
    Flattening flattening = Flattening::none;
    bool overwrite = false, json = false;
};

struct FitJob {
    fs::path picture, output;
    ModelKind kind = ModelKind::car3d;
    TextureModel model;
    std::string verdict;
    double read = 0.0, analysis = 0.0, fit = 0.0, scoring = 0.0, total = 0.0;
};

std::string quoted(const fs::path& path) {
    return "'" + path.string() + "'";
}

/// One model per picture: OUTPUT itself, or, where that is a folder, STEM.json inside. With --all ten, as
/// STEM-MODEL.json. Jobs of a picture follow one another.
std::vector<FitJob> plan(const FitArguments& options) {
    refuse_folders(options.pictures);
    const bool all = !options.all.empty();
    if (all == !options.output.empty()) {
        throw UsageError(all ? "--output and --all: give one of the two" : "--output or --all is needed");
    }
    if (all && options.fit.choose_model) throw UsageError("--model auto: --all fits every model");
    check_joint(options.maps, options.pictures.size());
    const bool several = options.pictures.size() > 1 && !options.maps.joint;
    const fs::path target = all ? options.all : options.output;
    const bool folder = is_output_folder(all ? "--all" : "--output", target.string(),
                                         all       ? "ten models"
                                         : several ? "several pictures"
                                                   : "",
                                         several ? remedy_for_one_model(options.pictures) : "");
    const std::vector<ModelKind> one{options.fit.model};
    const std::span<const ModelKind> kinds = all ? model_kinds() : std::span<const ModelKind>(one);
    std::vector<FitJob> jobs;
    RunFiles files(options.overwrite, options.json);
    for (const std::string& picture : options.pictures) files.reads(picture, "that is the picture");
    std::set<fs::path> outputs;
    for (const fs::path picture : options.pictures) {
        for (const ModelKind kind : kinds) {
            FitJob job;
            job.picture = picture;
            job.kind = kind;
            const std::string suffix = all ? "-" + std::string(name(kind)) + ".json" : ".json";
            job.output = folder ? target / picture.stem().concat(suffix) : target;
            if (!outputs.insert(job.output).second) {
                throw UsageError("two pictures would have the model " + quoted(job.output));
            }
            files.writes_model(job.output);
            jobs.push_back(std::move(job));
        }
        if (options.maps.joint) break;  // one model of all
    }
    return jobs;
}

/// What the chosen model loses, where that shows.
std::string structure_reason(const FitVerdict& verdict) {
    if (!verdict.loses_shapes()) return {};
    return "structure_distance " + number_text(verdict.structure_distance) +
           " from the picture to a texture of this model, above " +
           number_text(FitVerdict::noticeable_structure) +
           ": shapes are lost; btfield compound fit or btfield roll keep more of them";
}

/// As Analysis::fit_all(), with errors that name the picture.
std::vector<TextureModel> fit_all_of(const fs::path& path, Analysis& analysis,
                                     const std::vector<FitOptions>& options) {
    try {
        return analysis.fit_all(options);
    } catch (const InputError& error) {
        throw InputError(quoted(path) + ": " + error.asked(), error.found(), error.remedy());
    }
}

/// Of fits, up to where they are scored.
StagesShown stages_shown(Progress& bar, double done, double share, const std::string& picture) {
    return {bar,
            done,
            share,
            picture + ": ",
            {{"choice", 0.0, 0.75},
             {"planes", 0.0, 0.1},
             {"pyramid", 0.1, 0.15},
             {"lag covariances", 0.15, 0.35},
             {"fit", 0.35, 0.85},
             {"gains", 0.85, 0.9}}};
}

/// Fits the jobs of one picture, which is read and analysed once. What they share counts for the first.
void fit_picture(Device& device, std::span<FitJob> jobs, const FitArguments& options, Progress& bar,
                 double done, double share) {
    const Stopwatch reading;
    const fs::path& path = jobs.front().picture;
    bar.show(done, "read " + path.filename().string());
    JointPicture input;
    if (options.maps.joint) {
        input = read_joint(device, options.pictures, options.maps, options.reading);
    } else {
        input.picture = read_told(path, options.reading);
        input.provenance = provenance_of(path, input.picture);
    }
    const std::string flat = flatten_light(path.string(), input.picture.image, options.flattening);
    const Picture& picture = input.picture;
    jobs.front().read = jobs.front().total = reading.seconds();

    Analysis analysis(device, picture.image);
    std::vector<FitOptions> all;
    for (std::size_t k = 0; k < jobs.size(); ++k) {
        FitOptions& each = all.emplace_back(options.fit);
        each.model = jobs[k].kind;
        each.progress = [&, k](std::string_view stage, double seconds) {
            FitJob& job = jobs[k];
            const bool fitting = stage == "fit" || stage == "gains";
            (fitting ? job.fit : job.analysis) += seconds;
            job.total += seconds;
        };
    }
    const StagesShown stages = stages_shown(bar, done, share, path.filename().string());
    std::vector<TextureModel> models = fit_all_of(path, analysis, all);
    bar.show(done + 0.9 * share, path.filename().string() + ": score");
    for (std::size_t k = 0; k < jobs.size(); ++k) {
        const Stopwatch scoring;
        jobs[k].model = std::move(models[k]);
        std::vector<std::string> reasons = std::move(jobs[k].model.provenance.reasons);
        jobs[k].model.provenance = input.provenance;
        std::vector<MaterialMap>& maps = jobs[k].model.provenance.maps;
        const auto grown = [&](Size size) { return Synthesiser(device, jobs[k].model, size).synthesise(0); };
        // Nothing of a model that cannot be grown, and no sentences about ten models of a picture.
        const bool valid = is_valid(jobs[k].model), told = !options.json && options.all.empty();
        if (options.maps.joint && valid)
            match_relief(device, maps, picture.image, grown(picture.image.size()));
        if ((options.fit.choose_model || told) && valid) {
            const FitVerdict verdict = verdict_on(device, picture.image, jobs[k].model, grown);
            const std::string structure = structure_reason(verdict);
            if (options.fit.choose_model && !structure.empty()) reasons.push_back(structure);
            if (told) jobs[k].verdict = verdict_text(verdict, jobs[k].model, options.fit);
        }
        if (!flat.empty()) reasons.push_back(flat);
        jobs[k].model.provenance.reasons = reasons;
        jobs[k].scoring = scoring.seconds();
        jobs[k].total += jobs[k].scoring;
    }
}

Json job_json(const FitJob& job, std::uintmax_t bytes) {
    Json seconds;
    seconds["read"] = job.read;
    seconds["analysis"] = job.analysis;
    seconds["fit"] = job.fit;
    seconds["total"] = job.total;
    Json object = model_json(job.model, job.output, bytes);
    object["seconds"] = std::move(seconds);
    return object;
}

/// First what people want to know, then the figures.
std::string job_text(const FitJob& job, std::uintmax_t bytes) {
    return "wrote " + job.output.string() + " (read " + seconds_text(job.read) + ", analysis " +
           seconds_text(job.analysis) + ", fit " + seconds_text(job.fit) +
           (job.verdict.empty() ? "" : ", score " + seconds_text(job.scoring)) + ", total " +
           seconds_text(job.total) + ")\n" + job.verdict + (job.verdict.empty() ? "" : "\n") +
           model_text(job.model, bytes);
}

void run(const FitArguments& options) {
    const Stopwatch watch;
    std::vector<FitJob> jobs = plan(options);
    hint_at_joint(options.maps, options.pictures);
    // While the device opens.
    for (const auto& picture : options.pictures) preload_picture_formats(picture, PictureUse::read);
    Device device(options.device);
    const double opening = watch.seconds();
    {
        Progress bar;
        const std::size_t pictures = options.maps.joint ? 1 : options.pictures.size(),
                          each = jobs.size() / pictures;
        const double share = 1.0 / static_cast<double>(pictures);
        for (std::size_t i = 0; i < pictures; ++i) {
            fit_picture(device, std::span(jobs).subspan(i * each, each), options, bar,
                        share * static_cast<double>(i), share);
        }
    }
    jobs.front().total += opening;

    // Written when all are fitted: a picture that cannot be fitted leaves no models of the others behind.
    Json objects = Json::array();
    std::string text;
    for (FitJob& job : jobs) {
        const Stopwatch writing;
        write_model(job.output, job.model);
        job.total += writing.seconds();
        std::error_code error;
        std::uintmax_t bytes = fs::file_size(job.output, error);
        if (error) bytes = to_json(job.model).size();  // a pipe or device has no size
        if (!is_valid(job.model)) {
            warn(quoted(job.output) + " is not certified at " + uncertified_levels(job.model) +
                 ", and synth will refuse it; use --estimator auto or ml, --neighbourhood causal, "
                 "another --order, or synth --allow-invalid");
        }
        objects.push_back(job_json(job, bytes));
        text += job_text(job, bytes);
    }
    emit_results(options.json, objects, "fits", text);
}

}  // namespace

void add_fit(CLI::App& app, Action& action) {
    CLI::App* command = app.add_subcommand("fit", "fit a model to a picture");
    const auto options = std::make_shared<FitArguments>();
    FitOptions& fit = options->fit;
    command->add_option("IMAGE", options->pictures, "picture: PNG, JPEG, TIFF, EXR, HDR, PNM, WebP or HEIC")
        ->required()
        ->type_name("");
    take_dash(command
                  ->add_option("-o,--output", options->output,
                               "model file: JSON, or CBOR when the name ends in .btfm; - is standard output; "
                               "a folder takes NAME.json of every picture")
                  ->type_name("MODEL"),
              "/dev/stdout");
    command
        ->add_option("--all", options->all,
                     "instead of --output: fit all ten models, written as NAME-MODEL.json into this folder")
        ->type_name("FOLDER");
    add_selection(*command, fit);
    const std::string estimation = "Estimation", averages = "Moving averages";
    add_choice(*command, "--estimator", fit.estimator,
               "least squares, exact maximum likelihood, or the first where it is valid (default: auto)")
        ->group(estimation);
    add_choice(*command, "--noise", fit.noise, "form of the noise covariance (default: full)")
        ->group(estimation);
    add_choice(*command, "--gains", fit.gains,
               "level gains that restore the picture's covariances (default: match)")
        ->group(estimation);
    add_choice(*command, "--marginals", fit.marginals,
               "keep the picture's histograms, or model its values as they are (default: match)")
        ->group(estimation);
    add_positive(*command, "--threshold", fit.moving_average.threshold,
                 "ma: pixels this many standard deviations above the mean are significant (default: 0.5)")
        ->group(averages);
    add_choice(*command, "--significance", fit.moving_average.rule,
               "ma: they need a neighbour below in both directions (p4) or in any (p1) (default: p4)")
        ->group(averages);
    add_crop(*command, "--crop", options->reading.crop, "fit this rectangle of the picture only");
    add_flattening(*command, options->flattening);
    add_reading(*command, options->reading);
    add_joint(*command, options->maps);
    add_device(*command, options->device);
    add_overwrite(*command, options->overwrite);
    add_json(*command, options->json);
    set_guide(*command,
              {.usual = {{"btfield fit cork.png -o cork.json"},
                         {"btfield fit cork.png -o cork.json --model auto --levels auto --order auto"}},
               .more = {{"btfield fit *.png -o models/", "models/NAME.json of every picture"},
                        {"btfield fit cork.png --all models/",
                         "models/cork-2d-car.json to models/cork-3d-pmrf.json"},
                        {"btfield fit bark.tif -o bark.btfm --order 8 --levels 3 --crop 0,0,512,512"},
                        {"btfield fit sand.png -o sand.json --model 3d-msar --noise diagonal"},
                        {"btfield fit moss.png -o moss.json --neighbourhood correlated:12"},
                        {"btfield fit photo.jpg -o photo.json --flatten low", "without its uneven light"},
                        {"btfield fit bark-*.jpg -o bark.json --joint",
                         "colour, normal and height maps as one model"}}});
    command->callback([command, options, &action] {
        if (options->all.empty() && !options->fit.choose_model)
            refuse_idle_options(*command, options->fit, "--model");
        action = [options] { run(*options); };
    });
}

}  // namespace btfield::cli

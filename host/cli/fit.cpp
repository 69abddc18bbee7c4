#include "btfield/fit.hpp"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <filesystem>
#include <memory>
#include <set>

#include "btfield/error.hpp"
#include "btfield/image_io.hpp"
#include "btfield/model_file.hpp"
#include "host/cli/command.hpp"
#include "host/cli/model_report.hpp"
#include "host/cli/options.hpp"
#include "host/cli/report.hpp"

namespace btfield::cli {
namespace {

namespace fs = std::filesystem;

struct Options {
    std::vector<std::string> pictures;
    std::string output, device;
    std::optional<Crop> crop;
    FitOptions fit;
    bool json = false;
};

struct Job {
    fs::path picture, output;
    TextureModel model;
    double read = 0.0, analysis = 0.0, fit = 0.0, total = 0.0;
};

std::string quoted(const fs::path& path) {
    return "'" + path.string() + "'";
}

/// A model under a picture's name is a slip of the hand, and would replace a picture of that name.
bool is_picture_name(const fs::path& path) {
    static const std::set<std::string> extensions{".png", ".jpg", ".jpeg", ".tif", ".tiff", ".exr",
                                                  ".hdr", ".pgm", ".ppm",  ".pnm", ".bmp",  ".gif"};
    std::string extension = path.extension().string();
    for (char& c : extension) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    return extensions.count(extension) == 1;
}

/// One model per picture: OUTPUT itself, or, where that is a folder, STEM.json inside.
std::vector<Job> plan(const Options& options) {
    std::error_code error;
    const bool folder = fs::is_directory(options.output, error);
    if (options.pictures.size() > 1 && !folder) {
        throw UsageError("--output: '" + options.output + "' is no folder, as several pictures need");
    }
    std::vector<Job> jobs;
    std::set<fs::path> outputs;
    for (const fs::path picture : options.pictures) {
        Job job;
        job.picture = picture;
        job.output = folder ? options.output / picture.stem().concat(".json") : fs::path(options.output);
        if (!outputs.insert(job.output).second) {
            throw UsageError("two pictures would have the model " + quoted(job.output));
        }
        if (fs::equivalent(job.output, picture, error)) {
            throw InputError("write the model " + quoted(job.output), "that is the picture",
                             "give the model a name of its own");
        }
        if (is_picture_name(job.output)) {
            throw InputError("write the model " + quoted(job.output), "that is the name of a picture",
                             "end the name in .json or .btfm");
        }
        check_model_writable(job.output);
        jobs.push_back(std::move(job));
    }
    return jobs;
}

Provenance provenance(const fs::path& path, const Picture& picture) {
    Provenance result;
    result.source = path.filename().string();
    result.type = picture.type;
    result.picture_bytes = static_cast<std::uint64_t>(picture.image.values().size()) *
                           static_cast<std::uint64_t>(bytes_per_value(picture.type));
    result.software = "btfield " BTFIELD_VERSION;
    return result;
}

void fit_one(Device& device, Job& job, const Options& options, Progress& bar, double done, double share) {
    const Stopwatch watch;
    bar.show(done, "read " + job.picture.filename().string());
    const Picture picture = read_picture(job.picture, options.crop);
    job.read = watch.seconds();
    const bool opaque =
        std::all_of(picture.alpha.begin(), picture.alpha.end(), [](float a) { return a == 1.0F; });
    if (!opaque) warn(quoted(job.picture) + " is partly transparent, and transparency is not modelled");

    double stage_number = 0.0;
    FitOptions fit_options = options.fit;
    fit_options.progress = [&](std::string_view stage, double seconds) {
        const bool fitting = stage == "fit" || stage == "gains";
        (fitting ? job.fit : job.analysis) += seconds;
        // How many stages there will be depends on the picture: each takes a quarter of what is left.
        stage_number += 1.0;
        bar.show(done + share * (1.0 - std::pow(0.75, stage_number)),
                 job.picture.filename().string() + ": " + std::string(stage));
    };
    job.model = fit(device, picture.image, fit_options);
    job.model.provenance = provenance(job.picture, picture);
    job.total = watch.seconds();
}

Json job_json(const Job& job, std::uintmax_t bytes) {
    Json seconds;
    seconds["read"] = job.read;
    seconds["analysis"] = job.analysis;
    seconds["fit"] = job.fit;
    seconds["total"] = job.total;
    Json object = model_json(job.model, job.output, bytes);
    object["seconds"] = std::move(seconds);
    return object;
}

std::string job_text(const Job& job, std::uintmax_t bytes) {
    return model_text(job.model, bytes) + "wrote " + job.output.string() + " (read " +
           seconds_text(job.read) + ", analysis " + seconds_text(job.analysis) + ", fit " +
           seconds_text(job.fit) + ", total " + seconds_text(job.total) + ")\n";
}

void run(const Options& options) {
    const Stopwatch watch;
    std::vector<Job> jobs = plan(options);
    preload_picture_formats();  // while the device opens
    Device device(options.device);
    const double opening = watch.seconds();
    {
        Progress bar;
        const double share = 1.0 / static_cast<double>(jobs.size());
        for (std::size_t i = 0; i < jobs.size(); ++i) {
            fit_one(device, jobs[i], options, bar, share * static_cast<double>(i), share);
        }
    }
    jobs.front().total += opening;

    // Written when all are fitted: a picture that cannot be fitted leaves no models of the others behind.
    Json objects = Json::array();
    std::string text;
    for (Job& job : jobs) {
        const Stopwatch writing;
        write_model(job.output, job.model);
        job.total += writing.seconds();
        std::error_code error;
        std::uintmax_t bytes = fs::file_size(job.output, error);
        if (error) bytes = to_json(job.model).size();  // a pipe or device has no size
        if (!is_valid(job.model)) {
            warn(quoted(job.output) + " is not certified at " + uncertified_levels(job.model) +
                 ", and synth will refuse it; use --neighbourhood causal, another --order, or synth "
                 "--allow-invalid");
        }
        objects.push_back(job_json(job, bytes));
        text += job_text(job, bytes);
    }
    if (!options.json) {
        emit_text(text);
    } else if (jobs.size() == 1) {
        emit_json(objects.front());
    } else {
        Json object;
        object["fits"] = std::move(objects);
        emit_json(object);
    }
}

}  // namespace

void add_fit(CLI::App& app, Action& action) {
    CLI::App* command = app.add_subcommand("fit", "fit a model to a picture");
    const auto options = std::make_shared<Options>();
    FitOptions& fit = options->fit;
    command->add_option("IMAGE", options->pictures, "picture: PNG, JPEG, TIFF, EXR, HDR or PNM")
        ->required()
        ->type_name("");
    command
        ->add_option("-o,--output", options->output,
                     "model file: JSON, or CBOR when the name ends in .btfm; a folder takes NAME.json of "
                     "every picture")
        ->required()
        ->type_name("MODEL");
    std::vector<std::pair<std::string, ModelKind>> kinds;
    for (const ModelKind kind : model_kinds()) kinds.emplace_back(name(kind), kind);
    add_choice<ModelKind>(*command, "--model", fit.model, kinds,
                          "random field; see docs/models.md for which to choose (default: 3d-car)");
    add_int(*command, "--order", fit.order, 1, max_order, "order of the neighbourhood, 1 to 8 (default: 5)");
    add_choice<std::optional<NeighbourhoodKind>>(*command, "--neighbourhood", fit.neighbourhood,
                                                 {{"causal", NeighbourhoodKind::causal},
                                                  {"unilateral", NeighbourhoodKind::unilateral},
                                                  {"symmetric", NeighbourhoodKind::symmetric},
                                                  {"half", NeighbourhoodKind::half}},
                                                 "which offsets of the order; car takes the first two, mmrf "
                                                 "and pmrf symmetric only (default: causal for "
                                                 "car, symmetric for the others)");
    add_int(*command, "--levels", fit.levels, 1, 30, "pyramid levels; 1 is no pyramid (default: 4)");
    add_int(*command, "--factor", fit.factor, 2, 1024, "pyramid reduction factor (default: 2)");
    add_choice<EstimatorChoice>(
        *command, "--estimator", fit.estimator,
        {{"auto", EstimatorChoice::automatic},
         {"ls", EstimatorChoice::least_squares},
         {"ml", EstimatorChoice::maximum_likelihood}},
        "least squares, exact maximum likelihood, or the first where it is valid (default: auto)");
    add_choice<NoiseForm>(*command, "--noise", fit.noise,
                          {{"full", NoiseForm::full}, {"diagonal", NoiseForm::diagonal}},
                          "form of the noise covariance (default: full)");
    add_choice<GainMode>(*command, "--gains", fit.gains,
                         {{"match", GainMode::match}, {"none", GainMode::none}},
                         "level gains that restore the picture's covariances (default: match)");
    add_choice<MarginalMode>(
        *command, "--marginals", fit.marginals,
        {{"match", MarginalMode::match}, {"none", MarginalMode::none}},
        "keep the picture's histograms, or model its values as they are (default: match)");
    add_crop(*command, "--crop", options->crop, "fit this rectangle of the picture only");
    add_device(*command, options->device);
    add_json(*command, options->json);
    command->footer(
        "Examples:\n"
        "  btfield fit cork.png -o cork.json\n"
        "  btfield fit bark.tif -o bark.btfm --order 8 --levels 3 --crop 0,0,512,512\n"
        "  btfield fit sand.png -o sand.json --model 3d-msar --noise diagonal --json\n"
        "  btfield fit *.png -o models/");
    command->callback([options, &action] { action = [options] { run(*options); }; });
}

}  // namespace btfield::cli

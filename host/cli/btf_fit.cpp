#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>
#include <memory>
#include <numbers>
#include <numeric>
#include <optional>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

#include "btfield/btf_model.hpp"
#include "btfield/criteria.hpp"
#include "btfield/device.hpp"
#include "btfield/error.hpp"
#include "host/base/text.hpp"
#include "host/btf/btf_names.hpp"
#include "host/cli/btf_fit_textures.hpp"
#include "host/cli/btf_parts.hpp"
#include "host/cli/command_text.hpp"
#include "host/cli/fit_verdict.hpp"
#include "host/cli/idle_options.hpp"
#include "host/cli/model_report.hpp"
#include "host/cli/options.hpp"
#include "host/cli/picture_options.hpp"
#include "host/cli/report.hpp"
#include "host/cli/run_files.hpp"
#include "host/cli/selection_options.hpp"
#include "host/fit/fit_names.hpp"

namespace btfield::cli {
namespace {

namespace fs = std::filesystem;

struct BtfFitArguments {
    std::string set, output, height, device;
    BtfOptions reading;
    BtfMethod method = BtfMethod::joint;
    BtfFitOptions fit;
    std::optional<int> clusters, jobs;
    std::optional<Shard> shard;
    std::optional<BtfMatch> match;
    std::optional<double> height_scale;
    bool overwrite = false, json = false;
};

/// In pixels where its file has floats; else fractions, which need --height-scale.
Image read_height(const BtfFitArguments& options) {
    ReadOptions reading;
    reading.keep_values = true;
    reading.crop = options.reading.crop;
    Picture picture = read_told(options.height, reading);
    if (picture.image.planes() != 1)
        throw InputError("take '" + options.height + "' as a height",
                         "it has " + detail::counted(picture.image.planes(), "plane"), "give a grey picture");
    if (!is_hdr(picture) && !options.height_scale)
        throw InputError("take '" + options.height + "' as a height",
                         "nothing tells how many pixels black and white of it are apart",
                         "give --height-scale, or heights in pixels as EXR or TIFF of floats");
    for (float& value : picture.image.values())
        value *= static_cast<float>(options.height_scale.value_or(1.0));
    return std::move(picture.image);
}

Json errors_json(const BtfErrors& errors) {
    Json object;
    object["pixels_median"] = number(errors.median);
    object["pixels_mean"] = number(errors.mean);
    object["mean_error"] = number(errors.mean_error);
    object["std_error"] = number(errors.std_error);
    return object;
}

double relief_range(const Image& surface) {
    const auto [low, high] = std::ranges::minmax(surface.plane(0));
    return static_cast<double>(high) - static_cast<double>(low);
}

/// Above what rolls of a rock and a bark of 128 x 128 pixels have, 0.13 and 0.15: these keep more then.
constexpr double lost_structure = 0.16;
constexpr int largest_judged = 512;

/// How far patches of the grown surface are from those of the measured one (theory 15.5), seen at a slant
/// under two low lights: there shapes show. Not a number where a side is too short, or the surface cannot be
/// grown.
double structure_of(Device& device, const BtfFit& fit) {
    constexpr double unknown = std::numeric_limits<double>::quiet_NaN();
    if (!is_valid(fit.model)) return unknown;
    const Size whole = fit.model.size,
               size{std::min(whole.height, largest_judged), std::min(whole.width, largest_judged)};
    const auto radians = [](double degrees) { return degrees * std::numbers::pi / 180.0; };
    try {
        const BtfSynthesiser measured(device, fit.model, fit.surface), grown(device, fit.model, size, 0);
        double sum = 0.0;
        for (const double phi : {54.0, 234.0}) {
            const BtfDirection view{radians(30.0), radians(90.0)}, light{radians(60.0), radians(phi)};
            const Image part =
                measured.picture(view, light)
                    .crop((whole.height - size.height) / 2, (whole.width - size.width) / 2, size);
            sum += 0.5 * structure_distance(part, grown.picture(view, light));
        }
        return sum;
    } catch (const InputError&) {
        return unknown;  // the model is written: synth will say why it cannot be grown
    }
}

/// What grown surfaces keep of shapes; nothing where that is not known.
std::string structure_text(const BtfFit& fit, double structure) {
    if (!std::isfinite(structure)) return {};
    const SurfaceKind kind = fit.model.surface_kind();
    const std::string distance = "structure distance " + number_text(structure);
    if (structure <= lost_structure) return "Grown surfaces keep shapes: " + distance + ".\n";
    if (kind == SurfaceKind::roll)
        return "Grown surfaces keep shapes in part: " + distance +
               "; cuts between patches go through some.\n";
    return "Grown surfaces lose shapes: " + distance +
           ". --model roll lays the surface's own patches and keeps more, in a file that grows with the "
           "pictures' size" +
           (kind == SurfaceKind::field ? "; --model compound keeps regions.\n" : ".\n");
}

Json fit_json(const BtfFitArguments& options, const BtfFit& fit, double structure, std::uintmax_t bytes) {
    Json object;
    object["output"] = options.output;
    object["method"] = "joint";
    object["planes"] = fit.model.planes();
    object["unexplained"] = number(fit.model.unexplained);
    object["clusters"] = nullptr;
    object["pictures"] = fit.model.pairs.size();
    object["resumed"] = fit.resumed;
    object["kept_pictures"] = fit.model.tables.kept.size();
    object["table_error"] = number(fit.model.table_error);
    Json relief;
    relief["from"] = fit.model.relief;
    relief["range"] = number(relief_range(fit.surface));
    relief["scale_factor"] = number(fit.model.scale_factor);
    object["relief"] = std::move(relief);
    if (fit.score) {
        Json score = errors_json(fit.score->model);
        score["directions"] = fit.score->pairs.size();
        score["nearest"] = errors_json(fit.score->nearest);
        score["neighbours"] = errors_json(fit.score->neighbours);
        object["left_out"] = std::move(score);
    }
    object["model"] = std::string(surface_name(fit.model));
    object["structure_distance"] = number(structure);
    object["valid"] = is_valid(fit.model);
    object["bytes"] = bytes;
    object["compression_ratio"] = number(compression_ratio(fit.model.picture_bytes, bytes));
    return object;
}

std::string percent(double share) {
    return number_text(100.0 * share) + " %";
}

std::string relief_text(const BtfFit& fit) {
    const std::string& from = fit.model.relief;
    if (from == "level") return "The surface counts as level.\n";
    const std::string where = from == "given" ? "the height that was given"
                              : from == "set" ? "the set's own height"
                                              : "photometric stereo of the view from above";
    return "Relief: " + where + ", times " + number_text(fit.model.scale_factor) + ", over " +
           number_text(relief_range(fit.surface)) + " pixels.\n";
}

std::string fit_text(const BtfFitArguments& options, const BtfFit& fit, double structure,
                     std::uintmax_t bytes, double seconds) {
    const BtfModel& model = fit.model;
    std::string text = "wrote " + options.output + ": " + std::to_string(model.pairs.size()) +
                       " pictures of " + detail::text_of(model.size) + " pixels as " +
                       detail::counted(model.planes(), "plane") + ", in " + seconds_text(seconds) + "\n";
    if (fit.resumed > 0)
        text += std::to_string(fit.resumed) + " of them were read before, by a run that did not end.\n";
    text += relief_text(fit);
    text += "The planes leave " + percent(model.unexplained) +
            " of the variance of the pictures unexplained; more --planes leave less.\n";
    if (model.tables.kept.size() < model.pairs.size())
        text += "Weights of " + std::to_string(model.tables.kept.size()) +
                " pictures are kept, those of the others interpolated: off by " + percent(model.table_error) +
                " of the variance.\n";
    if (fit.score) {
        const BtfScore& score = *fit.score;
        text += std::to_string(score.pairs.size()) +
                " pictures that the fit was not shown: pixels are off by " + percent(score.model.median) +
                " of a picture's deviation (median), means by " + percent(score.model.mean_error) +
                ", deviations by " + percent(score.model.std_error) + ".\nThe nearest picture is off by " +
                percent(score.nearest.median) + ", the four nearest together by " +
                percent(score.neighbours.median) + ".\n";
    }
    text += structure_text(fit, structure);
    return text + std::to_string(bytes) +
           " bytes, 1 : " + number_text(compression_ratio(model.picture_bytes, bytes)) +
           " of 8-bit pictures\n";
}

double share_of(std::string_view stage, double share) {
    constexpr std::pair<std::string_view, std::pair<double, double>> stages[] = {
        {"relief", {0.0, 0.05}},  {"pictures", {0.05, 0.5}}, {"scale", {0.55, 0.1}},
        {"planes", {0.65, 0.25}}, {"tables", {0.9, 0.05}},   {"field", {0.95, 0.05}}};
    for (const auto& [name, part] : stages)
        if (name == stage) return part.first + part.second * share;
    return 1.0;
}

void run_fit(const BtfFitArguments& given) {
    const Stopwatch total;
    BtfFitArguments options = given;
    if (options.height_scale && options.height.empty()) throw UsageError("--height-scale goes with --height");
    RunFiles files(options.overwrite, options.json);
    if (!options.height.empty()) files.reads(options.height, "that is the height");
    check_outside("write the model '" + options.output + "'", options.output, options.set);
    files.writes_model(options.output);
    if (!is_standard_output(options.output)) {
        options.fit.part = options.output + ".part";
        files.writes(options.fit.part);
    }
    BtfSet set = open_told(options.set, options.reading);
    if (const std::size_t missing = set.missing().size(); missing > 0)
        warn(options.set + ": " + detail::counted(missing, "picture") + " of " +
             std::to_string(set.views().size() * set.lights().size()) + (missing == 1 ? " is" : " are") +
             " missing; the model makes them up (info --json names some)");
    if (!options.height.empty()) options.fit.height = read_height(options);
    Device device(options.device);
    BtfFit fit;
    {
        Progress progress;
        const Stopwatch watch;
        const auto all = static_cast<double>(set.pictures().size());
        double first = -1.0;
        options.fit.progress = [&](std::string_view stage, double share) {
            std::string what(stage);
            if (stage == "pictures") {
                if (first < 0.0) first = share;
                what += ", " + number_text(all * (share - first) / std::max(watch.seconds(), 1e-9)) + "/s";
            }
            progress.show(share_of(stage, share), what);
        };
        const StagesShown field(progress, 0.95, 0.05, "field: ", {});
        fit = fit_btf(device, set, options.fit);
    }
    for (const std::string& remark : fit.remarks) warn(remark);
    if (!is_valid(fit.model)) {
        const auto* field = std::get_if<TextureModel>(&fit.model.surface);
        warn("'" + options.output + "' is not certified" +
             (field != nullptr ? " at " + uncertified_levels(*field) : std::string()) +
             ", and synth will refuse it; use another --order or --model");
    }
    write_btf_model(options.output, fit.model);
    std::error_code ignored;
    if (!options.fit.part.empty()) fs::remove(options.fit.part, ignored);
    const std::uintmax_t bytes = model_file_bytes(options.output);
    const double structure = structure_of(device, fit);
    if (options.json) {
        Json object = fit_json(options, fit, structure, bytes);
        object["device"] = device.info().name;
        object["seconds"]["total"] = total.seconds();
        emit_json(object);
    } else {
        emit_result(fit_text(options, fit, structure, bytes, total.seconds()));
    }
}

/// Options that some methods have no use for.
struct MethodOption {
    std::string name;
    std::vector<BtfMethod> methods;
};
const std::vector<MethodOption>& method_options() {
    using enum BtfMethod;
    static const std::vector<MethodOption> options{
        {"--planes", {joint}},        {"--height", {joint}},   {"--height-scale", {joint}},
        {"--find-scale", {joint}},    {"--periodic", {joint}}, {"--clusters", {segment, joint}},
        {"--match", {segment, each}}, {"--jobs", {each}},      {"--table-error", {joint}},
        {"--shard", {each}},
    };
    return options;
}

/// What the command line has against the method.
void check_method(const CLI::App& command, BtfMethod method) {
    for (const MethodOption& option : method_options()) {
        if (command.count(option.name) == 0 || std::ranges::count(option.methods, method) > 0) continue;
        std::string methods;
        for (const BtfMethod of : option.methods)
            methods += (methods.empty() ? "" : " or ") + std::string(name(of));
        throw UsageError(option.name + " goes with --method " + methods + ", not with " +
                         std::string(name(method)));
    }
}

/// And against what grows the surface.
void check_surface(const CLI::App& command, BtfMethod method, SurfaceKind surface) {
    const std::string word = surface == SurfaceKind::compound ? "--model compound" : "--model roll";
    if (method != BtfMethod::joint && surface != SurfaceKind::field)
        throw UsageError(word + " goes with --method joint, not with " + std::string(name(method)));
    if (method == BtfMethod::joint && surface != SurfaceKind::compound && command.count("--clusters") > 0)
        throw UsageError("--clusters goes with --method segment, or with --model compound");
    if (surface == SurfaceKind::field) return;
    for (const char* option : {"--order", "--neighbourhood", "--levels", "--factor", "--estimator"})
        if (command.count(option) > 0)
            throw UsageError(std::string(option) + " goes with random fields, not with " + word);
}

TexturesFitArguments textures_arguments(const CLI::App& command, const BtfFitArguments& options) {
    TexturesFitArguments arguments{.set = options.set,
                                   .output = options.output,
                                   .device = options.device,
                                   .reading = options.reading,
                                   .fit = BtfTexturesOptions(options.method),
                                   .shard = options.shard,
                                   .overwrite = options.overwrite,
                                   .json = options.json};
    BtfTexturesOptions& fit = arguments.fit;
    FitOptions field = options.fit.field;
    // What was not asked for is the method's.
    if (command.count("--model") == 0) field.model = fit.field.model;
    if (command.count("--order") == 0) field.order = fit.field.order;
    fit.field = field;
    fit.leave_out = options.fit.leave_out;
    fit.clusters = options.clusters.value_or(fit.clusters);
    fit.jobs = options.jobs.value_or(fit.jobs);
    fit.match = options.match.value_or(fit.match);
    return arguments;
}

}  // namespace

void add_btf_fit(CLI::App& parent, Action& action) {
    CLI::App* command = parent.add_subcommand("fit", "fit a model to a BTF");
    const auto options = std::make_shared<BtfFitArguments>();
    command->add_option("SET", options->set, "pictures of a material, as btf info takes them")
        ->required()
        ->type_name("");
    command->add_option("-o,--output", options->output, "model: JSON, or CBOR when the name ends in .btfm")
        ->required()
        ->type_name("MODEL");
    BtfFitOptions& fit = options->fit;
    add_choice(*command, "--method", options->method,
               "joint: planes of the surface that all pictures share; segment: a texture for each cluster of "
               "pictures; each: one for each picture (default: joint)");
    add_int(*command, "--planes", fit.planes, 1, 60, "joint: planes of the surface (default: 16)");
    add_int(*command, "--clusters", options->clusters, 1, 128,
            "segment: textures (default: 20); joint with --model compound: regions of the surface");
    add_choice(*command, "--match", options->match,
               "segment, each: what directions have of their own: mean and contrast, or nothing (default: "
               "means)");
    add_int(*command, "--jobs", options->jobs, 1, 1024,
            "each: pictures that are fitted at a time (default: as many as there are cores)");
    add_shard(
        *command, [options](Shard shard) { options->shard = shard; },
        "each: only every n-th picture, beside the model; the same command without --shard joins all shards");
    add_int(*command, "--leave-out", fit.leave_out.pairs, 0, 1 << 20,
            "do not show a picture in n to the fit, and tell how well those are made up");
    add_int(*command, "--leave-out-views", fit.leave_out.views, 0, 1 << 20,
            "nor any picture of every n-th view");
    add_int(*command, "--leave-out-lights", fit.leave_out.lights, 0, 1 << 20,
            "nor any picture of every n-th light");
    command
        ->add_option(
            "--table-error", fit.table_error,
            "keep weights of so few pictures that interpolating those of the others adds at most this "
            "share of what planes leave unexplained; 0 keeps all (default: 0.2)")
        ->type_name("SHARE");
    const std::string relief = "Relief";
    command->add_option("--height", options->height, "height map of the surface, of the pictures' size")
        ->type_name("IMAGE")
        ->group(relief);
    add_positive(*command, "--height-scale", options->height_scale,
                 "pixels between black and white of --height (default: floats are pixels)")
        ->group(relief);
    command
        ->add_flag("--find-scale", fit.find_scale,
                   "find the factor on the relief for which the views agree best, whatever it is from")
        ->group(relief);
    command
        ->add_flag("--periodic", fit.periodic,
                   "opposite edges of the pictures continue each other: they tile")
        ->group(relief);
    add_selection(*command, fit.field, {"compound|roll", [&fit](const std::string& word) {
                                            if (word == "compound")
                                                fit.surface = SurfaceKind::compound;
                                            else if (word == "roll")
                                                fit.surface = SurfaceKind::roll;
                                            return word == "compound" || word == "roll";
                                        }});
    command->get_option("--model")->description(
        "random field; see docs/models.md for which to choose; auto: 2D or 3D by kappa, the rest by BIC "
        "(default: 3d-car, of segment 3d-msar)");
    command->get_option("--order")->description(
        "order of the neighbourhood, 1 to 8; auto: by BIC (default: 3, of segment 2)");
    add_choice(*command, "--estimator", fit.field.estimator,
               "least squares, exact maximum likelihood, or the first where it is valid (default: auto)");
    add_btf_reading(*command, options->reading);
    add_device(*command, options->device);
    add_overwrite(*command, options->overwrite);
    add_json(*command, options->json);
    set_guide(*command, {.usual = {{"btfield btf fit set/ -o rock.btfm"}},
                         .more = {{"btfield btf fit set/ -o rock.btfm --periodic --leave-out 10",
                                   "a made set, which tiles, and how well directions between are made up"},
                                  {"btfield btf fit cloth/ -o cloth.btfm --planes 24 --crop 0,0,256,256"},
                                  {"btfield btf fit set/ -o large.btfm --model roll",
                                   "the surface's own pixels, for larger ones: stones stay stones"},
                                  {"btfield btf fit set/ -o few.btfm --method segment --clusters 10"},
                                  {"btfield btf fit set/ -o all.btfm --method each",
                                   "goes on where a run was that did not end"},
                                  {"btfield btf fit set/ -o all.btfm --method each --shard 2/8"},
                                  {"mpirun -n 16 btfield btf fit set/ -o all.btfm --method each"}}});
    command->callback([command, options, &action] {
        check_method(*command, options->method);
        check_surface(*command, options->method, options->fit.surface);
        options->fit.regions = options->clusters;
        FitOptions field = options->fit.field;
        if (options->method != BtfMethod::joint && command->count("--model") == 0)
            field.model = BtfTexturesOptions(options->method).field.model;
        if (options->fit.surface == SurfaceKind::field && !field.choose_model)
            refuse_idle_options(*command, field, "--model");
        if (options->method == BtfMethod::joint) {
            action = [options] { run_fit(*options); };
            return;
        }
        action = [arguments = textures_arguments(*command, *options)] { run_textures_fit(arguments); };
    });
}

}  // namespace btfield::cli

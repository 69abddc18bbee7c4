#include <algorithm>
#include <filesystem>
#include <limits>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <span>
#include <system_error>
#include <utility>
#include <variant>
#include <vector>

#include "btfield/compound.hpp"
#include "btfield/error.hpp"
#include "btfield/image_io.hpp"
#include "btfield/picture_batch.hpp"
#include "btfield/synthesis.hpp"
#include "btfield/threads.hpp"
#include "host/base/file_output.hpp"
#include "host/base/text.hpp"
#include "host/cli/command.hpp"
#include "host/cli/command_text.hpp"
#include "host/cli/material_export.hpp"
#include "host/cli/material_files.hpp"
#include "host/cli/options.hpp"
#include "host/cli/output_names.hpp"
#include "host/cli/picture_options.hpp"
#include "host/cli/profile_text.hpp"
#include "host/cli/report.hpp"
#include "host/cli/run_files.hpp"
#include "host/cli/texture_writer.hpp"
#include "host/relief/relief_names.hpp"
#include "host/synthesis/synthesis_names.hpp"

namespace btfield::cli {
namespace {

namespace fs = std::filesystem;

struct SynthArguments {
    std::vector<std::string> models;
    std::string output, control, labels_output, device;
    std::optional<Size> size, period;
    std::optional<Offset> offset;
    std::uint64_t seed = 0;
    std::optional<int> count;
    std::optional<Shard> shard;
    SynthesisOptions synthesis;
    WritingArguments writing;
    std::optional<NormalConvention> normals;
    ExportArguments exports;
    bool profile = false, overwrite = false, json = false;
};

/// One model's textures.
struct SynthJob {
    std::string file;
    std::variant<TextureModel, CompoundModel> model;
    Size size;
    Size plane;  ///< that is grown; larger where textures are windows of it
    std::optional<Offset> offset;
    std::vector<fs::path> outputs, labels_outputs, exports;
    std::optional<MaterialFiles> material;  ///< outputs are its maps, texture by texture
    std::optional<ControlField> control;
    std::vector<double> shares;  ///< of a compound model's regions, summed over textures
    std::vector<std::uint64_t> seeds;
    int first = 0;  ///< number of the first texture in the batch, of which this may be a shard
    bool tileable = false;
    Size lattice;
    std::uintmax_t clamped_pixels = 0;
    WrittenRemarks remarks;
    double rate = 0.0;  ///< textures per second, from the first one's beginning to the last one's end
    double setup = 0.0, synthesis = 0.0, write = 0.0, total = 0.0;
};

int planes_of(const SynthJob& job) {
    return std::visit([](const auto& model) { return model.planes; }, job.model);
}

PixelType type_of(const SynthJob& job) {
    return std::visit([](const auto& model) { return model.provenance.type; }, job.model);
}

const Provenance& provenance_of(const SynthJob& job) {
    return std::visit([](const auto& model) -> const Provenance& { return model.provenance; }, job.model);
}

/// The format that holds what was analysed, for textures whose name is not given.
const char* extension(const SynthJob& job) {
    const PixelType type = type_of(job);
    if (type == PixelType::half || type == PixelType::float32) return ".exr";
    return planes_of(job) == 1 || planes_of(job) == 3 ? ".png" : ".tif";
}

/// What the error says, of this model where there are several.
template <class Work>
void about(const SynthArguments& options, const std::string& file, Work work) {
    try {
        work();
    } catch (const InputError& error) {
        if (options.models.size() == 1 || error.asked().find(file) != std::string::npos) throw;
        throw InputError("'" + file + "': " + error.asked(), error.found(), error.remedy());
    }
}

void set_model(const SynthArguments& options, SynthJob& job, CompoundModel model) {
    if (options.synthesis.method == SynthesisMethod::raster)
        throw InputError(
            "synthesise by raster recursion",
            "this is a compound model, and only causal autoregressive ones can be run pixel after "
            "pixel",
            "leave out --method");
    if (!options.control.empty()) {
        job.control = read_labels(options.control, palette(model));
        if (!options.offset && options.size && job.control->size != *options.size)
            throw InputError(
                "synthesise " + detail::compact_text_of(*options.size) + " on '" + options.control + "'",
                "the labels are " + detail::text_of(job.control->size),
                "leave out --size, or give labels of that size");
    }
    job.size = options.size.value_or(job.control ? job.control->size : model.size);
    job.plane = job.control ? job.control->size : options.period.value_or(job.size);
    check_synthesis(model, job.plane, options.synthesis.allow_invalid);
    job.model = std::move(model);
}

void set_model(const SynthArguments& options, SynthJob& job, TextureModel model) {
    if (!(options.control.empty() && options.labels_output.empty()))
        throw InputError("synthesise '" + job.file + "' with labels", "it is a model without regions",
                         "give a model of 'btfield compound fit'");
    job.size = options.size.value_or(model.size);
    job.plane = options.period.value_or(job.size);
    check_synthesis(model, job.plane, options.synthesis);
    job.model = std::move(model);
}

bool is_picture(const fs::path& file) {
    return lower_extension(file) == ".png";
}

/// One texture's maps, and what --export adds.
void check_exports(SynthJob& job, std::optional<int> number, int count,
                   const std::vector<fs::path>& outputs) {
    job.material->check(outputs);
    const MaterialFiles::Exports exports = job.material->exports(number, count);
    for (const fs::path& file : exports.pictures) {
        check_writable(file, 3, PixelType::uint8, PixelType::uint8);
        job.exports.push_back(file);
    }
    for (const fs::path& file : exports.texts) {
        detail::check_output(file, "write '" + file.string() + "'");
        job.exports.push_back(file);
    }
}

/// Numbers of the batch's textures that this run grows: from the first to before the second.
std::pair<int, int> own_textures(const SynthArguments& options) {
    const int count = options.count.value_or(1);
    if (!options.shard) return {0, count};
    const auto [index, of] = *options.shard;
    if (!options.count) throw UsageError("--shard goes with --count: it is a part of that batch");
    if (of > count)
        throw UsageError("--shard: " + detail::counted(count, "texture") + " make no " + std::to_string(of) +
                         " shards");
    const auto end_of = [count, parts = of](int shard) {
        return static_cast<int>(static_cast<long long>(count) * shard / parts);
    };
    return {end_of(index - 1), end_of(index)};
}

/// Reads and checks all models and all names of outputs, before any work is done.
std::vector<SynthJob> plan(const SynthArguments& options) {
    const bool folder =
        is_output_folder("--output", options.output, options.models.size() > 1 ? "several models" : "");
    if (options.period && !options.offset)
        throw UsageError("--period goes with --offset: it says after how many pixels the plane repeats");
    if (options.offset && options.synthesis.method == SynthesisMethod::raster)
        throw UsageError("--offset: the plane of a raster recursion does not repeat; leave out --method");
    if (options.offset && !options.labels_output.empty())
        throw UsageError("--offset excludes --save-labels, which writes all of a control field");
    if (options.period && !options.control.empty())
        throw UsageError("--period excludes --control, whose size it is");
    if (options.models.size() > 1 && !(options.labels_output.empty() && options.control.empty()))
        throw UsageError("--control and --save-labels go with one model");
    if (options.offset && !options.period && options.control.empty())
        warn(
            "--offset without --period: the plane repeats after the texture's own size, so that every window "
            "is the same texture, shifted; give a larger --period for more of it");
    const int count = options.count.value_or(1);
    const auto [begin, end] = own_textures(options);
    std::vector<SynthJob> jobs;
    RunFiles files(options.overwrite, options.json);
    if (!options.control.empty()) files.reads(options.control);
    std::set<fs::path> names;
    for (const std::string& file : options.models) {
        SynthJob job;
        job.file = file;
        job.offset = options.offset;
        job.first = begin;
        about(options, file, [&] {
            std::visit([&](auto model) { set_model(options, job, std::move(model)); }, read_any_model(file));
        });
        std::visit([&](const auto& model) { files.reads_model(file, model.provenance); }, job.model);
        if (!provenance_of(job).maps.empty()) {
            static_cast<void>(is_output_folder("--output", options.output, "the maps of a material"));
            job.material.emplace(provenance_of(job), file, options.output, options.writing, options.normals,
                                 options.exports);
        } else if (options.normals || !options.exports.formats.empty() || options.exports.pixel_size) {
            throw UsageError(std::string(options.normals                   ? "--convention"
                                         : options.exports.formats.empty() ? "--pixel-size"
                                                                           : "--export") +
                             ": '" + file + "' is no model of a material's maps");
        }
        const fs::path output =
            folder ? options.output / fs::path(file).stem().concat(extension(job)) : fs::path(options.output);
        for (int i = begin; i < end; ++i) {
            std::vector<fs::path> outputs{options.count ? numbered(output, i, count) : output};
            if (job.material)
                outputs = job.material->names(options.count ? std::optional(i) : std::nullopt, count);
            for (const fs::path& each : outputs)
                if (!names.insert(each).second)
                    throw UsageError("two models would have the texture '" + each.string() + "'");
            if (job.material)
                check_exports(job, options.count ? std::optional(i) : std::nullopt, count, outputs);
            else
                check_writable(output, planes_of(job), type_of(job), options.writing.type);
            job.outputs.insert(job.outputs.end(), outputs.begin(), outputs.end());
            job.seeds.push_back(options.seed + static_cast<std::uint64_t>(i));
            if (!options.labels_output.empty())
                job.labels_outputs.push_back(options.count ? numbered(options.labels_output, i, count)
                                                           : fs::path(options.labels_output));
            if (!job.labels_outputs.empty()) check_labels_output(job.labels_outputs.back());
        }
        jobs.push_back(std::move(job));
    }
    // When all models are read: an output may be what another one was fitted to.
    for (const SynthJob& job : jobs) {
        for (const fs::path& output : job.outputs) files.writes(output);
        for (const fs::path& labels : job.labels_outputs) files.writes(labels);
        if (job.material) files.writes_text(job.material->side_file());
        for (const fs::path& file : job.exports)
            is_picture(file) ? files.writes(file) : files.writes_text(file);
    }
    return jobs;
}

/// What textures are windows of has to go on across its edges: grown on all of the lattice.
template <class Grower, class... Options>
Grower whole_plane(Device& device, SynthJob& job, const auto& model, const Options&... rest) {
    Grower grower(device, model, job.plane, rest...);
    if (!job.offset || grower.lattice() == job.plane) return grower;
    job.plane = grower.lattice();
    return Grower(device, model, job.plane, rest...);
}

/// Where threads that write put pictures, and what they note in the job.
struct Sink {
    PictureBatch pictures;
    std::mutex noting;  ///< of clamped_pixels, remarks and write of the job
};

void write_maps(Device& device, const SynthArguments& options, SynthJob& job, Sink& sink, std::size_t number,
                const Image& texture) {
    const std::size_t each = job.outputs.size() / job.seeds.size();
    const auto first = job.outputs.begin() + static_cast<std::ptrdiff_t>(number * each);
    const std::vector<fs::path> names(first, first + static_cast<std::ptrdiff_t>(each));
    const bool endless = job.tileable || job.offset;
    std::optional<Crop> window;
    if (job.offset) window = Crop{job.offset->column, job.offset->row, job.size.width, job.size.height};
    const ExportedMaterial material = job.material->exported(
        options.count ? std::optional(job.first + static_cast<int>(number)) : std::nullopt,
        options.count.value_or(1), job.size, job.tileable);
    WrittenRemarks remarks;
    const std::uintmax_t clamped = job.material->write(
        device, sink.pictures, names, texture, endless ? SurfaceEdges::periodic : SurfaceEdges::mirror,
        window, material, remarks);
    {
        const std::lock_guard lock(sink.noting);
        job.clamped_pixels += clamped;
        job.remarks.add(remarks);
    }
    if (number == 0) job.material->write_side_file(job.size, job.tileable);
    const std::vector<std::string> left_out = job.material->write_exports(material);
    if (number == 0)
        for (const std::string& remark : left_out) warn(remark);
}

/// Of textures: squares of larger values, which spectra are made of, leave single precision.
constexpr double largest_value = 1e18;

/// Of textures of one job, any number of threads may write.
void write_texture(Device& device, const SynthArguments& options, SynthJob& job, Sink& sink,
                   std::size_t number, const Image& texture) {
    const Stopwatch writing;
    const auto note_time = [&] {
        const std::lock_guard lock(sink.noting);
        job.write += writing.seconds();
    };
    // What a model's numbers can lead to is no fault of a picture.
    if (!std::ranges::all_of(texture.values(), [](float v) { return std::abs(v) <= largest_value; }))
        throw InputError("synthesise from '" + job.file + "'",
                         "its texture has values that are not finite or beyond " + number_text(largest_value),
                         "the model's numbers are out of range: fit it again");
    if (job.material) {
        write_maps(device, options, job, sink, number, texture);
        return note_time();
    }
    const WriteOptions how = std::visit(
        [&](const auto& model) { return write_options(model.provenance, options.writing); }, job.model);
    const auto write = [&](const Image& image) {
        const WriteReport report = sink.pictures.write(job.outputs[number], image, how);
        const std::lock_guard lock(sink.noting);
        job.clamped_pixels += report.clamped_pixels;
        job.remarks.add(job.outputs[number], report);
    };
    if (job.offset)
        write(texture.window(job.offset->row, job.offset->column, job.size));
    else
        write(texture);
    note_time();
}

/// Whether a field that somebody painted goes on across its edges: labels change there no more often than
/// inside.
bool continues(const ControlField& field) {
    const auto height = static_cast<std::size_t>(field.size.height);
    const auto width = static_cast<std::size_t>(field.size.width);
    const auto changes = [&](std::size_t a, std::size_t b) {
        return field.labels[a] != field.labels[b] ? 1.0 : 0.0;
    };
    double inside = 0.0, down = 0.0, across = 0.0;
    for (std::size_t r = 0; r < height; ++r) {
        across += changes(r * width, r * width + width - 1) / static_cast<double>(height);
        for (std::size_t c = 0; c + 1 < width; ++c) inside += changes(r * width + c, r * width + c + 1);
    }
    for (std::size_t c = 0; c < width; ++c)
        down += changes(c, (height - 1) * width + c) / static_cast<double>(width);
    const double usual = inside / static_cast<double>(height * std::max<std::size_t>(1, width - 1));
    return std::max(across, down) <= 1.25 * usual + 0.02;
}

/// What takes the textures of one job from grow().
class Output {
  public:
    /// \param batch  textures that are grown at a time
    Output(Device& device, const SynthArguments& options, SynthJob& job, Progress& bar, double done,
           double share, std::size_t batch)
        : job_(job),
          bar_(bar),
          done_(done),
          share_(share),
          writer_(
              [&, this](std::size_t number, const Image& texture) {
                  write_texture(device, options, job_, sink_, number, texture);
              },
              threads(job), std::max(batch, static_cast<std::size_t>(thread_limit()))) {}

    void put(std::size_t number, Image texture) {
        writer_.put(number, std::move(texture));
        const auto ready = static_cast<double>(number + 1), all = static_cast<double>(job_.seeds.size());
        const double seconds = watch_.seconds(), rate = ready / seconds;
        std::string text =
            std::to_string(number + 1) + " of " + detail::counted(job_.seeds.size(), "texture");
        if (seconds > 1.0)
            text += ", " + number_text(rate) + "/s, " + seconds_text((all - ready) / rate) + " left";
        bar_.show(done_ + share_ * ready / all, text);
    }
    void finish() {
        writer_.finish();
        const Stopwatch waiting;
        sink_.pictures.finish();
        job_.write += waiting.seconds();
        job_.rate = static_cast<double>(job_.seeds.size()) / watch_.seconds();
    }

  private:
    /// A single texture is written at once, and one thread does all where no more is allowed.
    static int threads(const SynthJob& job) {
        return job.seeds.size() > 1 && thread_limit() > 1 ? thread_limit() : 0;
    }

    SynthJob& job_;
    Progress& bar_;
    double done_, share_;
    Stopwatch watch_;
    Sink sink_;
    TextureWriter writer_;
};

void grow_compound(Device& device, const SynthArguments& options, SynthJob& job, Progress& bar, double done,
                   double share) {
    const Stopwatch total, setup;
    const auto& model = std::get<CompoundModel>(job.model);
    auto synthesiser = whole_plane<CompoundSynthesiser>(device, job, model, options.synthesis.allow_invalid);
    job.setup += setup.seconds();
    job.tileable =
        synthesiser.tileable() && job.size == job.plane && (!job.control || continues(*job.control));
    job.lattice = synthesiser.lattice();
    job.shares.assign(model.regions.size(), 0.0);
    Output output(device, options, job, bar, done, share, 1);
    for (std::size_t i = 0; i < job.seeds.size(); ++i) {
        const Stopwatch synthesis;
        const ControlField field =
            job.control ? on_lattice(*job.control, job.plane) : synthesiser.control_field(job.seeds[i]);
        Image texture = synthesiser.synthesise(job.seeds[i], field);
        job.synthesis += synthesis.seconds();
        const ControlField seen = on_lattice(field, job.plane);
        const std::vector<double> own = shares(seen);
        for (std::size_t k = 0; k < own.size(); ++k) job.shares[k] += own[k];
        output.put(i, std::move(texture));
        if (!job.labels_outputs.empty()) write_labels(job.labels_outputs[i], seen, palette(model));
    }
    output.finish();
    job.total += total.seconds();
}

void grow(Device& device, const SynthArguments& options, SynthJob& job, Progress& bar, double done,
          double share) {
    bar.show(done, fs::path(job.file).filename().string());
    if (std::holds_alternative<CompoundModel>(job.model)) {
        grow_compound(device, options, job, bar, done, share);
        return;
    }
    const Stopwatch total, setup;
    auto synthesiser =
        whole_plane<Synthesiser>(device, job, std::get<TextureModel>(job.model), options.synthesis);
    job.setup += setup.seconds();
    job.tileable = synthesiser.tileable() && job.size == job.plane;
    job.lattice = synthesiser.lattice();
    const std::size_t count = job.seeds.size();
    const auto batch = static_cast<std::size_t>(std::max(1, synthesiser.batch()));
    Output output(device, options, job, bar, done, share, batch);
    for (std::size_t start = 0; start < count; start += batch) {
        const std::size_t n = std::min(batch, count - start);
        const Stopwatch synthesis;
        std::vector<Image> textures =
            synthesiser.synthesise(std::span<const std::uint64_t>(job.seeds).subspan(start, n));
        job.synthesis += synthesis.seconds();
        for (std::size_t i = 0; i < n; ++i) output.put(start + i, std::move(textures[i]));
    }
    output.finish();
    job.total += total.seconds();
}

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
    command->callback([options, &action] { action = [options] { run(*options); }; });
}

}  // namespace btfield::cli

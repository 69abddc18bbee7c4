#include "host/cli/synth_job.hpp"

#include <set>
#include <utility>

#include "btfield/image_io.hpp"
#include "host/base/file_output.hpp"
#include "host/base/text.hpp"
#include "host/cli/command.hpp"
#include "host/cli/command_text.hpp"
#include "host/cli/output_names.hpp"
#include "host/cli/report.hpp"
#include "host/cli/run_files.hpp"

namespace btfield::cli {

namespace fs = std::filesystem;

int planes_of(const SynthJob& job) {
    return std::visit([](const auto& model) { return model.planes; }, job.model);
}

namespace {

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

void set_model(const SynthArguments& options, SynthJob& job, CompoundModel model) {
    if (options.synthesis.method == SynthesisMethod::raster)
        throw InputError(
            "synthesise by raster recursion",
            "this is a compound model, and only causal autoregressive ones can be run pixel after "
            "pixel",
            "leave out --method");
    if (options.synthesis.noise_domain == NoiseDomain::spatial)
        throw InputError("synthesise '" + job.file + "' with noise drawn in space",
                         "it is a compound model, whose regions' models say where theirs is drawn",
                         "leave out --noise-domain");
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
    job.material->check(outputs, job.size);
    const MaterialFiles::Exports exports = job.material->exports(number, count);
    for (const fs::path& file : exports.pictures) {
        check_writable(file, 3, PixelType::uint8, PixelType::uint8, job.size);
        job.exports.push_back(file);
    }
    for (const fs::path& file : exports.texts) {
        detail::check_output(file, "write '" + file.string() + "'");
        job.exports.push_back(file);
    }
}

void check_compression(const SynthArguments& options, const fs::path& output) {
    if (!options.writing.compression) return;
    const std::string extension = lower_extension(output);
    if (extension != ".png" && extension != ".tif" && extension != ".tiff" && extension != ".exr")
        throw UsageError("--compression is of PNG, TIFF and EXR: '" + output.string() + "' is none of them");
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

}  // namespace

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
                check_writable(outputs.front(), planes_of(job), type_of(job), options.writing.type, job.size);
            check_compression(options, outputs.front());
            job.outputs.insert(job.outputs.end(), outputs.begin(), outputs.end());
            job.seeds.push_back(options.seed + static_cast<std::uint64_t>(i));
            if (!options.labels_output.empty())
                job.labels_outputs.push_back(options.count ? numbered(options.labels_output, i, count)
                                                           : fs::path(options.labels_output));
            if (!job.labels_outputs.empty()) check_labels_output(job.labels_outputs.back(), job.size);
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

}  // namespace btfield::cli

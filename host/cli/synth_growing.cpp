#include "host/cli/synth_growing.hpp"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <mutex>
#include <span>
#include <utility>
#include <vector>

#include "btfield/picture_batch.hpp"
#include "btfield/threads.hpp"
#include "host/base/text.hpp"
#include "host/cli/command_text.hpp"
#include "host/cli/texture_writer.hpp"

namespace btfield::cli {

namespace fs = std::filesystem;

namespace {

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
class TextureOutput {
  public:
    /// \param batch  textures that are grown at a time
    TextureOutput(Device& device, const SynthArguments& options, SynthJob& job, Progress& bar, double done,
                  double share, std::size_t batch)
        : job_(job),
          bar_(bar),
          done_(done),
          share_(share),
          writer_(
              [&, this](std::size_t number, const Image& texture) {
                  write_texture(device, options, job_, sink_, number, texture);
              },
              threads(job), room(job, batch)) {}

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
    /// Of textures that wait, so that memory does not grow with what is asked for.
    static constexpr double most_waiting = 256e6;
    static double bytes_of(const SynthJob& job) {
        return sizeof(float) * static_cast<double>(area(job.plane)) * planes_of(job);
    }
    /// A single texture is written at once, as is a large one, and one thread does all where no more is
    /// allowed.
    static int threads(const SynthJob& job) {
        const bool beside = job.seeds.size() > 1 && thread_limit() > 1 && 2.0 * bytes_of(job) < most_waiting;
        return beside ? thread_limit() : 0;
    }
    static std::size_t room(const SynthJob& job, std::size_t batch) {
        const auto fits = static_cast<std::size_t>(most_waiting / bytes_of(job));
        return std::clamp<std::size_t>(fits, 1, std::max(batch, static_cast<std::size_t>(thread_limit())));
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
    TextureOutput output(device, options, job, bar, done, share, 1);
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

}  // namespace

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
    TextureOutput output(device, options, job, bar, done, share, batch);
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

}  // namespace btfield::cli

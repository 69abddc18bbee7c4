#include <algorithm>
#include <cmath>
#include <filesystem>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <system_error>
#include <vector>

#include "btfield/error.hpp"
#include "btfield/image_io.hpp"
#include "btfield/roller.hpp"
#include "host/base/text.hpp"
#include "host/cli/command.hpp"
#include "host/cli/command_text.hpp"
#include "host/cli/options.hpp"
#include "host/cli/output_names.hpp"
#include "host/cli/picture_options.hpp"
#include "host/cli/report.hpp"
#include "host/cli/run_files.hpp"

namespace btfield::cli {
namespace {

namespace fs = std::filesystem;

constexpr int least_side = 16;  // of quilts and tiles
/// Steps across cuts over those inside from which on they are plain to see: stones and bark have up to 1.6.
constexpr double visible_seam = 3.0;
/// Part of the variance by which patches differ along their cuts from which on, where steps are higher there
/// too, cuts are likely to show: bark, stones and grass have up to 0.45, and noise, whose cuts nobody sees,
/// 1.2 with steps as inside.
constexpr double visible_cost = 0.6, visible_step = 1.25;

struct RollArguments {
    std::vector<std::string> images, cut_on;
    std::string output, device;
    std::optional<Size> size;
    std::optional<int> tiles;
    bool tile = false, overwrite = false, json = false;
    RollerOptions roller;
    ReadOptions reading;
    WritingArguments writing;
};

/// One of the registered pictures, and the names of what is made of it.
struct RollJob {
    fs::path file;
    Picture picture;
    std::vector<fs::path> outputs;
};

struct RollSeconds {
    double read = 0.0, roll = 0.0, write = 0.0, total = 0.0;
};

/// Pictures in the order given; a folder stands for those in it, by name.
std::vector<fs::path> picture_files(const std::vector<std::string>& names) {
    static const std::set<std::string> extensions{".png", ".jpg", ".jpeg", ".tif", ".tiff", ".exr",
                                                  ".hdr", ".ppm", ".pgm",  ".pbm", ".pnm"};
    std::vector<fs::path> files;
    for (const std::string& name : names) {
        std::error_code error;
        if (!fs::is_directory(name, error)) {
            files.emplace_back(name);
            continue;
        }
        std::set<fs::path> inside;
        for (const fs::directory_entry& entry : fs::directory_iterator(name, error)) {
            if (entry.is_regular_file(error) && extensions.contains(lower_extension(entry.path())))
                inside.insert(entry.path());
        }
        if (inside.empty())
            throw InputError("read the pictures in '" + name + "'", "there are none",
                             "give pictures, or a folder of them");
        files.insert(files.end(), inside.begin(), inside.end());
    }
    return files;
}

/// The picture's own format where it keeps every value and can be written.
std::string lossless_extension(const RollJob& job) {
    static const std::set<std::string> kept{".png", ".tif", ".tiff", ".exr", ".hdr", ".pgm", ".ppm", ".pnm"};
    if (kept.contains(lower_extension(job.file))) return job.file.extension().string();
    const int planes = job.picture.image.planes();
    return planes == 1 || planes == 3 ? ".png" : ".tif";
}

/// Reads all pictures and checks all names, before any work is done.
std::vector<RollJob> plan(const RollArguments& options) {
    const std::vector<fs::path> files = picture_files(options.images);
    const bool folder =
        is_output_folder("--output", options.output, files.size() > 1 ? "several pictures" : "");
    std::vector<RollJob> jobs;
    std::set<fs::path> names;
    for (const fs::path& file : files) {
        RollJob job{file, read_told(file, options.reading), {}};
        const Size size = job.picture.image.size();
        if (!jobs.empty() && size != jobs.front().picture.image.size())
            throw InputError("roll '" + file.string() + "' with '" + jobs.front().file.string() + "'",
                             "they are " + detail::text_of(size) + " and " +
                                 detail::text_of(jobs.front().picture.image.size()) + " pixels",
                             "give pictures that lie on each other pixel by pixel");
        const fs::path output = folder
                                    ? options.output / fs::path(file.stem()).concat(lossless_extension(job))
                                    : fs::path(options.output);
        const int count = options.tiles.value_or(1);
        for (int i = 0; i < count; ++i) {
            job.outputs.push_back(options.tiles ? numbered(output, i, count) : output);
            if (!names.insert(job.outputs.back()).second)
                throw UsageError("two pictures would be written as '" + job.outputs.back().string() + "'");
        }
        jobs.push_back(std::move(job));
    }
    RunFiles read(options.overwrite, options.json);
    for (const RollJob& job : jobs) read.reads(job.file, "it is one of the pictures to be rolled");
    for (const RollJob& job : jobs)
        for (const fs::path& output : job.outputs) {
            read.writes(output);
            check_writable(output, job.picture.image.planes(), job.picture.type, options.writing.type,
                           options.size);
        }
    return jobs;
}

/// The pictures that the cuts look at.
std::vector<Image> features(const RollArguments& options, const std::vector<RollJob>& jobs) {
    std::vector<Image> result;
    std::set<std::string> unknown(options.cut_on.begin(), options.cut_on.end());
    for (const RollJob& job : jobs) {
        bool taken = options.cut_on.empty();
        for (const std::string& name :
             {job.file.string(), job.file.filename().string(), job.file.stem().string()}) {
            if (std::find(options.cut_on.begin(), options.cut_on.end(), name) == options.cut_on.end())
                continue;
            taken = true;
            unknown.erase(name);
        }
        if (taken) result.push_back(job.picture.image);
    }
    if (!unknown.empty()) {
        std::string names;
        for (const RollJob& job : jobs) names += (names.empty() ? "" : ", ") + job.file.stem().string();
        throw UsageError("--cut-on: '" + *unknown.begin() + "' is none of the pictures; there are " + names);
    }
    return result;
}

std::uintmax_t write(const RollArguments& options, const std::vector<RollJob>& jobs,
                     const std::vector<SourceMap>& maps) {
    std::uintmax_t clamped = 0;
    WrittenRemarks remarks;
    for (const RollJob& job : jobs)
        for (std::size_t i = 0; i < maps.size(); ++i) {
            const fs::path& output = job.outputs[i];
            WriteOptions how = write_options(job.picture, options.writing);
            how.keep_values = options.reading.keep_values;
            const WriteReport report = write_picture(output, apply(maps[i], job.picture.image), how);
            clamped += report.clamped_pixels;
            remarks.add(output, report);
        }
    remarks.tell();
    return clamped;
}

void report_json(const RollArguments& options, const std::vector<RollJob>& jobs,
                 const std::vector<SourceMap>& maps, double cost, double seam, const Device& device,
                 const RollSeconds& seconds) {
    Json outputs = Json::array();
    for (const RollJob& job : jobs)
        for (const fs::path& output : job.outputs) outputs.push_back(output.string());
    Json object;
    object["outputs"] = std::move(outputs);
    object["size"] = size_json(maps.front().size);
    object["tile"] = options.tile;
    object["tileable"] = true;
    object["seed"] = options.roller.seed;
    object["cut_cost"] = number(cost);
    object["seam"] = number(seam);
    object["device"] = device.info().name;
    object["seconds"]["read"] = seconds.read;
    object["seconds"]["roll"] = seconds.roll;
    object["seconds"]["write"] = seconds.write;
    object["seconds"]["total"] = seconds.total;
    emit_json(object);
}

void report_text(const RollArguments& options, const std::vector<RollJob>& jobs,
                 const std::vector<SourceMap>& maps, double cost, double seam, const Device& device,
                 const RollSeconds& seconds) {
    std::string text;
    for (const RollJob& job : jobs) {
        text += "wrote " + job.outputs.front().string();
        if (job.outputs.size() > 1)
            text += " to " + job.outputs.back().filename().string() + ", " +
                    std::to_string(job.outputs.size()) + " tiles that fit beside each other";
        text += "\n";
    }
    text += detail::text_of(maps.front().size) + " pixels out of " + detail::text_of(maps.front().sample) +
            ", seed " + std::to_string(options.roller.seed) + ", on " + device.info().name +
            "\nOpposite edges continue each other: it tiles.\n";
    if (seam > 0.0)
        text +=
            "seam " + number_text(seam) +
            ": steps across cuts over steps inside patches, 1 where cuts do not show\npatches differ along "
            "their cuts by " +
            number_text(100.0 * cost) +
            " % of the picture's variance: 0 where they are alike, 200 % of places that have nothing in "
            "common\n";
    text += "read " + seconds_text(seconds.read) + ", roll " + seconds_text(seconds.roll) + ", write " +
            seconds_text(seconds.write) + ", total " + seconds_text(seconds.total) + "\n";
    emit_result(text);
}

void tell_of_cuts(const RollArguments& options, std::size_t pictures, double cost, double seam) {
    const bool differ = cost > visible_cost && seam > visible_step;
    if (seam <= visible_seam && !differ) return;
    warn((seam > visible_seam
              ? "cuts show: steps across them are " + number_text(seam) + " times those inside patches"
              : "cuts may show: patches differ along them by " + number_text(std::round(100.0 * cost)) +
                    " % of the variance, and steps across them are " + number_text(seam) +
                    " times those inside") +
         "; a larger sample, another --seed" + (options.tile && options.size ? ", no --size" : "") +
         (options.roller.overlap ? "" : ", a larger --overlap") +
         (pictures > 1 ? " or cuts that look at some of the pictures (--cut-on)"
                       : " or a quilt or tile instead") +
         " may hide them");
}

void run(RollArguments options) {
    options.tile = options.tile || options.tiles;
    if (!options.tile && !options.size)
        throw UsageError("one of --tile, --tiles and --size is needed: a tile, or a quilt of a size");
    if (options.size && std::min(options.size->height, options.size->width) < least_side)
        throw UsageError("--size: " + detail::compact_text_of(*options.size) + " is smaller than " +
                         detail::compact_size_text(least_side, least_side));
    if (options.tile && options.roller.block)
        throw UsageError("--block excludes --tile: a tile is one patch");
    const Stopwatch total;
    RollSeconds seconds;
    preload_picture_formats();
    const std::vector<RollJob> jobs = plan(options);
    const std::vector<Image> cut_on = features(options, jobs);
    seconds.read = total.seconds();

    const Stopwatch rolling;
    Device device(options.device);
    Roller roller(device, cut_on);
    std::vector<SourceMap> maps;
    {
        Progress bar;
        const StagesShown stages(bar, 0.0, 1.0, "", {{"tile", 0.0, 1.0}, {"quilt", 0.0, 1.0}});
        if (options.tile) {
            maps = roller.tiles(options.tiles.value_or(1), options.size, options.roller);
        } else {
            maps.push_back(roller.quilt(*options.size, options.roller));
        }
    }
    seconds.roll = rolling.seconds();
    const Stopwatch writing;
    const std::uintmax_t clamped = write(options, jobs, maps);
    seconds.write = writing.seconds();
    seconds.total = total.seconds();

    if (clamped > 0)
        warn(detail::counted(clamped, "pixel") +
             " had values that their format cannot hold and were clamped; EXR and "
             "float TIFF keep them");
    double cost = 0.0, seam = 0.0;
    for (const SourceMap& map : maps) {
        cost = std::max(cost, map.cut_cost);
        seam = std::max(seam, map.seam);
    }
    tell_of_cuts(options, jobs.size(), cost, seam);
    (options.json ? report_json : report_text)(options, jobs, maps, cost, seam, device, seconds);
}

}  // namespace

void add_roll(CLI::App& app, Action& action) {
    CLI::App* command =
        app.add_subcommand("roll", "make a tile, or texture of any size, of a picture's own pixels");
    const auto options = std::make_shared<RollArguments>();
    command
        ->add_option(
            "IMAGE", options->images,
            "pictures of one surface that lie on each other, cut alike; a folder stands for its pictures")
        ->required()
        ->type_name("");
    command
        ->add_option("-o,--output", options->output,
                     "picture; a folder takes NAME.EXT of every picture, NAME.png of a JPEG")
        ->required()
        ->type_name("IMAGE");
    command->add_flag("--tile", options->tile,
                      "one patch whose opposite borders meet; its size is found unless --size gives it");
    add_int(*command, "--tiles", options->tiles, 1, 10000,
            "this many tiles that fit beside each other; a zero-padded number goes before the extension");
    add_size(*command, "--size", options->size, "width and height in pixels: of a quilt, or of the tiles");
    add_uint64(*command, "--seed", options->roller.seed, "which texture (default: 0)");
    const std::string cuts = "Cuts";
    add_int(*command, "--block", options->roller.block, 8, 16384,
            "side of a quilt's patches in pixels (default: by the picture's correlation)")
        ->group(cuts);
    add_int(*command, "--overlap", options->roller.overlap, 2, 8192,
            "pixels over which neighbours are compared and cut (default: a quarter of the block, a twelfth "
            "of the "
            "picture or an eighth of a given tile)")
        ->group(cuts);
    command
        ->add_option("--cut-on", options->cut_on,
                     "the pictures, by name, on which patches are chosen and cut (default: all)")
        ->delimiter(',')
        ->type_name("NAME")
        ->group(cuts);
    add_reading(*command, options->reading);
    add_writing(*command, options->writing, false);
    add_device(*command, options->device);
    add_overwrite(*command, options->overwrite);
    add_json(*command, options->json);
    set_guide(
        *command,
        {.usual = {{"btfield roll bark.png -o tile.png --tile", "a patch that tiles"},
                   {"btfield roll bark.png -o large.png --size 1024x1024", "a torus of any size"}},
         .more = {{"btfield roll bark.png -o tile.png --tiles 8 --size 256x256",
                   "tile-0.png to tile-7.png, any beside any"},
                  {"btfield roll colour.png height.exr -o tiles/ --tile --cut-on height"}},
         .notes = {"Pixels are copied, never resampled or blended, so 8 and 16 bit, half and float values "
                   "stay what they are."}});
    command->callback([options, &action] { action = [options] { run(*options); }; });
}

}  // namespace btfield::cli

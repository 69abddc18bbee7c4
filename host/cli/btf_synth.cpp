#include <algorithm>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "btfield/btf_model.hpp"
#include "btfield/btf_textures.hpp"
#include "btfield/device.hpp"
#include "btfield/error.hpp"
#include "btfield/image_io.hpp"
#include "host/base/text.hpp"
#include "host/cli/btf_parts.hpp"
#include "host/cli/command_text.hpp"
#include "host/cli/options.hpp"
#include "host/cli/picture_options.hpp"
#include "host/cli/report.hpp"
#include "host/cli/run_files.hpp"

namespace btfield::cli {
namespace {

namespace fs = std::filesystem;

struct BtfSynthArguments {
    std::string model, device;
    std::optional<Size> size;
    std::uint64_t seed = 0;
    std::optional<BtfDirection> view, light;
    bool all = false, surface = false, allow_invalid = false, json = false;
    BtfWritingArguments writing;
};

/// What was grown of a model, whichever method it is of.
struct GrownBtf {
    BtfMeasured measured;
    Size size;
    bool tileable = true;
    Image surface;  ///< height and planes; nothing of textures
    std::function<Image(const BtfDirection& view, const BtfDirection& light)> picture;
};

GrownBtf grown_surface(Device& device, const BtfModel& model, const BtfSynthArguments& options) {
    const auto grown = std::make_shared<const BtfSynthesiser>(
        device, model, options.size.value_or(model.size), options.seed, options.allow_invalid);
    return {
        model, grown->size(), grown->tileable(), grown->surface(),
        [grown](const BtfDirection& view, const BtfDirection& light) { return grown->picture(view, light); }};
}

GrownBtf grown_textures(Device& device, const BtfTextures& model, const BtfSynthArguments& options) {
    const auto grown = std::make_shared<const BtfTextureSynthesiser>(
        device, model, options.size.value_or(model.size), options.seed, options.allow_invalid);
    return {
        model, grown->size(), grown->tileable(), Image(),
        [grown](const BtfDirection& view, const BtfDirection& light) { return grown->picture(view, light); }};
}

/// Of such a set, but for its height.
BtfDescription grown_description(const BtfMeasured& model, Size size) {
    BtfDescription description;
    description.format = "grown";
    description.size = size;
    description.planes = model.colours;
    description.space = model.space;
    description.names = model.names;
    description.white = model.white;
    description.views = model.views;
    description.lights = model.lights;
    return description;
}

/// All pictures of what was grown in the directions of its model.
class GrownSet : public BtfSource {
  public:
    explicit GrownSet(const GrownBtf& grown)
        : grown_(&grown), description_(grown_description(grown.measured, grown.size)) {
        if (grown.surface.planes() == 0) return;
        description_.height = Image(grown.size, 1);
        std::ranges::copy(grown.surface.plane(0), description_.height.values().begin());
    }
    [[nodiscard]] const BtfDescription& description() const override { return description_; }
    [[nodiscard]] Image picture(int view, int light) const override {
        return grown_->picture(description_.views[static_cast<std::size_t>(view)],
                               description_.lights[static_cast<std::size_t>(light)]);
    }

  private:
    const GrownBtf* grown_;
    BtfDescription description_;
};

void check_arguments(const BtfSynthArguments& options) {
    const bool direction = options.view || options.light;
    if (static_cast<int>(direction) + static_cast<int>(options.all) + static_cast<int>(options.surface) != 1)
        throw UsageError("give --view and --light, or --all, or --surface");
    if (direction && !(options.view && options.light)) throw UsageError("--view and --light go together");
}

std::string tiling(const GrownBtf& grown) {
    return grown.tileable ? "Opposite edges continue each other: it tiles.\n" : "It does not tile.\n";
}

void finish(const BtfSynthArguments& options, Json object, const std::string& text, const GrownBtf& grown,
            const Device& device, double set_up, const Stopwatch& total) {
    if (!options.json) {
        emit_result(text + tiling(grown));
        return;
    }
    object["size"] = size_json(grown.size);
    object["seeds"] = Json::array({options.seed});
    object["tileable"] = grown.tileable;
    object["device"] = device.info().name;
    object["seconds"]["setup"] = set_up;
    object["seconds"]["total"] = total.seconds();
    emit_json(object);
}

void run_synth(const BtfSynthArguments& options) {
    const Stopwatch total;
    check_arguments(options);
    if (options.all)
        preload_picture_formats();
    else
        preload_picture_formats(options.writing.output);
    const std::variant<BtfModel, BtfTextures> model = read_any_btf(options.model);
    const auto* const joint = std::get_if<BtfModel>(&model);
    if (options.surface && !joint)
        throw InputError("write the surface of '" + options.model + "'",
                         "it holds textures of pictures, not planes of a surface",
                         "use a model of the method joint");
    const BtfMeasured& measured =
        joint ? static_cast<const BtfMeasured&>(*joint) : std::get<BtfTextures>(model);
    const int colours = measured.colours;
    const Size wanted = options.size.value_or(measured.size);
    BtfWritingArguments writing = options.writing;
    if (options.all) check_btf_writing(writing, {options.model}, grown_description(measured, wanted));
    const std::string& output = options.writing.output;
    if (!options.all) {
        RunFiles files(options.writing.overwrite, options.json);
        files.reads(options.model, "that is the model");
        files.writes(output);
        check_writable(output, options.surface ? joint->planes() + 1 : colours,
                       options.surface ? PixelType::float32 : PixelType::uint8, options.writing.how.type,
                       wanted);
    }
    Device device(options.device);
    const GrownBtf grown = joint ? grown_surface(device, *joint, options)
                                 : grown_textures(device, std::get<BtfTextures>(model), options);
    const Size size = grown.size;
    const double set_up = total.seconds();
    Json object;
    object["outputs"] = Json::array({output});
    if (options.all) {
        const BtfSet set(std::make_shared<const GrownSet>(grown));
        const BtfWriteReport report = write_told(writing, set);
        object["pictures"] = report.pictures;
        object["bytes"] = report.bytes;
        object["clamped_pixels"] = report.clamped_pixels;
        put_components(report, object);
        finish(options, std::move(object),
               "wrote " + output + ": " + std::to_string(report.pictures) + " pictures of " +
                   detail::text_of(size) + " pixels, seed " + std::to_string(options.seed) + "\n" +
                   components_text(report),
               grown, device, set_up, total);
        return;
    }
    WriteOptions how;
    how.type = options.writing.how.type;
    if (options.surface) {
        Image surface = grown.surface;
        std::vector<std::string> names{"height"};
        for (int k = 1; k < surface.planes(); ++k) names.push_back("T" + std::to_string(k));
        surface.set_names(names);
        how.source = PixelType::float32;
        object["clamped_pixels"] = write_picture(output, surface, how).clamped_pixels;
        finish(options, std::move(object),
               "wrote " + output + ": height in pixels and " + detail::counted(joint->planes(), "plane") +
                   ", " + detail::text_of(size) + " pixels, seed " + std::to_string(options.seed) + "\n",
               grown, device, set_up, total);
        return;
    }
    const Stopwatch showing;
    Image picture = grown.picture(*options.view, *options.light);
    const double seconds = showing.seconds();
    const auto exposure = static_cast<float>(options.writing.how.exposure);
    for (float& value : picture.values()) value *= exposure;
    const WriteReport report = write_picture(output, picture, how);
    object["clamped_pixels"] = report.clamped_pixels;
    object["seconds"]["per_texture"] = seconds;
    std::string text = "wrote " + output + ": " + detail::text_of(size) + " pixels, seed " +
                       std::to_string(options.seed) + "\n";
    if (report.clamped_pixels > 0)
        text += detail::counted(report.clamped_pixels, "pixel") +
                " are brighter than white and were clamped; a lower --exposure keeps them.\n";
    finish(options, std::move(object), text, grown, device, set_up, total);
}

void add_direction(CLI::App& app, const std::string& name, std::optional<BtfDirection>& value,
                   const std::string& help) {
    const auto read = [name, &value](const std::string& text) {
        value = parse_direction(text);
        if (!value)
            throw CLI::ValidationError(name,
                                       "'" + text + "' is not THETA,PHI in degrees, theta from 0 to 89");
    };
    app.add_option_function<std::string>(name, read, help)->type_name("THETA,PHI");
}

}  // namespace

void add_btf_synth(CLI::App& parent, Action& action) {
    CLI::App* command = parent.add_subcommand("synth", "grow a BTF, and show it from anywhere");
    const auto options = std::make_shared<BtfSynthArguments>();
    command->add_option("MODEL", options->model, "model that btf fit wrote")->required()->type_name("");
    add_btf_writing(*command, options->writing);
    add_direction(*command, "--view", options->view, "one picture: direction to the viewer, in degrees");
    add_direction(*command, "--light", options->light, "and to the light");
    command->add_flag("--all", options->all, "all views and lights of the model's set, into a folder");
    command->add_flag("--surface", options->surface,
                      "the grown surface itself: height and planes, as EXR or TIFF");
    add_size(*command, "--size", options->size, "of the pictures, WxH (default: those of the set)");
    add_uint64(*command, "--seed", options->seed,
               "another seed is another piece of the material (default: 0)");
    command->add_flag("--allow-invalid", options->allow_invalid, "grow a model although a certificate fails");
    add_device(*command, options->device);
    add_json(*command, options->json);
    set_guide(*command,
              {.usual = {{"btfield btf synth rock.btfm -o rock.png --view 0,0 --light 60,90"}},
               .more = {{"btfield btf synth rock.btfm -o a.png --view 30,45 --light 9.5,10 --size 512"},
                        {"btfield btf synth rock.btfm -o rock-large/ --all --size 512",
                         "a set as the one that was measured, of 512 x 512 pixels"}}});
    command->callback([options, &action] { action = [options] { run_synth(*options); }; });
}

}  // namespace btfield::cli

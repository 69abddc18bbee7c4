#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <variant>

#include "btfield/btf_model.hpp"
#include "btfield/btf_page.hpp"
#include "btfield/btf_textures.hpp"
#include "btfield/device.hpp"
#include "btfield/error.hpp"
#include "host/base/file_output.hpp"
#include "host/base/text.hpp"
#include "host/cli/btf_parts.hpp"
#include "host/cli/command_text.hpp"
#include "host/cli/options.hpp"
#include "host/cli/output_names.hpp"
#include "host/cli/report.hpp"
#include "host/cli/run_files.hpp"

namespace btfield::cli {
namespace {

namespace fs = std::filesystem;

struct ViewArguments {
    std::string model, output, device;
    std::optional<Size> size;
    std::optional<int> planes;
    std::uint64_t seed = 0;
    bool allow_invalid = false, overwrite = false, json = false;
};

void run_view(const ViewArguments& options) {
    const Stopwatch total;
    const std::variant<BtfModel, BtfTextures> either = read_any_btf(options.model);
    if (const auto* const textures = std::get_if<BtfTextures>(&either))
        throw InputError("write a page of '" + options.model + "'",
                         "the method " + std::string(name(textures->method)) +
                             " made textures of pictures, and a page shows planes of a surface",
                         "use a model of btf fit --method joint, or btf render");
    const auto& model = std::get<BtfModel>(either);
    RunFiles files(options.overwrite, options.json);
    files.reads(options.model, "that is the model");
    files.writes_text(options.output);
    const std::string asked = "write '" + options.output + "'";
    if (const std::string ending = lower_extension(options.output); ending != ".html" && ending != ".htm")
        throw InputError(asked, "a page is an HTML file", "let its name end in .html");
    detail::check_output(options.output, asked);
    Device device(options.device);
    const BtfSynthesiser grown(device, model, options.size.value_or(model.size), options.seed,
                               options.allow_invalid);
    if (!grown.tileable())
        warn("a tile of " + detail::text_of(grown.size()) +
             " pixels does not continue at its edges; sides without factors above 13 do");
    const double set_up = total.seconds();
    Progress progress;
    BtfPageOptions how;
    how.title = fs::path(options.model).stem().string();
    how.planes = options.planes.value_or(0);
    how.progress = [&](double share) { progress.show(share, "directions"); };
    const Stopwatch making;
    const std::string page = btf_page(model, grown, how);
    const double made = making.seconds();
    detail::write_file(options.output, page, asked);
    if (options.json) {
        Json object;
        object["output"] = options.output;
        object["bytes"] = page.size();
        object["size"] = size_json(grown.size());
        object["planes"] = how.planes == 0 ? model.planes() : how.planes;
        object["tileable"] = grown.tileable();
        object["seed"] = options.seed;
        object["device"] = device.info().name;
        object["seconds"] = {{"setup", set_up}, {"page", made}, {"total", total.seconds()}};
        emit_json(object);
        return;
    }
    emit_result("wrote " + options.output + ": " + number_text(static_cast<double>(page.size()) / 1e6) +
                " MB, a tile of " + detail::text_of(grown.size()) + " pixels, seed " +
                std::to_string(options.seed) + "; open it in a browser\n");
}

}  // namespace

void add_btf_view(CLI::App& parent, Action& action) {
    CLI::App* command = parent.add_subcommand("view", "make a page that shows a material in a browser");
    const auto options = std::make_shared<ViewArguments>();
    command->add_option("MODEL", options->model, "model that btf fit wrote")->required()->type_name("");
    command->add_option("-o,--output", options->output, "the page, with all that it needs in it")
        ->required()
        ->type_name("PAGE.html");
    add_size(*command, "--size", options->size,
             "of the tile that is grown and repeated, WxH (default: that of the model)");
    add_int(*command, "--planes", options->planes, 1, 1 << 16,
            "the first so many of the model's planes: a smaller page (default: all)");
    add_uint64(*command, "--seed", options->seed,
               "another seed is another piece of the material (default: 0)");
    command->add_flag("--allow-invalid", options->allow_invalid, "grow a model although a certificate fails");
    add_overwrite(*command, options->overwrite);
    add_device(*command, options->device);
    add_json(*command, options->json);
    set_guide(*command,
              {.usual = {{"btfield btf view rock.btfm -o rock.html"}},
               .more = {{"btfield btf view rock.btfm -o rock.html --size 256 --planes 12"}},
               .notes = {"The page needs WebGL 2 and nothing from the network. Dragging moves the light, the "
                         "right button the view; ? lists the keys."}});
    command->callback([options, &action] { action = [options] { run_view(*options); }; });
}

}  // namespace btfield::cli

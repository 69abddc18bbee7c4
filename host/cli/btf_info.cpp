#include <cstdint>
#include <filesystem>
#include <limits>
#include <memory>
#include <string>
#include <variant>

#include "btfield/btf_model.hpp"
#include "btfield/btf_textures.hpp"
#include "host/base/text.hpp"
#include "host/cli/btf_fit_textures.hpp"
#include "host/cli/btf_parts.hpp"
#include "host/cli/command_text.hpp"
#include "host/cli/model_report.hpp"
#include "host/cli/options.hpp"
#include "host/cli/report.hpp"

namespace btfield::cli {
namespace {

struct InfoArguments {
    std::string set;
    BtfOptions reading;
    bool json = false;
};

/// Bytes of a model's parts, however its file packs them.
struct ModelParts {
    std::uintmax_t mean = 0, contrast = 0, weights = 0, rest = 0;
};

ModelParts parts_of(const BtfModel& model, std::uintmax_t bytes) {
    ModelParts parts{2 * model.tables.mean.size(), model.tables.contrast.size(), model.tables.weights.size()};
    const std::uintmax_t tables = parts.mean + parts.contrast + parts.weights;
    parts.rest = bytes > tables ? bytes - tables : 0;
    return parts;
}

Json btf_model_json(const BtfModel& model, std::uintmax_t bytes) {
    Json object;
    object["format"] = "model";
    object["method"] = "joint";
    object["size"] = size_json(model.size);
    object["planes"] = model.colours;
    object["views"] = model.views.size();
    object["lights"] = model.lights.size();
    object["pictures"] = model.pairs.size();
    object["colour"] = std::string(name(model.space));
    object["white"] = number(model.white);
    object["kept_pictures"] = model.tables.kept.size();
    object["table_error"] = number(model.table_error);
    object["surface_planes"] = model.planes();
    object["model"] = std::string(surface_name(model));
    object["valid"] = is_valid(model);
    object["unexplained"] = number(model.unexplained);
    object["relief"]["from"] = model.relief;
    object["relief"]["scale_factor"] = number(model.scale_factor);
    object["bytes"] = bytes;
    const ModelParts parts = parts_of(model, bytes);
    object["parts"]["mean"] = parts.mean;
    object["parts"]["contrast"] = parts.contrast;
    object["parts"]["weights"] = parts.weights;
    object["parts"]["field"] = parts.rest;
    object["compression_ratio"] = number(compression_ratio(model.picture_bytes, bytes));
    object["file_ratio"] = number(compression_ratio(model.file_bytes, bytes));
    return object;
}

std::string btf_model_text(const BtfModel& model, std::uintmax_t bytes) {
    std::string text = "model     joint: height and " + detail::counted(model.planes(), "plane") + " as " +
                       std::string(surface_name(model)) + "\n";
    text += "pictures  " + std::to_string(model.pairs.size()) + ": " +
            detail::counted(model.views.size(), "view") + " x " +
            detail::counted(model.lights.size(), "light") + ", of " + detail::text_of(model.size) +
            " pixels, " + detail::counted(model.colours, "plane") + "; weights of " +
            std::to_string(model.tables.kept.size()) + " are kept\n";
    text += "relief    " + model.relief + ", times " + number_text(model.scale_factor) + "\n";
    text += "left      " + number_text(100.0 * model.unexplained) + " % of the variance, tables add " +
            number_text(100.0 * model.table_error) + " %\n";
    const ModelParts parts = parts_of(model, bytes);
    text += "bytes     " + std::to_string(bytes) + ": means " + std::to_string(parts.mean) + ", contrasts " +
            std::to_string(parts.contrast) + ", weights " + std::to_string(parts.weights) + ", field " +
            std::to_string(parts.rest) + "\n";
    text +=
        "ratio     1 : " + number_text(compression_ratio(model.picture_bytes, bytes)) + " of 8-bit pictures";
    if (model.file_bytes > 0)
        text += ", 1 : " + number_text(compression_ratio(model.file_bytes, bytes)) + " of the set's files";
    return text + "\n";
}

bool names_model(const std::string& file) {
    const auto extension = std::filesystem::path(file).extension();
    return extension == ".btfm" || extension == ".json";
}

void run_info(const InfoArguments& options) {
    if (names_model(options.set)) {
        const std::variant<BtfModel, BtfTextures> read = read_any_btf(options.set);
        const std::uintmax_t bytes = model_file_bytes(options.set);
        if (const auto* textures = std::get_if<BtfTextures>(&read)) {
            if (options.json)
                emit_json(textures_json(*textures, bytes));
            else
                emit_text(textures_text(*textures, bytes));
            return;
        }
        const auto& model = std::get<BtfModel>(read);
        if (options.json)
            emit_json(btf_model_json(model, bytes));
        else
            emit_text(btf_model_text(model, bytes));
        return;
    }
    const BtfSet set = open_told(options.set, options.reading);
    if (options.json)
        emit_json(set_json(set));
    else
        emit_text(set_text(set));
}

}  // namespace

void add_btf_info(CLI::App& parent, Action& action) {
    CLI::App* command = parent.add_subcommand("info", "tell what a BTF has: directions, size, colours");
    const auto options = std::make_shared<InfoArguments>();
    command->add_option("SET", options->set, "a BTF (docs/btf.md), or a model of one")
        ->required()
        ->type_name("");
    add_btf_reading(*command, options->reading);
    add_json(*command, options->json);
    set_guide(*command,
              {.usual = {{"btfield btf info set/"}},
               .more = {{"btfield btf info set/ --json"}, {"btfield btf info rock.btfm", "bytes by part"}},
               .notes = {"Pictures without which the set is not complete are counted as missing. "
                         "Two of the same directions are an error."}});
    command->callback([options, &action] { action = [options] { run_info(*options); }; });
}

}  // namespace btfield::cli

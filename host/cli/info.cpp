#include <cstdint>
#include <memory>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "btfield/compound.hpp"
#include "btfield/error.hpp"
#include "host/cli/command.hpp"
#include "host/cli/command_text.hpp"
#include "host/cli/compound_report.hpp"
#include "host/cli/model_report.hpp"
#include "host/cli/options.hpp"
#include "host/cli/report.hpp"

namespace btfield::cli {
namespace {

struct InfoArguments {
    std::vector<std::string> models;
    bool json = false;
};

/// What both kinds of models say of where they come from.
void add_provenance(Json& object, const Provenance& provenance) {
    object["software"] = provenance.software;
    object["picture_bytes"] = provenance.picture_bytes;
    object["reasons"] = provenance.reasons;
}

Json info_json(const CompoundModel& model, const std::string& file, std::uintmax_t bytes) {
    Json object = compound_json(model, file, bytes);
    add_provenance(object, model.provenance);
    return object;
}

Json info_json(const TextureModel& model, const std::string& file, std::uintmax_t bytes) {
    Json object = model_json(model, file, bytes);
    Json means = Json::array();
    for (const double mean : model.mean) means.push_back(number(mean));
    object["mean"] = std::move(means);
    add_provenance(object, model.provenance);
    return object;
}

std::string info_text(const CompoundModel& model, std::uintmax_t bytes) {
    return compound_text(model, bytes) + "written by " + model.provenance.software + "\n";
}

std::string info_text(const TextureModel& model, std::uintmax_t bytes) {
    std::string text = model_text(model, bytes) + "mean";
    for (const double mean : model.mean) text += " " + number_text(mean);
    text += "\nwritten by " + model.provenance.software + "\n";
    if (!is_valid(model))
        text += "synth refuses this model: the certificate fails at " + uncertified_levels(model) + "\n";
    return text;
}

void run(const InfoArguments& options) {
    Json objects = Json::array();
    std::string text;
    for (const std::string& file : options.models) {
        const std::uintmax_t bytes = model_file_bytes(file);
        const auto show = [&](const auto& model) {
            if (options.json)
                objects.push_back(info_json(model, file, bytes));
            else
                text += (text.empty() ? "" : "\n") + info_text(model, bytes);
        };
        std::visit(show, read_any_model(file));
    }
    emit_answers(options.json, objects, "models", text);
}

}  // namespace

void add_info(CLI::App& app, Action& action) {
    CLI::App* command = app.add_subcommand("info", "show what model files hold");
    const auto options = std::make_shared<InfoArguments>();
    take_dash(command->add_option("MODEL", options->models, "model file; - is standard input")
                  ->required()
                  ->type_name(""),
              "/dev/stdin");
    add_json(*command, options->json);
    set_guide(*command, {.usual = {{"btfield info cork.json"}}, .more = {{"btfield info models/*.json"}}});
    command->callback([options, &action] { action = [options] { run(*options); }; });
}

}  // namespace btfield::cli

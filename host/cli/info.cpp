#include <filesystem>
#include <memory>
#include <variant>

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
    std::string model;
    bool json = false;
};

void show(const CompoundModel& model, const InfoArguments& options, std::uintmax_t bytes) {
    if (!options.json) {
        emit_text(compound_text(model, bytes) + "written by " + model.provenance.software + "\n");
        return;
    }
    Json object = compound_json(model, options.model, bytes);
    object["software"] = model.provenance.software;
    object["picture_bytes"] = model.provenance.picture_bytes;
    object["reasons"] = model.provenance.reasons;
    emit_json(object);
}

void run(const InfoArguments& options) {
    const std::uintmax_t bytes = model_file_bytes(options.model);
    const std::variant<TextureModel, CompoundModel> either = read_any_model(options.model);
    if (const auto* compound = std::get_if<CompoundModel>(&either)) {
        show(*compound, options, bytes);
        return;
    }
    const auto& model = std::get<TextureModel>(either);
    if (options.json) {
        Json object = model_json(model, options.model, bytes);
        Json means = Json::array();
        for (const double mean : model.mean) means.push_back(number(mean));
        object["mean"] = std::move(means);
        object["software"] = model.provenance.software;
        object["picture_bytes"] = model.provenance.picture_bytes;
        object["reasons"] = model.provenance.reasons;
        emit_json(object);
        return;
    }
    std::string text = model_text(model, bytes);
    text += "mean";
    for (const double mean : model.mean) text += " " + number_text(mean);
    text += "\nwritten by " + model.provenance.software + "\n";
    if (!is_valid(model))
        text += "synth refuses this model: the certificate fails at " + uncertified_levels(model) + "\n";
    emit_text(text);
}

}  // namespace

void add_info(CLI::App& app, Action& action) {
    CLI::App* command = app.add_subcommand("info", "show what a model file holds");
    const auto options = std::make_shared<InfoArguments>();
    command->add_option("MODEL", options->model, "model file")->required()->type_name("");
    add_json(*command, options->json);
    set_guide(*command, {{{"btfield info cork.json"}}});
    command->callback([options, &action] { action = [options] { run(*options); }; });
}

}  // namespace btfield::cli

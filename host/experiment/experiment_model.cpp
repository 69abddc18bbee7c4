#include "btfield/experiment.hpp"
#include "host/experiment/experiment_names.hpp"

namespace btfield {

using namespace detail;

std::string_view name(ExperimentModel model) {
    return word_of(model);
}

ExperimentModel experiment_model(ModelKind kind) {
    return static_cast<ExperimentModel>(kind);
}

std::optional<ModelKind> random_field(ExperimentModel model) {
    if (model > ExperimentModel::pmrf3d) return std::nullopt;
    return static_cast<ModelKind>(model);
}

}  // namespace btfield

#include "btfield/models.hpp"

#include <cstddef>
#include <string>
#include <utility>

#include "host/model/model_names.hpp"

namespace btfield {

using namespace detail;

std::string_view name(ModelKind kind) {
    return word_of(kind);
}

ModelKind model_kind(std::string_view name) {
    return value_of<ModelKind>(name);
}

std::span<const ModelKind> model_kinds() {
    static constexpr auto kinds = values_of<ModelKind>();
    return kinds;
}

bool is_2d(ModelKind kind) {
    switch (kind) {
        case ModelKind::car2d:
        case ModelKind::ma2d:
        case ModelKind::msar2d:
        case ModelKind::mmrf2d:
        case ModelKind::pmrf2d:
            return true;
        case ModelKind::car3d:
        case ModelKind::ma3d:
        case ModelKind::msar3d:
        case ModelKind::mmrf3d:
        case ModelKind::pmrf3d:
            break;
    }
    return false;
}

Family family(ModelKind kind) {
    switch (kind) {
        case ModelKind::car2d:
        case ModelKind::car3d:
            return Family::car;
        case ModelKind::ma2d:
        case ModelKind::ma3d:
            return Family::ma;
        case ModelKind::msar2d:
        case ModelKind::msar3d:
            return Family::msar;
        case ModelKind::mmrf2d:
        case ModelKind::mmrf3d:
            return Family::mmrf;
        case ModelKind::pmrf2d:
        case ModelKind::pmrf3d:
            break;
    }
    return Family::pmrf;
}

Model model_of(Family family, LinearField field) {
    switch (family) {
        case Family::car:
            return CarModel{std::move(field)};
        case Family::msar:
            return SarModel{std::move(field)};
        case Family::ma:
            return MaModel{std::move(field)};
        case Family::mmrf:
            return MrfModel{std::move(field), MrfForm::mmrf};
        case Family::pmrf:
            break;
    }
    return MrfModel{std::move(field), MrfForm::pmrf};
}

std::string_view name(Estimator estimator) {
    return word_of(estimator);
}

Estimator estimator(std::string_view name) {
    return value_of<Estimator>(name);
}

std::string_view name(NoiseForm form) {
    return word_of(form);
}

NoiseForm noise_form(std::string_view name) {
    return value_of<NoiseForm>(name);
}

std::string_view name(MapRole role) {
    return word_of(role);
}

MapRole map_role(std::string_view name) {
    return value_of<MapRole>(name);
}

const LinearField& linear_field(const Model& model) {
    return std::visit([](const auto& m) -> const LinearField& { return m; }, model);
}

namespace {

/// Coefficients that are free: Markov ones come in pairs, where s and −s share theirs.
std::size_t free_coefficients(const Model& model) {
    const LinearField& field = linear_field(model);
    std::size_t coefficients = field.coefficients.size();
    for (const std::uint8_t present : field.active) coefficients -= present == 0 ? 1 : 0;
    return std::holds_alternative<MrfModel>(model) ? coefficients / 2 : coefficients;
}

}  // namespace

std::size_t parameter_count(const LevelModel& level, NoiseForm noise) {
    std::size_t count = 0;
    for (const Model& part : level.models) {
        const auto d = static_cast<std::size_t>(linear_field(part).planes);
        count += free_coefficients(part) + (noise == NoiseForm::full ? d * (d + 1) / 2 : d);
    }
    return count;
}

std::size_t parameter_count(const TextureModel& model) {
    std::size_t count = model.mean.size();
    // Of a level, and its gain.
    for (const LevelModel& level : model.levels) count += parameter_count(level, model.noise) + 1;
    for (const Marginal& marginal : model.marginals) count += marginal.values.size();
    const auto r = static_cast<std::size_t>(model.basis.rank), d = static_cast<std::size_t>(model.planes);
    if (!model.marginals.empty()) count += is_2d(model.kind) ? r : r * (r + 1) / 2;
    count += model.basis.scale.size();
    return count + (model.basis.planes > 0 ? r * d - r * (r + 1) / 2 : 0);  // orthonormal rows
}

int modelled_planes(const TextureModel& model) {
    return model.basis.planes > 0 ? model.basis.rank : model.planes;
}

bool is_valid(const TextureModel& model) {
    for (const LevelModel& level : model.levels) {
        if (!level.certificate.valid) return false;
    }
    return true;
}

}  // namespace btfield

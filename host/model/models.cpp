#include "btfield/models.hpp"

#include <array>
#include <cstddef>
#include <string>
#include <utility>

#include "btfield/error.hpp"

namespace btfield {
namespace {

template <typename Enum, std::size_t N>
using Names = std::array<std::pair<Enum, std::string_view>, N>;

constexpr Names<ModelKind, 10> kind_names{{{ModelKind::car2d, "2d-car"},
                                           {ModelKind::car3d, "3d-car"},
                                           {ModelKind::ma2d, "2d-ma"},
                                           {ModelKind::ma3d, "3d-ma"},
                                           {ModelKind::msar2d, "2d-msar"},
                                           {ModelKind::msar3d, "3d-msar"},
                                           {ModelKind::mmrf2d, "2d-mmrf"},
                                           {ModelKind::mmrf3d, "3d-mmrf"},
                                           {ModelKind::pmrf2d, "2d-pmrf"},
                                           {ModelKind::pmrf3d, "3d-pmrf"}}};
constexpr Names<Estimator, 3> estimators{{{Estimator::least_squares, "ls"},
                                          {Estimator::maximum_likelihood, "ml"},
                                          {Estimator::random_decrement, "rd"}}};
constexpr Names<NoiseForm, 2> noise_forms{{{NoiseForm::full, "full"}, {NoiseForm::diagonal, "diagonal"}}};

template <typename Enum, std::size_t N>
std::string_view name_in(const Names<Enum, N>& names, Enum value, const char* what) {
    for (const auto& [candidate, text] : names) {
        if (candidate == value) return text;
    }
    throw InputError(std::string("name a ") + what, "there is none of this value",
                     "use one of the declared values");
}

template <typename Enum, std::size_t N>
Enum value_in(const Names<Enum, N>& names, std::string_view text, const char* what) {
    std::string known;
    for (const auto& [value, candidate] : names) {
        if (candidate == text) return value;
        known += known.empty() ? "" : ", ";
        known += candidate;
    }
    throw InputError(std::string("find the ") + what + " '" + std::string(text) + "'", "it is not known",
                     "use " + known);
}

}  // namespace

std::string_view name(ModelKind kind) {
    return name_in(kind_names, kind, "model");
}

ModelKind model_kind(std::string_view name) {
    return value_in(kind_names, name, "model");
}

std::span<const ModelKind> model_kinds() {
    static constexpr auto kinds = [] {
        std::array<ModelKind, kind_names.size()> list{};
        for (std::size_t i = 0; i < list.size(); ++i) list[i] = kind_names[i].first;
        return list;
    }();
    return kinds;
}

bool is_2d(ModelKind kind) {
    return name(kind).front() == '2';
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
    return name_in(estimators, estimator, "estimator");
}

Estimator estimator(std::string_view name) {
    return value_in(estimators, name, "estimator");
}

std::string_view name(NoiseForm form) {
    return name_in(noise_forms, form, "noise form");
}

NoiseForm noise_form(std::string_view name) {
    return value_in(noise_forms, name, "noise form");
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

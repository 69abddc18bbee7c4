#include "host/btf/surface_field.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>
#include <optional>
#include <span>
#include <string>
#include <utility>

#include "btfield/error.hpp"
#include "btfield/height.hpp"
#include "btfield/material.hpp"
#include "btfield/roller.hpp"
#include "btfield/synthesis.hpp"
#include "host/base/eigen.hpp"
#include "host/base/parallel.hpp"
#include "host/base/text.hpp"
#include "host/btf/btf_measured.hpp"
#include "host/btf/btf_tables.hpp"

namespace btfield::detail {
namespace {

template <class... Kinds>
struct Overloaded : Kinds... {
    using Kinds::operator()...;
};
template <class... Kinds>
Overloaded(Kinds...) -> Overloaded<Kinds...>;

/// Planes T with mean 0 and covariance 1 over the surface, as those have that the weights were fitted to:
/// without it, how bright a piece is would depend on the stones that happen to lie in it.
void standardise(Image& surface) {
    const int planes = surface.planes() - 1;
    const auto count = static_cast<double>(area(surface.size()));
    if (count < 4.0 * planes) return;  // too few pixels to tell
    for (int k = 1; k <= planes; ++k) {
        const auto plane = surface.plane(k);
        const double mean =
            std::accumulate(plane.begin(), plane.end(), 0.0, [](double sum, float v) { return sum + v; }) /
            count;
        for (float& value : plane) value = static_cast<float>(value - mean);
    }
    Eigen::MatrixXd covariance(planes, planes);
    for_each_block(planes, [&](int i) {
        const auto a = surface.plane(i + 1);
        for (int j = 0; j <= i; ++j) {
            const auto b = surface.plane(j + 1);
            double sum = 0.0;
            for (std::size_t p = 0; p < a.size(); ++p)
                sum += static_cast<double>(a[p]) * static_cast<double>(b[p]);
            covariance(i, j) = covariance(j, i) = sum / count;
        }
    });
    const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(covariance);
    if (!(solver.eigenvalues()[0] > 1e-3)) return;  // a piece too small for its planes
    const Eigen::VectorXd scale = solver.eigenvalues().cwiseSqrt().cwiseInverse();
    const Eigen::MatrixXd& axes = solver.eigenvectors();
    const Eigen::MatrixXd root = axes * scale.asDiagonal() * axes.transpose();
    const Image before = surface;
    for_each_block(planes, [&](int i) {
        const auto to = surface.plane(i + 1);
        std::ranges::fill(to, 0.0F);
        for (int j = 0; j < planes; ++j) {
            const auto factor = static_cast<float>(root(i, j));
            const auto from = before.plane(j + 1);
            for (std::size_t p = 0; p < to.size(); ++p) to[p] += factor * from[p];
        }
    });
}

std::vector<std::string> names_of(int planes) {
    std::vector<std::string> names{"height"};
    for (int k = 1; k <= planes; ++k) names.push_back("T" + std::to_string(k));
    return names;
}

std::vector<MaterialMap> maps_of(const Image& surface) {
    Image height(surface.size(), 1);
    std::ranges::copy(surface.plane(0), height.values().begin());
    MaterialMap relief{"height", MapRole::height, 1, ColourSpace::unspecified, PixelType::float32};
    relief.scale = encoded_height_scale(height);
    return {relief, MaterialMap{"planes", MapRole::other, surface.planes() - 1, ColourSpace::unspecified,
                                PixelType::float32}};
}

bool has_relief(const Image& surface) {
    const auto [low, high] = std::ranges::minmax_element(surface.plane(0));
    return *high > *low;
}

TextureModel fit_field(Device& device, const Image& surface, const FitOptions& options) {
    TextureModel model = fit(device, surface, options);
    model.names = surface.names();
    model.provenance.maps = maps_of(surface);
    if (has_relief(surface)) {
        SynthesisOptions trial;
        trial.allow_invalid = true;
        Synthesiser synthesiser(device, model, surface.size(), trial);
        match_relief(device, model.provenance.maps, surface, synthesiser.synthesise(1));
    }
    return model;
}

CompoundModel fit_regions(Device& device, const Image& surface, const Image& look,
                          std::optional<int> regions) {
    CompoundOptions options;
    options.clusters.regions = regions;
    if (look.planes() != 3) options.clusters.space = ClusterSpace::planes;
    Clustering clustering = cluster(look, options.clusters);
    options.labels = std::move(clustering.field);
    CompoundModel model = fit_compound(device, surface, options);
    model.provenance.maps = maps_of(surface);
    if (!clustering.reason.empty()) model.provenance.reasons.push_back(clustering.reason);
    if (has_relief(surface))
        match_relief(device, model.provenance.maps, surface,
                     CompoundSynthesiser(device, model, surface.size(), true).synthesise(1));
    return model;
}

template <typename Number>
double quantise(std::span<const float> values, std::vector<Number>& to) {
    constexpr auto most = static_cast<double>(std::numeric_limits<Number>::max());
    float largest = 0.0F;
    for (const float value : values) largest = std::max(largest, std::abs(value));
    const double unit = largest > 0.0F ? static_cast<double>(largest) / most : 1.0;
    for (const float value : values)
        to.push_back(static_cast<Number>(std::lround(static_cast<double>(value) / unit)));
    return unit;
}

SurfaceSample sample_of(const Image& surface) {
    SurfaceSample sample;
    sample.size = surface.size();
    sample.height_unit = quantise(surface.plane(0), sample.height);
    for (int k = 1; k < surface.planes(); ++k)
        sample.plane_units.push_back(quantise(surface.plane(k), sample.planes));
    return sample;
}

Image image_of(const SurfaceSample& sample) {
    Image image(sample.size, 1 + static_cast<int>(sample.plane_units.size()));
    const std::size_t pixels = area(sample.size);
    for (std::size_t p = 0; p < pixels; ++p)
        image.plane(0)[p] = static_cast<float>(sample.height_unit * sample.height[p]);
    for (std::size_t k = 0; k < sample.plane_units.size(); ++k)
        for (std::size_t p = 0; p < pixels; ++p)
            image.plane(static_cast<int>(k) + 1)[p] =
                static_cast<float>(sample.plane_units[k] * sample.planes[k * pixels + p]);
    return image;
}

/// Heights with their gains, of models that have them.
void raise(Device& device, const std::vector<MaterialMap>& maps, GrownSurface& grown) {
    const std::vector<Image> split = split_maps(
        device, maps, grown.surface, grown.tileable ? SurfaceEdges::periodic : SurfaceEdges::mirror);
    std::ranges::copy(split.front().values(), grown.surface.plane(0).begin());
}

void check_maps(const std::vector<MaterialMap>& maps, int of_model, int planes) {
    if (of_model != planes + 1)
        refuse_model("its surface has " + counted(of_model, "plane") + ", not the height and " +
                     std::to_string(planes));
    if (maps.size() != 2 || maps[0].role != MapRole::height || maps[0].planes != 1 ||
        maps[1].planes != planes)
        refuse_model("its surface is not a height and planes");
}

void check_sample(const SurfaceSample& sample, int planes) {
    const Size size = sample.size;
    if (size.height < 16 || size.width < 16 || size.height > 16384 || size.width > 16384)
        refuse_model("its sample has " + text_of(size) + " pixels, which the roller cannot cut");
    const std::size_t pixels = area(size);
    if (sample.plane_units.size() != static_cast<std::size_t>(planes) || sample.height.size() != pixels ||
        sample.planes.size() != pixels * sample.plane_units.size())
        refuse_model("its sample has not a height and planes of each pixel");
    const auto sound = [](double unit) { return std::isfinite(unit) && unit > 0.0; };
    if (!sound(sample.height_unit) || !std::ranges::all_of(sample.plane_units, sound))
        refuse_model("a unit of its sample is not above 0");
}

}  // namespace

SurfaceField fit_surface(Device& device, const Image& surface, const Image& look,
                         const BtfFitOptions& options) {
    Image named = surface;
    named.set_names(names_of(surface.planes() - 1));
    switch (options.surface) {
        case SurfaceKind::field:
            return fit_field(device, named, options.field);
        case SurfaceKind::compound:
            return fit_regions(device, named, look, options.regions);
        case SurfaceKind::roll:
            break;
    }
    return sample_of(surface);
}

void check_surface(const SurfaceField& field, int planes) {
    std::visit(Overloaded{[&](const TextureModel& model) {
                              check_maps(model.provenance.maps, model.planes, planes);
                              check(model);
                          },
                          [&](const CompoundModel& model) {
                              check_maps(model.provenance.maps, model.planes, planes);
                              check(model);
                          },
                          [&](const SurfaceSample& sample) { check_sample(sample, planes); }},
               field);
}

GrownSurface grow_surface(Device& device, const SurfaceField& field, Size size, std::uint64_t seed,
                          bool allow_invalid) {
    GrownSurface grown;
    std::visit(Overloaded{[&](const TextureModel& model) {
                              SynthesisOptions options;
                              options.allow_invalid = allow_invalid;
                              Synthesiser synthesiser(device, model, size, options);
                              grown = {synthesiser.synthesise(seed), synthesiser.tileable()};
                              raise(device, model.provenance.maps, grown);
                          },
                          [&](const CompoundModel& model) {
                              CompoundSynthesiser synthesiser(device, model, size, allow_invalid);
                              grown = {synthesiser.synthesise(seed), synthesiser.tileable()};
                              raise(device, model.provenance.maps, grown);
                          },
                          [&](const SurfaceSample& sample) {
                              const std::array<Image, 1> surface{image_of(sample)};
                              RollerOptions options;
                              options.seed = seed;
                              Roller roller(device, surface);
                              grown.surface = apply(roller.quilt(size, options), surface.front());
                          }},
               field);
    standardise(grown.surface);
    return grown;
}

}  // namespace btfield::detail

namespace btfield {

std::string_view surface_name(const BtfModel& model) {
    switch (model.surface_kind()) {
        case SurfaceKind::field:
            return name(std::get<TextureModel>(model.surface).kind);
        case SurfaceKind::compound:
            return "compound";
        case SurfaceKind::roll:
            break;
    }
    return "roll";
}

std::size_t parameter_count(const BtfModel& model) {
    const BtfTables& tables = model.tables;
    const std::size_t of_tables = tables.mean.size() + tables.contrast.size() + tables.weights.size();
    if (const auto* field = std::get_if<TextureModel>(&model.surface))
        return of_tables + parameter_count(*field);
    if (const auto* compound = std::get_if<CompoundModel>(&model.surface))
        return of_tables + parameter_count(*compound);
    const auto& sample = std::get<SurfaceSample>(model.surface);
    return of_tables + sample.height.size() + sample.planes.size();
}

bool is_valid(const BtfModel& model) {
    if (const auto* field = std::get_if<TextureModel>(&model.surface)) return is_valid(*field);
    if (const auto* compound = std::get_if<CompoundModel>(&model.surface)) return is_valid(*compound);
    return true;
}

}  // namespace btfield

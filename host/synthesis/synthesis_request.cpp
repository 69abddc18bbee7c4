#include "host/synthesis/synthesis_request.hpp"

#include "host/base/text.hpp"
#include "host/cl/tuning.hpp"
#include "host/spectrum/certificate_text.hpp"
#include "host/synthesis/causal_recursion.hpp"
#include "host/synthesis/independent_planes.hpp"

namespace btfield {
namespace detail {
namespace {

bool convolves(const LevelModel& level, MovingAverageRoute wanted) {
    if (wanted != MovingAverageRoute::automatic) return wanted == MovingAverageRoute::convolution;
    const LinearField field = joined_planes(level.models);
    const auto planes = static_cast<std::size_t>(independent_planes(field).front().planes);
    return field.offsets.size() * planes <= largest_convolution;
}

}  // namespace

std::vector<LevelRoute> routes_of(const TextureModel& model, const SynthesisOptions& options) {
    std::vector<LevelRoute> routes;
    for (const LevelModel& level : model.levels) {
        LevelRoute route = LevelRoute::spectrum;
        if (options.method == SynthesisMethod::raster)
            route = LevelRoute::recursion;
        else if (options.noise_domain == NoiseDomain::spatial)
            route = family(model.kind) == Family::ma && convolves(level, options.moving_average)
                        ? LevelRoute::convolution
                        : LevelRoute::transfer;
        routes.push_back(route);
    }
    return routes;
}

void check_request(const TextureModel& model, Size size, const SynthesisOptions& options) {
    check(model);
    if (size.height < 1 || size.width < 1)
        throw InputError("synthesise " + compact_text_of(size), "a side is smaller than 1",
                         "give positive sides");
    if (options.method == SynthesisMethod::raster && family(model.kind) != Family::car)
        throw InputError("synthesise by raster recursion",
                         "this is a " + std::string(name(model.kind)) +
                             " model, and only causal autoregressive ones can be run pixel after pixel",
                         "use --method torus, or fit with --model 2d-car or 3d-car");
    if (options.allow_invalid) return;
    for (std::size_t k = 0; k < model.levels.size(); ++k)
        if (!model.levels[k].certificate.valid)
            throw InputError(
                "synthesise from this " + std::string(name(model.kind)) + " model",
                "the certificate of level " + std::to_string(k) + " fails (" +
                    failure_text(model.levels[k].certificate) +
                    "): the texture would not have the statistics that were fitted",
                std::string(family(model.kind) == Family::ma
                                ? "fit with another --threshold, --order or number of levels"
                                : "fit with --estimator auto or ml, or with a causal neighbourhood") +
                    ", or insist with --allow-invalid");
}

}  // namespace detail

using namespace detail;

void check_synthesis(const TextureModel& model, Size size, const SynthesisOptions& options) {
    check_request(model, size, options);
    static_cast<void>(SynthesisLayout(model, size, routes_of(model, options)));
    if (options.method != SynthesisMethod::raster) return;
    for (std::size_t k = 0; k < model.levels.size(); ++k)
        at_level(k, [&] { check_recursion(joined_planes(model.levels[k].models)); });
}

}  // namespace btfield

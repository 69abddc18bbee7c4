// The ten models as P3's Table 1 compares its three: analysis of 800 x 800 and synthesis of 512 x 512 RGB
// pixels with first-order neighbourhoods, one level, no marginals. The paper's seconds, of two dual-core
// Pentiums at 2.8 GHz: SAR 0.25 and 1.35, CAR 0.55 and 0.15, Gauss-Markov 3.9 and 2.5.
#include <memory>
#include <string>

#include "bench/cases.hpp"
#include "bench/peers/car_fit.hpp"
#include "bench/peers/synthesis.hpp"
#include "bench/report.hpp"
#include "btfield/synthesis.hpp"

namespace btfield::bench {
namespace {

constexpr Size training{800, 800}, grown{512, 512};

FitOptions options_of(ModelKind kind, int order) {
    FitOptions options;
    options.marginals = MarginalMode::none;
    options.model = kind;
    options.order = order;
    options.levels = 1;
    return options;
}

std::string title(const char* what, ModelKind kind, int order) {
    return std::string(what) + " " + std::string(name(kind)) + " order " + std::to_string(order);
}

Work synthesis_work() {
    const double values = 3.0 * static_cast<double>(area(grown));
    return {.items = values, .bytes = values * sizeof(float)};
}

void add_analysis(ModelKind kind, int order) {
    add(title("analysis", kind, order), [=] {
        const auto image = std::make_shared<Image>(picture(training));
        return std::pair(Work{}, std::function<void()>([=, options = options_of(kind, order)] {
                             benchmark::DoNotOptimize(fit(device(), *image, options));
                         }));
    });
}

void add_analysis_peer(int order) {
    add(title("analysis", ModelKind::car3d, order) + peer_suffix, [=] {
        const auto image = std::make_shared<Image>(picture(training));
        const TextureModel own = fit(device(), *image, options_of(ModelKind::car3d, order));
        const LinearField& field = std::get<CarModel>(own.levels.front().models.front());
        const std::vector<double> there = peer::fit_car(*image, field.offsets);
        // The prior weighs as much as 1e-3 pixels.
        for (std::size_t i = 0; i < there.size(); ++i)
            must_agree(field.coefficients[i], there[i], 1e-4, "coefficient");
        return std::pair(Work{}, std::function<void()>([=, offsets = field.offsets] {
                             benchmark::DoNotOptimize(peer::fit_car(*image, offsets));
                         }));
    });
}

void add_synthesis_of(ModelKind kind, int order) {
    add(title("synthesis", kind, order), [=] {
        const TextureModel model = fit(device(), picture(training), options_of(kind, order));
        const auto synthesiser = std::make_shared<Synthesiser>(device(), model, grown);
        return std::pair(synthesis_work(), std::function<void()>([synthesiser] {
                             benchmark::DoNotOptimize(synthesiser->synthesise(1));
                         }));
    });
    if (kind != ModelKind::car3d && kind != ModelKind::msar3d) return;
    add(title("synthesis", kind, order) + peer_suffix, [=] {
        const TextureModel model = fit(device(), picture(training), options_of(kind, order));
        const auto synthesiser = std::make_shared<peer::Synthesiser>(model, grown);
        return std::pair(synthesis_work(), std::function<void()>([synthesiser] {
                             Image texture(grown, 3);
                             synthesiser->synthesise(1, texture);
                             benchmark::DoNotOptimize(texture.values().data());
                         }));
    });
}

}  // namespace

void add_models() {
    for (const int order : {1, 5}) {
        for (const ModelKind kind : model_kinds()) add_analysis(kind, order);
        add_analysis_peer(order);
    }
    for (const int order : {1, 5})
        for (const ModelKind kind : model_kinds()) add_synthesis_of(kind, order);
}

}  // namespace btfield::bench

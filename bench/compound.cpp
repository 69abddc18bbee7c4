// Compound models: the fit, and textures beside single ones of the regions' model.

#include <cstdint>
#include <memory>
#include <string>
#include <utility>

#include "bench/cases.hpp"
#include "bench/report.hpp"
#include "btfield/compound.hpp"
#include "btfield/synthesis.hpp"

namespace btfield::bench {
namespace {

constexpr Size sample_size{512, 512}, texture_size{1024, 1024};

CompoundModel fitted(int regions) {
    CompoundOptions options;
    options.clusters.regions = regions;
    return fit_compound(device(), picture(sample_size), options);
}

void add_texture(const std::string& name, int regions) {
    const Work work{.items = static_cast<double>(area(texture_size))};
    add(name, [=] {
        const auto synthesiser =
            std::make_shared<CompoundSynthesiser>(device(), fitted(regions), texture_size);
        const auto seed = std::make_shared<std::uint64_t>(0);
        return std::pair(work, std::function<void()>([synthesiser, seed] {
                             benchmark::DoNotOptimize(synthesiser->synthesise((*seed)++).values().data());
                         }));
    });
}

}  // namespace

void add_compound() {
    add("compound fit of 512 rgb, regions found", [] {
        const auto image = std::make_shared<Image>(picture(sample_size));
        const Work work{.items = static_cast<double>(area(sample_size))};
        return std::pair(work, std::function<void()>([image] {
                             benchmark::DoNotOptimize(fit_compound(device(), *image).regions.data());
                         }));
    });
    add_texture("compound texture 1024 rgb, 5 regions", 5);
    add_texture("compound texture 1024 rgb, 12 regions", 12);
    add("compound single texture 1024 rgb of a region", [] {
        const CompoundModel model = fitted(5);
        SynthesisOptions options;
        options.noise_domain = NoiseDomain::spatial;
        const auto synthesiser =
            std::make_shared<Synthesiser>(device(), model.regions.front().residual, texture_size, options);
        const Work work{.items = static_cast<double>(area(texture_size))};
        return std::pair(work, std::function<void()>([synthesiser] {
                             benchmark::DoNotOptimize(synthesiser->synthesise(1).values().data());
                         }));
    });
}

}  // namespace btfield::bench

#include "btfield/synthesis.hpp"

#include <cmath>
#include <map>
#include <memory>
#include <numeric>
#include <string>
#include <vector>

#include "bench/cases.hpp"
#include "bench/peers/synthesis.hpp"
#include "bench/report.hpp"
#include "btfield/theory.hpp"
#include "host/pictures/picture_room.hpp"

namespace btfield::bench {
namespace {

constexpr Size size{512, 512};
constexpr int order = 3;

std::vector<std::uint64_t> seeds(int count) {
    std::vector<std::uint64_t> result(static_cast<std::size_t>(count));
    std::iota(result.begin(), result.end(), 1);
    return result;
}

Work work(const TextureModel& model, int count) {
    const double values = static_cast<double>(area(size)) * model.planes * count;
    return {.items = values, .bytes = values * sizeof(float), .textures = static_cast<double>(count)};
}

/// The peer's textures must have the standard deviation that the model promises.
void check_peer(const TextureModel& model) {
    peer::Synthesiser synthesiser(model, size);
    const int count = 16;
    std::vector<Image> textures(count, Image(size, model.planes));
    synthesiser.synthesise(seeds(count), textures);
    const auto expected = theoretical_deviation(model, size);
    for (int p = 0; p < model.planes; ++p) {
        double sum = 0;
        for (const Image& texture : textures)
            for (const float value : texture.plane(p))
                sum += std::pow(value - model.mean[static_cast<std::size_t>(p)], 2);
        const double deviation = std::sqrt(sum / (static_cast<double>(area(size)) * count));
        const double theory = expected[static_cast<std::size_t>(p)];
        must_agree(theory, deviation, 0.05 * theory, "standard deviation");
    }
}

void add_case(int levels, int count) {
    const std::string name = "synthesis 512 rgb order 3 K=" + std::to_string(levels) +
                             (count == 1 ? " single" : " batch of " + std::to_string(count));
    add(name, [=] {
        const TextureModel fitted = model(order, levels);
        auto synthesiser = std::make_shared<Synthesiser>(device(), fitted, size);
        return std::pair(work(fitted, count), std::function<void()>([synthesiser, s = seeds(count)] {
                             benchmark::DoNotOptimize(synthesiser->synthesise(s));
                         }));
    });
    add(name + peer_suffix, [=] {
        const TextureModel fitted = model(order, levels);
        check_peer(fitted);
        auto synthesiser = std::make_shared<peer::Synthesiser>(fitted, size);
        auto textures = std::make_shared<std::vector<Image>>(count, Image(size, fitted.planes));
        return std::pair(work(fitted, count), std::function<void()>([=, s = seeds(count)] {
                             // A texture in memory of its own each time, as here.
                             for (Image& texture : *textures)
                                 texture = detail::PictureRoom::make(size, fitted.planes, fitted.space, 0);
                             if (count == 1)
                                 synthesiser->synthesise(s.front(), textures->front());
                             else
                                 synthesiser->synthesise(s, *textures);
                             benchmark::DoNotOptimize(textures->data());
                         }));
    });
}

/// The same by kernel, on a device that takes the time of every launch.
void add_profile(int levels, int count) {
    struct State {
        std::unique_ptr<Device> device;
        std::unique_ptr<Synthesiser> synthesiser;
        int textures = 0;
    };
    auto state = std::make_shared<State>();
    add_split(
        "synthesis 512 rgb order 3 K=" + std::to_string(levels) +
            (count == 1 ? " single" : " batch of " + std::to_string(count)) + ", by kernel",
        [=] {
            DeviceOptions options;
            options.profile = true;
            const TextureModel fitted = model(order, levels);
            state->synthesiser.reset();
            state->device = std::make_unique<Device>("", options);
            state->synthesiser = std::make_unique<Synthesiser>(*state->device, fitted, size);
            [[maybe_unused]] const auto setup = state->device->take_profile();
            state->textures = 0;
            return std::pair(work(fitted, count), std::function<void()>([state, s = seeds(count)] {
                                 benchmark::DoNotOptimize(state->synthesiser->synthesise(s));
                                 state->textures += static_cast<int>(s.size());
                             }));
        },
        [state] {
            std::map<std::string, double> parts;
            for (const ProfileEntry& entry : state->device->take_profile())
                parts[entry.kernel] = entry.seconds / state->textures;
            return parts;
        });
}

}  // namespace

void add_synthesis() {
    for (const int levels : {1, 3})
        for (const int count : {1, 16}) {
            add_case(levels, count);
            add_profile(levels, count);
        }
}

}  // namespace btfield::bench

#include <array>
#include <cstdint>
#include <memory>
#include <vector>

#include "bench/cases.hpp"
#include "bench/peers/noise.hpp"
#include "bench/report.hpp"
#include "host/synthesis/spectral_factors.hpp"

namespace btfield::bench {

using namespace detail;

namespace {

constexpr Size size{2048, 2048};
constexpr int planes = 3;

Work work() {
    const double normals = static_cast<double>(area(size)) * planes;
    return {.items = normals, .bytes = normals * sizeof(float)};
}

}  // namespace

void add_noise() {
    const std::string name = "noise, 3 planes of 2048";
    add(name, [] {
        struct State {
            Buffer out, keys;
        };
        DeviceImpl& impl = device().impl();
        auto state =
            std::make_shared<State>(State{impl.buffer(area(size) * planes * sizeof(float)),
                                          impl.upload(std::vector<std::array<std::uint32_t, 2>>{{1, 0}})});
        return std::pair(work(), std::function<void()>([&impl, state] {
                             draw_normal_field(impl, state->out, state->keys, size, planes, 1, 0);
                             impl.finish();
                         }));
    });
    add(name + peer_suffix, [] {
        auto out = std::make_shared<std::vector<float>>(area(size) * planes);
        return std::pair(work(), std::function<void()>([out] {
                             peer::fill_noise(1, *out);
                             benchmark::DoNotOptimize(out->data());
                         }));
    });
}

}  // namespace btfield::bench

// Raster recursion of a causal model at 512 x 512, order 3: one texture, and a batch.
#include <array>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "bench/cases.hpp"
#include "bench/peers/linear_field.hpp"
#include "bench/peers/noise.hpp"
#include "bench/report.hpp"
#include "host/synthesis/causal_recursion.hpp"
#include "host/synthesis/independent_planes.hpp"

namespace btfield::bench {

using namespace detail;

namespace {

constexpr Size size{512, 512};
constexpr int order = 3;

}  // namespace

void add_causal_recursion() {
    for (const int batch : {1, 8}) {
        const std::string name =
            "noise and raster 512 rgb order 3" + (batch > 1 ? ", batch of " + std::to_string(batch) : "");
        add(name, [batch] {
            struct State {
                std::unique_ptr<CausalRecursion> recursion;
                Buffer keys, images;
            };
            DeviceImpl& impl = device().impl();
            auto state = std::make_shared<State>();
            const TextureModel fitted = model(order, 1);
            state->recursion = std::make_unique<CausalRecursion>(
                impl, linear_field(fitted.levels.front().models.front()), size, 1.0, fitted.mean);
            std::vector<std::array<std::uint32_t, 2>> keys;
            for (int b = 0; b < batch; ++b) keys.push_back({static_cast<std::uint32_t>(b), 0});
            state->keys = impl.upload(keys);
            const std::size_t values =
                area(size) * static_cast<std::size_t>(fitted.planes) * static_cast<std::size_t>(batch);
            state->images = impl.buffer(values * sizeof(float));
            return std::pair(Work{.items = static_cast<double>(values),
                                  .bytes = static_cast<double>(values) * sizeof(float),
                                  .textures = static_cast<double>(batch)},
                             std::function<void()>([&impl, state, batch] {
                                 state->recursion->draw(impl, state->images, state->keys, batch, 0);
                                 impl.finish();
                             }));
        });
        add(name + peer_suffix, [batch] {
            struct State {
                LinearField field;
                std::vector<float> a, root, noise;
                Size domain;
            };
            auto state = std::make_shared<State>();
            const TextureModel fitted = model(order, 1);
            state->field = linear_field(fitted.levels.front().models.front());
            const RecursionMargins margins = recursion_margins(state->field);
            state->domain = {size.height + margins.top, size.width + margins.left + margins.right};
            state->a.assign(state->field.coefficients.begin(), state->field.coefficients.end());
            const Eigen::MatrixXd root = noise_root(state->field);
            for (int i = 0; i < fitted.planes; ++i)
                for (int j = 0; j < fitted.planes; ++j) state->root.push_back(static_cast<float>(root(i, j)));
            state->noise.resize(area(state->domain) * static_cast<std::size_t>(fitted.planes));
            const double values = static_cast<double>(area(size)) * fitted.planes * batch;
            return std::pair(Work{.items = values, .textures = static_cast<double>(batch)},
                             std::function<void()>([state, batch] {
                                 for (int b = 0; b < batch; ++b) {
                                     peer::fill_noise(static_cast<std::uint64_t>(b), state->noise);
                                     peer::causal_recursion(state->field.offsets, state->a, state->root,
                                                            state->field.planes, state->domain, state->noise);
                                 }
                             }));
        });
    }
}

}  // namespace btfield::bench

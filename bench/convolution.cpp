// Moving averages at 512 x 512, order 5: the random decrement estimate, and the convolution of noise that is
// drawn with it or given.
#include <array>
#include <cstdint>
#include <memory>
#include <vector>

#include "bench/cases.hpp"
#include "bench/peers/linear_field.hpp"
#include "bench/peers/noise.hpp"
#include "bench/report.hpp"
#include "host/fit/random_decrement.hpp"
#include "host/synthesis/convolution.hpp"
#include "host/synthesis/independent_planes.hpp"

namespace btfield::bench {

using namespace detail;

namespace {

constexpr Size size{512, 512};
constexpr int order = 5;

MaModel fitted() {
    const Image image = picture(size);
    return fit_ma(image, lag_covariance(image, {0, 0}),
                  {NeighbourhoodKind::symmetric, neighbourhood(order, NeighbourhoodKind::symmetric)},
                  NoiseForm::full);
}

void add_case(const std::string& name, bool draw) {
    add(name, [draw] {
        struct State {
            std::unique_ptr<Convolution> convolution;
            Buffer keys, noise, images;
        };
        DeviceImpl& impl = device().impl();
        auto state = std::make_shared<State>();
        const MaModel model = fitted();
        const std::vector<double> mean(static_cast<std::size_t>(model.planes));
        state->convolution = std::make_unique<Convolution>(impl, model, size, 1.0, mean);
        state->keys = impl.upload(std::vector<std::array<std::uint32_t, 2>>{{1, 0}});
        const std::size_t values = area(size) * static_cast<std::size_t>(model.planes);
        state->noise = impl.upload(std::vector<float>(values));
        state->images = impl.buffer(values * sizeof(float));
        const Work work{.items = static_cast<double>(values),
                        .bytes = (draw ? 1.0 : 2.0) * static_cast<double>(values) * sizeof(float)};
        return std::pair(work, std::function<void()>([&impl, state, draw] {
                             if (draw)
                                 state->convolution->draw(impl, state->images, state->keys, 1, 0);
                             else
                                 state->convolution->filter(impl, state->noise, state->images, 1);
                             impl.finish();
                         }));
    });
    add(name + peer_suffix, [draw] {
        struct State {
            MaModel model;
            std::vector<float> m, noise, images;
        };
        auto state = std::make_shared<State>();
        state->model = fitted();
        const auto d = static_cast<std::size_t>(state->model.planes);
        const Eigen::MatrixXd root = noise_root(state->model);
        for (std::size_t k = 0; k < state->model.coefficients.size(); ++k) {
            double sum = 0.0;
            for (std::size_t j = 0; j < d; ++j)
                sum += state->model.coefficients[k / d * d + j] *
                       root(static_cast<Eigen::Index>(j), static_cast<Eigen::Index>(k % d));
            state->m.push_back(static_cast<float>(sum));
        }
        state->noise.resize(d * area(size));
        state->images.resize(d * area(size));
        const Work work{.items = static_cast<double>(state->noise.size())};
        return std::pair(work, std::function<void()>([state, draw] {
                             if (draw) peer::fill_noise(1, state->noise);
                             peer::convolve(state->model.offsets, state->m, state->model.planes, size,
                                            state->noise, state->images);
                         }));
    });
}

}  // namespace

void add_convolution() {
    add_case("convolve 512 rgb order 5", false);
    add_case("noise and convolve 512 rgb order 5", true);
    add("random decrement 800 rgb order 5", [] {
        auto image = std::make_shared<Image>(picture({800, 800}));
        auto statistic = std::make_shared<LagCovariance>(lag_covariance(*image, {0, 0}));
        return std::pair(
            Work{.items = static_cast<double>(image->values().size())},
            std::function<void()>([image, statistic] {
                const MaModel model =
                    fit_ma(*image, *statistic,
                           {NeighbourhoodKind::symmetric, neighbourhood(order, NeighbourhoodKind::symmetric)},
                           NoiseForm::full);
                benchmark::DoNotOptimize(model.coefficients.data());
            }));
    });
}

}  // namespace btfield::bench

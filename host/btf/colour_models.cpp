#include "host/btf/colour_models.hpp"

#include <cmath>
#include <string>

#include "btfield/error.hpp"
#include "btfield/image.hpp"

namespace btfield::detail {
namespace {

using Colour = std::array<double, 3>;

enum Model {
    rgb = 0,
    yuv = 1,
    pca = 3,
    ycocg = 4,
    relative = 5,
    relative_to_mean = 6,
    log_y = 9,
    log_all = 10,
    log_y_relative = 11,
    log_rgb = 12
};

constexpr double epsilon = static_cast<double>(least_light);

Colour rgb_of_yuv(const Colour& v) {
    return {v[0] + 1.13983 * v[2], v[0] - 0.39465 * v[1] - 0.5806 * v[2], v[0] + 2.03211 * v[1]};
}

/// exp(|v| + ln ε) with the sign of v.
double signed_exponential(double v) {
    return std::copysign(std::exp(std::abs(v)) * epsilon, v);
}

Colour decoded(int model, const std::array<float, 12>& numbers, const Colour& v) {
    const auto number = [&](std::size_t i) { return static_cast<double>(numbers[i]); };
    const double y = std::exp(v[0]) - epsilon;
    switch (model) {
        case yuv:
            return rgb_of_yuv(v);
        case pca: {
            Colour c{};
            for (std::size_t j = 0; j < 3; ++j)
                c[j] = number(j) + v[0] * number(3 + j) + v[1] * number(6 + j) + v[2] * number(9 + j);
            return c;
        }
        case ycocg:
            return {v[0] + v[1] - v[2], v[0] + v[2], v[0] - v[1] - v[2]};
        case log_y:
            return rgb_of_yuv({y, v[1], v[2]});
        case log_all:
            return rgb_of_yuv({y, signed_exponential(v[1]), signed_exponential(v[2])});
        case log_y_relative:
            return rgb_of_yuv({y, v[1] * (y + epsilon), v[2] * (y + epsilon)});
        case log_rgb:
            return {y, std::exp(v[1]) - epsilon, std::exp(v[2]) - epsilon};
        default:
            return v;
    }
}

}  // namespace

ColourModel::ColourModel(int model, const std::array<float, 12>& numbers, int channels, const ByteFile& file)
    : model_(model), numbers_(numbers) {
    const bool any = model == rgb || model == relative || model == relative_to_mean;
    const bool three = model == yuv || model == pca || model == ycocg || (model >= log_y && model <= log_rgb);
    if (!any && !three)
        throw InputError(file.asked(), "its colour model is " + std::to_string(model),
                         "convert it to another: 0, 1, 3 to 6 and 9 to 12 are known");
    if (three && channels != 3)
        file.refuse("its colour model " + std::to_string(model) + " is of three channels, and it has " +
                    std::to_string(channels));
}

void ColourModel::decode(Image& image) const {
    const auto channels = static_cast<std::size_t>(image.planes());
    const std::size_t pixels = area(image.size());
    if (model_ == relative || model_ == relative_to_mean) {
        for (std::size_t i = 0; i < pixels; ++i) {
            const auto all = static_cast<double>(channels);
            const double f = static_cast<double>(image.plane(0)[i]) * (model_ == relative ? 1.0 : all);
            double sum = 0.0;
            for (std::size_t c = 1; c < channels; ++c)
                sum += static_cast<double>(image.plane(static_cast<int>(c))[i]);
            const double first = model_ == relative ? (1.0 - sum) * f : f - sum / all;
            for (std::size_t c = 1; c < channels; ++c) {
                float& value = image.plane(static_cast<int>(c))[i];
                const auto v = static_cast<double>(value);
                value = static_cast<float>(model_ == relative ? v * f : f + v * f);
            }
            image.plane(0)[i] = static_cast<float>(first);
        }
        return;
    }
    if (model_ == rgb) return;
    for (std::size_t i = 0; i < pixels; ++i) {
        const Colour v{static_cast<double>(image.plane(0)[i]), static_cast<double>(image.plane(1)[i]),
                       static_cast<double>(image.plane(2)[i])};
        const Colour c = decoded(model_, numbers_, v);
        for (int p = 0; p < 3; ++p) image.plane(p)[i] = static_cast<float>(c[static_cast<std::size_t>(p)]);
    }
}

}  // namespace btfield::detail

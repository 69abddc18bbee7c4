#include "host/relief/pixel_fit.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <numeric>

#include "host/base/eigen.hpp"
#include "host/base/parallel.hpp"

namespace btfield::detail {
namespace {

using Float4 = std::array<float, 4>;

Float4 float4(const LightDirection& d) {
    return {static_cast<float>(d[0]), static_cast<float>(d[1]), static_cast<float>(d[2]), 0.0F};
}

/// Half way between the light and a viewer straight above.
LightDirection half_way(const LightDirection& light) {
    const double length = std::hypot(light[0], light[1], light[2] + 1.0);
    return {light[0] / length, light[1] / length, (light[2] + 1.0) / length};
}

int number_of_rule(LightRule rule) {
    switch (rule) {
        case LightRule::ranks:
            return 1;
        case LightRule::huber:
            return 2;
        case LightRule::amb:
            return 3;
        case LightRule::lobe:
            return 4;
        case LightRule::ls:
        case LightRule::automatic:
            break;
    }
    return 0;
}

/// All values, each plane padded to the pitch.
Buffer upload(DeviceImpl& device, const PixelStack& stack, std::size_t lights, std::size_t pitch) {
    const std::size_t row = pitch * bytes_of(stack.form), given = stack.pixels * bytes_of(stack.form);
    const auto planes = static_cast<std::size_t>(stack.planes);
    Buffer values = device.buffer(lights * planes * row);
    device.fill(values, [&](std::byte* to) {
        for_each_block(static_cast<int>(lights), [&](int light) {
            std::byte* first = to + static_cast<std::size_t>(light) * planes * row;
            stack.copy(light, first, row);
            for (std::size_t p = 0; p < planes; ++p) std::memset(first + p * row + given, 0, row - given);
        });
    });
    return values;
}

}  // namespace

std::vector<LightDirection> pseudo_inverse(std::span<const LightDirection> lights) {
    Eigen::MatrixXd moments = Eigen::MatrixXd::Zero(3, 3);
    for (const LightDirection& d : lights)
        for (int i = 0; i < 3; ++i)
            for (int j = 0; j < 3; ++j)
                moments(i, j) += d[static_cast<std::size_t>(i)] * d[static_cast<std::size_t>(j)];
    const Eigen::LLT<Eigen::MatrixXd> factor(moments);
    std::vector<LightDirection> rows;
    for (const LightDirection& d : lights) {
        const Eigen::VectorXd row = factor.solve(Eigen::Vector3d(d[0], d[1], d[2]));
        rows.push_back({row[0], row[1], row[2]});
    }
    return rows;
}

double modelled_value(const std::array<double, fit_planes>& fit, const LightDirection& light,
                      double roughness) {
    const auto dot = [](const auto& a, const auto& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; };
    const double shade = dot(fit, light), length = std::sqrt(dot(fit, fit));
    double value = std::max(shade, 0.0) + fit[3];
    if (fit[4] > 0.0 && length > 0.0) {
        const double cosine = dot(fit, half_way(light)) / length, alpha = roughness * roughness;
        const double root = alpha / (cosine * cosine * (alpha - 1.0) + 1.0);
        const double faded = std::clamp(10.0 * shade / length, 0.0, 1.0);
        if (cosine > 0.0) value += fit[4] * root * root * faded;
    }
    return value;
}

PixelFits fit_pixels(DeviceImpl& device, const PixelStack& stack, std::span<const LightDirection> lights,
                     const PixelRule& rule) {
    std::vector<Float4> directions, half_ways, inverse;
    for (const LightDirection& light : lights) {
        directions.push_back(float4(light));
        half_ways.push_back(float4(half_way(light)));
    }
    for (const LightDirection& row : pseudo_inverse(lights)) inverse.push_back(float4(row));
    int room = 16;
    while (room < static_cast<int>(lights.size())) room *= 2;
    BuildParameters parameters = device.lanes();
    parameters.set("BTFIELD_LIGHTS", room)
        .set("BTFIELD_RULE", number_of_rule(rule.rule))
        .set("BTFIELD_FEW", rule.rule == LightRule::amb && rule.few_lights)
        .set("BTFIELD_STACK", static_cast<int>(stack.form))
        .set("BTFIELD_TABLE", !stack.table.empty());

    const std::size_t pixels = stack.pixels;
    const auto lanes = static_cast<std::size_t>(device.vector_width());
    const std::size_t width = stack.width == 0 ? pixels : stack.width, height = pixels / width;
    const auto bytes = [&](int count) { return sizeof(float) * static_cast<std::size_t>(count) * pixels; };
    const std::size_t pitch = (pixels + 2 * lanes - 1) / lanes * lanes;
    const Buffer values = upload(device, stack, lights.size(), pitch);
    const Buffer gains = device.upload(stack.gains), table = device.upload(stack.table),
                 to = device.upload(directions), half = device.upload(half_ways),
                 rows = device.upload(inverse);
    Buffer fits = device.buffer(bytes(fit_planes)), albedo = device.buffer(bytes(stack.planes)),
           residual = device.buffer(bytes(1)), counts = device.buffer(bytes(2));
    const auto launch = [&](bool follow, std::size_t period, std::size_t count) {
        BuildParameters with = parameters;
        with.set("BTFIELD_FOLLOW", follow);
        device.launch(device.kernel("pixel_fit", "fit_pixels", with), {(width + lanes - 1) / lanes, count},
                      Grain::fine, values, gains, table, to, half, rows, static_cast<int>(lights.size()),
                      stack.planes, static_cast<int>(height), static_cast<int>(width),
                      static_cast<int>(pitch), static_cast<int>(period), static_cast<float>(rule.low),
                      static_cast<float>(rule.high), static_cast<float>(rule.roughness), fits, albedo,
                      residual, counts);
    };
    if (rule.rule == LightRule::lobe && stack.width > 0) {
        const std::size_t groups = (height + group_rows - 1) / group_rows;
        launch(false, group_rows, groups);
        launch(true, group_rows, groups * (group_rows - 1));
    } else {
        launch(false, 1, height);
    }
    PixelFits result;
    const auto read = [&](const Buffer& from, std::vector<float>& into, int count) {
        into.resize(static_cast<std::size_t>(count) * pixels);
        device.read(from, into.data(), bytes(count));
    };
    read(fits, result.fits, fit_planes);
    read(albedo, result.albedo, stack.planes);
    read(residual, result.residual, 1);
    read(counts, result.counts, 2);
    return result;
}

PixelFits fit_pixels(DeviceImpl& device, std::span<const float> stack, std::size_t pixels, int planes,
                     std::span<const LightDirection> lights, const PixelRule& rule) {
    PixelStack values;
    values.pixels = pixels;
    values.planes = planes;
    values.gains.assign(lights.size() * static_cast<std::size_t>(planes), 1.0F);
    values.copy = [&](int light, std::byte* to, std::size_t pitch) {
        const auto first = static_cast<std::size_t>(light) * static_cast<std::size_t>(planes);
        for (std::size_t p = 0; p < static_cast<std::size_t>(planes); ++p)
            std::memcpy(to + p * pitch, stack.data() + (first + p) * pixels, sizeof(float) * pixels);
    };
    return fit_pixels(device, values, lights, rule);
}

}  // namespace btfield::detail

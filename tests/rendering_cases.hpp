#pragma once

// A material whose tables and surface are smooth functions, without a fit.

#include <cmath>
#include <numbers>

#include "btfield/btf_model.hpp"
#include "tests/example_model.hpp"

namespace btfield::test {

constexpr double degree = std::numbers::pi / 180.0;

/// Of planes + 1 planes: hills and waves of slopes that rays follow well. Planes have about mean 0 and
/// variance 1.
inline Image smooth_surface(Size size, int planes, double relief = 1.5) {
    Image surface(size, planes + 1);
    for (int k = 0; k <= planes; ++k)
        for (int r = 0; r < size.height; ++r)
            for (int c = 0; c < size.width; ++c) {
                const double x = 2.0 * std::numbers::pi * c / size.width,
                             y = 2.0 * std::numbers::pi * r / size.height;
                const double wave = std::sin((1 + k % 2) * x + 0.7 * k) + std::cos((2 - k % 2) * y - k);
                surface.at(k, r, c) = static_cast<float>(k == 0 ? 0.5 * relief * wave : wave);
            }
    return surface;
}

/// All pairs of the 81 directions. Means fall from above to the rim, planes answer to light from the sides.
inline BtfModel smooth_btf(Size size, int colours = 3, int planes = 5) {
    BtfModel model;
    model.size = size;
    model.colours = colours;
    model.views = model.lights = btf_directions_81();
    model.tables.weight_units.assign(static_cast<std::size_t>(planes), 2e-3);
    for (int v = 0; v < 81; ++v)
        for (int l = 0; l < 81; ++l) {
            model.tables.kept.push_back(static_cast<std::uint32_t>(model.pairs.size()));
            model.pairs.push_back({v, l});
            const BtfDirection view = model.views[static_cast<std::size_t>(v)],
                               light = model.lights[static_cast<std::size_t>(l)];
            const auto from = light.vector();
            for (int c = 0; c < colours; ++c) {
                const double mean = (0.3 + 0.1 * c) * from[2] * (1.0 - 0.2 * view.theta);
                model.tables.mean.push_back(static_cast<float>(mean));
                model.tables.contrast.push_back(0);
                for (int k = 0; k < planes; ++k)
                    model.tables.weights.push_back(static_cast<std::int8_t>(std::lround(
                        40.0 / (k + 1) * (k % 2 == 0 ? from[0] : from[1]) + 8.0 * view.theta - 3 * c)));
            }
        }
    TextureModel field = example_model(ModelKind::car3d, planes + 1, 1);
    MaterialMap relief{"height", MapRole::height, 1};
    relief.scale = 1.0;
    field.provenance.maps = {relief, MaterialMap{"planes", MapRole::other, planes}};
    model.surface = std::move(field);
    return model;
}

}  // namespace btfield::test

#pragma once

#include <cmath>
#include <cstddef>
#include <utility>
#include <vector>

#include "btfield/models.hpp"
#include "btfield/neighbourhood.hpp"
#include "btfield/pyramid.hpp"

namespace btfield::test {

/// A valid model with numbers of many digits everywhere, so that a lost bit shows. Stable: its coefficients
/// are small.
inline TextureModel example_model(ModelKind kind = ModelKind::car3d, int planes = 2, int levels = 2,
                                  NoiseForm noise = NoiseForm::full, bool per_pair = false) {
    const auto d = static_cast<std::size_t>(planes);
    TextureModel model;
    model.kind = kind;
    model.size = {37, 50};
    model.planes = planes;
    model.space = planes == 3 ? ColourSpace::srgb : ColourSpace::unspecified;
    model.noise = noise;
    for (std::size_t i = 0; i < d; ++i)
        model.mean.push_back(0.3 + std::sqrt(2.0 + static_cast<double>(i)) / 10.0);
    model.provenance = {"cork \"1\"\n\xC3\xA9.png", PixelType::uint16, 37ULL * 50ULL * d * 2ULL,
                        "btfield 0.1.0"};

    const std::vector<Size> sizes = pyramid_sizes(model.size, levels, model.factor);
    for (std::size_t k = 0; k < sizes.size(); ++k) {
        LinearField field;
        field.planes = planes;
        field.kind = kind == ModelKind::car3d ? NeighbourhoodKind::causal : NeighbourhoodKind::symmetric;
        field.offsets = neighbourhood(2, field.kind);
        const std::size_t count = field.offsets.size() * d * d;
        for (std::size_t n = 0; n < count; ++n) {
            const bool absent = per_pair && n % 5 == 2;
            const double value =
                0.4 * std::sin(1.0 + static_cast<double>(n + k)) / static_cast<double>(count);
            field.coefficients.push_back(absent ? 0.0 : value);
            if (per_pair) field.active.push_back(absent ? 0 : 1);
        }
        for (std::size_t i = 0; i < d; ++i) {
            for (std::size_t j = 0; j < d; ++j) {
                const double variance = 0.01 / 3.0;
                field.noise_covariance.push_back(i == j                     ? variance
                                                 : noise == NoiseForm::full ? variance / 3.0
                                                                            : 0.0);
            }
        }
        LevelModel level;
        level.size = sizes[k];
        if (kind == ModelKind::car3d) {
            level.models = {CarModel{std::move(field)}};
        } else {
            level.models = {SarModel{std::move(field)}};
        }
        level.gain = 1.0 + 1.0 / (7.0 + static_cast<double>(k));
        level.log_likelihood = 4.0 / 3.0;
        level.certificate = {true, 2.0 / 3.0, 0, std::vector<double>(d, 0.99 + 1.0 / 300.0)};
        model.levels.push_back(std::move(level));
    }
    return model;
}

/// The linear part, to be spoilt.
inline LinearField& field_of(TextureModel& model, std::size_t level) {
    return std::visit([](auto& m) -> LinearField& { return m; }, model.levels[level].models.front());
}

}  // namespace btfield::test

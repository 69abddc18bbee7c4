#include "tests/example_model.hpp"

#include <cmath>
#include <cstdlib>
#include <utility>
#include <variant>
#include <vector>

#include "btfield/neighbourhood.hpp"
#include "btfield/pyramid.hpp"

namespace btfield::test {

LinearField example_field(ModelKind kind, int planes, NoiseForm noise, bool per_pair, std::size_t variant) {
    const auto d = static_cast<std::size_t>(planes);
    const bool markov = family(kind) == Family::mmrf || family(kind) == Family::pmrf;
    LinearField field;
    field.planes = planes;
    field.kind = family(kind) == Family::car ? NeighbourhoodKind::causal : NeighbourhoodKind::symmetric;
    field.offsets = neighbourhood(2, field.kind);
    if (family(kind) == Family::ma) field.offsets.push_back({0, 0});
    const std::size_t count = field.offsets.size() * d * d;
    for (std::size_t n = 0; n < count; ++n) {
        const bool absent = per_pair && n % 5 == 2;
        double value = 0.4 * std::sin(1.0 + static_cast<double>(n + variant)) / static_cast<double>(count);
        if (markov) {
            const Offset s = field.offsets[n / (d * d)];
            const bool diagonal = n % (d * d) % (d + 1) == 0;
            value = diagonal ? 0.03 / (1.0 + std::abs(s.row) + 2.0 * std::abs(s.column + s.row)) : 0.0;
        }
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
    return field;
}

TextureModel example_model(ModelKind kind, int planes, int levels, NoiseForm noise, bool per_pair,
                           bool marginals) {
    const auto d = static_cast<std::size_t>(planes);
    TextureModel model;
    model.kind = kind;
    model.size = {37, 50};
    model.planes = planes;
    model.space = planes == 3 ? ColourSpace::srgb : ColourSpace::unspecified;
    model.noise = noise;
    for (std::size_t i = 0; i < d; ++i)
        model.mean.push_back(0.3 + std::sqrt(2.0 + static_cast<double>(i)) / 10.0);
    model.provenance = {"cork \"1\"\n\xC3\xA9.png",
                        PixelType::uint16,
                        37ULL * 50ULL * d * 2ULL,
                        "btfield 0.1.0",
                        {"\xCE\xBA = 1.5", "because"}};
    if (is_2d(kind) || marginals) {
        model.basis = {planes, planes, std::vector<double>(d * d), model.mean};
        for (std::size_t i = 0; i < d; ++i) model.basis.matrix[i * d + i] = 1.0;
        if (planes >= 2) {
            const double c = std::cos(1.0), s = std::sin(1.0);
            model.basis.matrix[0] = model.basis.matrix[d + 1] = c;
            model.basis.matrix[1] = s;
            model.basis.matrix[d] = -s;
        }
    }
    for (std::size_t i = 0; marginals && i < d; ++i)
        model.marginals.push_back({{-0.3, -0.1 / 3.0, 0.05, 0.2 + static_cast<double>(i) / 7.0}});

    if (marginals) {
        model.whitening.assign(d * d, 0.1 / 3.0);
        for (std::size_t i = 0; i < d; ++i) model.whitening[i * d + i] = 4.0 / 3.0;
    }
    const std::vector<Size> sizes = pyramid_sizes(model.size, levels, model.factor);
    for (std::size_t k = 0; k < sizes.size(); ++k) {
        LevelModel level;
        level.size = sizes[k];
        for (std::size_t p = 0; p < (is_2d(kind) ? d : 1); ++p) {
            level.models.push_back(model_of(
                family(kind), example_field(kind, is_2d(kind) ? 1 : planes, noise, per_pair, k + 10 * p)));
        }
        level.gain = 1.0 + 1.0 / (7.0 + static_cast<double>(k));
        level.log_likelihood = 4.0 / 3.0;
        level.certificate = {true, 2.0 / 3.0, 0, std::vector<double>(d, 0.99 + 1.0 / 300.0)};
        model.levels.push_back(std::move(level));
    }
    return model;
}

LinearField& field_of(TextureModel& model, std::size_t level) {
    return std::visit([](auto& m) -> LinearField& { return m; }, model.levels[level].models.front());
}

}  // namespace btfield::test

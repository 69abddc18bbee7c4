#pragma once

// Fields of several regions on one torus as theory 18.5 writes them, in float64.

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <complex>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "btfield/control_field.hpp"
#include "btfield/models.hpp"
#include "tests/reference/algebra.hpp"
#include "tests/reference/fields.hpp"
#include "tests/reference/fourier.hpp"
#include "tests/reference/moving_average.hpp"
#include "tests/reference/noise.hpp"
#include "tests/reference/pyramid.hpp"
#include "tests/reference/spectral_factor.hpp"

namespace btfield::reference {

/// Levels of a picture, [level][plane].
using Levels = std::vector<std::vector<Plane>>;

/// White noise on the lattice, [plane][row][column].
inline std::vector<float> lattice_noise(std::uint64_t seed, int level, int first_plane, int planes, Size t) {
    std::vector<float> noise;
    for (int p = 0; p < planes; ++p)
        for (int r = 0; r < t.height; ++r)
            for (int c = 0; c < t.width; ++c)
                noise.push_back(static_cast<float>(spatial_noise(seed, level, first_plane + p, r, c).value));
    return noise;
}

inline void append_planes(std::vector<Plane>& planes, const std::vector<double>& values, Size t,
                          double gain) {
    for (std::size_t first = 0; first < values.size(); first += area(t)) {
        Plane& plane = planes.emplace_back(t);
        for (std::size_t i = 0; i < area(t); ++i) plane.values[i] = gain * values[first + i];
    }
}

/// Y_t = F_t z_t at every frequency, transformed back; N the pixels of the lattice, F F* the density, z of
/// variance 2: y = (2N)^{−1/2} Σ_t Y_t exp(√−1 ω_t·r). Autoregressive models, and Markov fields of one plane.
inline std::vector<double> spectral_texture(const Model& model, std::uint64_t seed, int level,
                                            int first_plane, Size t) {
    const LinearField& field = linear_field(model);
    const bool markov = std::holds_alternative<MrfModel>(model);
    const int d = field.planes;
    std::vector<std::vector<std::complex<double>>> spectra(static_cast<std::size_t>(d));
    for (auto& spectrum : spectra) spectrum.resize(area(t));
    const double scale = 1.0 / std::sqrt(2.0 * static_cast<double>(area(t)));
    for (int kx = 0; kx < t.width; ++kx)
        for (int ky = 0; ky <= t.height / 2; ++ky) {
            Eigen::VectorXcd z(d);
            for (int j = 0; j < d; ++j) z(j) = spectral_noise(seed, level, first_plane + j, t, kx, ky);
            // Of one plane W = root⁻¹ Λ root is Λ.
            const Eigen::MatrixXcd f =
                markov ? mmrf_factor(transfer_matrix(field, t, kx, ky), scale * noise_root(field))
                       : spectral_factor(field, t, scale, kx, ky);
            const Eigen::VectorXcd y = product(f, z);
            const int mirror_x = (t.width - kx) % t.width, mirror_y = (t.height - ky) % t.height;
            for (int i = 0; i < d; ++i) {
                auto& spectrum = spectra[static_cast<std::size_t>(i)];
                spectrum[static_cast<std::size_t>(kx * t.height + ky)] = y(i);
                if (mirror_y > t.height / 2)
                    spectrum[static_cast<std::size_t>(mirror_x * t.height + mirror_y)] = std::conj(y(i));
            }
        }
    std::vector<double> values;
    for (const auto& spectrum : spectra)
        for (const std::complex<double> value : inverse(spectrum, t)) values.push_back(value.real());
    return values;
}

/// Level k of one model on the whole lattice, of the noise that all regions have; moving averages take it on
/// the lattice, the others in frequency.
inline std::vector<Plane> level_texture(const TextureModel& model, std::size_t k, Size t,
                                        std::uint64_t seed) {
    std::vector<Plane> planes;
    const LevelModel& level = model.levels[k];
    for (const Model& part : level.models) {
        const LinearField& field = linear_field(part);
        const int first = static_cast<int>(planes.size()), number = static_cast<int>(k);
        append_planes(planes,
                      family(model.kind) == Family::ma
                          ? moving_average(field, symmetric_root(noise_covariance(field)), t,
                                           lattice_noise(seed, number, first, field.planes, t))
                          : spectral_texture(part, seed, number, first, t),
                      t, level.gain);
    }
    return planes;
}

/// Of each pixel what its region's planes have there, 0 where they have none: planes [region][plane] of a
/// level's lattice, labels of the finest, `step` pixels to one of the level's.
inline std::vector<Plane> selected(const std::vector<std::vector<Plane>>& regions, const ControlField& field,
                                   Size size, int step, std::size_t planes) {
    std::vector<Plane> result(planes, Plane(size));
    for (int r = 0; r < size.height; ++r)
        for (int c = 0; c < size.width; ++c) {
            const auto place = static_cast<std::size_t>(r * step * field.size.width + c * step);
            const std::vector<Plane>& own = regions[field.labels[place]];
            for (std::size_t p = 0; p < own.size(); ++p) result[p].at(r, c) = own[p].at(r, c);
        }
    return result;
}

/// Sum of the levels, each expanded to the finest.
inline std::vector<Plane> collapsed(const Levels& levels, int factor) {
    std::vector<Plane> sum = levels.back();
    for (std::size_t k = levels.size() - 1; k-- > 0;)
        for (std::size_t p = 0; p < sum.size(); ++p) {
            sum[p] = expand(sum[p], levels[k][p].size, factor);
            for (std::size_t i = 0; i < sum[p].values.size(); ++i) sum[p].values[i] += levels[k][p].values[i];
        }
    return sum;
}

}  // namespace btfield::reference

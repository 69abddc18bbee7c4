#include "host/synthesis/spectral_factors.hpp"

#include <gtest/gtest.h>

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <complex>
#include <limits>
#include <numbers>

#include "btfield/error.hpp"
#include "btfield/neighbourhood.hpp"
#include "tests/device_cases.hpp"
#include "tests/reference/algebra.hpp"
#include "tests/reference/noise.hpp"
#include "tests/reference/spectral_factor.hpp"

namespace btfield {

using namespace detail;

namespace {

using Complex = std::complex<double>;

constexpr double all_memory = 1e9, no_memory = 0.0;
constexpr float nan_value = std::numeric_limits<float>::quiet_NaN();

/// Lines, odd and even sides, H/2 on either side of the blocks of 16 and 32 frequencies that share a draw.
constexpr std::array lattices = {Size{1, 1},  Size{1, 6},  Size{2, 5},  Size{5, 2}, Size{6, 1},
                                 Size{13, 7}, Size{32, 3}, Size{64, 5}, Size{67, 4}};

/// Coefficients of random signs whose absolute sums stay below `strength` in every row: Λ keeps at least 1 −
/// strength of its diagonal at every frequency. Noise covariance far from diagonal.
LinearField random_field(int planes, std::vector<Offset> offsets, double strength = 0.8, unsigned seed = 1) {
    const auto d = static_cast<std::size_t>(planes);
    std::mt19937 generator(seed);
    std::uniform_real_distribution<double> uniform(-1.0, 1.0);
    LinearField field;
    field.planes = planes;
    field.offsets = std::move(offsets);
    field.coefficients.resize(field.offsets.size() * d * d);
    for (std::size_t i = 0; i < d; ++i) {
        double sum = 0.0;
        const auto row = [&](auto&& act) {
            for (std::size_t s = 0; s < field.offsets.size(); ++s)
                for (std::size_t j = 0; j < d; ++j) act(field.coefficients[(s * d + i) * d + j]);
        };
        row([&](double& a) { sum += std::abs(a = uniform(generator)); });
        row([&](double& a) { a *= strength / sum; });
    }
    Eigen::MatrixXd root = Eigen::MatrixXd::Identity(planes, planes);
    for (Eigen::Index i = 0; i < planes; ++i)
        for (Eigen::Index j = 0; j < planes; ++j) root(i, j) += 0.9 * uniform(generator) / std::sqrt(planes);
    const Eigen::MatrixXd covariance = reference::product(root, Eigen::MatrixXd(root.transpose()));
    for (Eigen::Index i = 0; i < planes; ++i)
        for (Eigen::Index j = 0; j < planes; ++j) field.noise_covariance.push_back(covariance(i, j));
    return field;
}

/// Planes that correlate at almost 1 and have long ranges: Λ has eigenvalues 1 − c for each c of `sums` at
/// frequency 0, in a basis of planes turned away from the axes.
LinearField ill_conditioned_field(const std::vector<double>& sums) {
    const int d = static_cast<int>(sums.size());
    LinearField field = random_field(d, neighbourhood(2, NeighbourhoodKind::causal));
    Eigen::MatrixXd waves(d, d);
    for (int i = 0; i < d; ++i)
        for (int j = 0; j < d; ++j) waves(i, j) = std::sin(1.0 + 2.0 * static_cast<double>(i * 7 + j));
    Eigen::VectorXd diagonal(d);
    for (int i = 0; i < d; ++i) diagonal(i) = sums[static_cast<std::size_t>(i)];
    const Eigen::MatrixXd total = reference::with_eigenvalues(reference::orthogonal_factor(waves), diagonal);
    // A causal combination with weights of both signs that add up to 1.
    const double weights[] = {-0.4, 0.7, -0.1, 0.8};
    for (std::size_t s = 0; s < field.offsets.size(); ++s)
        for (int i = 0; i < d; ++i)
            for (int j = 0; j < d; ++j)
                field.coefficients[(s * sums.size() + static_cast<std::size_t>(i)) * sums.size() +
                                   static_cast<std::size_t>(j)] = weights[s] * total(i, j);
    return field;
}

/// The factor in float64 and how far float32 may be from it.
struct Expected {
    Eigen::MatrixXcd factor;
    double bound = 0.0;  ///< of ‖ΔF‖_F
    double condition = 1.0;
};

/// ‖ΔF‖ <= ‖Λ⁻¹‖ ‖ΔΛ‖ ‖F‖ to first order. The kernel sums Λ = M + Σ_s A_s u_s with every A_s, M and table
/// rounded: |ΔΛ| <= c u (|M| + Σ_s |A_s| 2(|sin h1| + |sin h2|)), h1 + h2 = half the angle of s, because
/// sin(h1 + h2) is summed from both. Elimination with pivoting adds d roundings of numbers no larger than
/// that (its growth stays near 1 here). c = 4: products of rounded numbers count twice, real and imaginary
/// parts once more.
Expected expected_factor(const LinearField& field, Size lattice, double scale, int kx, int ky) {
    const int d = field.planes;
    const auto entries = static_cast<std::size_t>(d * d);
    Eigen::MatrixXd total = Eigen::MatrixXd::Identity(d, d), magnitude = Eigen::MatrixXd::Zero(d, d);
    for (std::size_t s = 0; s < field.offsets.size(); ++s) {
        const double rows = std::numbers::pi * field.offsets[s].row * ky / lattice.height;
        const double columns = std::numbers::pi * field.offsets[s].column * kx / lattice.width;
        for (std::size_t e = 0; e < entries; ++e) {
            const double a = field.coefficients[s * entries + e];
            const auto i = static_cast<Eigen::Index>(e) / d, j = static_cast<Eigen::Index>(e) % d;
            total(i, j) -= a;
            magnitude(i, j) += 2.0 * std::abs(a) * (std::abs(std::sin(rows)) + std::abs(std::sin(columns)));
        }
    }
    magnitude += total.cwiseAbs();
    const Eigen::VectorXd singular =
        reference::singular_values(reference::transfer_matrix(field, lattice, kx, ky));
    Expected result;
    result.factor = reference::spectral_factor(field, lattice, scale, kx, ky);
    result.condition = singular(0) / singular(d - 1);
    result.bound =
        4.0 * test::unit_roundoff * (d + 1.0) * magnitude.norm() / singular(d - 1) * result.factor.norm();
    return result;
}

std::size_t at(Size lattice, int plane, int kx, int ky) {
    return (static_cast<std::size_t>(plane) * static_cast<std::size_t>(lattice.width) +
            static_cast<std::size_t>(kx)) *
               static_cast<std::size_t>(spectrum_pitch(lattice.height)) +
           static_cast<std::size_t>(ky);
}

/// [texture · d + plane][kx][ky]
struct HostSpectrum {
    Size lattice;
    std::vector<float> re, im;
    HostSpectrum(Size size, int planes, float value)
        : lattice(size), re(spectrum_floats(size, planes), value), im(re) {}
    [[nodiscard]] Complex value(int plane, int kx, int ky) const {
        const std::size_t i = at(lattice, plane, kx, ky);
        return {static_cast<double>(re[i]), static_cast<double>(im[i])};
    }
};

HostSpectrum filtered(Device& device, const SpectralFactors& factors, HostSpectrum host, int batch) {
    Spectrum spectrum{device.impl().upload(host.re), device.impl().upload(host.im)};
    factors.filter(device.impl(), spectrum, batch);
    host.re = test::read_all<float>(device, spectrum.re);
    host.im = test::read_all<float>(device, spectrum.im);
    return host;
}

HostSpectrum drawn(Device& device, const SpectralFactors& factors, Size lattice, int planes,
                   const std::vector<std::uint64_t>& seeds, int level) {
    const int batch = static_cast<int>(seeds.size());
    HostSpectrum host(lattice, planes * batch, nan_value);
    Spectrum spectrum{device.impl().upload(host.re), device.impl().upload(host.im)};
    const Buffer keys = test::upload_seeds(device, seeds);
    factors.draw(device.impl(), spectrum, keys, batch, level);
    host.re = test::read_all<float>(device, spectrum.re);
    host.im = test::read_all<float>(device, spectrum.im);
    return host;
}

template <class F>
void for_each_frequency(Size lattice, F&& f) {
    for (int kx = 0; kx < lattice.width; ++kx)
        for (int ky = 0; ky <= lattice.height / 2; ++ky) f(kx, ky);
}

/// Texture j of a batch of d gets the spectrum "1 in plane j": what comes out is column j of every F_t.
/// Returns the largest relative error in units of u·(16 + cond Λ).
double check_factors(Device& device, const LinearField& field, Size lattice, double memory,
                     double scale = 1.0) {
    const int d = field.planes;
    const std::vector<double> no_mean(static_cast<std::size_t>(d), 0.0);
    SpectralFactors factors(device.impl(), {field}, lattice, scale, no_mean, memory);
    factors.store(device.impl());
    EXPECT_EQ(factors.stored_bytes() > 0.0, memory > 0.0);
    HostSpectrum units(lattice, d * d, 0.0F);
    for (int j = 0; j < d; ++j)
        for_each_frequency(lattice, [&](int kx, int ky) { units.re[at(lattice, j * d + j, kx, ky)] = 1.0F; });
    const HostSpectrum found = filtered(device, factors, std::move(units), d);
    double worst = 0.0;
    for_each_frequency(lattice, [&](int kx, int ky) {
        const Expected expected = expected_factor(field, lattice, scale, kx, ky);
        Eigen::MatrixXcd factor(d, d);
        for (int j = 0; j < d; ++j)
            for (int i = 0; i < d; ++i) factor(i, j) = found.value(j * d + i, kx, ky);
        const double error = (factor - expected.factor).norm();
        EXPECT_LE(error, expected.bound)
            << "kx " << kx << ", ky " << ky << ", condition " << expected.condition;
        const double relative = error / expected.factor.norm();
        const double cost = relative / (test::unit_roundoff * (16.0 + expected.condition));
        if (!(cost <= worst)) worst = cost;
    });
    return worst;
}

/// |z| is √(−2 ln u) for complex draws, and at most 6.67 √2 with the relative error that tests/noise_test.cpp
/// allows; where |z| is small, so is u's distance from 1, and its rounding shows.
double draw_bound(Complex z) {
    return 8e-6 + std::min(0x1p-21 / std::abs(z), 0x1p-10);
}

/// Y_t = F_t z_t, and the mean at frequency 0.
void check_draw(Device& device, const LinearField& field, Size lattice, double memory) {
    const int d = field.planes, level = 3;
    std::vector<double> mean;
    for (int i = 0; i < d; ++i) mean.push_back(100.0 + i);
    SpectralFactors factors(device.impl(), {field}, lattice, 0.5, mean, memory);
    factors.store(device.impl());
    const std::vector<std::uint64_t> seeds{1, 0xfedcba9876543210};
    const HostSpectrum found = drawn(device, factors, lattice, d, seeds, level);
    for_each_frequency(lattice, [&](int kx, int ky) {
        const Expected expected = expected_factor(field, lattice, 0.5, kx, ky);
        for (std::size_t b = 0; b < seeds.size(); ++b) {
            Eigen::VectorXcd z(d);
            Eigen::VectorXd dz(d);
            for (int j = 0; j < d; ++j) {
                z(j) = reference::spectral_noise(seeds[b], level, j, lattice, kx, ky);
                dz(j) = draw_bound(z(j));
            }
            const Eigen::VectorXcd y = reference::product(expected.factor, z);
            const Eigen::MatrixXd magnitude = expected.factor.cwiseAbs();
            const Eigen::VectorXd sums = reference::product(magnitude, Eigen::VectorXd(z.cwiseAbs()));
            const Eigen::VectorXd moved = reference::product(magnitude, dz);
            for (int i = 0; i < d; ++i) {
                const double mu = kx == 0 && ky == 0 ? mean[static_cast<std::size_t>(i)] : 0.0;
                // Factor, draws, d complex products, and the sum with the mean.
                const double bound = expected.bound * z.norm() + moved(i) +
                                     (2.0 * d + 2.0) * test::unit_roundoff * sums(i) +
                                     test::unit_roundoff * mu;
                EXPECT_LE(std::abs(found.value(static_cast<int>(b) * d + i, kx, ky) - y(i) - mu), bound)
                    << "texture " << b << ", plane " << i << ", kx " << kx << ", ky " << ky;
            }
        }
    });
}

class SpectralFactorsSmall : public testing::TestWithParam<int> {
  protected:
    Device device_ = test::device_of_width(GetParam());
};
INSTANTIATE_TEST_SUITE_P(Widths, SpectralFactorsSmall, testing::ValuesIn(test::vector_widths),
                         testing::PrintToStringParamName());

TEST_P(SpectralFactorsSmall, FactorsFollowTheReference) {
    for (const int planes : {1, 3, 5})
        for (const Size lattice : lattices) {
            SCOPED_TRACE(test::text(lattice) + ", planes " + std::to_string(planes));
            check_factors(device_, random_field(planes, neighbourhood(3, NeighbourhoodKind::causal)), lattice,
                          all_memory);
        }
}

TEST_P(SpectralFactorsSmall, DrawsFollowTheReference) {
    for (const int planes : {1, 3, 5})
        for (const Size lattice : lattices) {
            SCOPED_TRACE(test::text(lattice) + ", planes " + std::to_string(planes));
            check_draw(device_, random_field(planes, neighbourhood(2, NeighbourhoodKind::symmetric)), lattice,
                       all_memory);
        }
}

TEST_P(SpectralFactorsSmall, FactorsThatAreNotStoredAreTheSame) {
    const LinearField field = random_field(3, neighbourhood(2, NeighbourhoodKind::causal));
    for (const Size lattice : {Size{5, 2}, Size{67, 4}}) {
        SCOPED_TRACE(test::text(lattice));
        check_factors(device_, field, lattice, no_memory);
        check_draw(device_, field, lattice, no_memory);
    }
}

TEST_P(SpectralFactorsSmall, MeansAreDrawnWithoutStoringFactors) {
    const std::vector<SpectralForm> parts{
        random_field(2, neighbourhood(2, NeighbourhoodKind::causal), 0.8, 1),
        random_field(2, neighbourhood(2, NeighbourhoodKind::causal), 0.8, 2)};
    const std::vector<double> mean{1.0, 2.0, 3.0, 4.0};
    Eigen::MatrixXd density(2, 2);
    density << 500.0, 200.0, 200.0, 300.0;
    constexpr double scale = 0.5;
    const Eigen::MatrixXd root = scale * symmetric_root(density);
    const std::vector<std::uint64_t> seeds{7, 8};
    constexpr int level = 1;
    for (const Size lattice : {Size{1, 1}, Size{6, 1}, Size{5, 2}, Size{64, 5}, Size{130, 2}}) {
        SCOPED_TRACE(test::text(lattice));
        SpectralFactors plain(device_.impl(), parts, lattice, scale, mean, no_memory);
        const HostSpectrum before = drawn(device_, plain, lattice, 4, seeds, level);
        for (const double memory : {no_memory, all_memory}) {
            SpectralFactors factors(device_.impl(), parts, lattice, scale, mean, memory);
            factors.set_means(device_.impl(), {std::nullopt, density});
            EXPECT_EQ(factors.stored_bytes(), 0.0);
            factors.store(device_.impl());
            EXPECT_EQ(factors.stored_bytes() > 0.0, memory > 0.0);
            const HostSpectrum found = drawn(device_, factors, lattice, 4, seeds, level);
            for_each_frequency(lattice, [&](int kx, int ky) {
                for (int p = 0; p < 8; ++p) {
                    Complex wanted = before.value(p, kx, ky);
                    if (kx == 0 && ky == 0 && p % 4 >= 2) {
                        wanted = mean[static_cast<std::size_t>(p % 4)];
                        for (int j = 0; j < 2; ++j)
                            wanted += root(p % 2, j) *
                                      reference::spectral_noise(seeds[static_cast<std::size_t>(p / 4)], level,
                                                                2 + j, lattice, 0, 0);
                    }
                    // Draws are good to 1e-5, roots to rounding.
                    EXPECT_LE(std::abs(found.value(p, kx, ky) - wanted), 2e-4 + 1e-5 * std::abs(wanted))
                        << "plane " << p << ", kx " << kx << ", ky " << ky;
                }
            });
        }
    }
}

class SpectralFactorsNative : public testing::Test {
  protected:
    Device device_;
};

TEST_F(SpectralFactorsNative, EveryNumberOfPlanes) {
    for (const int planes : {1, 2, 3, 4, 5})
        for (const Size lattice : {Size{13, 7}, Size{64, 5}}) {
            SCOPED_TRACE(test::text(lattice) + ", planes " + std::to_string(planes));
            const LinearField field = random_field(planes, neighbourhood(5, NeighbourhoodKind::symmetric));
            check_factors(device_, field, lattice, all_memory);
            check_draw(device_, field, lattice, all_memory);
        }
}

TEST_F(SpectralFactorsNative, EveryNumberOfPlanesWithoutStoring) {
    for (const int planes : {1, 5}) {
        SCOPED_TRACE(planes);
        const LinearField field = random_field(planes, neighbourhood(2, NeighbourhoodKind::causal));
        check_factors(device_, field, {13, 7}, no_memory);
        check_draw(device_, field, {13, 7}, no_memory);
    }
}

TEST(SpectralFactorsLong, ManyPlanes) {
    Device device;
    for (const int planes : {8, 32}) {
        SCOPED_TRACE(planes);
        const LinearField field = random_field(planes, neighbourhood(1, NeighbourhoodKind::causal));
        check_factors(device, field, {12, 5}, all_memory);
        check_draw(device, field, {12, 5}, all_memory);
    }
    check_draw(device, random_field(8, neighbourhood(1, NeighbourhoodKind::symmetric)), {13, 4}, no_memory);
}

TEST_F(SpectralFactorsNative, OffsetsBeyondTheLatticeWrap) {
    for (const Size lattice : lattices) {
        SCOPED_TRACE(test::text(lattice));
        check_factors(device_, random_field(1, {{-70, 3}, {-1, 200}, {0, -9}, {5, 5}}), lattice, all_memory,
                      2.0);
    }
}

TEST_F(SpectralFactorsNative, IllConditionedNearFrequencyZero) {
    // cond Λ runs from 1 to 1e4 on the way to frequency 0. Rounding the entries of Λ costs u·cond and no
    // frequency costs more; a dozen sums and products cost the rest. For one plane Λ is small without being
    // ill-conditioned, and must keep its relative accuracy all the way.
    for (const std::vector<double>& sums :
         {std::vector<double>{0.9999}, std::vector<double>{0.9999, 0.2},
          std::vector<double>{0.9998, 0.97, 0.3}, std::vector<double>{0.9998, 0.999, 0.9, 0.5, 0.1}})
        for (const Size lattice : {Size{64, 64}, Size{512, 6}, Size{6, 500}}) {
            SCOPED_TRACE(test::text(lattice) + ", planes " + std::to_string(sums.size()));
            EXPECT_LE(check_factors(device_, ill_conditioned_field(sums), lattice, all_memory), 1.0);
        }
}

TEST_F(SpectralFactorsNative, PivotsAreFound) {
    // Λ = [1 − a, −1; −1, 1 − a] with a = 1 at every frequency where the wave is 1: no elimination without
    // row exchange.
    LinearField field = random_field(2, {{0, -1}});
    field.coefficients = {1.0, 1.0, 1.0, 1.0};
    check_factors(device_, field, {9, 8}, all_memory);
    field.coefficients = {0.999999, 0.5, 0.5, 0.999999};
    check_factors(device_, field, {9, 8}, all_memory);
}

TEST_F(SpectralFactorsNative, WhiteNoiseHasNoOffsets) {
    const LinearField field = random_field(3, {});
    check_factors(device_, field, {13, 7}, all_memory);
    check_draw(device_, field, {13, 7}, all_memory);
}

TEST_F(SpectralFactorsNative, FilterTakesAnySpectrumAndAddsTheMean) {
    const LinearField field = random_field(3, neighbourhood(2, NeighbourhoodKind::causal));
    const std::vector<double> mean{100.0, 200.0, -300.0};
    for (const double memory : {all_memory, no_memory})
        for (const Size lattice : {Size{13, 7}, Size{34, 5}}) {
            SCOPED_TRACE(test::text(lattice));
            constexpr int batch = 2;
            SpectralFactors factors(device_.impl(), {field}, lattice, 0.5, mean, memory);
            factors.store(device_.impl());
            HostSpectrum in(lattice, 3 * batch, nan_value);  // the padding stays undefined
            std::mt19937 generator(3);
            std::normal_distribution<float> normal;
            for (int p = 0; p < 3 * batch; ++p)
                for_each_frequency(lattice, [&](int kx, int ky) {
                    in.re[at(lattice, p, kx, ky)] = normal(generator);
                    in.im[at(lattice, p, kx, ky)] = normal(generator);
                });
            const HostSpectrum found = filtered(device_, factors, in, batch);
            for_each_frequency(lattice, [&](int kx, int ky) {
                const Expected expected = expected_factor(field, lattice, 0.5, kx, ky);
                for (int b = 0; b < batch; ++b) {
                    Eigen::VectorXcd x(3);
                    for (int j = 0; j < 3; ++j) x(j) = in.value(3 * b + j, kx, ky);
                    const Eigen::VectorXcd y = reference::product(expected.factor, x);
                    for (int i = 0; i < 3; ++i) {
                        const double mu = kx == 0 && ky == 0 ? mean[static_cast<std::size_t>(i)] : 0.0;
                        EXPECT_LE(std::abs(found.value(3 * b + i, kx, ky) - y(i) - mu),
                                  expected.bound * x.norm() +
                                      8.0 * test::unit_roundoff *
                                          (expected.factor.norm() * x.norm() + std::abs(mu)))
                            << "texture " << b << ", plane " << i << ", kx " << kx << ", ky " << ky;
                    }
                }
            });
        }
}

TEST_F(SpectralFactorsNative, BatchesAreTheirTextures) {
    const LinearField field = random_field(3, neighbourhood(2, NeighbourhoodKind::causal));
    const Size lattice{34, 6};
    SpectralFactors factors(device_.impl(), {field}, lattice, 1.0, {0.0, 0.0, 0.0}, all_memory);
    factors.store(device_.impl());
    const std::vector<std::uint64_t> seeds{9, 8, 7};
    const HostSpectrum together = drawn(device_, factors, lattice, 3, seeds, 0);
    for (std::size_t b = 0; b < seeds.size(); ++b) {
        const HostSpectrum alone = drawn(device_, factors, lattice, 3, {seeds[b]}, 0);
        for (int p = 0; p < 3; ++p)
            for_each_frequency(lattice, [&](int kx, int ky) {
                EXPECT_EQ(alone.value(p, kx, ky), together.value(static_cast<int>(b) * 3 + p, kx, ky));
            });
    }
}

TEST_F(SpectralFactorsNative, PackedSpectraHaveTheSameValues) {
    const LinearField field = random_field(3, neighbourhood(2, NeighbourhoodKind::causal));
    const Size lattice{34, 6};
    SpectralFactors factors(device_.impl(), {field}, lattice, 1.0, {1.0, 2.0, 3.0}, all_memory);
    const std::vector<std::uint64_t> seeds{9, 8};
    const int planes = 3 * static_cast<int>(seeds.size());
    const PackedSpectrum packed{lattice};
    for (const bool stored : {false, true}) {
        if (stored) factors.store(device_.impl());
        const HostSpectrum apart = drawn(device_, factors, lattice, 3, seeds, 2);
        Buffer memory = device_.impl().upload(std::vector<float>(packed.bytes(planes) / sizeof(float)));
        const Buffer keys = test::upload_seeds(device_, seeds);
        factors.draw(device_.impl(), memory, keys, static_cast<int>(seeds.size()), 2);
        const auto found = test::read_all<float>(device_, memory);
        for (int p = 0; p < planes; ++p)
            for_each_frequency(lattice, [&](int kx, int ky) {
                const std::size_t i = static_cast<std::size_t>(p) * packed.stride() + at(lattice, 0, kx, ky);
                ASSERT_EQ(Complex(static_cast<double>(found[i]),
                                  static_cast<double>(found[i + packed.imaginary()])),
                          apart.value(p, kx, ky))
                    << "plane " << p << ", kx " << kx << ", ky " << ky;
            });
    }
}

TEST_F(SpectralFactorsNative, BudgetDecidesWhatIsStored) {
    const LinearField field = random_field(2, neighbourhood(1, NeighbourhoodKind::causal));
    const Size lattice{20, 12};
    const double bytes = 2.0 * sizeof(float) * static_cast<double>(spectrum_floats(lattice, 4));
    const std::vector<double> mean(2, 0.0);
    for (const double budget : {bytes, bytes - 1.0, -1.0}) {
        SpectralFactors factors(device_.impl(), {field}, lattice, 1.0, mean, budget);
        const double expected = budget < bytes ? 0.0 : bytes;
        EXPECT_EQ(factors.storable_bytes(), expected);
        EXPECT_EQ(factors.stored_bytes(), 0.0);
        factors.store(device_.impl());
        EXPECT_EQ(factors.stored_bytes(), expected);
    }
}

TEST_F(SpectralFactorsNative, RefusesCovariancesWithoutRoot) {
    LinearField field = random_field(2, neighbourhood(1, NeighbourhoodKind::causal));
    field.noise_covariance = {1.0, 2.0, 2.0, 1.0};
    EXPECT_THROW(SpectralFactors(device_.impl(), {field}, {8, 8}, 1.0, {0.0, 0.0}, all_memory), InputError);
}

}  // namespace
}  // namespace btfield

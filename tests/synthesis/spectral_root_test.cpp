// kernels/synthesis/spectral_root.cl: hermitian_root.clh, hermitian_factor.clh and general_solve.clh.

#include <gtest/gtest.h>

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <complex>
#include <limits>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include "btfield/neighbourhood.hpp"
#include "tests/device_cases.hpp"
#include "tests/reference/algebra.hpp"
#include "tests/reference/spectral_factor.hpp"

namespace btfield {
namespace {

using Complex = std::complex<double>;
using Eigen::Index;
using Eigen::MatrixXcd;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr std::array planes = {1, 2, 3, 4, 6, 8, 31, 32};
constexpr std::array conditions = {1.0, 30.0, 1e3, 1e4, 1e5, 1e6};

/// Of every root, factor and solve for conditions up to 1e4.
constexpr double promise = 1e-4;

std::mt19937& generator() {
    static std::mt19937 engine(1);
    return engine;
}

MatrixXcd random_matrix(Index d) {
    std::normal_distribution<double> normal;
    MatrixXcd a(d, d);
    for (Index i = 0; i < d; ++i)
        for (Index j = 0; j < d; ++j) a(i, j) = Complex(normal(generator()), normal(generator()));
    return a;
}

MatrixXcd random_unitary(Index d) {
    return reference::unitary_factor(random_matrix(d));
}

/// Eigenvalues from 1 down to 1/condition: graded, one small, one large, random, evenly spaced.
VectorXd spectrum(Index d, double condition, int kind) {
    std::uniform_real_distribution<double> uniform;
    VectorXd values(d);
    for (Index i = 0; i < d; ++i) {
        const double place = d > 1 ? static_cast<double>(i) / static_cast<double>(d - 1) : 1.0;
        switch (kind % 5) {
            case 0:
                values[i] = std::pow(condition, -place);
                break;
            case 1:
                values[i] = i == 0 ? 1.0 / condition : 1.0;
                break;
            case 2:
                values[i] = i == 0 ? 1.0 : 1.0 / condition;
                break;
            case 3:
                values[i] = std::pow(condition, -uniform(generator()));
                break;
            default:
                values[i] = 1.0 / condition + place * (1.0 - 1.0 / condition);
                break;
        }
    }
    return values;
}

/// Matrices as the kernels take them, [i][j][matrix], and what float32 made of them.
struct Matrices {
    Index d = 0;
    std::size_t count = 0;
    std::vector<float> re, im;
    Matrices(Index planes_count, std::size_t matrices)
        : d(planes_count),
          count(matrices),
          re(static_cast<std::size_t>(d * d) * pitch(), 1.0F),
          im(re.size(), 0.0F) {}
    [[nodiscard]] std::size_t pitch() const { return (count + 15) / 16 * 16; }
    [[nodiscard]] std::size_t at(Index i, Index j, std::size_t n) const {
        return static_cast<std::size_t>(i * d + j) * pitch() + n;
    }
    void set(std::size_t n, const MatrixXcd& a) {
        for (Index i = 0; i < d; ++i)
            for (Index j = 0; j < d; ++j) {
                re[at(i, j, n)] = static_cast<float>(a(i, j).real());
                im[at(i, j, n)] = static_cast<float>(a(i, j).imag());
            }
    }
    [[nodiscard]] MatrixXcd get(std::size_t n) const {
        MatrixXcd a(d, d);
        for (Index i = 0; i < d; ++i)
            for (Index j = 0; j < d; ++j)
                a(i, j) = Complex(static_cast<double>(re[at(i, j, n)]), static_cast<double>(im[at(i, j, n)]));
        return a;
    }
};

/// Hermitian with these conditions in turn, in random bases and in bases close to the planes'. The lower
/// triangle is what counts: NaN above it, and in the imaginary part of the diagonal.
Matrices hermitian_matrices(Index d, std::size_t count, double condition) {
    Matrices result(d, count);
    for (std::size_t n = 0; n < count; ++n) {
        MatrixXcd basis = random_unitary(d);
        if (n % 3 == 2) basis = reference::unitary_factor(MatrixXcd::Identity(d, d) + 1e-3 * basis);
        result.set(n, reference::with_eigenvalues(basis, spectrum(d, condition, static_cast<int>(n))));
    }
    return result;
}

MatrixXcd from_lower_triangle(const MatrixXcd& a) {
    MatrixXcd result = a.triangularView<Eigen::StrictlyLower>();
    result += result.adjoint().eval();
    result.diagonal() = a.diagonal().real().cast<Complex>();
    return result;
}

void spoil_upper_triangle(Matrices& m) {
    constexpr float nan = std::numeric_limits<float>::quiet_NaN();
    for (std::size_t n = 0; n < m.count; ++n)
        for (Index i = 0; i < m.d; ++i)
            for (Index j = i; j < m.d; ++j) {
                if (j > i) m.re[m.at(i, j, n)] = nan;
                m.im[m.at(i, j, n)] = nan;
            }
}

/// Symmetric positive definite with this condition.
MatrixXd noise_root(Index d, double condition) {
    const MatrixXd basis = reference::orthogonal_factor(random_matrix(d).real());
    MatrixXd root = reference::with_eigenvalues(basis, spectrum(d, std::sqrt(condition), 0));
    root = (0.5 * (root + root.transpose())).eval();
    return root.cast<float>().cast<double>();
}

std::vector<float> packed(const MatrixXd& a) {
    std::vector<float> values;
    for (Index i = 0; i < a.rows(); ++i)
        for (Index j = 0; j < a.cols(); ++j) values.push_back(static_cast<float>(a(i, j)));
    return values;
}

Kernel kernel(Device& device, const char* name, Index d, int factor = 1, bool indefinite = false) {
    BuildParameters parameters = device.impl().lanes();
    parameters.set("BTFIELD_PLANES", static_cast<int>(d)).set("BTFIELD_FACTOR", factor);
    if (indefinite) parameters.set("BTFIELD_INDEFINITE", 1);
    return device.impl().kernel("spectral_root", name, parameters);
}

Range vectors(Device& device, const Matrices& m) {
    return {m.pitch() / static_cast<std::size_t>(device.impl().vector_width())};
}

struct Roots {
    Matrices root, inverse;
};

Roots hermitian_roots(Device& device, const Matrices& m) {
    DeviceImpl& impl = device.impl();
    const std::size_t bytes = m.re.size() * sizeof(float);
    const Buffer re = impl.upload(m.re), im = impl.upload(m.im);
    const Buffer rr = impl.buffer(bytes), ri = impl.buffer(bytes), vr = impl.buffer(bytes),
                 vi = impl.buffer(bytes);
    impl.launch(kernel(device, "hermitian_roots", m.d), vectors(device, m), Grain::coarse, re, im, rr, ri, vr,
                vi, static_cast<int>(m.pitch()));
    Roots result{m, m};
    result.root.re = test::read_all<float>(device, rr), result.root.im = test::read_all<float>(device, ri);
    result.inverse.re = test::read_all<float>(device, vr),
    result.inverse.im = test::read_all<float>(device, vi);
    return result;
}

/// hermitian_root_factors or general_solves: matrices and one real matrix in, matrices out.
Matrices with_right_side(Device& device, const char* name, const Matrices& m, const MatrixXd& right,
                         int factor = 1, bool indefinite = false) {
    DeviceImpl& impl = device.impl();
    const std::size_t bytes = m.re.size() * sizeof(float);
    const Buffer re = impl.upload(m.re), im = impl.upload(m.im), b = impl.upload(packed(right));
    const Buffer fr = impl.buffer(bytes), fi = impl.buffer(bytes);
    impl.launch(kernel(device, name, m.d, factor, indefinite), vectors(device, m), Grain::coarse, re, im, b,
                fr, fi, static_cast<int>(m.pitch()));
    Matrices result = m;
    result.re = test::read_all<float>(device, fr), result.im = test::read_all<float>(device, fi);
    return result;
}

/// Relative error, infinite when it is not a number.
double error(const MatrixXcd& found, const MatrixXcd& expected) {
    const double e = (found - expected).norm() / expected.norm();
    return std::isfinite(e) ? e : std::numeric_limits<double>::infinity();
}

/// The Cholesky factor's columns, rounded to float32, have a condition of √cond; d-term sums and the
/// rotations' roundings of every column come on top.
double root_bound(Index d, double condition) {
    const double bound = 8.0 * test::unit_roundoff * (static_cast<double>(d) + std::sqrt(condition));
    return condition <= 1e4 ? std::min(bound, promise) : bound;
}

std::size_t matrices_of(Index d) {
    return d <= 8 ? 45 : 17;
}

class SpectralRootWidths : public testing::TestWithParam<int> {
  protected:
    Device device_ = test::device_of_width(GetParam());
};

INSTANTIATE_TEST_SUITE_P(Widths, SpectralRootWidths, testing::ValuesIn(test::vector_widths),
                         testing::PrintToStringParamName());

TEST_P(SpectralRootWidths, RootsMatchFloat64) {
    for (const int d : planes)
        for (const double condition : conditions) {
            Matrices m = hermitian_matrices(d, matrices_of(d), condition);
            const Matrices kept = m;
            spoil_upper_triangle(m);
            const Roots found = hermitian_roots(device_, m);
            double root = 0.0, inverse = 0.0;
            for (std::size_t n = 0; n < m.count; ++n) {
                const MatrixXcd a = from_lower_triangle(kept.get(n));
                root = std::max(root, error(found.root.get(n), reference::hermitian_root(a)));
                inverse =
                    std::max(inverse, error(found.inverse.get(n), reference::hermitian_inverse_root(a)));
            }
            const double bound = root_bound(d, condition);
            EXPECT_LE(root, bound) << d << " planes, condition " << condition;
            EXPECT_LE(inverse, bound) << d << " planes, condition " << condition;
        }
}

TEST_P(SpectralRootWidths, FactorsOfMarkovFieldsMatchFloat64) {
    for (const int d : planes)
        for (const double condition : conditions)
            for (const double noise_condition : {1.0, 100.0}) {
                const MatrixXd root = noise_root(d, noise_condition);
                Matrices m = hermitian_matrices(d, matrices_of(d) / 3, condition);
                const Matrices kept = m;
                spoil_upper_triangle(m);
                const Matrices mmrf = with_right_side(device_, "hermitian_root_factors", m, root, 1);
                const Matrices pmrf = with_right_side(device_, "hermitian_root_factors", m, root, 2);
                double worst_mmrf = 0.0, worst_pmrf = 0.0;
                for (std::size_t n = 0; n < m.count; ++n) {
                    const MatrixXcd a = from_lower_triangle(kept.get(n));
                    worst_mmrf = std::max(worst_mmrf, error(mmrf.get(n), reference::mmrf_factor(a, root)));
                    worst_pmrf = std::max(worst_pmrf, error(pmrf.get(n), reference::pmrf_factor(a, root)));
                }
                // Σ^{1/2} may shrink the eigenvector that W^{-1/2} is large along, by its condition at most.
                const double bound = std::min(std::sqrt(noise_condition) * root_bound(d, condition),
                                              condition <= 1e4 ? promise : 1.0);
                EXPECT_LE(worst_mmrf, bound)
                    << d << " planes, conditions " << condition << ", " << noise_condition;
                EXPECT_LE(worst_pmrf, bound)
                    << d << " planes, conditions " << condition << ", " << noise_condition;
            }
}

/// What is left of a matrix when directions of negative eigenvalues are left out, to a power.
MatrixXcd positive_power(const MatrixXcd& basis, const VectorXd& values, double power) {
    VectorXd powers(values.size());
    for (Index i = 0; i < values.size(); ++i) powers[i] = values[i] > 0.0 ? std::pow(values[i], power) : 0.0;
    return basis * powers.cast<Complex>().asDiagonal() * basis.adjoint();
}

TEST_P(SpectralRootWidths, NegativeDirectionsAreLeftOut) {
    for (const int d : {1, 2, 3, 4}) {
        const MatrixXd root = noise_root(d, 10.0);
        Matrices m(d, matrices_of(d));
        std::vector<MatrixXcd> bases;
        std::vector<VectorXd> values;
        std::uniform_real_distribution<double> size(0.2, 1.0);
        for (std::size_t n = 0; n < m.count; ++n) {
            bases.push_back(random_unitary(d));
            VectorXd eigenvalues(d);
            // All positive, all negative, and mixed.
            for (Index i = 0; i < d; ++i)
                eigenvalues[i] = size(generator()) * (n % 3 == 0 || (n % 3 == 2 && i % 2 == 0) ? 1.0 : -1.0);
            values.push_back(eigenvalues);
            m.set(n, bases.back() * eigenvalues.cast<Complex>().asDiagonal() * bases.back().adjoint());
        }
        spoil_upper_triangle(m);
        const Matrices mmrf = with_right_side(device_, "hermitian_root_factors", m, root, 1, true);
        const Matrices pmrf = with_right_side(device_, "hermitian_root_factors", m, root, 2, true);
        for (std::size_t n = 0; n < m.count; ++n) {
            const MatrixXcd expected = root.cast<Complex>() * positive_power(bases[n], values[n], -0.5);
            // The shift is below 2 d, and sums have d terms: eigenvalues are off by some d² u, those above
            // 0.2 and the eigenvectors, whose gap is above 0.4, by ten times that in what is made of them.
            const double bound = 200.0 * d * d * test::unit_roundoff;
            EXPECT_LE((mmrf.get(n) - expected).norm(), bound * root.norm()) << d << " planes, matrix " << n;
            const VectorXd inverse = values[n].cwiseInverse();
            const MatrixXcd other = bases[n] * inverse.cast<Complex>().asDiagonal() * bases[n].adjoint() *
                                    root.cast<Complex>() * positive_power(bases[n], values[n], 0.5);
            EXPECT_LE((pmrf.get(n) - other).norm(), 5.0 * bound * root.norm())
                << d << " planes, matrix " << n;
        }
    }
}

TEST_P(SpectralRootWidths, SolvesMatchFloat64) {
    for (const int d : planes)
        for (const double condition : conditions) {
            Matrices m(d, matrices_of(d));
            for (std::size_t n = 0; n < m.count; ++n)
                m.set(n, random_unitary(d) * spectrum(d, condition, static_cast<int>(n)).asDiagonal() *
                             random_unitary(d));
            const MatrixXd right = reference::lower_root(noise_root(d, 10.0));
            const MatrixXd rounded = right.cast<float>().cast<double>();
            const Matrices found = with_right_side(device_, "general_solves", m, rounded);
            // Elimination in float32: d·u·cond, squared by the refinement of what has a condition above 16 d
            // (in the Frobenius norm, which is no smaller); and the last additions.
            const double once = 4.0 * test::unit_roundoff * (d + 4.0) * condition;
            const double bound = 4.0 * test::unit_roundoff + (condition > 16.0 * d ? once * once : once);
            double worst = 0.0;
            for (std::size_t n = 0; n < m.count; ++n)
                worst =
                    std::max(worst, error(found.get(n), reference::solution(m.get(n), MatrixXcd(rounded))));
            EXPECT_LE(worst, condition <= 1e4 ? std::min(bound, promise) : bound)
                << d << " planes, condition " << condition;
        }
}

/// F_t of the half spectrum by hermitian_factors: [i][j][kx][ky], float32.
struct LatticeFactors {
    Size lattice;
    Index d;
    std::vector<float> re, im;
    [[nodiscard]] MatrixXcd get(int kx, int ky) const {
        MatrixXcd f(d, d);
        const auto pitch = static_cast<std::size_t>(spectrum_pitch(lattice.height));
        for (Index i = 0; i < d; ++i)
            for (Index j = 0; j < d; ++j) {
                const std::size_t at =
                    (static_cast<std::size_t>(i * d + j) * static_cast<std::size_t>(lattice.width) +
                     static_cast<std::size_t>(kx)) *
                        pitch +
                    static_cast<std::size_t>(ky);
                f(i, j) = Complex(static_cast<double>(re[at]), static_cast<double>(im[at]));
            }
        return f;
    }
};

/// steps: Hermitian field's A_s (PMRF) or those of W (MMRF).
LatticeFactors lattice_factors(Device& device, const std::vector<Offset>& offsets,
                               const std::vector<MatrixXd>& steps, const MatrixXd& root, Size lattice,
                               int factor) {
    DeviceImpl& impl = device.impl();
    const Index d = root.rows();
    const int pitch = spectrum_pitch(lattice.height);
    std::vector<float> coefficients, rows;
    std::vector<std::array<float, 2>> columns;
    std::vector<std::array<int, 2>> places;
    MatrixXd at_zero = MatrixXd::Identity(d, d);
    const auto append = [&](const MatrixXd& a) {
        const std::vector<float> values = packed(a);
        coefficients.insert(coefficients.end(), values.begin(), values.end());
    };
    for (std::size_t s = 0; s < offsets.size(); ++s) {
        append(steps[s]);
        at_zero -= steps[s];
        places.push_back({{static_cast<int>(s), static_cast<int>(s)}});
        const double row = std::numbers::pi * offsets[s].row / lattice.height;
        const double column = std::numbers::pi * offsets[s].column / lattice.width;
        for (int ky = 0; ky < pitch; ++ky) rows.push_back(static_cast<float>(std::cos(row * ky)));
        for (int ky = 0; ky < pitch; ++ky) rows.push_back(static_cast<float>(std::sin(row * ky)));
        for (int kx = 0; kx < lattice.width; ++kx)
            columns.push_back(
                {{static_cast<float>(std::cos(column * kx)), static_cast<float>(std::sin(column * kx))}});
    }
    append(at_zero);
    append(root);
    const Buffer c = impl.upload(coefficients), o = impl.upload(places), r = impl.upload(rows),
                 k = impl.upload(columns);
    const std::size_t bytes = spectrum_floats(lattice, static_cast<int>(d * d)) * sizeof(float);
    const Buffer re = impl.buffer(bytes), im = impl.buffer(bytes);
    impl.launch(
        kernel(device, "hermitian_factors", d, factor),
        {static_cast<std::size_t>(pitch / impl.vector_width()), static_cast<std::size_t>(lattice.width)},
        Grain::coarse, c, o, r, k, static_cast<int>(offsets.size()), re, im, lattice.width, pitch);
    return {lattice, d, test::read_all<float>(device, re), test::read_all<float>(device, im)};
}

TEST_P(SpectralRootWidths, FactorsOfEveryFrequencyMatchFloat64) {
    for (const int d : {1, 2, 3}) {
        const auto offsets = neighbourhood(2, NeighbourhoodKind::symmetric);
        std::vector<MatrixXd> steps(offsets.size());
        for (std::size_t s = 0; s < offsets.size(); ++s)
            for (std::size_t t = 0; t <= s; ++t) {
                if (offsets[t] != -offsets[s]) continue;
                // 8 of at most 0.11: Λ is at least 0.1 everywhere.
                MatrixXd a = random_matrix(d).real();
                a *= 0.11 / a.norm();
                steps[s] = a, steps[t] = a.transpose();
            }
        const MatrixXd root = noise_root(d, 10.0);
        for (const Size lattice : {Size{1, 1}, Size{6, 5}, Size{13, 4}, Size{34, 3}})
            for (const int factor : {1, 2}) {
                const LatticeFactors found = lattice_factors(device_, offsets, steps, root, lattice, factor);
                for (int kx = 0; kx < lattice.width; ++kx)
                    for (int ky = 0; ky <= lattice.height / 2; ++ky) {
                        MatrixXcd lambda = MatrixXcd::Identity(d, d);
                        for (std::size_t s = 0; s < offsets.size(); ++s) {
                            const double turns = static_cast<double>(ky) * offsets[s].row / lattice.height +
                                                 static_cast<double>(kx) * offsets[s].column / lattice.width;
                            lambda -=
                                steps[s].cast<Complex>() * std::polar(1.0, 2.0 * std::numbers::pi * turns);
                        }
                        const MatrixXcd expected = factor == 1 ? reference::mmrf_factor(lambda, root)
                                                               : reference::pmrf_factor(lambda, root);
                        // Λ is summed from 8 rounded terms and M, of norm 2.7 in all; cond Λ <= 19 twice (Λ⁻¹
                        // and the condition of Σ^{1/2}).
                        EXPECT_LE(error(found.get(kx, ky), expected),
                                  4.0 * test::unit_roundoff * (d + 1.0) * 2.7 / 0.1 * std::sqrt(10.0))
                            << d << " planes, form " << factor << ", kx " << kx << ", ky " << ky;
                        // F_{−t} = conj(F_t), to the rounding of the tables.
                        if (ky == 0) {
                            const int mirror = kx == 0 ? 0 : lattice.width - kx;
                            EXPECT_LE(error(found.get(mirror, 0).conjugate(), found.get(kx, 0)),
                                      8.0 * test::unit_roundoff * (d + 1.0) * 2.7 / 0.1 * std::sqrt(10.0));
                        }
                    }
            }
    }
}

TEST_P(SpectralRootWidths, RootsScale) {
    for (const int d : {2, 3, 8}) {
        const Matrices m = hermitian_matrices(d, 19, 100.0);
        const Roots plain = hermitian_roots(device_, m);
        for (const double factor : {0x1p-20, 0x1p20}) {
            Matrices scaled = m;
            for (std::size_t n = 0; n < m.count; ++n) scaled.set(n, factor * m.get(n));
            const Roots found = hermitian_roots(device_, scaled);
            // Powers of 4 only move exponents; reciprocal roots of the library may differ by two units.
            for (std::size_t n = 0; n < m.count; ++n) {
                EXPECT_LE(error(found.root.get(n), std::sqrt(factor) * plain.root.get(n)),
                          16.0 * test::unit_roundoff);
                EXPECT_LE(error(found.inverse.get(n), plain.inverse.get(n) / std::sqrt(factor)),
                          16.0 * test::unit_roundoff);
            }
        }
    }
}

TEST_P(SpectralRootWidths, WhatIsNotPositiveDefiniteHasNoRoot) {
    for (const int d : planes) {
        Matrices m = hermitian_matrices(d, 33, 100.0);
        const Roots before = hermitian_roots(device_, m);
        for (const std::size_t n : {0U, 13U, 32U}) {
            VectorXd values = spectrum(d, 10.0, 0);
            values[0] = -0.5;
            const MatrixXcd basis = random_unitary(d);
            m.set(n, reference::with_eigenvalues(basis, values));
        }
        const Roots after = hermitian_roots(device_, m);
        for (std::size_t n = 0; n < m.count; ++n) {
            if (n == 0 || n == 13 || n == 32) {
                EXPECT_TRUE(std::isnan(after.root.get(n).norm())) << d << " planes";
                EXPECT_TRUE(std::isnan(after.inverse.get(n).norm())) << d << " planes";
            } else {
                EXPECT_EQ(before.root.get(n), after.root.get(n)) << d << " planes";
                EXPECT_EQ(before.inverse.get(n), after.inverse.get(n)) << d << " planes";
            }
        }
    }
}

}  // namespace
}  // namespace btfield

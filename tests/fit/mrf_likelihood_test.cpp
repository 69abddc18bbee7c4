#include "host/fit/mrf_likelihood.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <complex>
#include <functional>
#include <numbers>
#include <random>
#include <span>
#include <string>
#include <unsupported/Eigen/FFT>

#include "btfield/error.hpp"
#include "btfield/image_io.hpp"
#include "host/fit/folded_periodogram.hpp"
#include "tests/places.hpp"
#include "tests/reference/algebra.hpp"
#include "tests/reference/fields.hpp"
#include "tests/reference/markov.hpp"

namespace btfield {

using namespace detail;

namespace {

using Complex = std::complex<double>;
using Eigen::Index;
using Eigen::MatrixXcd;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using std::size_t;
constexpr double pi = std::numbers::pi;

Image picture(const char* name) {
    return read_picture(test::data_folder() + "/" + name).image;
}

/// Every pixel less the mean of its four neighbours: without the long waves that need fine grids to check.
Image detail(const Image& image) {
    Image result(image.size(), image.planes());
    const int height = image.height(), width = image.width();
    for (int p = 0; p < image.planes(); ++p) {
        for (int r = 0; r < height; ++r) {
            for (int c = 0; c < width; ++c) {
                result.at(p, r, c) =
                    image.at(p, r, c) -
                    0.25F * (image.at(p, (r + 1) % height, c) + image.at(p, (r + height - 1) % height, c) +
                             image.at(p, r, (c + 1) % width) + image.at(p, r, (c + width - 1) % width));
            }
        }
    }
    return result;
}

std::vector<Offset> symmetric(int order) {
    return neighbourhood(order, NeighbourhoodKind::symmetric);
}

/// A field on the symmetric support from parameters: Σ's lower triangle (or its diagonal), then A_s (PMRF) or
/// Q_s (MMRF) of the positive offsets.
class Parameters {
  public:
    Parameters(MrfForm form, int planes, std::vector<Offset> offsets, bool full)
        : form_(form), planes_(planes), offsets_(std::move(offsets)), full_(full) {}

    [[nodiscard]] MrfModel field(const VectorXd& x) const {
        const int d = planes_;
        MrfModel model;
        model.form = form_;
        model.planes = d;
        model.kind = NeighbourhoodKind::symmetric;
        model.offsets = offsets_;
        Index k = 0;
        MatrixXd sigma = MatrixXd::Zero(d, d);
        for (int i = 0; i < d; ++i) {
            for (int j = full_ ? 0 : i; j <= i; ++j) {
                sigma(i, j) = sigma(j, i) = x[k];
                ++k;
            }
        }
        const MatrixXd left = form_ == MrfForm::mmrf ? sigma : MatrixXd::Identity(d, d);
        model.coefficients.resize(offsets_.size() * static_cast<size_t>(d * d));
        const auto store = [&](Offset s, const MatrixXd& a) {
            const auto place =
                static_cast<size_t>(std::find(offsets_.begin(), offsets_.end(), s) - offsets_.begin());
            for (int i = 0; i < d; ++i) {
                for (int j = 0; j < d; ++j)
                    model.coefficients[(place * static_cast<size_t>(d) + static_cast<size_t>(i)) *
                                           static_cast<size_t>(d) +
                                       static_cast<size_t>(j)] = a(i, j);
            }
        };
        for (const Offset s : offsets_) {
            if (s < Offset{}) continue;
            MatrixXd q(d, d);
            for (int i = 0; i < d; ++i) {
                for (int j = 0; j < d; ++j) q(i, j) = x[k++];
            }
            store(s, reference::product(left, q));
            store(-s, reference::product(left, MatrixXd(q.transpose())));
        }
        for (int i = 0; i < d; ++i) {
            for (int j = 0; j < d; ++j) model.noise_covariance.push_back(sigma(i, j));
        }
        return model;
    }
    [[nodiscard]] VectorXd of(const MrfModel& model) const {
        std::vector<double> x;
        const MatrixXd sigma = reference::noise_covariance(model);
        for (int i = 0; i < planes_; ++i) {
            for (int j = full_ ? 0 : i; j <= i; ++j) x.push_back(sigma(i, j));
        }
        const MatrixXd left =
            form_ == MrfForm::mmrf ? reference::inverse(sigma) : MatrixXd::Identity(planes_, planes_);
        for (size_t s = 0; s < offsets_.size(); ++s) {
            if (offsets_[s] < Offset{}) continue;
            const MatrixXd q = reference::product(left, reference::coefficients(model, s));
            for (int i = 0; i < planes_; ++i) {
                for (int j = 0; j < planes_; ++j) x.push_back(q(i, j));
            }
        }
        return Eigen::Map<VectorXd>(x.data(), static_cast<Index>(x.size()));
    }
    /// A valid field with correlated planes: Σ_s 2 ‖A_s‖ (MMRF: Σ^{1/2} Q_s Σ^{1/2}) is 0.8.
    [[nodiscard]] VectorXd example(unsigned seed) const {
        std::mt19937 random(seed);
        std::normal_distribution<double> normal;
        const int d = planes_;
        MatrixXd sigma = MatrixXd::Identity(d, d);
        for (int i = 0; i < d; ++i) {
            sigma(i, i) = 1.0 + 0.5 * i;
            for (int j = 0; j < i && full_; ++j) sigma(i, j) = sigma(j, i) = 0.4;
        }
        const MatrixXd root = reference::symmetric_inverse_root(sigma);
        std::vector<double> x;
        for (int i = 0; i < d; ++i) {
            for (int j = full_ ? 0 : i; j <= i; ++j) x.push_back(sigma(i, j));
        }
        const double share = 0.8 / static_cast<double>(offsets_.size());
        for (const Offset s : offsets_) {
            if (s < Offset{}) continue;
            MatrixXd a = MatrixXd::Identity(d, d);
            for (Index e = 0; e < a.size(); ++e) a(e) += 0.5 * normal(random);
            a *= share / a.norm();
            if (form_ == MrfForm::mmrf) a = reference::product(root, a, root);
            for (int i = 0; i < d; ++i) {
                for (int j = 0; j < d; ++j) x.push_back(a(i, j));
            }
        }
        return Eigen::Map<VectorXd>(x.data(), static_cast<Index>(x.size()));
    }

  private:
    MrfForm form_;
    int planes_;
    std::vector<Offset> offsets_;
    bool full_;
};

/// Means over half of a side × side grid of a function of (ω1, ω2).
double mean_over_grid(int side, const std::function<double(double, double)>& f) {
    double sum = 0.0;
    const double unit = 2.0 * pi / side;
    for (int m = 0; m <= side / 2; ++m) {
        const double weight = m == 0 || 2 * m == side ? 1.0 : 2.0;
        for (int n = 0; n < side; ++n) sum += weight * f(unit * m, unit * n);
    }
    return sum / (double{1} * side * side);
}

MatrixXcd hermitian_part(const MatrixXcd& a) {
    return 0.5 * (a + a.adjoint());
}

void expect_moments(const MrfModel& model, const LagCovariance& data, bool full, int side, double tolerance) {
    const Offset box{1, 1};
    const LagCovariance found = reference::covariances(model, side, box);
    std::vector<Offset> lags = model.offsets;
    lags.push_back({});
    for (const Offset s : lags) {
        if (!found.contains(s)) continue;
        for (int i = 0; i < model.planes; ++i) {
            for (int j = 0; j < model.planes; ++j) {
                if (s == Offset{} && i != j && !full) continue;
                const double scale = std::sqrt(data(i, i, {}) * data(j, j, {}));
                EXPECT_NEAR(found(i, j, s), data(i, j, s), tolerance * scale) << i << j << s.row << s.column;
            }
        }
    }
}

TEST(MrfLikelihood, MomentsOfPicturesAreMet) {
    for (const char* name : {"cork.png", "grass.png"}) {
        const Image whole = picture(name);
        for (const bool long_waves : {true, false}) {
            const Image image = long_waves ? whole : detail(whole);
            for (const NoiseForm noise : {NoiseForm::full, NoiseForm::diagonal}) {
                const std::vector<Offset> support = symmetric(4);
                const LagCovariance data = lag_covariance(image, difference_box(support));
                const MrfLikelihoodFit fit =
                    fit_mmrf_ml(data, {NeighbourhoodKind::symmetric, support}, noise);
                EXPECT_TRUE(fit.converged) << name;
                EXPECT_TRUE(fit.certified) << name;
                EXPECT_EQ(fit.penalty, 0.0) << name;
                EXPECT_GT(fit.min_eigenvalue, 0.0);
                EXPECT_LT(fit.objective, fit.start_objective);
                // Data are met to ten times the tolerance of 1e-8, and 1e-9 of white noise is added.
                EXPECT_LE(fit.gradient, 1e-7) << name;
                for (const double ratio : fit.variance_ratio) EXPECT_NEAR(ratio, 1.0, 2e-7) << name;
                // Without long waves a plain grid of 64 points shows it too.
                if (!long_waves) expect_moments(fit.model, data, noise == NoiseForm::full, 64, 1e-6);
            }
        }
    }
}

TEST(MrfLikelihood, KnownFieldComesBackFromItsCovariances) {
    for (const int d : {1, 2, 3}) {
        for (const bool full : {true, false}) {
            const std::vector<Offset> support = symmetric(2);
            const Parameters parameters(MrfForm::mmrf, d, support, full);
            const VectorXd truth = parameters.example(7);
            // Sums of 64 points are exact to e^{−64} for a Λ that stays above 0.2.
            const LagCovariance data =
                reference::covariances(parameters.field(truth), 64, difference_box(support));
            const MrfLikelihoodFit fit = fit_mmrf_ml(data, {NeighbourhoodKind::symmetric, support},
                                                     full ? NoiseForm::full : NoiseForm::diagonal);
            EXPECT_TRUE(fit.converged && fit.certified);
            const VectorXd found = parameters.of(fit.model);
            // Moments are met to 1e-8, and 1e-9 of white noise is added.
            for (Index k = 0; k < truth.size(); ++k) EXPECT_NEAR(found[k], truth[k], 1e-6) << d << full << k;
        }
    }
}

TEST(MrfLikelihood, FitIsStationaryForAPlainObjective) {
    const Image image = detail(picture("cork.png").crop(0, 0, {96, 120}));
    const std::vector<Offset> support = symmetric(2);
    const LagCovariance data = lag_covariance(image, difference_box(support));
    const MrfLikelihoodFit fit =
        fit_mmrf_ml(data, {NeighbourhoodKind::symmetric, support}, NoiseForm::diagonal);
    ASSERT_TRUE(fit.converged);
    const Parameters parameters(MrfForm::mmrf, image.planes(), support, false);
    const VectorXd x = parameters.of(fit.model);
    const auto objective = [&](const VectorXd& at) {
        const MrfModel model = parameters.field(at);
        const MatrixXd precision = reference::inverse(reference::noise_covariance(model));
        double f = 0.0;
        for (int i = 0; i < model.planes; ++i) f += precision(i, i) * data(i, i, {});
        for (size_t s = 0; s < support.size(); ++s) {
            const MatrixXd q = reference::product(precision, reference::coefficients(model, s));
            for (int i = 0; i < model.planes; ++i) {
                for (int j = 0; j < model.planes; ++j) f -= q(i, j) * data(i, j, support[s]);
            }
        }
        return f - mean_over_grid(64, [&](double row, double column) {
                   const MatrixXcd g = reference::inverse_density(model, row, column);
                   return reference::log_determinant(hermitian_part(g));
               });
    };
    const double lowest = objective(x);
    // Two sums of analytic functions, both exact to far more.
    EXPECT_NEAR(fit.objective, lowest, 1e-6);
    std::mt19937 random(3);
    std::normal_distribution<double> normal;
    for (int direction = 0; direction < 4; ++direction) {
        VectorXd v(x.size());
        for (Index k = 0; k < v.size(); ++k) v[k] = normal(random) * x[k];
        const double h = 1e-3;
        const double up = objective(x + h * v), down = objective(x - h * v);
        EXPECT_GT(up, lowest);
        EXPECT_GT(down, lowest);
        // No slope: what is left is the third order, h of the second.
        EXPECT_LT(std::abs(up - down), 0.1 * (up + down - 2.0 * lowest));
    }
}

TEST(MrfLikelihood, PairSetsAreKept) {
    const Image image = detail(picture("cork.png").crop(0, 0, {96, 96}));
    const std::vector<Offset> support = symmetric(1);
    const LagCovariance data = lag_covariance(image, difference_box(support));
    // Planes 1 and 2 see each other along rows only, plane 3 only itself.
    std::vector<std::uint8_t> active;
    for (const Offset s : support) {
        for (const int pair : {1, s.row == 0 ? 1 : 0, 0, s.row == 0 ? 1 : 0, 1, 0, 0, 0, 1})
            active.push_back(static_cast<std::uint8_t>(pair));
    }
    const MrfLikelihoodFit fit =
        fit_mmrf_ml(data, {NeighbourhoodKind::custom, support, active}, NoiseForm::diagonal);
    EXPECT_TRUE(fit.converged && fit.certified);
    for (size_t k = 0; k < active.size(); ++k) EXPECT_EQ(fit.model.coefficients[k] == 0.0, active[k] == 0);
    const FoldedPeriodogram spectrum = folded_periodogram(image);
    for (const NoiseForm noise : {NoiseForm::diagonal, NoiseForm::full}) {
        const MrfLikelihoodFit pseudo =
            fit_pmrf_ml(data, spectrum, {NeighbourhoodKind::custom, support, active}, noise);
        EXPECT_TRUE(pseudo.certified);
        for (size_t k = 0; k < active.size(); ++k)
            EXPECT_EQ(pseudo.model.coefficients[k] == 0.0, active[k] == 0);
    }
}

TEST(MrfLikelihood, PlanesThatRepeatEachOther) {
    const Image grey = picture("grass.png");
    Image image(grey.size(), 2);
    for (int p = 0; p < 2; ++p) std::copy(grey.plane(0).begin(), grey.plane(0).end(), image.plane(p).begin());
    const std::vector<Offset> support = symmetric(1);
    const LagCovariance data = lag_covariance(image, difference_box(support));
    for (const NoiseForm noise : {NoiseForm::full, NoiseForm::diagonal}) {
        const MrfLikelihoodFit fit = fit_mmrf_ml(data, {NeighbourhoodKind::symmetric, support}, noise);
        EXPECT_TRUE(fit.certified);
        // 1e-8 of white noise tells them apart; with a diagonal Σ their likeness has to come out of ever
        // longer waves.
        for (const double ratio : fit.variance_ratio)
            EXPECT_NEAR(ratio, 1.0, noise == NoiseForm::full ? 1e-7 : 0.5);
    }
    const MrfLikelihoodFit pseudo = fit_pmrf_ml(data, folded_periodogram(image),
                                                {NeighbourhoodKind::symmetric, support}, NoiseForm::full);
    EXPECT_TRUE(pseudo.certified);
}

TEST(MrfLikelihood, OnePlaneIsTheSameGaussianFieldInBothForms) {
    const Image image = picture("grass.png");
    const std::vector<Offset> support = symmetric(3);
    const LagCovariance data = lag_covariance(image, difference_box(support));
    const MrfLikelihoodFit a = fit_mmrf_ml(data, {NeighbourhoodKind::symmetric, support}, NoiseForm::full);
    const MrfLikelihoodFit b =
        fit_pmrf_ml(data, {}, {NeighbourhoodKind::symmetric, support}, NoiseForm::diagonal);
    EXPECT_EQ(a.model.coefficients, b.model.coefficients);
    EXPECT_EQ(b.model.form, MrfForm::pmrf);
    for (size_t s = 0; s < support.size(); ++s)
        EXPECT_EQ(a.model.coefficients[s], a.model.coefficients[support.size() - 1 - s]);
}

TEST(MrfLikelihood, BadRequestsAreNamed) {
    LagCovariance data(2, {32, 32}, {2, 2});
    data.set(0, 0, {}, 1.0);
    data.set(1, 1, {}, 1.0);
    const auto message = [&](const std::vector<Offset>& offsets, const std::vector<std::uint8_t>& active,
                             NoiseForm noise) -> std::string {
        try {
            static_cast<void>(fit_mmrf_ml(data, {NeighbourhoodKind::custom, offsets, active}, noise));
        } catch (const InputError& error) {
            return error.what();
        }
        return "no error";
    };
    const NoiseForm full = NoiseForm::full, diagonal = NoiseForm::diagonal;
    EXPECT_NE(message({{0, 1}}, {}, full).find("not its opposite"), std::string::npos);
    EXPECT_NE(message({{0, 3}, {0, -3}}, {}, full).find("do not reach"), std::string::npos);
    EXPECT_NE(message({{0, 1}, {0, -1}, {0, 1}}, {}, full).find("twice"), std::string::npos);
    EXPECT_NE(message({}, {}, full).find("empty"), std::string::npos);
    EXPECT_NE(message({{0, 1}, {0, -1}}, {1, 1, 0, 1, 1, 1, 0, 1}, diagonal).find("mirror"),
              std::string::npos);
    EXPECT_NE(message({{0, 1}, {0, -1}}, {1, 1, 0, 1, 1, 0, 1, 1}, full).find("diagonal"), std::string::npos);
    data.set(1, 1, {}, 0.0);
    EXPECT_NE(message({{0, 1}, {0, -1}}, {}, full).find("plane 2 does not vary"), std::string::npos);
}

TEST(MrfLikelihood, PeriodogramKeepsTheCovariances) {
    const Image image = picture("cork.png").crop(0, 0, {60, 45});  // every frequency a cell of its own
    const LagCovariance data = lag_covariance(image, {2, 2});
    const FoldedPeriodogram folded = folded_periodogram(image);
    for (const Offset s : {Offset{0, 0}, {0, 1}, {2, -1}, {1, 2}}) {
        for (int i = 0; i < 3; ++i) {
            for (int j = 0; j < 3; ++j) {
                double sum = 0.0;
                for (size_t m = 0; m < folded.rows.size(); ++m) {
                    for (size_t n = 0; n < folded.grid.column.size(); ++n) {
                        const double angle = folded.grid.row[m] * s.row + folded.grid.column[n] * s.column;
                        sum += folded.grid.row_weight[m] * folded.grid.column_weight[n] *
                               (folded.rows[m].real(i, j)[n] * std::cos(angle) +
                                folded.rows[m].imaginary(i, j)[n] * std::sin(angle));
                    }
                }
                EXPECT_NEAR(sum, data(i, j, s), 1e-12 * std::sqrt(data(i, i, {}) * data(j, j, {})));
            }
        }
    }
}

TEST(MrfLikelihood, PseudoFieldIsAMinimum) {
    const Image image = detail(picture("cork.png").crop(0, 0, {72, 80}));
    const std::vector<Offset> support = symmetric(1);
    const LagCovariance data = lag_covariance(image, difference_box(support));
    const FoldedPeriodogram folded = folded_periodogram(image);
    for (const bool full : {true, false}) {
        const MrfLikelihoodFit fit = fit_pmrf_ml(data, folded, {NeighbourhoodKind::symmetric, support},
                                                 full ? NoiseForm::full : NoiseForm::diagonal);
        EXPECT_TRUE(fit.certified);
        EXPECT_TRUE(fit.converged);
        EXPECT_LT(fit.objective, fit.start_objective);
        const Parameters parameters(MrfForm::pmrf, image.planes(), support, full);
        const VectorXd x = parameters.of(fit.model);
        const auto objective = [&](const VectorXd& at) {
            const MrfModel model = parameters.field(at);
            double f = 0.0;
            for (size_t m = 0; m < folded.rows.size(); ++m) {
                for (size_t n = 0; n < folded.grid.column.size(); ++n) {
                    const MatrixXcd g =
                        reference::inverse_density(model, folded.grid.row[m], folded.grid.column[n]);
                    double trace = 0.0;
                    for (int i = 0; i < 3; ++i) {
                        for (int j = 0; j < 3; ++j) {
                            const Complex value{folded.rows[m].real(j, i)[n],
                                                folded.rows[m].imaginary(j, i)[n]};
                            trace += (g(i, j) * value).real();
                        }
                    }
                    f += folded.grid.row_weight[m] * folded.grid.column_weight[n] * trace;
                }
            }
            const MatrixXcd sigma = reference::noise_covariance(model).cast<Complex>();
            return f + reference::log_determinant(sigma) - mean_over_grid(64, [&](double row, double column) {
                       return reference::log_determinant(reference::lambda(model, row, column));
                   });
        };
        const double lowest = objective(x);
        // The integral of ln det on 96 points, and 1e-8 of white noise.
        EXPECT_NEAR(fit.objective, lowest, 1e-3);
        std::mt19937 random(5);
        std::normal_distribution<double> normal;
        for (int direction = 0; direction < 3; ++direction) {
            VectorXd v(x.size());
            for (Index k = 0; k < v.size(); ++k) v[k] = normal(random) * x[k];
            // Far enough for the second order to stand out of what the two objectives differ by.
            const double h = 3e-3;
            EXPECT_GT(objective(x + h * v) + objective(x - h * v), 2.0 * lowest);
            EXPECT_NEAR(objective(x + h * v) - objective(x - h * v), 0.0,
                        0.2 * (objective(x + h * v) + objective(x - h * v) - 2.0 * lowest));
        }
    }
}

/// A sample of the field on a torus: white noise through the Hermitian root of S_t.
Image draw(const MrfModel& model, int side, unsigned seed) {
    const int d = model.planes;
    const auto pixels = static_cast<size_t>(side) * static_cast<size_t>(side);
    std::mt19937_64 random(seed);
    std::normal_distribution<double> normal;
    std::vector<std::vector<Complex>> spectra(static_cast<size_t>(d));
    Eigen::FFT<double> fft;
    const auto transform = [&](std::vector<Complex>& values, bool forward) {
        std::vector<Complex> in(static_cast<size_t>(side)), out;
        for (const bool rows : {true, false}) {
            for (size_t line = 0; line < in.size(); ++line) {
                const size_t first = rows ? line * in.size() : line, step = rows ? 1 : in.size();
                for (size_t k = 0; k < in.size(); ++k) in[k] = values[first + k * step];
                if (forward) {
                    fft.fwd(out, in);
                } else {
                    fft.inv(out, in);
                }
                for (size_t k = 0; k < in.size(); ++k) values[first + k * step] = out[k];
            }
        }
    };
    for (auto& values : spectra) {
        values.resize(pixels);
        for (auto& v : values) v = normal(random);
        transform(values, true);
    }
    const double unit = 2.0 * pi / side;
    for (int m = 0; m < side; ++m) {
        for (int n = 0; n < side; ++n) {
            const MatrixXcd inverse = reference::inverse_density(model, unit * m, unit * n);
            const size_t place = static_cast<size_t>(m) * static_cast<size_t>(side) + static_cast<size_t>(n);
            Eigen::VectorXcd y(d);
            for (int i = 0; i < d; ++i) y[i] = spectra[static_cast<size_t>(i)][place];
            // Any root whose value at −ω is the conjugate one will do: the Cholesky factor of S⁻¹.
            y = Eigen::LLT<MatrixXcd>(hermitian_part(inverse)).matrixU().solve(y).eval();
            for (int i = 0; i < d; ++i) spectra[static_cast<size_t>(i)][place] = y[i];
        }
    }
    Image image({side, side}, d);
    for (int p = 0; p < d; ++p) {
        auto& values = spectra[static_cast<size_t>(p)];
        transform(values, false);
        std::transform(values.begin(), values.end(), image.plane(p).begin(),
                       [](const Complex& v) { return static_cast<float>(v.real()); });
    }
    return image;
}

/// Standard errors of the parameters from this many pixels: the inverse of ½ mean tr(S ∂_p S⁻¹ S ∂_q S⁻¹).
VectorXd standard_errors(const Parameters& parameters, const VectorXd& x, double pixels) {
    constexpr int side = 32;
    const Index count = x.size();
    std::vector<MrfModel> up, down;
    const double h = 1e-5;
    for (Index k = 0; k < count; ++k) {
        VectorXd y = x;
        y[k] += h;
        up.push_back(parameters.field(y));
        y[k] -= 2.0 * h;
        down.push_back(parameters.field(y));
    }
    const MrfModel centre = parameters.field(x);
    MatrixXd information = MatrixXd::Zero(count, count);
    for (int m = 0; m < side; ++m) {
        for (int n = 0; n < side; ++n) {
            const double row = 2.0 * pi * m / side, column = 2.0 * pi * n / side;
            const MatrixXcd density = reference::inverse(reference::inverse_density(centre, row, column));
            std::vector<MatrixXcd> slopes;
            for (size_t k = 0; k < up.size(); ++k) {
                const MatrixXcd slope = (reference::inverse_density(up[k], row, column) -
                                         reference::inverse_density(down[k], row, column)) /
                                        (2.0 * h);
                slopes.push_back(reference::product(density, slope));
            }
            for (Index a = 0; a < count; ++a) {
                for (Index b = 0; b < count; ++b) {
                    information(a, b) += 0.5 * (slopes[static_cast<size_t>(a)].cwiseProduct(
                                                    slopes[static_cast<size_t>(b)].transpose()))
                                                   .sum()
                                                   .real();
                }
            }
        }
    }
    information *= pixels / (side * side);
    return reference::inverse(information).diagonal().cwiseSqrt();
}

TEST(MrfLikelihoodLong, KnownFieldComesBackFromASample) {
    constexpr int side = 1024;
    for (const MrfForm form : {MrfForm::mmrf, MrfForm::pmrf}) {
        for (const int d : {1, 3}) {
            for (const bool full : {true, false}) {
                if (d == 1 && !full) continue;
                const std::vector<Offset> support = symmetric(1);
                const Parameters parameters(form, d, support, full);
                const VectorXd truth = parameters.example(11);
                const Image image = draw(parameters.field(truth), side, 1);
                const LagCovariance data = lag_covariance(image, difference_box(support));
                const NoiseForm noise = full ? NoiseForm::full : NoiseForm::diagonal;
                const MrfLikelihoodFit fit =
                    form == MrfForm::mmrf ? fit_mmrf_ml(data, {NeighbourhoodKind::symmetric, support}, noise)
                                          : fit_pmrf_ml(data, folded_periodogram(image),
                                                        {NeighbourhoodKind::symmetric, support}, noise);
                EXPECT_TRUE(fit.certified && fit.converged);
                const VectorXd found = parameters.of(fit.model);
                const VectorXd error = standard_errors(parameters, truth, double{1} * side * side);
                for (Index k = 0; k < truth.size(); ++k) {
                    EXPECT_NEAR(found[k], truth[k], 4.0 * error[k])
                        << (form == MrfForm::mmrf ? "mmrf " : "pmrf ") << d << full << " parameter " << k;
                }
                for (const double ratio : fit.variance_ratio) EXPECT_NEAR(ratio, 1.0, 0.01);
            }
        }
    }
}

}  // namespace
}  // namespace btfield

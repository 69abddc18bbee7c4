// host/fit/random_decrement.cpp.

#include "host/fit/random_decrement.hpp"
#include "host/analysis/expansion.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numeric>
#include <span>
#include <vector>

#include "btfield/error.hpp"
#include "btfield/fit.hpp"
#include "btfield/image_io.hpp"
#include "btfield/pyramid.hpp"
#include "host/fit/level_gains.hpp"
#include "host/spectrum/spectral_form.hpp"
#include "tests/device_cases.hpp"
#include "tests/places.hpp"
#include "tests/reference/moving_average_covariance.hpp"

namespace btfield {

using namespace detail;

namespace {

/// P4 2.3, 2.4 as it is written: every pixel is asked, float64; with `inside`, every pixel of a region whose
/// pixel at s is too. 0 where there is none.
double signature(const Image& image, const LagCovariance& statistic, int i, int j, Offset s,
                 const MaOptions& options, const std::vector<std::uint8_t>& inside = {}) {
    const int height = image.height(), width = image.width();
    const auto y = [&](int plane, int r, int c) {
        return static_cast<double>(image.at(plane, (r + 8 * height) % height, (c + 8 * width) % width));
    };
    const auto xi = [&](int plane) {
        return static_cast<double>(
            static_cast<float>(statistic.mean()[static_cast<std::size_t>(plane)] +
                               options.threshold * std::sqrt(statistic(plane, plane, {}))));
    };
    const auto counts = [&](int r, int c) {
        const int place = (r + 8 * height) % height * width + (c + 8 * width) % width;
        return inside.empty() || inside[static_cast<std::size_t>(place)] != 0;
    };
    double sum = 0.0, count = 0.0;
    for (int r = 0; r < height; ++r) {
        for (int c = 0; c < width; ++c) {
            if (!(y(j, r, c) > xi(j)) || !counts(r, c) || !counts(r + s.row, c + s.column)) continue;
            const bool along = y(i, r, c - 1) < xi(i) || y(i, r, c + 1) < xi(i);
            const bool across = y(i, r - 1, c) < xi(i) || y(i, r + 1, c) < xi(i);
            if (options.rule == SignificanceRule::p4 ? along && across : along || across) {
                sum += y(i, r + s.row, c + s.column);
                count += 1.0;
            }
        }
    }
    return count > 0.0 ? sum / count - statistic.mean()[static_cast<std::size_t>(i)] : 0.0;
}

/// White noise through a kernel that has its mass at (0, 0), (0, 1) and (1, 0).
Image moving_average(Size size, int planes) {
    const Image noise = test::random_image(size, planes, 0.5F, 3);
    Image image(size, planes);
    for (int p = 0; p < planes; ++p) {
        for (int r = 0; r < size.height; ++r) {
            for (int c = 0; c < size.width; ++c) {
                const int up = (r + size.height - 1) % size.height, left = (c + size.width - 1) % size.width;
                const int other = (p + 1) % planes;
                image.at(p, r, c) = noise.at(p, r, c) + 0.6F * noise.at(p, r, left) +
                                    0.4F * noise.at(p, up, c) + 0.3F * noise.at(other, r, c);
            }
        }
    }
    return image;
}

double worst_lag_zero_error(const LinearField& field, const LagCovariance& statistic, bool diagonal_only) {
    const LagCovariance own = reference::moving_average_covariance(field, statistic.size(), {0, 0});
    double worst = 0.0;
    for (int i = 0; i < field.planes; ++i) {
        for (int j = 0; j < field.planes; ++j) {
            if (diagonal_only && i != j) continue;
            const double error = std::abs(own(i, j, {}) - statistic(i, j, {})) /
                                 std::sqrt(statistic(i, i, {}) * statistic(j, j, {}));
            if (!(error <= worst)) worst = error;
        }
    }
    return worst;
}

TEST(RandomDecrement, IsThePapersAverage) {
    for (const Size size : {Size{7, 9}, Size{33, 40}}) {
        for (const int planes : {1, 3}) {
            const Image image = moving_average(size, planes);
            const LagCovariance statistic = lag_covariance(image, {0, 0});
            const std::vector<Offset> offsets{{-3, 2}, {0, -1}, {0, 0}, {1, 1}, {9, -11}};
            for (const SignificanceRule rule : {SignificanceRule::p4, SignificanceRule::p1}) {
                const MaOptions options{.threshold = 0.25, .rule = rule};
                const std::vector<double> found = random_decrement(image, statistic, offsets, options);
                std::size_t k = 0;
                for (const Offset s : offsets) {
                    for (int i = 0; i < planes; ++i) {
                        for (int j = 0; j < planes; ++j)
                            // Sums of some thousand values below 10 in another order.
                            EXPECT_NEAR(found[k++], signature(image, statistic, i, j, s, options), 1e-11);
                    }
                }
            }
        }
    }
}

/// Two blobs and a stripe of one pixel, which has no neighbour below.
std::vector<std::uint8_t> region_of(Size size) {
    std::vector<std::uint8_t> inside;
    for (int r = 0; r < size.height; ++r) {
        for (int c = 0; c < size.width; ++c) {
            const bool blob = r % 20 < 9 && (c + r / 2) % 25 < 11;
            inside.push_back(static_cast<std::uint8_t>(blob || r == 15 ? 1 : 0));
        }
    }
    return inside;
}

TEST(RandomDecrement, OfARegionIsTheAverageInsideIt) {
    for (const Size size : {Size{33, 40}, Size{70, 29}}) {
        for (const int planes : {1, 3}) {
            const Image image = moving_average(size, planes);
            const LagCovariance statistic = lag_covariance(image, {0, 0});
            const std::vector<Offset> offsets{{-3, 2}, {0, -1}, {0, 0}, {1, 1}, {9, -11}};
            const std::vector<std::uint8_t> inside = region_of(size);
            for (const SignificanceRule rule : {SignificanceRule::p4, SignificanceRule::p1}) {
                const MaOptions options{.threshold = 0.25, .rule = rule};
                const std::vector<double> found =
                    random_decrement(image, statistic, offsets, options, inside);
                std::size_t k = 0;
                for (const Offset s : offsets) {
                    for (int i = 0; i < planes; ++i) {
                        for (int j = 0; j < planes; ++j)
                            // As above.
                            EXPECT_NEAR(found[k++], signature(image, statistic, i, j, s, options, inside),
                                        1e-11);
                    }
                }
            }
        }
    }
}

TEST(RandomDecrement, OfARegionThatIsThePictureIsThePictures) {
    const Image image = moving_average({33, 40}, 3);
    const LagCovariance statistic = lag_covariance(image, {0, 0});
    const std::vector<Offset> offsets = neighbourhood(3, NeighbourhoodKind::symmetric);
    const std::vector<std::uint8_t> all(area(image.size()), 255);
    EXPECT_EQ(random_decrement(image, statistic, offsets, {}, all),
              random_decrement(image, statistic, offsets, {}));
    const auto fit = [&](std::span<const std::uint8_t> inside) {
        return fit_ma(image, statistic, {NeighbourhoodKind::symmetric, offsets}, NoiseForm::full, {}, inside);
    };
    EXPECT_EQ(fit(all).coefficients, fit({}).coefficients);
    EXPECT_EQ(fit(all).noise_covariance, fit({}).noise_covariance);
}

TEST(RandomDecrement, NeighboursThatNoRegionHasAreZero) {
    // Every third row: none of its pixels has one of the region right below.
    const Image image = moving_average({30, 40}, 1);
    const LagCovariance statistic = lag_covariance(image, {0, 0});
    std::vector<std::uint8_t> inside(area(image.size()), 0);
    for (std::size_t i = 0; i < inside.size(); ++i) inside[i] = i / 40 % 3 == 0 ? 1 : 0;
    const std::vector<double> found =
        random_decrement(image, statistic, {{0, 0}, {1, 0}, {3, 0}}, {.threshold = 0.25}, inside);
    EXPECT_GT(found[0], 0.0);
    EXPECT_EQ(found[1], 0.0);
    EXPECT_NE(found[2], 0.0);
}

TEST(RandomDecrement, FitOfARegionHasItsCovariance) {
    // The region's own values are louder than the rest.
    Image image = moving_average({96, 80}, 2);
    const std::vector<std::uint8_t> inside = region_of(image.size());
    LagCovariance statistic(2, image.size(), {0, 0});
    double pixels = 0.0;
    for (std::size_t i = 0; i < inside.size(); ++i) {
        if (inside[i] == 0) continue;
        for (int p = 0; p < 2; ++p) image.plane(p)[i] *= 3.0F;
        pixels += 1.0;
    }
    for (int p = 0; p < 2; ++p) {
        for (std::size_t i = 0; i < inside.size(); ++i)
            if (inside[i] != 0)
                statistic.mean()[static_cast<std::size_t>(p)] +=
                    static_cast<double>(image.plane(p)[i]) / pixels;
    }
    for (int p = 0; p < 2; ++p) {
        for (int q = 0; q < 2; ++q) {
            double sum = 0.0;
            for (std::size_t i = 0; i < inside.size(); ++i)
                if (inside[i] != 0)
                    sum += (static_cast<double>(image.plane(p)[i]) -
                            statistic.mean()[static_cast<std::size_t>(p)]) *
                           (static_cast<double>(image.plane(q)[i]) -
                            statistic.mean()[static_cast<std::size_t>(q)]);
            statistic.set(p, q, {}, sum / pixels);
        }
    }
    const std::vector<Offset> offsets = neighbourhood(3, NeighbourhoodKind::symmetric);
    const MaModel model =
        fit_ma(image, statistic, {NeighbourhoodKind::symmetric, offsets}, NoiseForm::full, {}, inside);
    EXPECT_EQ(model.coefficients, random_decrement(image, statistic, model.offsets, {}, inside));
    // As that of the picture: exact but for the solve's rounding.
    EXPECT_LE(worst_lag_zero_error(model, statistic, false), 1e-8);
}

TEST(RandomDecrement, LagZeroCovarianceIsThePictures) {
    for (const int planes : {1, 3}) {
        const Image image = moving_average({96, 80}, planes);
        const std::vector<Offset> offsets = neighbourhood(3, NeighbourhoodKind::symmetric);
        const LagCovariance statistic = lag_covariance(image, {0, 0});
        const MaModel full =
            fit_ma(image, statistic, {NeighbourhoodKind::symmetric, offsets}, NoiseForm::full);
        EXPECT_EQ(full.offsets.size(), offsets.size() + 1);
        EXPECT_EQ(std::count(full.offsets.begin(), full.offsets.end(), Offset{}), 1);
        // The planes of this picture are independent enough for a positive definite solution: exact but for
        // the solve's rounding.
        EXPECT_LE(worst_lag_zero_error(full, statistic, false), 1e-8);
        const MaModel diagonal =
            fit_ma(image, statistic, {NeighbourhoodKind::symmetric, offsets}, NoiseForm::diagonal);
        EXPECT_LE(worst_lag_zero_error(diagonal, statistic, true), 1e-8);
        for (int i = 0; i < planes; ++i) {
            for (int j = 0; j < planes; ++j)
                if (i != j) {
                    EXPECT_EQ(diagonal.noise_covariance[static_cast<std::size_t>(i * planes + j)], 0.0);
                }
        }
    }
}

TEST(RandomDecrement, PlanesThatRepeatEachOtherKeepTheirVariance) {
    const Image grey = moving_average({64, 64}, 1);
    Image image(grey.size(), 3);
    for (int p = 0; p < 3; ++p) std::copy_n(grey.plane(0).begin(), area(grey.size()), image.plane(p).begin());
    const LagCovariance statistic = lag_covariance(image, {0, 0});
    const MaModel model = fit_ma(
        image, statistic, {NeighbourhoodKind::symmetric, neighbourhood(2, NeighbourhoodKind::symmetric)},
        NoiseForm::full);
    EXPECT_LE(worst_lag_zero_error(model, statistic, false), 1e-8);
}

/// One noise that all planes share through kernels of different widths, and little else: no uncorrelated
/// noises make such variances but with one below 0.
Image shared_noise() {
    const Size size{64, 64};
    const Image noise = test::random_image(size, 1, 0.5F, 5), own = test::random_image(size, 3, 0.5F, 6);
    Image image(size, 3);
    for (int p = 0; p < 3; ++p) {
        for (int r = 0; r < size.height; ++r) {
            for (int c = 0; c < size.width; ++c) {
                float sum = 0.02F * own.at(p, r, c);
                for (int k = 0; k <= p; ++k) sum += noise.at(0, r, (c + size.width - k) % size.width);
                image.at(p, r, c) = sum;
            }
        }
    }
    return image;
}

TEST(RandomDecrement, DiagonalNoiseHasAVarianceInEveryPlane) {
    const Image image = shared_noise();
    const LagCovariance statistic = lag_covariance(image, {0, 0});
    int left_out = 0;
    for (int order = 1; order <= 8; ++order) {
        const MaModel model =
            fit_ma(image, statistic,
                   {NeighbourhoodKind::symmetric, neighbourhood(order, NeighbourhoodKind::symmetric)},
                   NoiseForm::diagonal);
        double most = 0.0;
        for (std::size_t i = 0; i < 3; ++i)
            most = std::max(most, model.noise_covariance[4 * i] /
                                      statistic(static_cast<int>(i), static_cast<int>(i), {}));
        for (std::size_t i = 0; i < 3; ++i) {
            for (std::size_t j = 0; j < 3; ++j) {
                if (i != j) {
                    EXPECT_EQ(model.noise_covariance[3 * i + j], 0.0);
                }
            }
            const double share = model.noise_covariance[4 * i] /
                                 statistic(static_cast<int>(i), static_cast<int>(i), {}) / most;
            EXPECT_GE(share, 0.99e-6) << "order " << order << ", plane " << i;
            left_out += share < 1.01e-6 ? 1 : 0;
        }
        EXPECT_LE(worst_lag_zero_error(model, statistic, true), 1e-8) << "order " << order;
    }
    EXPECT_GT(left_out, 0) << "no plane did without a noise of its own: the picture tests nothing";
}

TEST(RandomDecrement, EveryPictureHasItsMovingAverage) {
    Device device;
    for (const char* name :
         {"bark.png", "cork.png", "cork-xyz.exr", "grass.png", "landsat.tif", "rock.png", "sand.png"}) {
        Analysis analysis(device, read_picture(test::data_folder() + "/" + name).image);
        for (const int order : {1, 5}) {
            for (const int levels : {1, 3}) {
                for (const MarginalMode marginals : {MarginalMode::match, MarginalMode::none}) {
                    FitOptions options;
                    options.model = ModelKind::ma3d;
                    options.noise = NoiseForm::diagonal;
                    options.order = order;
                    options.levels = levels;
                    options.marginals = marginals;
                    const TextureModel model = analysis.fit(options);
                    EXPECT_NO_THROW(check(model)) << name << ", order " << order << ", K " << levels;
                    EXPECT_TRUE(is_valid(model)) << name << ", order " << order << ", K " << levels;
                }
            }
        }
    }
}

TEST(RandomDecrement, WhiteNoiseGivesAnImpulse) {
    // Away from the centre and the four neighbours that the rule looks at, the signature of white noise is
    // the mean of independent values: 5 standard errors of some 0.15 · 256² pixels.
    const Image image = test::random_image({256, 256}, 1);
    const LagCovariance statistic = lag_covariance(image, {0, 0});
    const std::vector<Offset> offsets{{0, 0}, {2, 1}, {-2, 0}, {1, 1}, {-3, 3}};
    const std::vector<double> found = random_decrement(image, statistic, offsets, {.threshold = 1.0});
    EXPECT_GT(found[0], 1.0);
    for (std::size_t s = 1; s < offsets.size(); ++s)
        EXPECT_LE(std::abs(found[s]), 5.0 / std::sqrt(0.15 * 65536));
}

TEST(RandomDecrement, CovarianceOfTheModelIsTheSumOverItsCoefficients) {
    MaModel field;
    field.planes = 1;
    field.offsets = {{0, -1}, {0, 0}, {2, 1}};
    field.coefficients = {0.5, 1.0, -0.25};
    field.noise_covariance = {4.0};
    const LagCovariance c = reference::moving_average_covariance(field, {32, 32}, {2, 2});
    EXPECT_DOUBLE_EQ(c(0, 0, {}), 4.0 * (0.25 + 1.0 + 0.0625));
    EXPECT_DOUBLE_EQ(c(0, 0, {0, 1}), 4.0 * 0.5);
    EXPECT_DOUBLE_EQ(c(0, 0, {2, 1}), 4.0 * -0.25);
    EXPECT_DOUBLE_EQ(c(0, 0, {2, 2}), 4.0 * -0.125);
    EXPECT_DOUBLE_EQ(c(0, 0, {-2, -2}), 4.0 * -0.125);
    EXPECT_DOUBLE_EQ(c(0, 0, {1, 0}), 0.0);
    EXPECT_EQ(transfer_field(MaModel{field}).offsets[2], (Offset{-2, -1}));
}

TEST(RandomDecrement, SaysWhyItCannot) {
    const Image image = moving_average({32, 32}, 3);
    const LagCovariance statistic = lag_covariance(image, {0, 0});
    const std::vector<Offset> offsets = neighbourhood(1, NeighbourhoodKind::symmetric);
    const auto fit_with = [&](const MaOptions& options, const std::vector<Offset>& support) {
        return fit_ma(image, statistic, {NeighbourhoodKind::symmetric, support}, NoiseForm::full, options);
    };
    try {
        static_cast<void>(fit_with({.threshold = 50.0}, offsets));
        ADD_FAILURE() << "no pixel lies 50 standard deviations above the mean";
    } catch (const InputError& error) {
        EXPECT_NE(std::string(error.what()).find("xi = 50"), std::string::npos) << error.what();
    }
    EXPECT_THROW(static_cast<void>(fit_with({.threshold = std::nan("")}, offsets)), InputError);
    EXPECT_THROW(static_cast<void>(fit_with({}, {{0, 1}, {0, 1}})), InputError);
    EXPECT_THROW(static_cast<void>(fit_ma(image.crop(0, 0, {16, 16}), statistic,
                                          {NeighbourhoodKind::symmetric, offsets}, NoiseForm::full)),
                 InputError);
    const std::vector<std::uint8_t> nowhere(area(image.size()), 0);
    EXPECT_THROW(static_cast<void>(random_decrement(image, statistic, offsets, {}, nowhere)), InputError);
    const Image flat({16, 16}, 1);
    EXPECT_THROW(static_cast<void>(fit_ma(flat, lag_covariance(flat, {0, 0}),
                                          {NeighbourhoodKind::symmetric, offsets}, NoiseForm::full)),
                 InputError);
}

/// With the default levels and matched gains the model's covariances are within 0.12 of the variance of the
/// picture's, its standard deviations within 5 %.
TEST(RandomDecrement, RealPicturesKeepTheirCovariances) {
    Device device;
    for (const char* name : {"cork", "grass", "sand"}) {
        const Image image = read_picture(test::data_folder() + "/" + name + ".png").image;
        const int d = image.planes(), count = default_levels(image.size());
        const std::vector<Image> levels = decompose(device, image, count, 2);
        const std::vector<Offset> lags = probe_lags(image.size());
        const std::vector<double> data = covariances_at(image, lags);
        std::vector<std::vector<double>> seen;
        for (int k = 0; k < count; ++k) {
            const Image& level = levels[static_cast<std::size_t>(k)];
            const MaModel model =
                fit_ma(level, lag_covariance(level, {0, 0}),
                       {NeighbourhoodKind::symmetric, neighbourhood(5, NeighbourhoodKind::symmetric)},
                       NoiseForm::full);
            seen.push_back(expanded_covariance(
                reference::moving_average_covariance(model, level.size(), expansion_box(2, k, lags)), 2, k,
                lags));
        }
        const std::vector<double> gains = match_gains(seen, data, d);
        double error = 0.0;
        for (std::size_t s = 0; s < lags.size(); ++s) {
            for (std::size_t i = 0; i < static_cast<std::size_t>(d); ++i) {
                const std::size_t at =
                    (s * static_cast<std::size_t>(d) + i) * static_cast<std::size_t>(d) + i;
                double own = 0.0;
                for (std::size_t k = 0; k < seen.size(); ++k) own += gains[k] * gains[k] * seen[k][at];
                const double variance = data[i * static_cast<std::size_t>(d) + i];
                error += std::abs(own - data[at]) / variance;
                if (s == 0) {
                    EXPECT_NEAR(std::sqrt(own / variance), 1.0, 0.05) << name << " plane " << i;
                }
            }
        }
        EXPECT_LE(error / static_cast<double>(lags.size() * static_cast<std::size_t>(d)), 0.12) << name;
    }
}

}  // namespace
}  // namespace btfield

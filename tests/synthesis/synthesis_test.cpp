#include "btfield/synthesis.hpp"

#include <gtest/gtest.h>

#include <Eigen/Core>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <numeric>

#include "btfield/criteria.hpp"
#include "btfield/error.hpp"
#include "btfield/fit.hpp"
#include "btfield/image_io.hpp"
#include "btfield/pyramid.hpp"
#include "btfield/theory.hpp"
#include "tests/places.hpp"

namespace btfield {
namespace {

/// A stable field with its own coefficients for every plane pair: Σ_s ‖A_s‖_∞ = `strength` < 1.
LinearField stable_field(int planes, int order, NeighbourhoodKind kind, double strength, unsigned variant) {
    const auto d = static_cast<std::size_t>(planes);
    LinearField field;
    field.planes = planes;
    field.kind = kind;
    field.offsets = neighbourhood(order, kind);
    const auto n = field.offsets.size();
    for (std::size_t e = 0; e < n * d * d; ++e)
        field.coefficients.push_back(1.0 + 0.8 * std::sin(1.7 * static_cast<double>(e + variant)));
    for (std::size_t i = 0; i < d; ++i) {
        double row = 0.0;
        for (std::size_t s = 0; s < n; ++s)
            for (std::size_t j = 0; j < d; ++j) row += std::abs(field.coefficients[(s * d + i) * d + j]);
        for (std::size_t s = 0; s < n; ++s)
            for (std::size_t j = 0; j < d; ++j) field.coefficients[(s * d + i) * d + j] *= strength / row;
    }
    for (std::size_t i = 0; i < d; ++i)
        for (std::size_t j = 0; j < d; ++j)
            field.noise_covariance.push_back(i == j ? 0.01 * (1.0 + 0.1 * static_cast<double>(i)) : 0.006);
    return field;
}

TextureModel texture_model(int planes, int levels, int factor, int order = 2, double strength = 0.9) {
    TextureModel model;
    model.size = {96, 80};
    model.planes = planes;
    model.factor = factor;
    for (int p = 0; p < planes; ++p) model.mean.push_back(0.3 + 0.05 * p);
    unsigned variant = 0;
    for (const Size size : pyramid_sizes(model.size, levels, factor)) {
        LevelModel level;
        level.size = size;
        level.models = {CarModel{stable_field(planes, order, NeighbourhoodKind::causal, strength, variant)}};
        level.gain = 1.0 + 0.25 * variant++;
        level.certificate.valid = true;
        level.certificate.min_singular = 1.0 - strength;
        level.certificate.variance_ratio.assign(static_cast<std::size_t>(planes), 1.0);
        model.levels.push_back(std::move(level));
    }
    return model;
}

std::vector<std::uint64_t> seeds_from(std::uint64_t first, int count) {
    std::vector<std::uint64_t> seeds(static_cast<std::size_t>(count));
    std::iota(seeds.begin(), seeds.end(), first);
    return seeds;
}

/// Largest difference in units of full scale (pictures here span about [0, 1]). NaN counts as infinite.
double largest_difference(const Image& a, const Image& b) {
    EXPECT_EQ(a.size(), b.size());
    EXPECT_EQ(a.planes(), b.planes());
    double largest = 0.0;
    for (std::size_t i = 0; i < a.values().size(); ++i) {
        const double difference =
            std::abs(static_cast<double>(a.values()[i]) - static_cast<double>(b.values()[i]));
        if (!(difference <= largest)) largest = std::isnan(difference) ? INFINITY : difference;
    }
    return largest;
}

bool same_bits(const Image& a, const Image& b) {
    return a.size() == b.size() && a.planes() == b.planes() &&
           std::memcmp(a.values().data(), b.values().data(), a.values().size_bytes()) == 0;
}

/// C_ij(s) of a picture about a known mean, on the torus.
double covariance_about(const Image& image, const std::vector<double>& mean, int i, int j, Offset s) {
    double sum = 0.0;
    const int h = image.height(), w = image.width();
    for (int r = 0; r < h; ++r)
        for (int c = 0; c < w; ++c)
            sum += (image.at(i, r, c) - mean[static_cast<std::size_t>(i)]) *
                   (image.at(j, ((r + s.row) % h + h) % h, ((c + s.column) % w + w) % w) -
                    mean[static_cast<std::size_t>(j)]);
    return sum / static_cast<double>(area(image.size()));
}

/// The mean over many seeds of every covariance lies within 4.5 of its standard errors of theory.
void expect_theory(const TextureModel& model, Size size, NoiseDomain domain, int count) {
    Device device;
    SynthesisOptions options;
    options.noise_domain = domain;
    Synthesiser synthesiser(device, model, size, options);
    const std::vector<Offset> lags = {{0, 0}, {0, 1}, {1, 0}, {1, 1}, {2, -1}, {0, 5}};
    const std::vector<double> theory = theoretical_covariance(model, size, lags);
    const std::vector<Image> textures = synthesiser.synthesise(seeds_from(100, count));
    const auto d = static_cast<std::size_t>(model.planes);
    for (std::size_t l = 0; l < lags.size(); ++l)
        for (std::size_t i = 0; i < d; ++i)
            for (std::size_t j = 0; j < d; ++j) {
                double sum = 0.0, squares = 0.0;
                for (const Image& texture : textures) {
                    const double c = covariance_about(texture, model.mean, static_cast<int>(i),
                                                      static_cast<int>(j), lags[l]);
                    sum += c;
                    squares += c * c;
                }
                const double mean = sum / count;
                const double error = std::sqrt((squares / count - mean * mean) / (count - 1));
                EXPECT_LE(std::abs(mean - theory[(l * d + i) * d + j]), 4.5 * error)
                    << "lag " << lags[l].row << "," << lags[l].column << " planes " << i << "," << j;
            }
}

TEST(Synthesis, HasTheModelsCovarianceWithoutPyramid) {
    expect_theory(texture_model(3, 1, 2), {48, 40}, NoiseDomain::frequency, 200);
}
TEST(Synthesis, HasTheModelsCovarianceOnOddLattices) {
    expect_theory(texture_model(1, 1, 2), {45, 33}, NoiseDomain::frequency, 200);
}
TEST(Synthesis, HasTheModelsCovarianceWithPyramid) {
    expect_theory(texture_model(2, 3, 2), {48, 64}, NoiseDomain::frequency, 200);
}
TEST(Synthesis, HasTheModelsCovarianceWithFactorThree) {
    expect_theory(texture_model(1, 2, 3), {45, 54}, NoiseDomain::frequency, 200);
}
TEST(Synthesis, SpatialNoiseHasTheSameCovariance) {
    expect_theory(texture_model(3, 2, 2), {48, 40}, NoiseDomain::spatial, 200);
}

TEST(Synthesis, BatchEqualsSingleSeedsBitForBit) {
    Device device;
    Synthesiser synthesiser(device, texture_model(3, 2, 2), {48, 64});
    const std::vector<Image> batch = synthesiser.synthesise(seeds_from(5, 7));
    ASSERT_EQ(batch.size(), 7U);
    for (std::size_t i = 0; i < batch.size(); ++i) {
        EXPECT_TRUE(same_bits(batch[i], synthesiser.synthesise(5 + i))) << i;
        for (std::size_t j = 0; j < i; ++j) EXPECT_FALSE(same_bits(batch[i], batch[j])) << i << j;
    }
    EXPECT_TRUE(synthesiser.synthesise(std::vector<std::uint64_t>{}).empty());
}

TEST(Synthesis, SeedsUseAllTheirBits) {
    Device device;
    Synthesiser synthesiser(device, texture_model(1, 1, 2), {16, 16});
    const Image low = synthesiser.synthesise(1);
    EXPECT_FALSE(same_bits(low, synthesiser.synthesise((std::uint64_t{1} << 32) + 1)));
    EXPECT_FALSE(same_bits(low, synthesiser.synthesise((std::uint64_t{1} << 63) + 1)));
}

// Noise is bit-identical; what follows it differs by the rounding of transforms: 1e-5 of full scale is the
// promise.
TEST(SynthesisLong, DoesNotDependOnWidthGroupOrTransform) {
    for (const NoiseDomain domain : {NoiseDomain::frequency, NoiseDomain::spatial}) {
        const TextureModel model = texture_model(3, 2, 2);
        SynthesisOptions how;
        how.noise_domain = domain;
        const auto grow = [&](const DeviceOptions& options) {
            Device device("", options);
            return Synthesiser(device, model, {40, 56}, how).synthesise(9);
        };
        const Image reference = grow({});
        for (const int width : {1, 4, 8, 16})
            for (const int group : {0, 1, 3, 16}) {
                if (group != 0 && width != 4) continue;
                DeviceOptions options;
                options.vector_width = width;
                options.work_group_size = group;
                EXPECT_LE(largest_difference(reference, grow(options)), 1e-5) << width << " " << group;
            }
        DeviceOptions options;
        options.fft = FftBackend::clfft;
        EXPECT_LE(largest_difference(reference, grow(options)), 1e-5);
    }
}

TEST(Synthesis, MeanIsTheModels) {
    // With white noise only, the mean over a texture has the standard error σ/√pixels.
    TextureModel model = texture_model(2, 1, 2, 1, 1e-9);
    Device device;
    const Image image = Synthesiser(device, model, {128, 128}).synthesise(3);
    for (int p = 0; p < 2; ++p) {
        const auto plane = image.plane(p);
        const double mean =
            std::accumulate(plane.begin(), plane.end(), 0.0) / static_cast<double>(plane.size());
        EXPECT_LE(std::abs(mean - model.mean[static_cast<std::size_t>(p)]), 4.5 * std::sqrt(0.011) / 128.0);
    }
}

TEST(Synthesis, AnySize) {
    Device device;
    const TextureModel model = texture_model(1, 3, 2);
    struct Case {
        Size size;
        bool tileable;
    };
    for (const Case& c : {Case{{1, 1}, false}, Case{{4, 4}, true}, Case{{17, 19}, false},
                          Case{{64, 48}, true}, Case{{68, 44}, false}, Case{{5, 64}, false}}) {
        Synthesiser synthesiser(device, model, c.size);
        EXPECT_EQ(synthesiser.size(), c.size);
        EXPECT_EQ(synthesiser.tileable(), c.tileable) << c.size.width << "x" << c.size.height;
        EXPECT_EQ(synthesiser.lattice() == c.size, c.tileable);
        const Image image = synthesiser.synthesise(1);
        EXPECT_EQ(image.size(), c.size);
        EXPECT_TRUE(std::all_of(image.values().begin(), image.values().end(),
                                [](float v) { return std::isfinite(v); }));
    }
    EXPECT_THROW(Synthesiser(device, model, {0, 5}), InputError);
    EXPECT_THROW(Synthesiser(device, model, {5, -1}), InputError);
}

// 17 does not suit the transforms: levels are grown on larger lattices and cropped before they are collapsed.
TEST(Synthesis, FactorsWithLargePrimesAreCroppedLevelByLevel) {
    const TextureModel model = texture_model(1, 2, 17, 2, 0.3);
    Device device;
    Synthesiser synthesiser(device, model, {34, 34});
    EXPECT_FALSE(synthesiser.tileable());
    const Image image = synthesiser.synthesise(1);
    const double mean = std::accumulate(image.values().begin(), image.values().end(), 0.0) / 1156.0;
    // The four pixels of the coarse level carry most of its error: 1.25·0.1/(1 − 0.3)/2.
    EXPECT_LE(std::abs(mean - 0.3), 4.5 * 0.09);
}

/// Mean squared jump from one column (row) to the next, at every position around the torus.
std::vector<double> jumps(const Image& image, bool columns) {
    const int n = columns ? image.width() : image.height(), m = columns ? image.height() : image.width();
    std::vector<double> result(static_cast<std::size_t>(n));
    for (int a = 0; a < n; ++a)
        for (int b = 0; b < m; ++b) {
            const int next = (a + 1) % n;
            const double jump =
                columns ? image.at(0, b, next) - image.at(0, b, a) : image.at(0, next, b) - image.at(0, a, b);
            result[static_cast<std::size_t>(a)] += jump * jump / m;
        }
    return result;
}

TEST(Synthesis, TilesWithoutSeams) {
    Device device;
    Synthesiser synthesiser(device, texture_model(1, 3, 2), {128, 96});
    ASSERT_TRUE(synthesiser.tileable());
    for (const Image& image : synthesiser.synthesise(seeds_from(0, 4)))
        for (const bool columns : {true, false}) {
            std::vector<double> all = jumps(image, columns);
            const double seam = all.back();
            all.pop_back();
            const auto [low, high] = std::minmax_element(all.begin(), all.end());
            // One of about a hundred alike: it may lead them, but not by more than their range.
            EXPECT_LE(seam, *high + (*high - *low));
            EXPECT_GE(seam, *low - (*high - *low));
        }
    // A texture that does not tile shows that the measure sees seams.
    Synthesiser cropped(device, texture_model(1, 3, 2, 2, 0.999), {127, 95});
    ASSERT_FALSE(cropped.tileable());
    std::vector<double> all = jumps(cropped.synthesise(0), true);
    const double seam = all.back();
    all.pop_back();
    EXPECT_GT(seam, *std::max_element(all.begin(), all.end()));
}

TEST(Synthesis, RefusesModelsWhoseCertificateFails) {
    Device device;
    TextureModel model = texture_model(1, 1, 2);
    model.levels[0].certificate.valid = false;
    model.levels[0].certificate.zeros = 4;
    try {
        Synthesiser(device, model, {16, 16});
        FAIL() << "not refused";
    } catch (const InputError& error) {
        EXPECT_NE(error.found().find("4 zeros"), std::string::npos) << error.what();
        EXPECT_NE(error.remedy().find("--allow-invalid"), std::string::npos) << error.what();
    }
    SynthesisOptions options;
    options.allow_invalid = true;
    EXPECT_NO_THROW(Synthesiser(device, model, {16, 16}, options));
}

TEST(Synthesis, MarkovModelsThatAreNoFieldsGiveFiniteTextures) {
    Device device;
    Analysis analysis(device, read_picture(test::data_folder() + "/cork.png").image.crop(0, 0, {128, 128}));
    for (const ModelKind kind :
         {ModelKind::mmrf2d, ModelKind::mmrf3d, ModelKind::pmrf2d, ModelKind::pmrf3d}) {
        FitOptions fit_options;
        fit_options.model = kind;
        fit_options.order = 3;
        fit_options.levels = 1;
        fit_options.estimator = EstimatorChoice::least_squares;
        fit_options.noise = NoiseForm::diagonal;
        fit_options.marginals = MarginalMode::none;
        const TextureModel model = analysis.fit(fit_options);
        ASSERT_FALSE(is_valid(model)) << name(kind) << " tests nothing";
        SynthesisOptions options;
        options.allow_invalid = true;
        const Image texture = Synthesiser(device, model, {64, 64}, options).synthesise(1);
        EXPECT_TRUE(std::ranges::all_of(texture.values(), [](float v) { return std::isfinite(v); }))
            << name(kind);
        EXPECT_NE(texture.values()[0], texture.values()[1]) << name(kind);
    }
}

TEST(Synthesis, SaysWhatFitsWhenMemoryDoesNot) {
    DeviceOptions options;
    options.memory_bytes = std::uint64_t{64} << 20;
    Device device({}, options);
    const TextureModel model = texture_model(3, 1, 2);
    try {
        Synthesiser(device, model, {16384, 16384});
        FAIL() << "not refused";
    } catch (const DeviceError& error) {
        EXPECT_NE(error.asked().find("16384x16384"), std::string::npos) << error.what();
        EXPECT_NE(error.remedy().find("give a size up to about"), std::string::npos) << error.what();
    }
    EXPECT_THROW(Synthesiser(device, model, {(1 << 20) + 1, 8}), InputError);
    // What no work group can transform, however few pixels there are.
    EXPECT_THROW(Synthesiser(device, model, {8, 16385}), InputError);
    EXPECT_NO_THROW(Synthesiser(device, model, {2, 16384}));
}

/// Known parameters → texture → least squares: every coefficient within 4 standard errors, Σ_ii [V_xx⁻¹]_pp /
/// pixels.
template <class Fitted>
void expect_recovered(const LinearField& truth, const LagCovariance& statistic, const Fitted& fitted) {
    const auto d = static_cast<std::size_t>(truth.planes), n = truth.offsets.size();
    Eigen::MatrixXd v(n * d, n * d);
    for (std::size_t s = 0; s < n; ++s)
        for (std::size_t t = 0; t < n; ++t)
            for (std::size_t j = 0; j < d; ++j)
                for (std::size_t k = 0; k < d; ++k)
                    v(static_cast<Eigen::Index>(s * d + j), static_cast<Eigen::Index>(t * d + k)) = statistic(
                        static_cast<int>(j), static_cast<int>(k), truth.offsets[t] - truth.offsets[s]);
    const Eigen::MatrixXd inverse = v.inverse();
    const auto pixels = static_cast<double>(area(statistic.size()));
    for (std::size_t s = 0; s < n; ++s)
        for (std::size_t i = 0; i < d; ++i)
            for (std::size_t j = 0; j < d; ++j) {
                const auto p = static_cast<Eigen::Index>(s * d + j);
                const double error = std::sqrt(truth.noise_covariance[i * d + i] * inverse(p, p) / pixels);
                EXPECT_LE(std::abs(fitted.coefficients[(s * d + i) * d + j] -
                                   truth.coefficients[(s * d + i) * d + j]),
                          4.0 * error)
                    << "offset " << s << " planes " << i << "," << j;
            }
    for (std::size_t i = 0; i < d; ++i)
        for (std::size_t j = 0; j < d; ++j) {
            const double ii = truth.noise_covariance[i * d + i], jj = truth.noise_covariance[j * d + j];
            const double ij = truth.noise_covariance[i * d + j];
            EXPECT_LE(std::abs(fitted.noise_covariance[i * d + j] - ij),
                      4.0 * std::sqrt((ii * jj + ij * ij) / pixels));
        }
}

TEST(Synthesis, FitRecoversTheParameters) {
    Device device;
    for (const int planes : {1, 3, 6}) {
        const TextureModel model = texture_model(planes, 1, 2, planes == 6 ? 1 : 3);
        const Image image =
            Synthesiser(device, model, {1024, 1024}).synthesise(static_cast<std::uint64_t>(planes));
        const LinearField& truth = linear_field(model.levels[0].models.front());
        const LagCovariance statistic = lag_covariance(image, difference_box(truth.offsets));
        expect_recovered(truth, statistic,
                         fit_car(statistic, {NeighbourhoodKind::causal, truth.offsets}, NoiseForm::full));
        expect_recovered(truth, statistic,
                         fit_sar(statistic, {NeighbourhoodKind::causal, truth.offsets}, NoiseForm::full));
    }
}

/// Pictures of tests/data with what the road must reach on them.
struct Picture512 {
    const char* file;
    int order, levels;
    double lag_error;  ///< bound on Comparison::lag_covariance_error
};

void PrintTo(const Picture512& p, std::ostream* out) {
    *out << p.file << " order " << p.order << " levels " << p.levels;
}

class SynthesisOfPictures : public testing::TestWithParam<Picture512> {};

TEST_P(SynthesisOfPictures, KeepsDeviationAndCovariance) {
    const std::filesystem::path path = std::filesystem::path(test::data_folder()) / GetParam().file;
    const Image picture = read_picture(path).image;
    Device device;
    FitOptions options;
    options.order = GetParam().order;
    options.levels = GetParam().levels;
    options.marginals = MarginalMode::none;
    const TextureModel model = fit(device, picture, options);
    ASSERT_TRUE(is_valid(model));
    const Size size{512, 512};
    Synthesiser synthesiser(device, model, size);
    const std::vector<double> theory = theoretical_deviation(model, size);
    const std::vector<Image> textures = synthesiser.synthesise(seeds_from(1, 8));
    std::vector<double> variance(theory.size());
    double lag_error = 0.0;
    for (const Image& texture : textures) {
        const Comparison comparison = compare(picture, texture);
        lag_error += comparison.lag_covariance_error / 8.0;
        for (std::size_t p = 0; p < theory.size(); ++p)
            variance[p] +=
                covariance_about(texture, model.mean, static_cast<int>(p), static_cast<int>(p), {0, 0}) / 8.0;
    }
    const Comparison self = compare(picture, picture);
    for (std::size_t p = 0; p < theory.size(); ++p) {
        EXPECT_NEAR(std::sqrt(variance[p]) / theory[p], 1.0, 0.03) << "plane " << p << " against theory";
        EXPECT_NEAR(std::sqrt(variance[p]) / self.planes[p].std[0], 1.0, 0.05)
            << "plane " << p << " against the picture";
    }
    EXPECT_LE(lag_error, GetParam().lag_error);
}

// 0.05 is the aim. Where a bound is larger, the model is too small for the picture and its own theory misses
// the aim as far: one level (or three of order 3) and one gain each cannot follow structure of many scales.
// More levels can: the last two rows.
INSTANTIATE_TEST_SUITE_P(
    Data, SynthesisOfPictures,
    testing::Values(Picture512{"cork.png", 5, 1, 0.05}, Picture512{"cork.png", 3, 3, 0.08},
                    Picture512{"grass.png", 5, 1, 0.05}, Picture512{"grass.png", 3, 3, 0.05},
                    Picture512{"sand.png", 5, 1, 0.05}, Picture512{"sand.png", 3, 3, 0.07},
                    Picture512{"bark.png", 5, 1, 0.07}, Picture512{"bark.png", 3, 3, 0.05},
                    Picture512{"rock.png", 5, 1, 0.18}, Picture512{"rock.png", 3, 3, 0.05},
                    Picture512{"landsat.tif", 5, 1, 0.19}, Picture512{"landsat.tif", 3, 3, 0.05},
                    Picture512{"cork.png", 5, 4, 0.05}, Picture512{"sand.png", 5, 4, 0.05}));

}  // namespace
}  // namespace btfield

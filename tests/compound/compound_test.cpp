#include "btfield/compound.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include "btfield/criteria.hpp"
#include "btfield/error.hpp"
#include "btfield/image_io.hpp"
#include "btfield/synthesis.hpp"
#include "host/compound/regional_averages.hpp"
#include "host/fit/random_decrement.hpp"
#include "tests/device_cases.hpp"
#include "tests/places.hpp"

namespace btfield {
namespace {

const std::string data = test::data_folder();

/// Blobs: quantiles of smooth noise.
ControlField blobs(Size size, int regions, unsigned seed) {
    TextureModel smooth;
    smooth.kind = ModelKind::ma3d;
    smooth.size = size;
    smooth.planes = 1;
    smooth.mean = {0.0};
    LevelModel level;
    level.size = size;
    MaModel kernel;
    kernel.planes = 1;
    for (int r = -8; r <= 8; ++r)
        for (int c = -8; c <= 8; ++c) {
            kernel.offsets.push_back({r, c});
            kernel.coefficients.push_back(std::exp(-(r * r + c * c) / 32.0));
        }
    kernel.noise_covariance = {1.0};
    level.models.emplace_back(kernel);
    level.certificate = {true, 1.0, 0, {1.0}};
    level.estimator = Estimator::random_decrement;
    smooth.levels = {level};
    const Image image = Synthesiser(test::default_device(), smooth, size).synthesise(seed);
    std::vector<float> sorted(image.values().begin(), image.values().end());
    std::sort(sorted.begin(), sorted.end());
    ControlField field{size, regions, {}};
    for (const float value : image.values()) {
        int label = 0;
        while (label + 1 < regions && value >= sorted[sorted.size() * static_cast<std::size_t>(label + 1) /
                                                      static_cast<std::size_t>(regions)])
            ++label;
        field.labels.push_back(static_cast<std::uint8_t>(label));
    }
    return field;
}

/// A single-level moving average of three planes, about 0.
TextureModel moving_average(Size size, const std::vector<Offset>& offsets, double decay, double deviation) {
    TextureModel model;
    model.kind = ModelKind::ma3d;
    model.size = size;
    model.planes = 3;
    model.mean = {0.0, 0.0, 0.0};
    LevelModel level;
    level.size = size;
    level.estimator = Estimator::random_decrement;
    level.certificate = {true, 0.1, 0, {1.0, 1.0, 1.0}};
    MaModel kernel;
    kernel.planes = 3;
    kernel.offsets = offsets;
    for (const Offset s : offsets)
        for (int i = 0; i < 3; ++i)
            for (int j = 0; j < 3; ++j)
                kernel.coefficients.push_back((i == j ? 1.0 : 0.2) *
                                              std::exp(-decay * (s.row * s.row + s.column * s.column)));
    const double variance = deviation * deviation;
    kernel.noise_covariance = {variance, 0, 0, 0, variance, 0, 0, 0, variance};
    level.models.emplace_back(kernel);
    model.levels = {level};
    return model;
}

/// Three regions, far apart in colour, each with a moving average of its own.
CompoundModel made_compound(const ControlField& field) {
    std::vector<Offset> offsets = neighbourhood(3, NeighbourhoodKind::symmetric);
    offsets.insert(std::upper_bound(offsets.begin(), offsets.end(), Offset{}), Offset{});
    CompoundModel model;
    model.size = field.size;
    model.planes = 3;
    model.space = ColourSpace::linear;  // planes of one kind: kernels are those of the planes as they are
    model.borders = Borders::none;
    model.control = field;
    model.mean = {0.0, 0.0, 0.0};
    const double decays[] = {0.2, 0.6, 1.5};
    for (int k = 0; k < 3; ++k) {
        CompoundRegion region;
        region.colour = {0.2 + 0.3 * k, 0.25 + 0.25 * k, 0.3 + 0.2 * k};
        region.weights = region.colour;
        region.share = shares(field)[static_cast<std::size_t>(k)];
        region.residual = moving_average(field.size, offsets, decays[k], 0.005 + 0.003 * k);
        model.regions.push_back(region);
    }
    return model;
}

CompoundOptions plain_options() {
    CompoundOptions options;
    options.borders = Borders::none;
    options.local.marginals = MarginalMode::none;
    options.local.levels = 1;
    return options;
}

double deviation(const Image& image, int plane) {
    return compare(image, image).planes[static_cast<std::size_t>(plane)].std[0];
}

class CompoundRecovery : public testing::TestWithParam<AveragesEstimator> {};
INSTANTIATE_TEST_SUITE_P(Averages, CompoundRecovery,
                         testing::Values(AveragesEstimator::spectral_root,
                                         AveragesEstimator::random_decrement),
                         [](const auto& each) { return std::string(name(each.param)); });

// A made compound: labels are found, and regional kernels are those that whole pictures of the regional
// models give, within four standard errors.
TEST_P(CompoundRecovery, LabelsAndKernels) {
    const Size size{256, 256};
    const ControlField field = blobs(size, 3, 1);
    const CompoundModel made = made_compound(field);
    CompoundSynthesiser synthesiser(test::default_device(), made, size);
    CompoundOptions options = plain_options();
    options.clusters.regions = 3;
    options.clusters.space = ClusterSpace::rgb;
    options.local.order = 3;
    options.averages = GetParam();
    const CompoundModel fitted =
        fit_compound(test::default_device(), synthesiser.synthesise(5, field), options);
    std::size_t same = 0;
    for (std::size_t n = 0; n < field.labels.size(); ++n) same += fitted.control.labels[n] == field.labels[n];
    EXPECT_GE(static_cast<double>(same), 0.99 * static_cast<double>(field.labels.size()));

    const LinearField& support = linear_field(made.regions.front().residual.levels.front().models.front());
    constexpr int replicates = 32;
    const Size quarter{128, 128};
    for (std::size_t k = 0; k < 3; ++k) {
        TextureModel model = made.regions[k].residual;
        model.size = model.levels.front().size = quarter;
        Synthesiser whole(test::default_device(), model, quarter);
        std::vector<double> sums(support.coefficients.size(), 0.0), squares(sums);
        for (std::uint64_t seed = 0; seed < replicates; ++seed) {
            const Image image = whole.synthesise(100 + seed);
            const MaModel one =
                GetParam() == AveragesEstimator::spectral_root
                    ? averages_of_covariances(lag_covariance(image, difference_box(support.offsets)),
                                              {support.kind, support.offsets})
                    : fit_ma(image, lag_covariance(image, {}), support, NoiseForm::full);
            for (std::size_t n = 0; n < sums.size(); ++n) {
                sums[n] += one.coefficients[n] / replicates;
                squares[n] += one.coefficients[n] * one.coefficients[n] / replicates;
            }
        }
        const LinearField& own = linear_field(fitted.regions[k].residual.levels.front().models.front());
        ASSERT_EQ(own.offsets, support.offsets);
        // Of that of a replicate.
        const double pixels =
            static_cast<double>(fitted.regions[k].pixels) / static_cast<double>(area(quarter));
        for (std::size_t n = 0; n < sums.size(); ++n) {
            const double variance =
                std::max(0.0, squares[n] - sums[n] * sums[n]) * replicates / (replicates - 1.0);
            // Of the region's pixels, and of the replicates' mean.
            const double error = std::sqrt(variance * (1.0 / pixels + 1.0 / replicates));
            EXPECT_LE(std::abs(own.coefficients[n] - sums[n]), 4.0 * error)
                << "region " << k << " entry " << n;
        }
    }
}

TEST(Compound, LabelsThatHaveNothingToDoWithThePictureExplainNothing) {
    const Size size{256, 256};
    CompoundOptions options;
    options.labels = blobs(size, 4, 3);
    const Image image = test::mixed_texture(size, 3, 7);
    const CompoundModel model = fit_compound(test::default_device(), image, options);
    EXPECT_LT(std::abs(model.explained), 0.01);
    for (const CompoundRegion& region : model.regions)
        for (std::size_t p = 0; p < 3; ++p) EXPECT_NEAR(region.colour[p], model.regions[0].colour[p], 0.1);
}

TEST(Compound, KeepsWhatOneModelLoses) {
    for (const char* name : {"/bark.png", "/rock.png", "/grass.png"}) {
        const Image image = read_picture(data + name).image;
        const CompoundModel model = fit_compound(test::default_device(), image);
        EXPECT_TRUE(is_valid(model)) << name;
        EXPECT_GT(model.explained, 0.5) << name;
        CompoundSynthesiser synthesiser(test::default_device(), model, {512, 512});
        const Image texture = synthesiser.synthesise(1);
        for (const Comparison::Plane& plane : compare(image, texture).planes)
            EXPECT_NEAR(plane.std_ratio, 1.0, 0.1) << name;
        const Image single =
            Synthesiser(test::default_device(), fit(test::default_device(), image, {}), {512, 512})
                .synthesise(1);
        EXPECT_LT(structure_distance(image, texture), 0.8 * structure_distance(image, single)) << name;
    }
}

// P1: shares of the regions in control fields of four times the area.
TEST(Compound, SharesOfRegionsStay) {
    const Image image = read_picture(data + "/bark.png").image;
    const CompoundModel model = fit_compound(test::default_device(), image);
    CompoundSynthesiser synthesiser(test::default_device(), model, {512, 512});
    for (std::uint64_t seed = 0; seed < 4; ++seed) {
        const std::vector<double> grown = shares(synthesiser.control_field(seed));
        for (std::size_t k = 0; k < grown.size(); ++k)
            EXPECT_NEAR(grown[k], model.regions[k].share, 0.03) << "seed " << seed << " region " << k;
    }
}

TEST(Compound, TexturesDependOnTheSeedAndNothingElse) {
    const Image image = read_picture(data + "/bark.png", Crop{0, 0, 128, 128}).image;
    const CompoundModel model = fit_compound(test::default_device(), image);
    CompoundSynthesiser synthesiser(test::default_device(), model, {96, 144});
    const Image first = synthesiser.synthesise(4), other = synthesiser.synthesise(5);
    const Image again = synthesiser.synthesise(4);
    EXPECT_TRUE(std::ranges::equal(first.values(), again.values()));
    EXPECT_FALSE(std::ranges::equal(first.values(), other.values()));
    EXPECT_EQ(first.size(), (Size{96, 144}));
    EXPECT_TRUE(synthesiser.tileable());
    for (const int width : {1, 4}) {
        Device narrow = test::device_of_width(width);
        const Image same = CompoundSynthesiser(narrow, model, {96, 144}).synthesise(4);
        double largest = 0.0;
        for (std::size_t n = 0; n < same.values().size(); ++n)
            largest = std::max(largest, std::abs(static_cast<double>(same.values()[n] - first.values()[n])));
        EXPECT_LE(largest, 1e-4) << width;
    }
}

// Steps across the wrap are no larger than steps inside.
TEST(Compound, OppositeEdgesContinueEachOther) {
    const Image image = read_picture(data + "/rock.png").image;
    const CompoundModel model = fit_compound(test::default_device(), image);
    const Image texture = CompoundSynthesiser(test::default_device(), model, {192, 192}).synthesise(2);
    double wrap = 0.0, inside = 0.0;
    for (int r = 0; r < 192; ++r) {
        wrap += std::abs(static_cast<double>(texture.at(0, r, 191) - texture.at(0, r, 0)));
        for (int c = 0; c + 1 < 192; ++c)
            inside += std::abs(static_cast<double>(texture.at(0, r, c) - texture.at(0, r, c + 1))) / 191.0;
    }
    EXPECT_LT(wrap, 1.25 * inside);
}

TEST(Compound, SizesThatDoNotTileAreCutOut) {
    const Image image = read_picture(data + "/bark.png", Crop{0, 0, 128, 128}).image;
    const CompoundModel model = fit_compound(test::default_device(), image);
    CompoundSynthesiser synthesiser(test::default_device(), model, {101, 67});
    EXPECT_FALSE(synthesiser.tileable());
    EXPECT_EQ(synthesiser.synthesise(0).size(), (Size{101, 67}));
    EXPECT_GE(synthesiser.lattice().height, 101);
    const ControlField own{{101, 67}, 1, std::vector<std::uint8_t>(101 * 67, 0)};
    EXPECT_EQ(synthesiser.synthesise(0, own).size(), (Size{101, 67}));
}

TEST(Compound, AnyModelServesRegions) {
    const Image image = read_picture(data + "/rock.png", Crop{0, 0, 160, 160}).image;
    for (const ModelKind kind : {ModelKind::ma2d, ModelKind::car3d, ModelKind::car2d, ModelKind::msar2d,
                                 ModelKind::mmrf2d, ModelKind::pmrf2d}) {
        CompoundOptions options;
        options.clusters.regions = 3;
        options.local.model = kind;
        options.local.order = 2;
        options.local.levels = 2;
        const CompoundModel model = fit_compound(test::default_device(), image, options);
        ASSERT_TRUE(is_valid(model)) << name(kind);
        const Image texture = CompoundSynthesiser(test::default_device(), model, {160, 160}).synthesise(1);
        for (const Comparison::Plane& plane : compare(image, texture).planes)
            EXPECT_NEAR(plane.std_ratio, 1.0, 0.15) << name(kind);
    }
}

TEST(Compound, PlainFormOfThePaper) {
    const Image image = read_picture(data + "/bark.png", Crop{0, 0, 128, 128}).image;
    CompoundOptions options;
    options.clusters.regions = 5;
    options.clusters.space = ClusterSpace::rgb;
    options.borders = Borders::swap;
    options.averages = AveragesEstimator::random_decrement;
    options.local.order = 3;
    options.local.gains = GainMode::none;
    options.local.marginals = MarginalMode::none;
    options.local.moving_average.rule = SignificanceRule::p1;
    const CompoundModel model = fit_compound(test::default_device(), image, options);
    EXPECT_EQ(model.regions.front().residual.levels.size(), 3U);
    EXPECT_EQ(linear_field(model.regions.front().residual.levels.front().models.front()).offsets.size(), 13U);
    EXPECT_EQ(model.regions.front().weights.size(), 3U);
    for (const LevelModel& level : model.regions.front().residual.levels) {
        EXPECT_EQ(level.estimator, Estimator::random_decrement);
        EXPECT_EQ(level.gain, model.regions.front().residual.levels.front().gain);
    }
    // Smoothing along borders takes variance, and there is hardly a pixel of bark without one.
    CompoundModel plain = model;
    plain.borders = Borders::none;
    const Image texture = CompoundSynthesiser(test::default_device(), model, {128, 128}).synthesise(1);
    const Image unsmoothed = CompoundSynthesiser(test::default_device(), plain, {128, 128}).synthesise(1);
    EXPECT_NEAR(deviation(unsmoothed, 0) / deviation(image, 0), 1.0, 0.1);
    EXPECT_GT(deviation(texture, 0) / deviation(image, 0), 0.6);
    EXPECT_LT(deviation(texture, 0), deviation(unsmoothed, 0));
}

TEST(Compound, TwoColours) {
    Image image({64, 64}, 1);
    const ControlField field = blobs({64, 64}, 2, 9);
    for (std::size_t n = 0; n < field.labels.size(); ++n)
        image.values()[n] = field.labels[n] == 0 ? 0.0F : 1.0F;
    const CompoundModel model = fit_compound(test::default_device(), image);
    EXPECT_EQ(model.regions.size(), 2U);
    const Image texture = CompoundSynthesiser(test::default_device(), model, {64, 64}).synthesise(1);
    double sum = 0.0;
    for (const float value : texture.values())
        sum += static_cast<double>(std::min(std::abs(value), std::abs(value - 1.0F)));
    EXPECT_LT(sum / static_cast<double>(texture.values().size()), 0.02);
}

TEST(Compound, SmallestPictures) {
    for (const Size size : {Size{16, 16}, Size{17, 16}, Size{16, 70}}) {
        const CompoundModel model = fit_compound(test::default_device(), test::mixed_texture(size, 3, 2));
        EXPECT_EQ(CompoundSynthesiser(test::default_device(), model, {32, 32}).synthesise(1).size(),
                  (Size{32, 32}));
    }
    CompoundOptions diagonal;
    diagonal.local.noise = NoiseForm::diagonal;
    const Image image = read_picture(data + "/bark.png", Crop{0, 0, 96, 96}).image;
    EXPECT_NO_THROW(check(fit_compound(test::default_device(), image, diagonal)));
}

TEST(Compound, Tile) {
    const Image image = read_picture(data + "/grass.png").image;
    CompoundOptions options;
    options.tile = Size{128, 144};
    const CompoundModel model = fit_compound(test::default_device(), image, options);
    EXPECT_TRUE(model.periodic);
    EXPECT_EQ(model.control.size, (Size{128, 144}));
    const Image texture = CompoundSynthesiser(test::default_device(), model, {256, 256}).synthesise(1);
    EXPECT_NEAR(deviation(texture, 0) / deviation(image, 0), 1.0, 0.15);
    // One region is a tile wherever it is cut, and its size needs no more room than it has.
    options.clusters.regions = 1;
    options.tile = image.size();
    const CompoundModel one = fit_compound(test::default_device(), image, options);
    EXPECT_TRUE(one.periodic);
    EXPECT_EQ(one.control.size, image.size());
}

class CompoundEdit : public testing::Test {
  protected:
    CompoundModel model_ = made_compound(blobs({64, 64}, 3, 2));
    [[nodiscard]] Image texture(const CompoundModel& model) const {
        return CompoundSynthesiser(test::default_device(), model, {64, 64}).synthesise(1, model.control);
    }
    [[nodiscard]] double mean(const Image& image, int region) const {
        double sum = 0.0, count = 0.0;
        for (std::size_t n = 0; n < model_.control.labels.size(); ++n) {
            if (model_.control.labels[n] != region) continue;
            sum += static_cast<double>(image.plane(0)[n]);
            count += 1.0;
        }
        return sum / count;
    }
};

TEST_F(CompoundEdit, Colour) {
    CompoundModel red = model_;
    recolour(red, 1, std::vector{0.9, 0.1, 0.1});
    const Image before = texture(model_), after = texture(red);
    EXPECT_NEAR(mean(after, 1) - mean(before, 1), 0.9 - model_.regions[1].colour[0], 1e-5);
    EXPECT_NEAR(mean(after, 0), mean(before, 0), 1e-6);
    EXPECT_THROW(recolour(red, 3, std::vector{0.9, 0.1, 0.1}), InputError);
    EXPECT_THROW(recolour(red, 0, std::vector{0.9}), InputError);
}

TEST_F(CompoundEdit, Contrast) {
    CompoundModel flat = model_;
    scale_contrast(flat, 2, 0.0);
    const Image before = texture(model_), after = texture(flat);
    for (std::size_t n = 0; n < model_.control.labels.size(); ++n) {
        if (model_.control.labels[n] == 2)
            EXPECT_NEAR(after.plane(0)[n], model_.regions[2].colour[0], 1e-6);
        else
            EXPECT_EQ(after.plane(0)[n], before.plane(0)[n]);
    }
    EXPECT_THROW(scale_contrast(flat, 0, -1.0), InputError);
    EXPECT_THROW(scale_contrast(flat, 0, std::nan("")), InputError);
}

TEST_F(CompoundEdit, RegionsOfOthers) {
    CompoundModel other = model_;
    recolour(other, 0, std::vector{0.5, 0.5, 0.5});
    CompoundModel mixed = model_;
    transplant(mixed, 1, other, 0);
    EXPECT_NEAR(mean(texture(mixed), 1), 0.5, 0.02);
    EXPECT_EQ(linear_field(mixed.regions[1].residual.levels[0].models[0]).coefficients,
              linear_field(other.regions[0].residual.levels[0].models[0]).coefficients);
    EXPECT_THROW(transplant(mixed, 1, other, 3), InputError);

    TextureModel plain = fit(test::default_device(), test::mixed_texture({64, 64}, 3, 3), {});
    transplant(mixed, 2, plain);
    const Image image = texture(mixed);
    EXPECT_NEAR(mean(image, 2), plain.mean[0], 0.3);
    EXPECT_NEAR(mean(image, 0), mean(texture(model_), 0), 1e-3);
    plain.factor = 3;
    EXPECT_THROW(transplant(mixed, 2, plain), InputError);
    EXPECT_THROW(transplant(mixed, 2, fit(test::default_device(), test::mixed_texture({64, 64}, 2, 3), {})),
                 InputError);
}

TEST(CompoundErrors, SayWhatIsWrong) {
    Device& device = test::default_device();
    const auto complaint = [&](const Image& image, const CompoundOptions& options) -> std::string {
        try {
            (void)fit_compound(device, image, options);
        } catch (const InputError& error) {
            return error.what();
        }
        return "no complaint";
    };
    const auto expect = [&](const Image& image, const CompoundOptions& options, const std::string& part) {
        const std::string text = complaint(image, options);
        EXPECT_NE(text.find(part), std::string::npos) << text;
    };
    Image flat({32, 32}, 3);
    expect(flat, {}, "one colour");
    expect(Image({12, 40}, 1), {}, "below 16");
    Image bad = test::mixed_texture({32, 32}, 1, 1);
    bad.values()[7] = std::numeric_limits<float>::quiet_NaN();
    expect(bad, {}, "NaN");
    const Image good = test::mixed_texture({64, 64}, 3, 1);
    CompoundOptions options;
    options.labels = ControlField{{32, 64}, 1, std::vector<std::uint8_t>(32 * 64, 0)};
    expect(good, options, "64");
    options.labels = ControlField{{64, 64}, 3, std::vector<std::uint8_t>(64 * 64, 0)};
    expect(good, options, "label 1 is nowhere");
    options = {};
    options.clusters.regions = 33;
    expect(good, options, "33");
    Image two({32, 32}, 1);
    for (std::size_t n = 0; n < two.values().size(); n += 3) two.values()[n] = 1.0F;
    options.clusters.regions = 3;
    expect(two, options, "2");
    options = {};
    options.local.levels = 6;
    expect(good, options, "at most");
    options = {};
    options.tile = Size{128, 128};
    expect(good, options, "tile");
    const CompoundModel model = fit_compound(device, good);
    EXPECT_THROW(CompoundSynthesiser(device, model, {8, 64}), InputError);
    CompoundSynthesiser synthesiser(device, model, {64, 64});
    EXPECT_THROW(
        (void)synthesiser.synthesise(0, ControlField{{32, 32}, 1, std::vector<std::uint8_t>(1024, 0)}),
        InputError);
    CompoundModel broken = model;
    broken.regions.front().residual.levels.front().certificate.valid = false;
    EXPECT_THROW(check_synthesis(broken, {64, 64}), InputError);
    EXPECT_NO_THROW(check_synthesis(broken, {64, 64}, true));
    broken.control.regions += 1;
    EXPECT_THROW(check(broken), InputError);
}

}  // namespace
}  // namespace btfield

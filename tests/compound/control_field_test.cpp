#include "btfield/control_field.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <set>
#include <span>
#include <string>
#include <vector>

#include "btfield/error.hpp"
#include "btfield/image_io.hpp"
#include "host/base/eigen.hpp"
#include "host/compound/cluster_features.hpp"
#include "host/compound/cluster_sample.hpp"
#include "host/compound/k_means.hpp"
#include "host/compound/region_divergence.hpp"
#include "tests/label_cases.hpp"
#include "tests/places.hpp"
#include "tests/reference/noise.hpp"

namespace btfield {

using namespace detail;

namespace {

using std::size_t;
using Colour = std::array<float, 3>;

const std::string data = test::data_folder();

/// More pixels than centres are searched on.
Image rock() {
    return read_picture(data + "/rock.png", Crop{0, 0, 128, 128}).image;
}

/// From the darkest to the lightest, far from each other and not on one line.
constexpr std::array<Colour, 7> colours{{{0.05F, 0.05F, 0.1F},
                                         {0.1F, 0.15F, 0.7F},
                                         {0.8F, 0.1F, 0.15F},
                                         {0.1F, 0.75F, 0.3F},
                                         {0.85F, 0.2F, 0.8F},
                                         {0.95F, 0.85F, 0.1F},
                                         {0.95F, 0.95F, 0.95F}}};

Image painted(const ControlField& field, std::span<const Colour> palette, double noise,
              ColourSpace space = ColourSpace::srgb) {
    Image image(field.size, 3, space);
    for (int p = 0; p < 3; ++p)
        for (int r = 0; r < field.size.height; ++r)
            for (int c = 0; c < field.size.width; ++c) {
                const size_t i = static_cast<size_t>(r * field.size.width + c);
                const double grain = noise * reference::spatial_noise(5, 0, p, r, c).value;
                image.at(p, r, c) =
                    palette[field.labels[i]][static_cast<size_t>(p)] + static_cast<float>(grain);
            }
    return image;
}

/// Regions one above the other, each of as many rows.
ControlField stripes(int regions, int rows, int width) {
    ControlField field{{regions * rows, width}, regions, {}};
    for (int k = 0; k < regions; ++k)
        field.labels.insert(field.labels.end(), static_cast<size_t>(rows * width),
                            static_cast<std::uint8_t>(k));
    return field;
}

ClusterOptions with(int regions, ClusterSpace space = ClusterSpace::automatic, std::uint64_t seed = 0) {
    ClusterOptions options;
    options.regions = regions;
    options.space = space;
    options.seed = seed;
    return options;
}

double agreement(const ControlField& a, const ControlField& b) {
    EXPECT_EQ(a.size, b.size);
    EXPECT_EQ(a.regions, b.regions);
    size_t same = 0;
    for (size_t i = 0; i < a.labels.size(); ++i) same += a.labels[i] == b.labels[i] ? 1U : 0U;
    return static_cast<double>(same) / static_cast<double>(a.labels.size());
}

void expect_error(const std::function<void()>& work, const std::string& found) {
    try {
        work();
        ADD_FAILURE() << "no error: " << found;
    } catch (const InputError& error) {
        EXPECT_EQ(error.found(), found);
    }
}

TEST(ControlField, CheckNamesTheFirstDefect) {
    const ControlField good{{2, 3}, 3, {0, 1, 2, 0, 1, 2}};
    EXPECT_NO_THROW(check(good));
    const auto broken = [&](auto change) {
        return [&good, change] {
            ControlField field = good;
            change(field);
            check(field);
        };
    };
    expect_error(broken([](ControlField& f) { f.size.height = 0; }), "it has no pixels");
    expect_error(broken([](ControlField& f) { f.size.width = -3; }), "it has no pixels");
    expect_error(broken([](ControlField& f) { f.regions = 0; }), "there are to be 0 regions");
    expect_error(broken([](ControlField& f) { f.regions = 33; }), "there are to be 33 regions");
    expect_error(broken([](ControlField& f) { f.labels.pop_back(); }), "it has 5 labels");
    expect_error(broken([](ControlField& f) { f.labels[5] = 3; }),
                 "the label at row 1, column 2 is 3, of 3 regions");
}

TEST(ControlField, SharesAreThoseOfThePixels) {
    EXPECT_EQ(shares({{2, 4}, 4, {0, 1, 3, 3, 3, 3, 1, 3}}), (std::vector{0.125, 0.25, 0.0, 0.625}));
    EXPECT_THROW(static_cast<void>(shares({{1, 1}, 1, {1}})), InputError);
}

TEST(ControlField, NamesOfSpaces) {
    EXPECT_EQ(name(ClusterSpace::automatic), "auto");
    EXPECT_EQ(name(ClusterSpace::planes), "planes");
}

// Labels are found again.

TEST(Cluster, ValuesAsTheyAreShowEveryPixel) {
    for (const int regions : {2, 5, 7}) {
        const ControlField field = test::patchy_labels({120, 131}, regions);
        const Clustering found = cluster(painted(field, colours, 0.02), with(regions, ClusterSpace::rgb));
        EXPECT_EQ(found.field.labels, field.labels) << regions;
        EXPECT_EQ(found.reason, "");
    }
}

TEST(Cluster, SmoothedColoursShowRegions) {
    for (const ColourSpace space : {ColourSpace::srgb, ColourSpace::linear, ColourSpace::unspecified}) {
        const ControlField field = stripes(7, 450, 20);
        const Clustering found = cluster(painted(field, colours, 0.04, space), with(7));
        EXPECT_GE(agreement(found.field, field), 0.999) << name(space);
    }
}

TEST(Cluster, RegionsAreNumberedFromTheDarkest) {
    const Image picture = rock();
    for (const ClusterSpace space : {ClusterSpace::lab, ClusterSpace::rgb, ClusterSpace::planes}) {
        const ControlField field = cluster(picture, with(9, space)).field;
        check(field);
        std::array<double, 9> sums{}, counts{};
        for (int p = 0; p < 3; ++p)
            for (size_t i = 0; i < field.labels.size(); ++i) {
                sums[field.labels[i]] += static_cast<double>(picture.plane(p)[i]);
                counts[field.labels[i]] += 1.0;
            }
        for (size_t k = 0; k < 9; ++k) {
            ASSERT_GT(counts[k], 0.0);
            if (k > 0) {
                EXPECT_GT(sums[k] / counts[k], sums[k - 1] / counts[k - 1]) << name(space);
            }
        }
    }
}

TEST(Cluster, SpacesDiffer) {
    const Image picture = rock();
    const ControlField lab = cluster(picture, with(6, ClusterSpace::lab)).field;
    EXPECT_EQ(cluster(picture, with(6)).field.labels, lab.labels);
    for (const ClusterSpace space : {ClusterSpace::rgb, ClusterSpace::planes})
        EXPECT_NE(cluster(picture, with(6, space)).field.labels, lab.labels);
    Image linear = picture;
    linear.set_space(ColourSpace::linear);
    EXPECT_NE(cluster(linear, with(6)).field.labels, lab.labels);
    Image heights = picture;  // three planes that are no colours
    heights.set_space(ColourSpace::unspecified);
    EXPECT_EQ(cluster(heights, with(6)).field.labels, lab.labels);
    for (float& v : heights.values()) v *= 1000.0F;
    EXPECT_EQ(cluster(heights, with(6)).field.labels,
              cluster(heights, with(6, ClusterSpace::planes)).field.labels);
}

TEST(Cluster, PlanesCountByTheirDeviations) {
    const ControlField field = stripes(2, 40, 60);
    Image image(field.size, 4);
    for (int r = 0; r < 80; ++r)
        for (int c = 0; c < 60; ++c) {
            image.at(0, r, c) = 1.0e6F;                    // says nothing
            image.at(1, r, c) = r < 40 ? 5.000F : 5.001F;  // tells the regions
            image.at(2, r, c) = static_cast<float>(3000.0 * reference::spatial_noise(1, 0, 0, r, c).value);
            image.at(3, r, c) = r < 40 ? 1.0e-20F : 0.0F;
        }
    const ControlField found = cluster(image, with(2)).field;
    EXPECT_GE(std::max(agreement(found, field), 1.0 - agreement(found, field)), 0.999);
}

TEST(Cluster, ScalesOfValuesDoNotMatter) {
    const Image picture = rock();
    for (const ClusterSpace space : {ClusterSpace::rgb, ClusterSpace::planes}) {
        const ControlField field = cluster(picture, with(5, space)).field;
        for (const float scale : {0x1p-90F, 0x1p100F}) {
            Image scaled = picture;
            for (float& v : scaled.values()) v *= scale;
            EXPECT_EQ(cluster(scaled, with(5, space)).field.labels, field.labels) << name(space) << scale;
        }
    }
}

TEST(Cluster, RarePixelsAreFound) {
    const Size size{150, 120};  // more pixels than centres are searched on
    Image image(size, 1);
    image.at(0, 3, 7) = 1.0F;
    image.at(0, 99, 70) = 5.0F;
    image.at(0, 100, 0) = -3.0F;
    const ControlField field = cluster(image, with(4, ClusterSpace::planes)).field;
    const std::set<int> labels(field.labels.begin(), field.labels.end());
    EXPECT_EQ(labels.size(), 4U);
    EXPECT_EQ(field.labels[100 * 120], 0);
    EXPECT_EQ(field.labels[99 * 120 + 70], 3);
}

TEST(Cluster, SeedsAgree) {
    const Image picture = rock();
    const ControlField field = cluster(picture, with(8)).field;
    EXPECT_EQ(cluster(picture, with(8)).field.labels, field.labels);
    for (const std::uint64_t seed : {1U, 2U})
        EXPECT_GE(agreement(cluster(picture, with(8, ClusterSpace::automatic, seed)).field, field), 0.95);
}

TEST(Cluster, AnyShape) {
    for (const Size size :
         {Size{1, 1}, Size{1, 40}, Size{40, 1}, Size{2, 3}, Size{1, 270001}, Size{270001, 1}}) {
        Image image(size, 2);
        for (int p = 0; p < 2; ++p)
            for (size_t i = 0; i < area(size); ++i) image.plane(p)[i] = static_cast<float>(i * 7 % 41);
        const int regions = area(size) < 5 ? 1 : 5;
        const ControlField field = cluster(image, with(regions)).field;
        check(field);
        EXPECT_EQ(std::set<int>(field.labels.begin(), field.labels.end()).size(),
                  static_cast<size_t>(regions));
    }
}

// How many regions.

TEST(ClusterNumber, IsThatOfTheColoursUnderNoise) {
    for (const int regions : {2, 4, 7}) {
        const ControlField field = stripes(regions, 180, 20);
        const Clustering found = cluster(painted(field, colours, 0.03));
        EXPECT_EQ(found.field.regions, regions) << found.reason;
        if (found.field.regions == regions) {
            EXPECT_GE(agreement(found.field, field), 0.995);
        }
        EXPECT_TRUE(found.reason.starts_with(std::to_string(regions) + " regions: any two are at least "))
            << found.reason;
        EXPECT_NE(found.reason.find("; of " + std::to_string(regions + 1) + ", "), std::string::npos)
            << found.reason;
    }
}

TEST(ClusterNumber, FollowsTheOptions) {
    const Image picture = rock();
    const auto regions = [&](int most, double divergence, size_t pixels) {
        ClusterOptions options;
        options.most = most;
        options.divergence = divergence;
        options.pixels = pixels;
        const Clustering found = cluster(picture, options);
        check(found.field);
        for (const double share : shares(found.field))
            EXPECT_GE(share * static_cast<double>(area(picture.size())) + 0.5, static_cast<double>(pixels));
        return found.field.regions;
    };
    EXPECT_EQ(regions(3, 0.0, 0), 3);
    EXPECT_EQ(regions(1, 0.0, 0), 1);
    EXPECT_EQ(regions(32, 0.0, 0), 32);
    EXPECT_EQ(regions(12, 1e9, 0), 1);
    EXPECT_LT(regions(12, 0.0, 3000), 6);
    EXPECT_LT(regions(12, 1.0, 0), regions(12, 0.25, 0));
}

TEST(ClusterNumber, IsAtMostThatOfTheColours) {
    const ControlField field = stripes(2, 40, 30);
    const Clustering two = cluster(painted(field, colours, 0.0));
    EXPECT_EQ(two.field.labels, field.labels);
    EXPECT_TRUE(two.reason.ends_with(" apart, the smallest has 1200 pixels; the picture has 2 colours"))
        << two.reason;
    for (const ClusterSpace space : {ClusterSpace::automatic, ClusterSpace::rgb, ClusterSpace::planes}) {
        ClusterOptions options;
        options.space = space;
        const Clustering one = cluster(Image({20, 30}, 3, ColourSpace::srgb), options);
        EXPECT_EQ(one.field.labels, std::vector<std::uint8_t>(600));
        EXPECT_EQ(one.field.regions, 1);
        EXPECT_EQ(one.reason, "1 region: the picture has 1 colour");
    }
    EXPECT_EQ(cluster(painted(stripes(2, 10, 30), colours, 0.0)).reason,
              "1 region: of 2, one would have 300 pixels");
}

TEST(ClusterNumber, OneIsAlwaysPossible) {
    const Clustering found = cluster(Image({5, 4}, 2), with(1));
    EXPECT_EQ(found.field.regions, 1);
    EXPECT_EQ(found.field.labels, std::vector<std::uint8_t>(20));
    EXPECT_EQ(found.reason, "");
}

TEST(Cluster, RefusesWhatItCannotDo) {
    const Image image = painted(stripes(2, 4, 5), colours, 0.0);
    const auto work = [](const Image& of, const ClusterOptions& options) {
        return [&of, options] { static_cast<void>(cluster(of, options)); };
    };
    const Image none;
    expect_error(work(none, {}), "it has no pixels");
    for (const int regions : {-1, 0, 33}) {
        const std::string found = "there are to be " + std::to_string(regions) + " regions";
        expect_error(work(image, with(regions)), found);
        ClusterOptions options;
        options.most = regions;
        expect_error(work(image, options), found);
    }
    expect_error(work(image, with(5)), "it has 2 colours, and there are to be 5 regions");
    for (const double divergence : {-0.1, std::nan(""), HUGE_VAL}) {
        ClusterOptions options;
        options.divergence = divergence;
        expect_error(work(image, options), "the divergence is no number from 0 on");
    }
    for (const float value :
         {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity()}) {
        Image broken = image;
        broken.at(1, 2, 3) = value;
        expect_error(work(broken, {}), "a pixel is not a finite number");
    }
    const Image grey({4, 4}, 1);
    expect_error(work(grey, with(1, ClusterSpace::lab)),
                 "it has 1 plane, and the cluster space 'lab' is one of three");
    expect_error(work(grey, with(1, ClusterSpace::rgb)),
                 "it has 1 plane, and the cluster space 'rgb' is one of three");
    Image close({1, 40}, 3, ColourSpace::linear);  // colours that L*a*b* in float32 does not tell apart
    for (float& value : close.values()) value = 1.0F;
    for (int c = 20; c < 40; ++c) close.at(0, 0, c) = std::nextafter(1.0F, 2.0F);
    expect_error(work(close, with(2)),
                 "it has 1 colour that smoothing in float32 leaves apart, and there are to be 2 regions");
}

// The parts.

TEST(ClusterFeatures, LabOfKnownColours) {
    const auto lab = [](const Colour& colour, ColourSpace space) {
        Image image({1, 1}, 3, space);
        for (int p = 0; p < 3; ++p) image.at(p, 0, 0) = colour[static_cast<size_t>(p)];
        const PixelPlanes planes = lab_of(image);
        return Colour{planes.plane(0)[0], planes.plane(1)[0], planes.plane(2)[0]};
    };
    const auto expect = [&](const Colour& colour, ColourSpace space, const Colour& expected) {
        for (size_t p = 0; p < 3; ++p)
            EXPECT_NEAR(lab(colour, space)[p], expected[p], 0.02) << name(space) << p;
    };
    for (const ColourSpace space : {ColourSpace::srgb, ColourSpace::unspecified, ColourSpace::linear}) {
        expect({1.0F, 1.0F, 1.0F}, space, {100.0F, 0.0F, 0.0F});
        expect({1.0F, 0.0F, 0.0F}, space, {53.24F, 80.09F, 67.20F});
        expect({0.0F, 0.0F, 1.0F}, space, {32.30F, 79.19F, -107.86F});
        expect({0.0F, 0.0F, 0.0F}, space, {0.0F, 0.0F, 0.0F});
    }
    expect({0.5F, 0.5F, 0.5F}, ColourSpace::srgb, {53.39F, 0.0F, 0.0F});
    expect({0.5F, 0.5F, 0.5F}, ColourSpace::linear, {76.07F, 0.0F, 0.0F});
    expect({0.02F, 0.02F, 0.02F}, ColourSpace::srgb, {1.40F, 0.0F, 0.0F});
    expect({0.95047F, 1.0F, 1.08883F}, ColourSpace::xyz, {100.0F, 0.0F, 0.0F});
}

TEST(ClusterFeatures, SmoothingIsAGaussianThatKeepsEdges) {
    const Size size{19, 23};
    Image image(size, 1);
    image.at(0, 9, 11) = 1.0F;
    const auto planes_of = [](const Image& of) {
        PixelPlanes planes(1, area(of.size()));
        std::ranges::copy(of.values(), planes.values.begin());
        return planes;
    };
    const PixelPlanes spread = smoothed(planes_of(image), size);
    const auto at = [&](int r, int c) { return static_cast<double>(spread.plane(0)[r * 23 + c]); };
    double sum = 0.0, rows = 0.0, columns = 0.0;
    for (int r = 0; r < 19; ++r)
        for (int c = 0; c < 23; ++c) {
            sum += at(r, c);
            rows += at(r, c) * (r - 9) * (r - 9);
            columns += at(r, c) * (c - 11) * (c - 11);
        }
    EXPECT_NEAR(sum, 1.0, 1e-6);
    EXPECT_NEAR(rows, 1.0, 0.01);
    EXPECT_NEAR(columns, 1.0, 0.01);
    EXPECT_NEAR(at(10, 13) / at(9, 11), std::exp(-2.5), 1e-6);
    for (float& v : image.values()) v = 0.75F;
    for (int c = 0; c < 23; ++c) image.at(0, 0, c) = 0.25F;
    const PixelPlanes edged = smoothed(planes_of(image), size);
    EXPECT_NEAR(edged.plane(0)[10 * 23], 0.75, 1e-6);
    EXPECT_NEAR(edged.plane(0)[0], 0.75 - 0.5 * 0.6995, 1e-3);  // 0.6995: half of the Gaussian and its middle
}

TEST(ClusterSample, PartsHaveThePicturesMean) {
    const Image picture = rock();
    const PixelPlanes planes = cluster_features_of(picture, ClusterSpace::rgb);
    const PixelPlanes sample = cluster_sample(planes, picture.size());
    ASSERT_EQ(sample.pixels, 4096U);
    double inside = 0.0, all = 0.0;  // variance that is left in the parts
    for (int p = 0; p < 3; ++p) {
        double mean = 0.0, square = 0.0, of_sample = 0.0, of_squares = 0.0;
        for (size_t i = 0; i < planes.pixels; ++i) {
            const double v = static_cast<double>(planes.plane(p)[i]);
            mean += v / static_cast<double>(planes.pixels);
            square += v * v / static_cast<double>(planes.pixels);
        }
        for (size_t i = 0; i < sample.pixels; ++i) {
            const double v = static_cast<double>(sample.plane(p)[i]);
            of_sample += v / 4096.0;
            of_squares += v * v / 4096.0;
        }
        EXPECT_NEAR(of_sample, mean, 1e-6);
        inside += square - of_squares;
        all += square - mean * mean;
    }
    EXPECT_LT(inside, 0.01 * all);
    EXPECT_GT(inside, 0.0);
}

TEST(ClusterSample, PartsAreCutWhereTheySpread) {
    PixelPlanes planes(2, 16384);
    for (size_t i = 0; i < planes.pixels; ++i) {
        planes.plane(0)[i] = static_cast<float>(i % 7) * 1e-5F;
        planes.plane(1)[i] = static_cast<float>(i * 4099 % 16384);
    }
    const PixelPlanes sample = cluster_sample(planes, {128, 128});
    std::vector<float> means(sample.plane(1), sample.plane(1) + sample.pixels);
    std::ranges::sort(means);
    for (size_t k = 0; k < means.size(); ++k) EXPECT_EQ(means[k], static_cast<float>(4 * k) + 1.5F);
}

TEST(KMeans, HasMoreMeansThanRegions) {
    // 100 heaps of 5 pixels, far apart.
    PixelPlanes planes(2, 500);
    for (std::size_t i = 0; i < planes.pixels; ++i) {
        planes.plane(0)[i] = static_cast<float>(10 * (i % 10)) + 0.01F * static_cast<float>(i / 100);
        planes.plane(1)[i] = static_cast<float>(10 * (i / 10 % 10)) - 0.02F * static_cast<float>(i / 100);
    }
    const std::vector<std::uint8_t> labels = k_means_labels(planes, k_means_centres(planes, 100, 1), 100, 20);
    std::set<std::uint8_t> found;
    for (std::size_t i = 0; i < planes.pixels; ++i) {
        found.insert(labels[i]);
        EXPECT_LT(labels[i], 100);
    }
    EXPECT_EQ(found.size(), 100U);
    // Starts may leave two heaps together and part another; hardly any.
    std::size_t split = 0;
    for (std::size_t i = 100; i < planes.pixels; ++i) split += labels[i] != labels[i % 100];
    EXPECT_LE(split, 20U);
}

TEST(KMeans, EmptyRegionsGetTheFarthestPixels) {
    PixelPlanes planes(1, 10000);
    for (size_t i = 0; i < 5; ++i) planes.plane(0)[i * 100 + 7] = static_cast<float>(i + 1);
    const std::vector<std::uint8_t> labels = k_means_labels(planes, std::vector<float>(6), 6, 0);
    EXPECT_EQ(std::set<int>(labels.begin(), labels.end()).size(), 6U);
    const std::vector<std::uint8_t> few = k_means_labels(planes, std::vector<float>(9), 9, 0);
    EXPECT_EQ(std::set<int>(few.begin(), few.end()).size(), 6U);
}

TEST(RegionDistances, AreDivergencesOfNormals) {
    const ControlField field = test::patchy_labels({30, 31}, 3);
    const Image image = painted(field, colours, 0.1);
    const PixelPlanes planes = cluster_features_of(image, ClusterSpace::rgb);
    std::array<Eigen::VectorXd, 3> means;
    std::array<Eigen::MatrixXd, 3> covariances;
    Eigen::MatrixXd values(3, static_cast<Eigen::Index>(planes.pixels));
    for (int p = 0; p < 3; ++p)
        for (size_t i = 0; i < planes.pixels; ++i)
            values(p, static_cast<Eigen::Index>(i)) = static_cast<double>(planes.plane(p)[i]);
    const Eigen::VectorXd mean = values.rowwise().mean();
    const double variance = (values.colwise() - mean).squaredNorm() / static_cast<double>(3 * planes.pixels);
    size_t fewest = planes.pixels;
    for (size_t k = 0; k < 3; ++k) {
        means[k] = Eigen::VectorXd::Zero(3);
        covariances[k] = Eigen::MatrixXd::Identity(3, 3) * (1e-4 * variance);
        size_t count = 0;
        for (size_t i = 0; i < planes.pixels; ++i)
            if (field.labels[i] == k) {
                means[k] += values.col(static_cast<Eigen::Index>(i));
                ++count;
            }
        fewest = std::min(fewest, count);
        means[k] /= static_cast<double>(count);
        for (size_t i = 0; i < planes.pixels; ++i) {
            const Eigen::VectorXd x = values.col(static_cast<Eigen::Index>(i)) - means[k];
            if (field.labels[i] == k) covariances[k] += x * x.transpose() / static_cast<double>(count);
        }
    }
    double least = HUGE_VAL;
    for (size_t a = 0; a < 3; ++a)
        for (size_t b = 0; b < a; ++b) {
            const Eigen::MatrixXd p = covariances[a].inverse(), q = covariances[b].inverse();
            const Eigen::VectorXd apart = means[a] - means[b];
            least = std::min(least, 0.25 * ((p * covariances[b]).trace() + (q * covariances[a]).trace() -
                                            6.0 + apart.dot((p + q) * apart)));
        }
    const RegionDistances found = region_distances(planes, field.labels, 3);
    EXPECT_EQ(found.fewest_pixels, fewest);
    EXPECT_NEAR(found.least, least, 1e-9 * least);
    EXPECT_EQ(region_distances(planes, field.labels, 4).fewest_pixels, 0U);
    EXPECT_EQ(region_distances(planes, field.labels, 4).least, 0.0);
}

}  // namespace
}  // namespace btfield

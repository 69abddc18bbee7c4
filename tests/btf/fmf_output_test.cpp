// host/btf/fmf_output.cpp and picture_factors.cpp.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "btfield/btf_output.hpp"
#include "btfield/btf_set.hpp"
#include "btfield/error.hpp"
#include "btfield/threads.hpp"
#include "host/base/eigen.hpp"
#include "host/pictures/colour.hpp"
#include "tests/temporary_folder.hpp"

namespace btfield {
namespace {

namespace fs = std::filesystem;
using test::TemporaryFolder;

constexpr double degree = 3.14159265358979 / 180.0;

/// Noise in every direction; one of 4 x 5 pictures is missing, and a light was moved.
class Noise : public BtfSource {
  public:
    explicit Noise(Size size = {3, 5}, int planes = 3, float scale = 1.0F) : scale_(scale) {
        d_.format = "noise";
        d_.size = size;
        d_.planes = planes;
        d_.space = planes == 3 ? ColourSpace::linear : ColourSpace::unspecified;
        for (int v = 0; v < 4; ++v) d_.views.push_back({20.0 * degree * v, v == 0 ? 0.0 : 200.0 * degree});
        for (int l = 0; l < 5; ++l) d_.lights.push_back({18.0 * degree * l, l == 0 ? 0.0 : 300.0 * degree});
        for (int v = 0; v < 4; ++v)
            for (int l = 0; l < 5; ++l) d_.true_lights.push_back(d_.lights[static_cast<std::size_t>(l)]);
        d_.present.assign(20, 1);
        d_.present[8] = 0;
        d_.height = Image(size, 1);
        d_.height.at(0, 1, 2) = 2.5F;
    }
    [[nodiscard]] const BtfDescription& description() const override { return d_; }
    [[nodiscard]] Image picture(int view, int light) const override {
        Image image(d_.size, d_.planes, d_.space);
        std::uint32_t state = static_cast<std::uint32_t>(1000 * view + light);
        for (float& value : image.values()) {
            state = state * 1664525U + 1013904223U;
            // A few strong components, and noise.
            const auto at = static_cast<double>(&value - image.values().data());
            const double strong = (1.0 + view) * std::cos(0.37 * at) + light * std::sin(0.11 * at * at);
            value = scale_ * static_cast<float>(4.0 + 0.5 * strong + 0.3 * (state >> 8U) / 16777216.0);
        }
        return image;
    }
    BtfDescription d_;

  private:
    float scale_;
};

struct Written {
    BtfWriteReport report;
    BtfSet set;
};

Written written(const fs::path& to, const BtfSet& set, int components, PixelType type) {
    BtfWriteOptions options;
    options.format = BtfFormat::fmf;
    options.type = type;
    options.components = components;
    const BtfWriteReport report = write_btf(to, set, options);
    EXPECT_EQ(report.bytes, fs::file_size(to));
    return {report, BtfSet::open(to)};
}

/// Root mean square difference of all pictures, to that of the first set's values.
double difference(const BtfSet& a, const BtfSet& b) {
    EXPECT_EQ(a.pictures(), b.pictures());
    double sum = 0.0, all = 0.0;
    for (const BtfPair& pair : a.pictures()) {
        const Image one = a.picture(pair.view, pair.light), other = b.picture(pair.view, pair.light);
        for (std::size_t i = 0; i < one.values().size(); ++i) {
            const auto value = static_cast<double>(one.values()[i]);
            sum += std::pow(value - static_cast<double>(other.values()[i]), 2);
            all += value * value;
        }
    }
    return std::sqrt(sum / all);
}

/// All pictures as a matrix, rows picture by picture and colour by colour.
Eigen::MatrixXd matrix_of(const BtfSet& set) {
    const std::vector<BtfPair> pairs = set.pictures();
    Eigen::MatrixXd a(static_cast<Eigen::Index>(pairs.size()) * set.planes(),
                      static_cast<Eigen::Index>(area(set.size())));
    Eigen::Index row = 0;
    for (const BtfPair& pair : pairs) {
        const Image image = set.picture(pair.view, pair.light);
        for (int c = 0; c < set.planes(); ++c, ++row)
            for (Eigen::Index x = 0; x < a.cols(); ++x)
                a(row, x) = static_cast<double>(image.plane(c)[static_cast<std::size_t>(x)]);
    }
    return a;
}

TEST(FmfOutput, AllComponentsAreThePictures) {
    const TemporaryFolder folder;
    for (const Size size : {Size{3, 5}, Size{9, 11}}) {  // fewer pixels than rows, and more
        SCOPED_TRACE(size.width);
        const BtfSet set(std::make_shared<Noise>(size));
        const int most = std::min(size.width * size.height, 19 * 3);
        const Written single = written(folder / "f.btf", set, 1000, PixelType::float32);
        EXPECT_EQ(single.report.components, most);
        EXPECT_LE(difference(set, single.set), 1e-6);
        EXPECT_LE(single.report.relative_error, 1e-6);
        const Written half = written(folder / "h.btf", set, 1000, PixelType::half);
        // Half a step of 11 bits in both factors.
        EXPECT_LE(difference(set, half.set), 0x1p-10);
        EXPECT_NEAR(half.report.relative_error, difference(set, half.set), 0.02 * half.report.relative_error);
        EXPECT_LT(half.report.bytes, single.report.bytes);
    }
}

TEST(FmfOutput, WhatIsKnownOfTheSetComesBack) {
    const TemporaryFolder folder;
    const auto source = std::make_shared<Noise>();
    source->d_.true_lights[5 + 3] = {50.0 * degree, 310.0 * degree};
    source->d_.light_cosine = false;
    const BtfSet set(source), back = written(folder / "a.btf", set, 3, PixelType::half).set;
    EXPECT_EQ(back.format(), "ubo2014-fmf");
    EXPECT_EQ(back.space(), ColourSpace::linear);
    EXPECT_FALSE(back.description().light_cosine);
    EXPECT_EQ(back.description().height.at(0, 1, 2), 2.5F);
    EXPECT_EQ(back.views().size(), 4U);
    ASSERT_EQ(back.pictures().size(), 19U);
    std::vector<BtfDirection> lights, expected;
    for (const BtfPair& pair : set.pictures()) expected.push_back(set.light(pair.view, pair.light));
    for (const BtfPair& pair : back.pictures()) lights.push_back(back.light(pair.view, pair.light));
    for (const BtfDirection& light : expected)
        EXPECT_TRUE(std::ranges::any_of(
            lights, [&](const BtfDirection& l) { return angle_between(l, light) < 1e-6; }));
    const auto spectra = std::make_shared<Noise>(Size{3, 5}, 5);
    spectra->d_.names = {"400", "450", "500", "550", "600"};
    const BtfSet five = written(folder / "b.btf", BtfSet(spectra), 100, PixelType::float32).set;
    EXPECT_EQ(five.description().names, spectra->d_.names);
    EXPECT_LE(difference(BtfSet(spectra), five), 1e-6);
}

TEST(FmfOutput, XyzBecomesRgb) {
    const TemporaryFolder folder;
    const auto xyz = std::make_shared<Noise>();
    xyz->d_.space = ColourSpace::xyz;
    xyz->d_.white = 100.0;
    const BtfSet set(xyz), back = written(folder / "a.btf", set, 1000, PixelType::float32).set;
    Image expected = set.picture(1, 1);
    for (float& value : expected.values()) value /= 100.0F;
    detail::convert(expected, ColourSpace::linear);
    const Image read = back.picture(1, 1);
    for (std::size_t i = 0; i < read.values().size(); ++i)
        EXPECT_NEAR(read.values()[i], expected.values()[i], 1e-6);
}

TEST(FmfOutput, FewComponentsAreTheBest) {
    const TemporaryFolder folder;
    const BtfSet set(std::make_shared<Noise>(Size{9, 11}));
    const Eigen::MatrixXd a = matrix_of(set);
    const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(Eigen::MatrixXd(a * a.transpose()));
    const Eigen::VectorXd squares = solver.eigenvalues().reverse();
    for (const int n : {1, 2, 5, 12}) {
        SCOPED_TRACE(n);
        const double best = std::sqrt(squares.tail(squares.size() - n).sum() / squares.sum());
        const Written some = written(folder / "a.btf", set, n, PixelType::float32);
        // Noise, all of whose components are about as large, is found least well.
        EXPECT_GE(some.report.relative_error, 0.9999 * best);
        EXPECT_LE(some.report.relative_error, 1.005 * best);
        EXPECT_NEAR(difference(set, some.set), some.report.relative_error, 1e-4 * best);
    }
}

/// What a reader computes of the numbers at the file's end, in the order that docs/btf.md tells.
TEST(FmfOutput, PicturesAreProductsOfWhatTheFileHolds) {
    const TemporaryFolder folder;
    constexpr std::size_t n = 4, rows = 57, pixels = 15;
    const BtfSet back =
        written(folder / "a.btf", BtfSet(std::make_shared<Noise>()), n, PixelType::float32).set;
    const std::string bytes = test::bytes_of(folder / "a.btf");
    std::vector<float> factors((1 + rows + pixels) * n);
    std::memcpy(factors.data(), bytes.data() + bytes.size() - factors.size() * sizeof(float),
                factors.size() * sizeof(float));
    const float* const u = factors.data() + n;
    const float* const v = u + rows * n;
    std::size_t row = 0;
    for (const BtfPair& pair : back.pictures()) {
        const Image image = back.picture(pair.view, pair.light);
        for (int c = 0; c < 3; ++c, ++row)
            for (std::size_t x = 0; x < pixels; ++x) {
                float sum = 0.0F;
                for (std::size_t k = 0; k < n; ++k) sum += u[row * n + k] * v[x * n + k];
                ASSERT_EQ(image.plane(c)[x], sum);
            }
    }
    // Singular values, the lengths of the second factor's columns.
    for (std::size_t k = 0; k < n; ++k) {
        double length = 0.0;
        for (std::size_t x = 0; x < pixels; ++x) length += std::pow(static_cast<double>(v[x * n + k]), 2);
        EXPECT_NEAR(std::sqrt(length), static_cast<double>(factors[k]),
                    1e-5 * static_cast<double>(factors[0]));
    }
}

TEST(FmfOutput, ThreadsDoNotMatter) {
    const TemporaryFolder folder;
    const BtfSet set(std::make_shared<Noise>(Size{40, 40}));
    limit_threads(1);
    static_cast<void>(written(folder / "one.btf", set, 6, PixelType::half));
    limit_threads(4);
    static_cast<void>(written(folder / "more.btf", set, 6, PixelType::half));
    limit_threads(0);
    EXPECT_EQ(test::bytes_of(folder / "one.btf"), test::bytes_of(folder / "more.btf"));
}

TEST(FmfOutput, WhatCannotBeWrittenLeavesNothing) {
    const TemporaryFolder folder;
    BtfWriteOptions options;
    options.format = BtfFormat::fmf;
    const BtfSet bright(std::make_shared<Noise>(Size{3, 5}, 3, 1e5F));
    try {
        static_cast<void>(write_btf(folder / "a.btf", bright, options));
        ADD_FAILURE() << "halves end at 65504";
    } catch (const InputError& error) {
        EXPECT_EQ(error.remedy(), "write type float");
    }
    options.components = 0;
    EXPECT_THROW(static_cast<void>(write_btf(folder / "a.btf", bright, options)), InputError);
    options.components = 1;
    options.exposure = 2.0;
    EXPECT_THROW(static_cast<void>(write_btf(folder / "a.btf", bright, options)), InputError);
    EXPECT_TRUE(folder.names().empty());
    // Flat black: components of nothing.
    options.exposure = 1.0;
    options.components = 7;
    const BtfSet black(std::make_shared<Noise>(Size{3, 5}, 3, 0.0F));
    EXPECT_EQ(write_btf(folder / "a.btf", black, options).relative_error, 0.0);
    EXPECT_EQ(BtfSet::open(folder / "a.btf").picture(0, 0).at(0, 1, 1), 0.0F);
}

}  // namespace
}  // namespace btfield

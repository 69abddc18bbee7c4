// host/compound/regional_covariance.cpp.

#include "host/compound/regional_covariance.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "tests/device_cases.hpp"
#include "tests/label_cases.hpp"
#include "tests/reference/lag_covariance.hpp"

namespace btfield {

using namespace detail;

namespace {

using std::size_t;

/// One region's mean values and covariances as theory 18.4 tells, every pixel asked, float64.
class Expected {
  public:
    Expected(const Image& image, const ControlField& field, int region)
        : image_(&image), field_(&field), region_(region) {
        for (const std::uint8_t label : field.labels) pixels_ += label == region ? 1.0 : 0.0;
        for (int p = 0; p < image.planes(); ++p) {
            double sum = 0.0;
            for (size_t i = 0; i < field.labels.size(); ++i)
                if (field.labels[i] == region) sum += static_cast<double>(image.plane(p)[i]);
            means_.push_back(pixels_ > 0.0 ? sum / pixels_ : 0.0);
        }
    }
    [[nodiscard]] double mean(int p) const { return means_[static_cast<size_t>(p)]; }
    [[nodiscard]] double covariance(int i, int j, Offset s, PairCount count) const {
        double sum = 0.0, pairs = 0.0;
        for (int r = 0; r < image_->height(); ++r)
            for (int c = 0; c < image_->width(); ++c) {
                const int row = reference::wrapped(r + s.row, image_->height());
                const int column = reference::wrapped(c + s.column, image_->width());
                if (!inside(r, c) || !inside(row, column)) continue;
                sum += (static_cast<double>(image_->at(i, r, c)) - mean(i)) *
                       (static_cast<double>(image_->at(j, row, column)) - mean(j));
                pairs += 1.0;
            }
        if (pairs == 0.0) return 0.0;
        return sum / (count == PairCount::pairs ? pairs : pixels_);
    }

  private:
    [[nodiscard]] bool inside(int r, int c) const {
        return field_->labels[static_cast<size_t>(r * image_->width() + c)] == region_;
    }
    const Image* image_;
    const ControlField* field_;
    int region_;
    double pixels_ = 0.0;
    std::vector<double> means_;
};

double largest(const Image& image) {
    double most = 0.0;
    for (const float value : image.values()) most = std::max(most, std::abs(static_cast<double>(value)));
    return most;
}

void expect_reference(const Image& image, const ControlField& field, Offset box, PairCount count) {
    const std::vector<LagCovariance> found =
        regional_covariances(image, field.labels, field.regions, box, count);
    ASSERT_EQ(found.size(), static_cast<size_t>(field.regions));
    // Deviations and the mean that is taken off are rounded, of values up to `most` and twice that, and each
    // product of two once more: 2 · (1 + 2) · 2 + 4 roundings of most².
    const double most = largest(image), bound = 16 * test::unit_roundoff * most * most;
    for (int k = 0; k < field.regions; ++k) {
        const LagCovariance& own = found[static_cast<size_t>(k)];
        EXPECT_EQ(own.size(), image.size());
        EXPECT_EQ(own.planes(), image.planes());
        EXPECT_EQ(own.box(), box);
        const Expected expected(image, field, k);
        for (int i = 0; i < image.planes(); ++i) {
            EXPECT_NEAR(own.mean()[static_cast<size_t>(i)], expected.mean(i), 1e-12 * most);
            for (int j = 0; j < image.planes(); ++j)
                for (int row = -box.row; row <= box.row; ++row)
                    for (int column = -box.column; column <= box.column; ++column)
                        ASSERT_NEAR(own(i, j, {row, column}), expected.covariance(i, j, {row, column}, count),
                                    bound)
                            << "region " << k << ", planes " << i << ", " << j << ", lag " << row << ", "
                            << column;
        }
    }
}

TEST(RegionalCovariance, IsThatOfPairsInsideTheRegion) {
    // Boxes beyond the sides wrap.
    for (const auto& [size, box] :
         {std::pair{Size{13, 11}, Offset{3, 2}}, std::pair{Size{4, 5}, Offset{6, 7}},
          std::pair{Size{1, 9}, Offset{0, 4}}, std::pair{Size{8, 16}, Offset{}}})
        for (const int planes : {1, 3})
            for (const int regions : {1, 4})
                for (const PairCount count : {PairCount::pairs, PairCount::pixels}) {
                    SCOPED_TRACE(test::text(size) + ", d = " + std::to_string(planes));
                    expect_reference(test::mixed_texture(size, planes, 7), test::patchy_labels(size, regions),
                                     box, count);
                }
}

TEST(RegionalCovariance, OfOneRegionIsThePictures) {
    const Image image = test::mixed_texture({23, 18}, 2, 3);
    const std::vector<std::uint8_t> labels(area(image.size()), 0);
    const LagCovariance whole = lag_covariance(image, {4, 5});
    const double bound = 16 * test::unit_roundoff * largest(image) * largest(image);
    for (const PairCount count : {PairCount::pairs, PairCount::pixels}) {
        const LagCovariance own = regional_covariances(image, labels, 1, {4, 5}, count).front();
        for (int row = -4; row <= 4; ++row)
            for (int column = -5; column <= 5; ++column)
                for (int i = 0; i < 2; ++i)
                    for (int j = 0; j < 2; ++j)
                        EXPECT_NEAR(own(i, j, {row, column}), whole(i, j, {row, column}), bound);
    }
}

TEST(RegionalCovariance, LagsWithoutPairsAndRegionsWithoutPixelsHaveNone) {
    // Region 1 is every third column, region 2 nowhere.
    const Image image = test::random_image({6, 12}, 1, 2.0F);
    ControlField field{image.size(), 3, {}};
    for (int i = 0; i < 72; ++i) field.labels.push_back(i % 3 == 0 ? 1 : 0);
    for (const PairCount count : {PairCount::pairs, PairCount::pixels}) {
        expect_reference(image, field, {1, 3}, count);
        const std::vector<LagCovariance> found = regional_covariances(image, field.labels, 3, {1, 3}, count);
        EXPECT_EQ(found[1](0, 0, {1, 2}), 0.0);
        EXPECT_GT(found[1](0, 0, {}), 0.0);
        EXPECT_EQ(found[2](0, 0, {}), 0.0);
        EXPECT_EQ(found[2].mean()[0], 0.0);
    }
}

}  // namespace
}  // namespace btfield

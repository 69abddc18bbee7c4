// host/btf/picture_features.cpp.

#include "host/btf/picture_features.hpp"

#include <gtest/gtest.h>

#include <vector>

#include "tests/plane_statistics.hpp"

namespace btfield {
namespace {

TEST(PictureFeatures, HistogramsAreThoseOfLab) {
    // One pixel each of black, mid grey, white, red, green and blue, many times.
    const float colours[6][3] = {
        {0, 0, 0}, {0.184187F, 0.184187F, 0.184187F}, {1, 1, 1}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
    const double lab[6][3] = {{0, 0, 0},
                              {50, 0, 0},
                              {100, 0, 0},
                              {53.24, 80.09, 67.2},
                              {87.73, -86.18, 83.18},
                              {32.3, 79.19, -107.86}};
    Image image({6, 6}, 3, ColourSpace::linear);
    for (int p = 0; p < 3; ++p)
        for (int r = 0; r < 6; ++r)
            for (int c = 0; c < 6; ++c) image.at(p, r, c) = 2.5F * colours[c][p];
    ASSERT_EQ(detail::feature_count(image), 192);
    std::vector<float> features(192);
    detail::put_features(image, 2.5, features);
    for (int h = 0; h < 3; ++h)
        for (int bin = 0; bin < 64; ++bin) {
            // Values within 0.05 of an edge may fall on either side.
            int least = 0, most = 0;
            for (const auto& colour : lab) {
                const double edge = h == 0 ? 100.0 * (bin + 1) / 64 : -112.0 + 224.0 * (bin + 1) / 64;
                least += colour[h] < edge - 0.05 || bin == 63;
                most += colour[h] < edge + 0.05 || bin == 63;
            }
            const float found = features[static_cast<std::size_t>(64 * h + bin)];
            EXPECT_GE(found, static_cast<float>(least) / 6.0F - 1e-5F) << h << " " << bin;
            EXPECT_LE(found, static_cast<float>(most) / 6.0F + 1e-5F) << h << " " << bin;
        }
    const detail::PictureMoments moments = detail::moments_of(image);
    EXPECT_NEAR(moments.mean[0], 2.5 * (0.184187 + 2) / 6, 1e-6);
    EXPECT_NEAR(moments.deviation[0], test::statistics_of(image.plane(0)).deviation, 1e-6);
}

TEST(PictureFeatures, LargePicturesAreSampled) {
    Image image({300, 400}, 1);
    for (int r = 0; r < 300; ++r)
        for (int c = 0; c < 400; ++c) image.at(0, r, c) = static_cast<float>(c % 50) / 50.0F;
    std::vector<float> features(64);
    detail::put_features(image, 1.0, features);
    // L* = 50 at 0.184: values 0 to 9 of 50 are darker.
    EXPECT_NEAR(features[31], 0.2, 0.02);
    EXPECT_EQ(features[63], 1.0F);
    image.at(0, 0, 0) = -3.0F;
    EXPECT_NEAR(detail::moments_of(image).mean[0], 0.49, 1e-6);
}

}  // namespace
}  // namespace btfield

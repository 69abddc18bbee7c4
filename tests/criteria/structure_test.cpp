#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "btfield/criteria.hpp"
#include "btfield/error.hpp"
#include "btfield/fit.hpp"
#include "btfield/image_io.hpp"
#include "btfield/roller.hpp"
#include "btfield/synthesis.hpp"
#include "tests/device_cases.hpp"
#include "tests/places.hpp"

namespace btfield {
namespace {

const std::string data = test::data_folder();

TEST(Structure, OfAPictureWithItselfIsNone) {
    const Image cork = read_picture(data + "/cork.png").image;
    EXPECT_EQ(structure_distance(cork, cork), 0.0);
    // Units do not matter: powers of 2 leave every digit.
    Image other = cork;
    for (float& v : other.values()) v *= 4.0F;
    EXPECT_NEAR(structure_distance(other, other.crop(0, 0, {200, 210})),
                structure_distance(cork, cork.crop(0, 0, {200, 210})), 1e-6);
}

TEST(Structure, OrdersWhatKeepsShapes) {
    Device device;
    std::mt19937 generator(3);
    for (const char* name : {"bark", "rock"}) {
        SCOPED_TRACE(name);
        const Image sample = read_picture(data + "/" + name + ".png").image;
        const Image quilt = apply(Roller(device, std::span(&sample, 1)).quilt(sample.size()), sample);
        const TextureModel model = fit(device, sample, {});
        const Image field = Synthesiser(device, model, sample.size()).synthesise(1);
        Image grain = sample;  // the same histogram, no neighbours
        std::vector<std::size_t> order(area(sample.size()));
        for (std::size_t i = 0; i < order.size(); ++i) order[i] = i;
        std::shuffle(order.begin(), order.end(), generator);
        for (int p = 0; p < sample.planes(); ++p)
            for (std::size_t i = 0; i < order.size(); ++i) grain.plane(p)[i] = sample.plane(p)[order[i]];
        const double of_quilt = structure_distance(sample, quilt),
                     of_field = structure_distance(sample, field),
                     of_grain = structure_distance(sample, grain);
        EXPECT_LT(1.3 * of_quilt, of_field);
        EXPECT_LT(1.3 * of_field, of_grain);
    }
}

/// The same number of patches of two normal fields of deviations 1 and s: along every direction the distance
/// of transport is E|z| |s − 1|.
TEST(Structure, OfNormalGrainIsKnown) {
    const Image a = test::random_image({512, 512}, 1, 0.0F, 1);
    Image b = test::random_image({512, 512}, 1, 0.0F, 2);
    for (float& v : b.values()) v *= 1.5F;
    // Both kinds of projections scale with s; contrast has a mean beside its spread, so its term is larger:
    // its mean, √(2/π) Σ|u|, over its deviation, √(1 − 2/π) ‖u‖ with ‖u‖ = 1, times 0.5. Directions have
    // Σ|u| = √(2/π) 8 where they are white; smooth ones the same, being normal too.
    const double of_patches = 0.5 * std::sqrt(2.0 / M_PI);
    const double of_contrast = 0.5 * (2.0 / M_PI) * 8.0 / std::sqrt(1.0 - 2.0 / M_PI);
    const double expected = 0.5 * (of_patches + of_contrast);
    // 0.5 of the mean's error over 128 directions and 4096 patches, and smooth directions' own spread.
    EXPECT_NEAR(structure_distance(a, b), expected, 0.06 * expected);
}

TEST(Structure, SmallPicturesHaveNone) {
    EXPECT_TRUE(
        std::isnan(structure_distance(test::random_image({7, 40}, 1), test::random_image({40, 40}, 1))));
    EXPECT_GT(structure_distance(test::random_image({8, 8}, 3), test::random_image({9, 11}, 3, 0.0F, 2)),
              0.0);
    EXPECT_THROW((void)structure_distance(test::random_image({20, 20}, 3), test::random_image({20, 20}, 1)),
                 InputError);
    EXPECT_THROW((void)structure_distance(Image({20, 20}, 1), test::random_image({20, 20}, 1)), InputError);
}

}  // namespace
}  // namespace btfield

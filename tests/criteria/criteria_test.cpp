#include "btfield/criteria.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include "btfield/error.hpp"
#include "tests/device_cases.hpp"

namespace btfield {
namespace {

// All expected values below are small integers and ratios of them, and so are all sums on the way: what
// remains is the rounding of float64.
constexpr double rounding = 1e-12;

void fill(Image& image, int plane, auto&& value) {
    for (int r = 0; r < image.height(); ++r) {
        for (int c = 0; c < image.width(); ++c) image.at(plane, r, c) = static_cast<float>(value(r, c));
    }
}

// Mean 0, variance 1, and at odd lags: −1 along both axes for checks; −1 along columns, 1 along rows for
// stripes.
double checks(int r, int c) {
    return (r + c) % 2 == 0 ? 1.0 : -1.0;
}
double stripes(int, int c) {
    return c % 2 == 0 ? 1.0 : -1.0;
}

Image one_plane(Size size, auto&& value) {
    Image image(size, 1);
    fill(image, 0, value);
    return image;
}

std::string message(const Image& a, const Image& b) {
    try {
        static_cast<void>(compare(a, b));
    } catch (const InputError& error) {
        return error.what();
    }
    return "no error";
}

TEST(criteria, equal_pictures_have_no_error) {
    const Image image = one_plane({32, 20}, [](int r, int c) { return (r * 7 + c * c) % 11; });
    const Comparison result = compare(image, image);
    EXPECT_EQ(result.lag_covariance_error, 0.0);
    EXPECT_EQ(result.spectral_covariance_error, 0.0);
    ASSERT_EQ(result.planes.size(), 1U);
    EXPECT_EQ(result.planes[0].std_ratio, 1.0);
    EXPECT_EQ(result.planes[0].mean[0], result.planes[0].mean[1]);
}

TEST(criteria, scale_and_offset) {
    const Image a = one_plane({4, 4}, checks);
    const Image b = one_plane({4, 4}, [](int r, int c) { return 2.0 * checks(r, c) + 3.0; });
    const Comparison result = compare(a, b);
    EXPECT_NEAR(result.planes[0].mean[0], 0.0, rounding);
    EXPECT_NEAR(result.planes[0].mean[1], 3.0, rounding);
    EXPECT_NEAR(result.planes[0].std[0], 1.0, rounding);
    EXPECT_NEAR(result.planes[0].std[1], 2.0, rounding);
    EXPECT_NEAR(result.planes[0].std_ratio, 2.0, rounding);
    // Every covariance is ±1 in A and ±4 in B.
    EXPECT_NEAR(result.lag_covariance_error, 3.0, rounding);
    EXPECT_NEAR(result.spectral_covariance_error, 3.0, rounding);
    // The error is relative to the first: ±4 against ±1 is 3/4 of the reference.
    EXPECT_NEAR(compare(b, a).lag_covariance_error, 0.75, rounding);
    EXPECT_NEAR(compare(b, a).spectral_covariance_error, 0.75, rounding);
}

TEST(criteria, quantile_errors_are_in_units_of_the_reference) {
    const Image a = one_plane({4, 4}, checks);
    // Half of the values at −1 and half at 1 against the same doubled and moved by 3: differences 2 and 4.
    const Image b = one_plane({4, 4}, [](int r, int c) { return 2.0 * checks(r, c) + 3.0; });
    EXPECT_NEAR(quantile_errors(a, b).at(0), std::sqrt(10.0), rounding);
    EXPECT_NEAR(quantile_errors(b, a).at(0), std::sqrt(10.0) / 2.0, rounding);
    // Places do not matter, nor does the number of pixels; 3 of 8 values at 1 against 4 of 8: a step of 2 on
    // 1/8.
    const Image rows = one_plane({6, 2}, [](int r, int) { return r < 3 ? -1.0 : 1.0; });
    EXPECT_EQ(quantile_errors(a, rows).at(0), 0.0);
    const Image fewer = one_plane({8, 1}, [](int r, int) { return r < 5 ? -1.0 : 1.0; });
    EXPECT_NEAR(quantile_errors(a, fewer).at(0), std::sqrt(4.0 / 8.0), rounding);
    EXPECT_THROW(static_cast<void>(quantile_errors(one_plane({4, 4}, [](int, int) { return 1.0; }), a)),
                 InputError);
}

TEST(criteria, lags_are_averaged) {
    // 4 x 4: h = 1 only. (0,0) and (0,1) agree; (1,0), (1,1), (1,−1) differ by 2.
    EXPECT_NEAR(compare(one_plane({4, 4}, checks), one_plane({4, 4}, stripes)).lag_covariance_error,
                6.0 / 5.0, rounding);
    // 8 x 8: h = 2 joins, and both patterns repeat every two pixels.
    EXPECT_NEAR(compare(one_plane({8, 8}, checks), one_plane({8, 8}, stripes)).lag_covariance_error,
                6.0 / 9.0, rounding);
    EXPECT_NEAR(compare(one_plane({4, 4}, checks), one_plane({4, 4}, stripes)).spectral_covariance_error, 0.0,
                rounding);
}

TEST(criteria, sizes_may_differ_and_the_common_lags_count) {
    const Image large = one_plane({64, 40}, checks);
    const Image wide = one_plane({4, 80}, stripes);  // fits h = 1 only, by its height
    EXPECT_NEAR(compare(large, wide).lag_covariance_error, 6.0 / 5.0, rounding);
    EXPECT_NEAR(compare(wide, large).lag_covariance_error, 6.0 / 5.0, rounding);
    // Each of the two fits h = 2 in one direction; both together fit h = 1.
    EXPECT_NEAR(compare(one_plane({64, 4}, checks), one_plane({4, 64}, stripes)).lag_covariance_error,
                6.0 / 5.0, rounding);
}

TEST(criteria, planes_are_averaged_and_crossed) {
    Image a({4, 4}, 2);
    fill(a, 0, checks);
    fill(a, 1, stripes);
    Image b({4, 4}, 2);
    fill(b, 0, checks);
    fill(b, 1, checks);
    const Comparison result = compare(a, b);
    // Plane 0 agrees at all five lags, plane 1 at two.
    EXPECT_NEAR(result.lag_covariance_error, 6.0 / 10.0, rounding);
    // C^A(0) is the identity, C^B(0) is all ones: √2 over √2.
    EXPECT_NEAR(result.spectral_covariance_error, 1.0, rounding);
}

TEST(criteria, large_mean_does_not_hide_the_variance) {
    const auto lifted = [](double scale) {
        return [scale](int r, int c) { return 4096.0 + scale * checks(r, c); };
    };
    const Comparison result = compare(one_plane({64, 64}, lifted(0.5)), one_plane({64, 64}, lifted(0.25)));
    EXPECT_NEAR(result.planes[0].std[0], 0.5, rounding);
    EXPECT_NEAR(result.planes[0].std_ratio, 0.5, rounding);
}

TEST(criteria, refuses_what_cannot_be_compared) {
    const Image grey = one_plane({8, 8}, checks);
    EXPECT_EQ(
        message(grey, Image({8, 8}, 3)),
        "compare two pictures: the first has 1 plane, the second 3; give pictures with the same number of "
        "planes");
    EXPECT_EQ(message(one_plane({8, 8}, [](int, int) { return 0.1; }), grey),
              "compare two pictures: the first is constant; give a reference that varies");
    EXPECT_EQ(message(grey, Image()), "compare two pictures: one of them is empty; give two pictures");
    EXPECT_EQ(message(Image(), grey), "compare two pictures: one of them is empty; give two pictures");
}

TEST(criteria, a_constant_second_picture_is_an_answer) {
    const Comparison result =
        compare(one_plane({4, 4}, checks), one_plane({4, 4}, [](int, int) { return 0.5; }));
    EXPECT_NEAR(result.planes[0].std_ratio, 0.0, rounding);
    EXPECT_NEAR(result.lag_covariance_error, 1.0, rounding);
}

TEST(criteria, constant_planes_of_the_reference_do_not_count) {
    Image a({32, 32}, 2), b({32, 32}, 2);
    const Image one = one_plane({32, 32}, checks), other = test::mixed_texture({32, 32}, 1, 3);
    std::ranges::copy(one.plane(0), a.plane(1).begin());
    std::ranges::copy(other.plane(0), b.plane(1).begin());
    const Comparison both = compare(a, b), single = compare(one, other);
    EXPECT_TRUE(std::isnan(both.planes[0].std_ratio));
    EXPECT_NEAR(both.lag_covariance_error, single.lag_covariance_error, rounding);
    EXPECT_TRUE(std::isnan(quantile_errors(a, b)[0]));
    EXPECT_EQ(quantile_errors(a, b)[1], quantile_errors(one, other)[0]);
    EXPECT_EQ(structure_distance(a, b), structure_distance(one, other));
}

TEST(criteria, not_a_number_stays_one) {
    Image bad = one_plane({8, 8}, checks);
    bad.at(0, 3, 3) = std::numeric_limits<float>::quiet_NaN();
    const Comparison result = compare(one_plane({8, 8}, checks), bad);
    EXPECT_TRUE(std::isnan(result.lag_covariance_error));
    EXPECT_TRUE(std::isnan(result.planes[0].std_ratio));
}

}  // namespace
}  // namespace btfield

// host/rendering/lit_shape.cpp, lit_table.cpp, sphere_frame.cpp and kernels/rendering/lit_shape.cl.

#include "host/rendering/lit_shape.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "host/rendering/lit_table.hpp"
#include "tests/device_cases.hpp"
#include "tests/reference/lit_shape.hpp"
#include "tests/rendering_cases.hpp"

namespace btfield {
namespace {

using test::degree;

/// Rays are halved to 1/128 of a texel, and what they hit differs by as much of a texel times the planes'
/// slopes, which are below 1 a texel, times weights below 0.1: 1e-3 of white. Longitudes of float32 are exact
/// to 1e-6 of a turn.
void expect_near(const Image& found, int row, int column, const std::vector<double>& truth) {
    for (int c = 0; c < found.planes(); ++c)
        EXPECT_NEAR(static_cast<double>(found.at(c, row, column)), truth[static_cast<std::size_t>(c)], 1.5e-3)
            << "row " << row << ", column " << column << ", colour " << c;
}

void expect_plane(const BtfScene& scene, const BtfDirection& view, Size tile) {
    const Image surface = test::smooth_surface(tile, 5);
    const LitShape shape(test::default_device().impl(), surface, 2);
    const PictureWeights weights{
        {0.5, 0.4}, {0.95, 1.0}, {0.1, -0.05, 0.02, 0.03, -0.01, 0.05, 0.05, -0.1, 0.02, 0.0}};
    const Vector3 light = BtfDirection{50.0 * degree, 1.0}.vector();
    const Image found = shape.plane(scene, {camera_frame(view), light, 75.0 * degree}, {1, 1, {weights}});
    ASSERT_EQ(found.size(), scene.size);
    for (int r = 0; r < scene.size.height; ++r)
        for (int c = 0; c < scene.size.width; ++c)
            expect_near(found, r, c, reference::plane_pixel(surface, scene, view, light, weights, r, c));
}

/// Entries that differ from place to place, where the view and the light are.
LitTable varied_table(int longitudes, int latitudes) {
    LitTable table{longitudes, latitudes, {}, {0.02, 0.03}};
    for (int j = 0; j < latitudes; ++j)
        for (int i = 0; i < longitudes; ++i) {
            const double a = 2.0 * std::numbers::pi * i / longitudes, b = static_cast<double>(j) / latitudes;
            table.entries.push_back(
                {{0.4 + 0.1 * b, 0.3 + 0.1 * std::sin(a)},
                 {0.9 + 0.1 * b, 1.0},
                 {0.1 * std::cos(a), -0.05, 0.1 * b, 0.03, 0.01, 0.05, 0.05 * std::sin(a), -0.1, 0.02, 0.0}});
        }
    return table;
}

void expect_sphere(const BtfScene& scene, const BtfDirection& view, const BtfDirection& light, Size tile) {
    // So flat that no ray grazes an edge, of which float32 and float64 may see either side.
    const Image surface = test::smooth_surface(tile, 5, 0.5);
    const LitShape shape(test::default_device().impl(), surface, 2);
    const LitTable table = varied_table(12, 7);
    const LitView seen{camera_frame(view), light.vector(), 70.0 * degree};
    const Image found = shape.sphere(scene, seen, table);
    int lit = 0;
    for (int r = 0; r < scene.size.height; ++r)
        for (int c = 0; c < scene.size.width; ++c) {
            expect_near(found, r, c, reference::sphere_pixel(surface, scene, seen, table, r, c));
            lit += found.at(0, r, c) > 0.05F;
        }
    EXPECT_GT(lit, 8);
}

TEST(LitShapeSmall, PixelsAreTheReferences) {
    expect_plane({BtfShape::plane, {7, 9}, 1.0, 0.0}, {50.0 * degree, 2.0}, {16, 18});
    expect_sphere({BtfShape::sphere, {12, 10}, 1.0, 0.0}, {20.0 * degree, 1.0}, {40.0 * degree, 2.0},
                  {16, 18});
}

TEST(LitShape, PlanesAreTheReferences) {
    for (const double theta : {0.0, 30.0, 65.0})
        for (const double scale : {0.4, 1.0, 3.0})
            expect_plane({BtfShape::plane, {21, 26}, scale, 0.0}, {theta * degree, 4.0}, {20, 24});
    expect_plane({BtfShape::plane, {5, 40}, 1.0, 0.0}, {40.0 * degree, -1.0}, {33, 16});
}

TEST(LitShape, SpheresAreTheReferences) {
    for (const double theta : {0.0, 35.0, 80.0})
        for (const double scale : {0.5, 2.0})
            expect_sphere({BtfShape::sphere, {40, 47}, scale, 0.0}, {theta * degree, 1.5},
                          {55.0 * degree, 2.5}, {20, 24});
}

TEST(LitShape, AWhiteMattSphereIsTheCosine) {
    const Size tile{8, 8};
    const LitShape shape(test::default_device().impl(), Image(tile, 2), 1);
    LitTable table{4, 3, std::vector<PictureWeights>(12, {{0.8}, {1.0}, {0.0}}), {0.25}};
    const BtfScene scene{BtfShape::sphere, {61, 81}, 1.0, 0.0};
    for (const BtfDirection view : {BtfDirection{}, BtfDirection{1.2, 4.0}}) {
        const CameraFrame camera = camera_frame(view);
        const Vector3 light = BtfDirection{1.0, 2.0}.vector();
        const Image found = shape.sphere(scene, {camera, light, 1.3}, table);
        const double radius = 0.45 * 61.0;
        for (int r = 0; r < 61; ++r)
            for (int c = 0; c < 81; ++c) {
                const double x = (c - 40.0) / radius, y = (30.0 - r) / radius, out = std::hypot(x, y);
                if (out > 1.0 + 0.6 / radius) {
                    EXPECT_EQ(found.at(0, r, c), 0.25F);
                } else if (out < 1.0 - 0.6 / radius) {
                    const double z = std::sqrt(1.0 - x * x - y * y);
                    const double cosine =
                        x * dot(camera.right, light) + y * dot(camera.up, light) + z * dot(camera.to, light);
                    EXPECT_NEAR(static_cast<double>(found.at(0, r, c)), 0.8 * std::max(cosine, 0.0), 1e-5);
                }
            }
    }
}

TEST(LitTable, HasWhatEachPlaceSees) {
    const BtfModel model = test::smooth_btf({8, 8});
    const DirectionTable table(model);
    const Vector3 camera = BtfDirection{0.5, 1.0}.vector(), light = BtfDirection{0.9, 3.0}.vector();
    const LitTable made = sphere_table(table, camera, light);
    ASSERT_EQ(made.entries.size(), static_cast<std::size_t>(made.longitudes * made.latitudes));
    int filled = 0;
    for (int j = 0; j < made.latitudes; ++j)
        for (int i = 0; i < made.longitudes; ++i) {
            const PlaceFrame place =
                place_frame(2.0 * std::numbers::pi * i / made.longitudes,
                            std::numbers::pi * (static_cast<double>(j) / (made.latitudes - 1) - 0.5));
            const PictureWeights& entry = made.entries[static_cast<std::size_t>(j * made.longitudes + i)];
            const double seen = dot(place.out, camera), lit = dot(place.out, light);
            filled += !entry.mean.empty();
            if (seen < -0.2 || lit < -0.2) {
                EXPECT_TRUE(entry.mean.empty());
            }
            if (seen < 0.0 || lit < 0.0) continue;
            ASSERT_EQ(entry.mean.size(), 3U);
            // As rendering_cases.hpp has it, but that rings of 15 degrees blunt the tip of theta, by a
            // twentieth of them; beyond the rim, that of the rim.
            const double theta = std::min(std::acos(std::min(seen, 1.0)), 75.0 * degree);
            EXPECT_NEAR(entry.mean[1], 0.4 * (1.0 - 0.2 * theta), 4e-3) << i << " " << j;
            const auto from = seen_from(place, light, 1.5).vector();
            if (theta > 70.0 * degree || from[2] < 0.35) continue;
            double square = 0.0;
            for (int k = 0; k < 5; ++k) {
                const double u = 2e-3 * (40.0 / (k + 1) * (k % 2 == 0 ? from[0] : from[1]) + 8.0 * theta);
                square += u * u;
            }
            EXPECT_NEAR(entry.contrast[0], 2.0 * std::sqrt(square), 6e-3) << i << " " << j;
        }
    EXPECT_GT(filled, made.longitudes * made.latitudes / 4);
}

TEST(LitTable, TheFirstPlanesStay) {
    const PictureWeights all{{1.0, 2.0}, {3.0, 4.0}, {1.0, 2.0, 3.0, 4.0, 5.0, 6.0}};
    EXPECT_EQ(first_planes(all, 2).weights, (std::vector<double>{1.0, 2.0, 4.0, 5.0}));
    EXPECT_EQ(first_planes(all, 3).weights, all.weights);
}

TEST(SphereFrame, FramesAreRightHandedAndOrthonormal) {
    const auto expect_frame = [](const Vector3& x, const Vector3& y, const Vector3& z) {
        for (const auto& [a, b] : {std::pair(x, y), std::pair(y, z), std::pair(z, x)})
            EXPECT_NEAR(dot(a, b), 0.0, 1e-12);
        for (const Vector3& a : {x, y, z}) EXPECT_NEAR(dot(a, a), 1.0, 1e-12);
        EXPECT_NEAR(x[0] * (y[1] * z[2] - y[2] * z[1]) + x[1] * (y[2] * z[0] - y[0] * z[2]) +
                        x[2] * (y[0] * z[1] - y[1] * z[0]),
                    1.0, 1e-12);
    };
    for (const double theta : {0.0, 0.4, 1.5})
        for (const double phi : {0.0, 1.0, 4.0}) {
            const BtfDirection view{theta, phi};
            const CameraFrame camera = camera_frame(view);
            expect_frame(camera.right, camera.up, camera.to);
            // Nothing turns about the axis along which the camera goes.
            const Vector3 axis{-std::sin(phi), std::cos(phi), 0.0};
            EXPECT_NEAR(dot(camera.right, axis), axis[0], 1e-12);
            EXPECT_NEAR(dot(camera.up, axis), axis[1], 1e-12);
            const PlaceFrame place = place_frame(phi, theta);
            expect_frame(place.east, place.north, place.out);
            // East is where longitude grows.
            const PlaceFrame next = place_frame(phi + 1e-6, theta);
            EXPECT_NEAR(dot(place.east, next.out), 1e-6 * std::cos(theta), 1e-10);
        }
    // In the middle of the picture from above the frame is the plane's own.
    const BtfDirection light{0.7, 2.0}, seen = seen_from(place_frame(0.0, 0.0), light.vector(), 1.5);
    EXPECT_NEAR(seen.theta, light.theta, 1e-12);
    EXPECT_NEAR(seen.phi, light.phi, 1e-12);
    EXPECT_EQ(seen_from(place_frame(0.0, 0.0), BtfDirection{1.4, 2.0}.vector(), 1.2).theta, 1.2);
}

}  // namespace
}  // namespace btfield

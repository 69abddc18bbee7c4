// Maps of one material: joined, grown, taken apart.

#include "btfield/material.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include "btfield/error.hpp"
#include "btfield/fit.hpp"
#include "btfield/model_file.hpp"
#include "btfield/pyramid.hpp"
#include "btfield/synthesis.hpp"
#include "host/relief/half_laplacian.hpp"
#include "tests/device_cases.hpp"
#include "tests/example_model.hpp"

namespace btfield {
namespace {

/// A torus of hills: long waves and, much lower, short ones.
Image hills(Size size, double scale) {
    Image height = test::mixed_texture(size, 1, 5);
    std::vector<Image> levels = decompose(test::default_device(), height, 5, 2);
    const std::vector<double> weights{0.0003, 0.002, 0.02, 0.3, 2.0};
    for (std::size_t k = 0; k < levels.size(); ++k)
        for (float& v : levels[k].values()) v *= static_cast<float>(weights[k] * scale);
    return collapse(test::default_device(), levels, 2);
}

double mean(std::span<const float> values) {
    double sum = 0.0;
    for (const float v : values) sum += static_cast<double>(v);
    return sum / static_cast<double>(values.size());
}

double covariance(std::span<const float> a, std::span<const float> b) {
    const double ma = mean(a), mb = mean(b);
    double sum = 0.0;
    for (std::size_t i = 0; i < a.size(); ++i)
        sum += (static_cast<double>(a[i]) - ma) * (static_cast<double>(b[i]) - mb);
    return sum / static_cast<double>(a.size());
}

double deviation(std::span<const float> a) {
    return std::sqrt(covariance(a, a));
}

/// Colour that follows the height, and grain of its own; normals and height of 16 bits.
std::vector<MapPicture> maps_of(const Image& height, bool with_height = true, bool directx = false) {
    std::vector<MapPicture> maps;
    MapPicture& colour = maps.emplace_back(MapPicture{"rock_albedo.png", MapRole::colour, {}, false});
    colour.picture.image = Image(height.size(), 3, ColourSpace::srgb);
    const Image grain = test::mixed_texture(height.size(), 3, 8);
    const double low = mean(height.values()), spread = deviation(height.values());
    for (int p = 0; p < 3; ++p)
        for (std::size_t i = 0; i < area(height.size()); ++i)
            colour.picture.image.plane(p)[i] =
                0.5F + 0.06F * (grain.plane(p)[i] - 0.5F) +
                0.05F * static_cast<float>((static_cast<double>(height.plane(0)[i]) - low) / spread);
    MapPicture& normal = maps.emplace_back(MapPicture{"rock_normal.png", MapRole::normal, {}, directx});
    normal.picture.type = PixelType::uint16;
    normal.picture.image = encode_normals(normals_of_slopes(slopes_of_height(height, SurfaceEdges::periodic)),
                                          directx ? NormalConvention::directx : NormalConvention::opengl);
    if (with_height) {
        MapPicture& map = maps.emplace_back(MapPicture{"rock_height.png", MapRole::height, {}, false});
        map.picture.type = PixelType::uint16;
        map.picture.image = encode_height(height, 2.0 * encoded_height_scale(height));
    }
    return maps;
}

TEST(Material, RolesByName) {
    const std::vector<std::pair<const char*, MapRole>> names{
        {"bark-albedo.jpg", MapRole::colour},
        {"Rock035_2K-PNG_NormalGL.png", MapRole::normal},
        {"Rock035_2K-PNG_Color.png", MapRole::colour},
        {"Rock035_Displacement.png", MapRole::height},
        {"wall_nor_dx_4k.exr", MapRole::normal},
        {"wall_disp_4k.png", MapRole::height},
        {"wall_diff_4k.png", MapRole::colour},
        {"wall_rough_4k.exr", MapRole::roughness},
        {"T_Metal_BaseColor.tga", MapRole::colour},
        {"T_Wall_AmbientOcclusion.tga", MapRole::occlusion},
        {"metal_plate_ao_1k.png", MapRole::occlusion},
        {"grass2_nm.jpg", MapRole::normal},
        {"cork.png", MapRole::other}};
    for (const auto& [name, role] : names) EXPECT_EQ(role_of_name(name), role) << name;
    using Files = std::vector<std::filesystem::path>;
    using Roles = std::vector<MapRole>;
    EXPECT_EQ(roles_of_names(Files{"rock_normal.png", "rock.png", "rock_gloss.png"}),
              (Roles{MapRole::normal, MapRole::colour, MapRole::other}));
    EXPECT_EQ(roles_of_names(Files{"rock.png", "moss.png", "rock_normal.png"}),
              (Roles{MapRole::other, MapRole::other, MapRole::normal}));
    EXPECT_EQ(roles_of_names(Files{"rock.png", "rock_diffuse.png"}),
              (Roles{MapRole::other, MapRole::colour}));
    EXPECT_TRUE(says_directx("wall_nor_dx_4k.exr"));
    EXPECT_TRUE(says_directx("Rock035_NormalDX.png"));
    EXPECT_FALSE(says_directx("Rock035_NormalGL.png"));
}

TEST(Material, HeightAndScaleComeFromNormals) {
    const Image height = hills({96, 128}, 1.0);
    for (const bool with_height : {true, false})
        for (const bool directx : {false, true}) {
            const Material material = join_maps(test::default_device(), maps_of(height, with_height, directx),
                                                SurfaceEdges::periodic);
            ASSERT_EQ(material.image.planes(), 4);
            ASSERT_EQ(material.maps.size(), with_height ? 3U : 2U);
            EXPECT_EQ(material.maps[1].planes, with_height ? 0 : 1);
            EXPECT_EQ(material.image.names().front(), "rock_albedo.R");
            const auto found = material.image.plane(3);
            const Image wanted =
                with_height ? height
                            : half_laplacian(test::default_device().impl(), height, SurfaceEdges::periodic);
            const double shift = mean(found) - mean(wanted.values());
            double most = 0.0;
            for (std::size_t i = 0; i < found.size(); ++i)
                most = std::max(most, std::abs(static_cast<double>(found[i]) -
                                               static_cast<double>(wanted.plane(0)[i]) - shift));
            EXPECT_LT(most, 0.01 * encoded_height_scale(wanted)) << with_height << directx;
            // And back.
            const std::vector<Image> back =
                split_maps(test::default_device(), material.maps, material.image, SurfaceEdges::periodic);
            const Image normals = normals_of_slopes(slopes_of_height(height, SurfaceEdges::periodic));
            for (std::size_t i = 0; i < normals.values().size(); ++i)
                ASSERT_NEAR(back[1].values()[i], normals.values()[i], 2e-3);
        }
}

TEST(Material, TexturesKeepDeviationsSlopesAndTheirCompany) {
    Device& device = test::default_device();
    const Material material = join_maps(device, maps_of(hills({256, 256}, 6.0)), SurfaceEdges::periodic);
    TextureModel model = fit(device, material.image, FitOptions{});
    model.provenance.maps = material.maps;
    const Size size = material.image.size();
    const auto grow = [&](std::uint64_t seed) { return Synthesiser(device, model, size).synthesise(seed); };
    match_relief(device, model.provenance.maps, material.image, grow(0));
    model = from_json(to_json(model));
    ASSERT_FALSE(model.provenance.maps[2].gains.empty());

    const std::vector<Image> own = split_maps(device, material.maps, material.image, SurfaceEdges::periodic);
    double height = 0.0, slopes = 0.0, company = 0.0, change = 0.0;
    constexpr int seeds = 8;
    for (int seed = 1; seed <= seeds; ++seed) {
        const Image texture = grow(static_cast<std::uint64_t>(seed));
        const std::vector<Image> maps =
            split_maps(device, model.provenance.maps, texture, SurfaceEdges::periodic);
        const std::vector<Image> without = split_maps(device, material.maps, texture, SurfaceEdges::periodic);
        const auto slope = [](const Image& h) {
            return deviation(slopes_of_height(h, SurfaceEdges::periodic).plane(0));
        };
        height += deviation(maps[2].values()) / deviation(own[2].values()) / seeds;
        change += deviation(maps[2].values()) / deviation(without[2].values()) / seeds;
        slopes += slope(maps[2]) / slope(own[2]) / seeds;
        const auto correlation = [](const Image& colour, const Image& h) {
            return covariance(colour.plane(1), h.plane(0)) /
                   (deviation(colour.plane(1)) * deviation(h.plane(0)));
        };
        company += (correlation(maps[0], maps[2]) - correlation(own[0], own[2])) / seeds;
        // Normals are those of the written height.
        const Image normals = normals_of_slopes(slopes_of_height(maps[2], SurfaceEdges::periodic));
        for (std::size_t i = 0; i < normals.values().size(); ++i)
            ASSERT_NEAR(maps[1].values()[i], normals.values()[i], 1e-6);
    }
    EXPECT_NEAR(height, 1.0, 0.08);  // long waves of a small lattice: chance
    EXPECT_NEAR(change, 1.0, 0.02);
    EXPECT_NEAR(slopes, 1.0, 0.1);
    EXPECT_NEAR(company, 0.0, 0.05);
}

TEST(Material, SlopesOfNormalsWithoutHeightAreKept) {
    Device& device = test::default_device();
    const Image height = hills({256, 256}, 6.0);
    const Material material = join_maps(device, maps_of(height, false, false), SurfaceEdges::periodic);
    TextureModel model = fit(device, material.image, FitOptions{});
    model.provenance.maps = material.maps;
    EXPECT_EQ(material.image.names()[0], "rock_albedo.R");
    EXPECT_EQ(material.image.names()[3], "rock_normal.steepness");
    const auto deviations = [&](const Image& image) {
        const Image normals = split_maps(device, material.maps, image, SurfaceEdges::periodic)[1];
        return std::pair{deviation(normals.plane(0)), deviation(normals.plane(1))};
    };
    const auto [across, down] = deviations(material.image);
    double x = 0.0, y = 0.0;
    constexpr int seeds = 4;
    for (int seed = 1; seed <= seeds; ++seed) {
        const auto [a, b] = deviations(
            Synthesiser(device, model, material.image.size()).synthesise(static_cast<std::uint64_t>(seed)));
        x += a / across / seeds;
        y += b / down / seeds;
    }
    EXPECT_NEAR(x, 1.0, 0.08);
    EXPECT_NEAR(y, 1.0, 0.08);
    // Heights of such maps would want gains, which are refused.
    model.provenance.maps[1].gains = {0.5};
    EXPECT_THROW(static_cast<void>(from_json(to_json(model))), InputError);
}

TEST(Material, GainsTakeOutWavesThatTheMaterialHasNot) {
    Device& device = test::default_device();
    Material material = join_maps(device, maps_of(hills({128, 160}, 6.0)), SurfaceEdges::periodic);
    Image rough = material.image;
    const Image noise = test::mixed_texture(rough.size(), 1, 11);
    for (std::size_t i = 0; i < noise.values().size(); ++i)
        rough.plane(3)[i] += 0.3F * (noise.values()[i] - 0.5F);
    const auto height_of = [&](const Image& image) {
        return split_maps(device, material.maps, image, SurfaceEdges::periodic)[2];
    };
    const auto slope = [](const Image& h) {
        return deviation(slopes_of_height(h, SurfaceEdges::periodic).plane(0));
    };
    const double wanted = slope(height_of(material.image)), before = slope(height_of(rough));
    EXPECT_GT(before, 1.5 * wanted);
    match_relief(device, material.maps, material.image, rough);
    EXPECT_TRUE(material.maps[0].gains.empty());
    EXPECT_LT(material.maps[2].gains.front(), 0.5);
    EXPECT_NEAR(slope(height_of(rough)) / wanted, 1.0, 0.05);
    // Of the material itself nothing is taken.
    match_relief(device, material.maps, material.image, material.image);
    for (const double gain : material.maps[2].gains) EXPECT_NEAR(gain, 1.0, 1e-3);
}

TEST(Material, RefusesWhatDoesNotBelongTogether) {
    Device& device = test::default_device();
    const Image height = hills({64, 64}, 1.0);
    const auto refusal = [&](const std::vector<MapPicture>& maps) -> std::string {
        try {
            static_cast<void>(join_maps(device, maps));
        } catch (const InputError& error) {
            return error.what();
        }
        return {};
    };
    EXPECT_EQ(refusal(maps_of(height)), "");
    std::vector<MapPicture> maps = maps_of(height);
    maps[2].picture.image = encode_height(hills({64, 80}, 1.0), 10.0);
    EXPECT_NE(refusal(maps).find("'rock_height.png' is 80 x 64 pixels"), std::string::npos) << refusal(maps);
    maps = maps_of(height);
    for (float& v : maps[2].picture.image.values()) v = 1.0F - v;
    EXPECT_NE(refusal(maps).find("different surfaces"), std::string::npos) << refusal(maps);
    // One axis the wrong way round, with more slope along the other, which alone agrees on the whole.
    for (const int axis : {0, 1}) {
        Image ridges({64, 64}, 1);
        for (int r = 0; r < 64; ++r)
            for (int c = 0; c < 64; ++c) {
                const double along = axis == 0 ? r : c, across = axis == 0 ? c : r;
                ridges.at(0, r, c) = static_cast<float>(3.0 * std::sin(0.7853981633974483 * along) +
                                                        1.5 * std::sin(0.5890486225480862 * across));
            }
        maps = maps_of(ridges);
        EXPECT_EQ(refusal(maps), "");
        for (float& v : maps[1].picture.image.plane(axis)) v = 1.0F - v;
        EXPECT_NE(refusal(maps).find("along one axis alone"), std::string::npos) << refusal(maps);
        EXPECT_NE(refusal(maps).find(axis == 0 ? "its red points" : "give --convention directx"),
                  std::string::npos)
            << refusal(maps);
    }
    maps = maps_of(height);
    maps[0].role = MapRole::height;
    EXPECT_NE(refusal(maps).find("second height"), std::string::npos) << refusal(maps);
    maps = maps_of(height);
    maps[0].name = "rock_normal.jpg";
    EXPECT_NE(refusal(maps).find("two of its maps"), std::string::npos) << refusal(maps);
    EXPECT_NE(refusal({}).find("no map"), std::string::npos);
    // A hostile model's names lead nowhere.
    TextureModel model = test::example_model(ModelKind::car3d, 4);
    model.provenance.maps = join_maps(device, maps_of(height)).maps;
    EXPECT_NO_THROW(check(model));
    for (const char* name : {"../a.png", "", "..", "a/b.png", "rock_normal.exr"}) {
        model.provenance.maps[0].name = name;
        EXPECT_THROW(check(model), InputError) << name;
    }
}

}  // namespace
}  // namespace btfield

// A BTF from a single picture, as one small model, seen from four directions and as a page:
// btf_of_picture PICTURE OUTPUT_FOLDER
//
// Nobody measured this material: its relief is guessed from brightness, bright is high. The pictures of 81
// views x 81 lights are computed of that; from there on all is as with a set that was measured.
#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <numbers>
#include <string>

#include "btfield/btf_model.hpp"
#include "btfield/btf_page.hpp"
#include "btfield/btf_renderer.hpp"
#include "btfield/error.hpp"
#include "btfield/height.hpp"
#include "btfield/image_io.hpp"
#include "btfield/made_btf.hpp"
#include "btfield/roller.hpp"

namespace {

using btfield::Image;
using btfield::Size;

/// Pixels: of the side that the picture is brought down to, and of the relief from its lowest to its highest.
constexpr int side = 128;
constexpr float relief = 4.0F;
constexpr double degree = std::numbers::pi / 180.0;

float linear_of_srgb(float value) {
    return value <= 0.04045F ? value / 12.92F : std::pow((value + 0.055F) / 1.055F, 2.4F);
}

/// The mean of each n x n pixels, in linear light.
Image reduced(const Image& picture, int n) {
    Image small({picture.height() / n, picture.width() / n}, picture.planes(),
                picture.planes() == 3 ? btfield::ColourSpace::linear : btfield::ColourSpace::unspecified);
    for (int p = 0; p < small.planes(); ++p)
        for (int r = 0; r < small.height(); ++r)
            for (int c = 0; c < small.width(); ++c) {
                float sum = 0.0F;
                for (int i = 0; i < n * n; ++i)
                    sum += linear_of_srgb(picture.at(p, n * r + i / n, n * c + i % n));
                small.at(p, r, c) = sum / static_cast<float>(n * n);
            }
    return small;
}

/// Means over planes and 3 x 3 pixels of a torus, spread over the relief.
Image height_of(const Image& albedo) {
    const int rows = albedo.height(), columns = albedo.width();
    Image height(albedo.size(), 1);
    for (int r = 0; r < rows; ++r)
        for (int c = 0; c < columns; ++c)
            for (int p = 0; p < albedo.planes(); ++p)
                for (int i = 0; i < 9; ++i)
                    height.at(0, r, c) +=
                        albedo.at(p, (r + i / 3 + rows - 1) % rows, (c + i % 3 + columns - 1) % columns);
    const auto [low, high] = std::ranges::minmax(height.values());
    const float scale = relief / std::max(high - low, 1e-6F);
    for (float& value : height.values()) value *= scale;
    return height;
}

btfield::BtfMaterial material_of(btfield::Device& device, const Image& picture) {
    const int n = std::max(1, std::min(picture.height(), picture.width()) / side);
    const std::array<Image, 1> sample{reduced(picture, n)};
    // Made sets tile.
    btfield::BtfMaterial material;
    material.albedo = apply(btfield::Roller(device, sample).tile(), sample.front());
    material.height = height_of(material.albedo);
    material.normals = normals_of_slopes(slopes_of_height(material.height, btfield::SurfaceEdges::periodic));
    return material;
}

/// Spheres beside each other: two lights from the front, and two turned.
Image four_directions(const btfield::BtfRenderer& renderer) {
    const std::array<std::pair<btfield::BtfDirection, btfield::BtfDirection>, 4> directions{
        {{{}, {30 * degree, 120 * degree}},
         {{}, {65 * degree, 20 * degree}},
         {{50 * degree, 200 * degree}, {50 * degree, 120 * degree}},
         {{45 * degree, 0.0}, {60 * degree, 90 * degree}}}};
    btfield::BtfScene scene;
    scene.size = {256, 256};
    Image all;
    for (std::size_t k = 0; k < directions.size(); ++k) {
        const Image one = renderer.picture(scene, directions[k].first, directions[k].second);
        if (k == 0) all = Image({one.height(), 4 * one.width()}, one.planes(), one.space());
        for (int p = 0; p < one.planes(); ++p)
            for (int r = 0; r < one.height(); ++r)
                for (int c = 0; c < one.width(); ++c)
                    all.at(p, r, static_cast<int>(k) * one.width() + c) = one.at(p, r, c);
    }
    return all;
}

void run(const std::filesystem::path& source, const std::filesystem::path& folder) {
    const auto start = std::chrono::steady_clock::now();
    const std::string stem = source.stem().string();
    std::filesystem::create_directories(folder);
    btfield::Device device;
    const btfield::BtfSet set = make_btf(device, material_of(device, btfield::read_picture(source).image));
    std::printf(
        "BTF: %zu pictures of %d x %d pixels, %zu views x %zu lights, relief guessed from brightness.\n",
        set.pictures().size(), set.size().width, set.size().height, set.views().size(), set.lights().size());

    btfield::BtfFitOptions options;
    options.periodic = true;
    const btfield::BtfFit fit = fit_btf(device, set, options);
    const std::filesystem::path model_path = folder / (stem + ".btfm");
    write_btf_model(model_path, fit.model);
    const auto bytes = std::filesystem::file_size(model_path);
    std::printf("Model: %d planes leave %.2f %% of the variance; %ju bytes for %ju of pictures, in %s.\n",
                fit.model.planes(), 100.0 * fit.model.unexplained, static_cast<std::uintmax_t>(bytes),
                static_cast<std::uintmax_t>(fit.model.picture_bytes), model_path.c_str());

    const Size tile{256, 256};
    const btfield::BtfSynthesiser grown(device, fit.model, tile, 1);
    const std::filesystem::path spheres = folder / (stem + "-spheres.png"), page = folder / (stem + ".html");
    btfield::write_picture(spheres, four_directions({device, fit.model, grown.surface()}),
                           btfield::PixelType::uint8);
    btfield::BtfPageOptions looks;
    looks.title = stem;
    std::ofstream(page, std::ios::binary) << btf_page(fit.model, grown, looks);
    const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    std::printf("Wrote %s (four directions) and\n      %s (turn it in a browser), in %.1f s.\n",
                spheres.c_str(), page.c_str(), seconds);
}

}  // namespace

int main(int count, char** arguments) {
    if (count != 3) {
        std::fprintf(stderr, "usage: btf_of_picture PICTURE OUTPUT_FOLDER\n");
        return 2;
    }
    try {
        run(arguments[1], arguments[2]);
        return 0;
    } catch (const std::exception& error) {
        std::fprintf(stderr, "%s\n", error.what());
        return 1;
    }
}

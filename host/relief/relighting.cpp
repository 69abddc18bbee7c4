#include "btfield/relighting.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>

#include "btfield/error.hpp"
#include "host/base/parallel.hpp"
#include "host/base/stop.hpp"
#include "host/base/text.hpp"
#include "host/relief/light_stack.hpp"

namespace btfield {

using namespace detail;

namespace {

using Light = std::array<double, 3>;

/// Width of a shadow's edge over the distance to what throws it.
constexpr float softness = 0.05F;
/// Pixels from one look to the next.
constexpr float stride = 0.7F;

void check_surface(const Surface& surface) {
    const std::string asked = "relight a surface";
    const Size size = surface.normals.size();
    const bool shaped =
        surface.height.values().empty() || (surface.height.size() == size && surface.height.planes() == 1);
    if (surface.normals.planes() != 3 || surface.albedo.size() != size || !shaped)
        throw InputError(asked, "normals, albedo and height do not lie on each other",
                         "give maps of one surface");
}

/// Heights between pixels.
class Terrain {
  public:
    explicit Terrain(const Surface& surface)
        : height_(&surface.height), torus_(surface.edges == SurfaceEdges::periodic) {
        highest_ = *std::ranges::max_element(surface.height.values());
    }
    [[nodiscard]] float highest() const { return highest_; }
    [[nodiscard]] bool beyond(float row, float column) const {
        return !torus_ && (row < 0.0F || column < 0.0F || row > static_cast<float>(height_->height() - 1) ||
                           column > static_cast<float>(height_->width() - 1));
    }
    [[nodiscard]] float at(float row, float column) const {
        const float r = std::floor(row), c = std::floor(column);
        const int top = inside(static_cast<int>(r), height_->height()),
                  left = inside(static_cast<int>(c), height_->width()),
                  bottom = inside(static_cast<int>(r) + 1, height_->height()),
                  right = inside(static_cast<int>(c) + 1, height_->width());
        const float down = row - r, across = column - c;
        const float above = height_->at(0, top, left) * (1.0F - across) + height_->at(0, top, right) * across;
        const float below =
            height_->at(0, bottom, left) * (1.0F - across) + height_->at(0, bottom, right) * across;
        return above * (1.0F - down) + below * down;
    }

  private:
    [[nodiscard]] int inside(int i, int n) const {
        if (!torus_) return std::clamp(i, 0, n - 1);
        i %= n;
        return i < 0 ? i + n : i;
    }
    const Image* height_;
    bool torus_;
    float highest_ = 0.0F;
};

/// Share of the light that reaches a pixel. `right`, `down`: a step of one pixel towards it, `rise` its
/// height.
float seen(const Terrain& terrain, int row, int column, float right, float down, float rise) {
    const auto r = static_cast<float>(row), c = static_cast<float>(column);
    const float from = terrain.at(r, c);
    float clearance = 1.0F;
    for (float t = 1.0F;; t += stride) {
        const float ray = from + rise * t, y = r + down * t, x = c + right * t;
        if (ray > terrain.highest() + softness * t || terrain.beyond(y, x)) break;
        clearance = std::min(clearance, (ray - terrain.at(y, x)) / (softness * t) + 0.5F);
        if (clearance <= 0.0F) return 0.0F;
    }
    return std::min(clearance, 1.0F);
}

}  // namespace

Light direction_of_angles(double theta, double phi) {
    const double t = theta * std::numbers::pi / 180.0, p = phi * std::numbers::pi / 180.0;
    return {std::sin(t) * std::cos(p), std::sin(t) * std::sin(p), std::cos(t)};
}

Image relight(const Surface& surface, const Light& light) {
    check_surface(surface);
    const double length = std::hypot(light[0], light[1], light[2]);
    if (!(length > 0.0) || !std::isfinite(length) || !(light[2] > 1e-6 * length))
        throw InputError("relight a surface", "the light is not above it",
                         "give a direction whose z is above 0");
    const auto x = static_cast<float>(light[0] / length), y = static_cast<float>(light[1] / length),
               z = static_cast<float>(light[2] / length);
    const float flat = std::hypot(x, y);
    const bool shadows = !surface.height.values().empty() && flat > 1e-6F;
    const std::optional<Terrain> terrain = shadows ? std::optional<Terrain>(surface) : std::nullopt;
    const Size size = surface.normals.size();
    Image image(size, surface.albedo.planes(), ColourSpace::linear);
    for_each_block(size.height, [&](int r) {
        for (int c = 0; c < size.width; ++c) {
            float shade = std::max(0.0F, surface.normals.at(0, r, c) * x + surface.normals.at(1, r, c) * y +
                                             surface.normals.at(2, r, c) * z);
            if (terrain && shade > 0.0F) shade *= seen(*terrain, r, c, x / flat, -y / flat, z / flat);
            for (int p = 0; p < image.planes(); ++p) image.at(p, r, c) = surface.albedo.at(p, r, c) * shade;
        }
    });
    return image;
}

std::vector<LightScore> score_lights(const Surface& surface, const LightSet& lights, LightCoding coding,
                                     double gamma, std::optional<Crop> crop) {
    check_surface(surface);
    ReadOptions reading;
    reading.crop = crop;
    reading.keep_values = true;
    std::vector<LightScore> scores;
    for (const LightPicture& light : lights.lights) {
        stop_if_asked();
        const Picture picture = read_picture(light.picture, reading);
        const Image relit = relight(surface, light.direction);
        const int planes = relit.planes();
        const std::vector<double>& gains = light.intensity;
        if (picture.image.size() != relit.size() || picture.image.planes() != planes ||
            (gains.size() > 1 && gains.size() != static_cast<std::size_t>(planes)))
            throw InputError("compare '" + light.picture.string() + "' with the surface",
                             "it has " + text_of(picture.image.size()) + " pixels and " +
                                 counted(picture.image.planes(), "plane") + ", the surface " +
                                 text_of(relit.size()) + " and " + std::to_string(planes),
                             "give pictures of the same view, with the same crop");
        const LightDecoder decoder(coding == LightCoding::automatic ? LightCoding::linear : coding, gamma,
                                   picture.type == PixelType::uint8 || picture.type == PixelType::uint16);
        double error = 0.0, all = 0.0;
        for (std::size_t i = 0; i < area(relit.size()); ++i) {
            double seen_value = 0.0, told = 0.0;
            for (int p = 0; p < planes; ++p) {
                const double gain =
                    gains.empty() ? 1.0 : 1.0 / gains[gains.size() == 1 ? 0 : static_cast<std::size_t>(p)];
                seen_value += std::abs(
                    static_cast<double>(decoder(picture.image.plane(p)[i], static_cast<float>(gain))));
                told += static_cast<double>(relit.plane(p)[i]);
            }
            error += std::abs(seen_value - told);
            all += seen_value;
        }
        scores.push_back({light.picture, all > 0.0 ? error / all : 0.0});
    }
    return scores;
}

}  // namespace btfield

#include "host/rendering/textured_shape.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numbers>
#include <optional>
#include <span>
#include <utility>

#include "host/base/parallel.hpp"
#include "host/btf/matched_tone.hpp"
#include "host/btf/spread_pixels.hpp"
#include "host/rendering/lit_table.hpp"
#include "host/rendering/shape_places.hpp"

namespace btfield::detail {
namespace {

using std::size_t;

/// Pixels of a tile that moments of textures are taken over.
constexpr size_t moment_pixels = 4096;
/// Textures that cancel each other where they are blended are not made up for beyond this.
constexpr double largest_gain = 4.0;
constexpr size_t corners = 4;

double on_torus(double x, int n) {
    const double y = x - n * std::floor(x / n);
    return y >= n ? 0.0 : std::max(y, 0.0);
}

/// The four pixels around a place of a tile, and their shares.
struct TilePlace {
    std::array<size_t, 4> at{};
    std::array<float, 4> share{};

    TilePlace(double x, double y, Size tile) {
        const double column = on_torus(x, tile.width), row = on_torus(y, tile.height);
        const int left = std::min(static_cast<int>(column), tile.width - 1),
                  top = std::min(static_cast<int>(row), tile.height - 1);
        const int right = left + 1 == tile.width ? 0 : left + 1,
                  bottom = top + 1 == tile.height ? 0 : top + 1;
        const auto a = static_cast<float>(column - left), b = static_cast<float>(row - top);
        const auto place = [&](int r, int c) {
            return static_cast<size_t>(r) * static_cast<size_t>(tile.width) + static_cast<size_t>(c);
        };
        at = {place(top, left), place(top, right), place(bottom, left), place(bottom, right)};
        share = {(1.0F - a) * (1.0F - b), a * (1.0F - b), (1.0F - a) * b, a * b};
    }
    [[nodiscard]] float of(std::span<const float> plane) const {
        return share[0] * plane[at[0]] + share[1] * plane[at[1]] + share[2] * plane[at[2]] +
               share[3] * plane[at[3]];
    }
};

float toned(float value, const Tone& tone) {
    tone_plane({&value, 1}, tone);
    return value;
}

/// What is seen at a place of the lattice.
struct Entry {
    BtfTextureLook look;
    double upward = 1.0;
    std::vector<Tone> tones;                 ///< [colour]
    std::vector<std::vector<float>> moment;  ///< [colour][pixel], toned, less their mean
    std::vector<double> mean, deviation;     ///< [colour], of these pixels
};

/// A pixel that shows the sphere, and is lit.
struct ShownPixel {
    size_t index = 0;
    double coverage = 1.0, lit = 0.0;
    std::array<double, corners> weights{};  ///< of south west, south east, north west, north east
};

/// Pixels between the same four entries.
struct Cell {
    std::array<int, corners> entries{};
    std::vector<ShownPixel> pixels;
};

class TexturedSphere {
  public:
    TexturedSphere(const BtfTextureSynthesiser& grown, const TexturesDirections& directions,
                   const BtfScene& scene, const CameraFrame& camera, const Vector3& light)
        : grown_(&grown),
          directions_(&directions),
          scene_(&scene),
          camera_(&camera),
          light_(&light),
          radius_(sphere_radius(scene.size)),
          texels_(texels_of_radian(scene, grown.size().width)),
          colours_(static_cast<size_t>(grown.model().colours)),
          matched_(grown.model().match == BtfMatch::means),
          blend_(scene.size, grown.model().colours) {}

    [[nodiscard]] Image picture(const std::vector<double>& background);

  private:
    void find_entries();
    void find_cells(const std::vector<double>& background);
    void prepare(const Image& texture, const std::vector<int>& entries);
    void add(const Image& texture, int number);
    void finish(const Cell& cell, const std::vector<double>& background, double ring);

    const BtfTextureSynthesiser* grown_;
    const TexturesDirections* directions_;
    const BtfScene* scene_;
    const CameraFrame* camera_;
    const Vector3* light_;
    double radius_, texels_;
    size_t colours_;
    bool matched_;
    Image blend_;  ///< sums of textures, and the picture in the end
    std::vector<Entry> entries_;
    std::vector<int> entry_at_;  ///< [latitude][longitude]; −1: neither seen nor lit
    std::vector<Cell> cells_;
};

void TexturedSphere::find_entries() {
    const std::vector<SpherePlace> places = sphere_places(camera_->to, *light_);
    entry_at_.assign(size_t{sphere_longitudes} * sphere_latitudes, -1);
    entries_.resize(places.size());
    for (size_t i = 0; i < places.size(); ++i) entry_at_[places[i].index] = static_cast<int>(i);
    for_each_block(static_cast<int>(places.size()), [&](int block) {
        const auto i = static_cast<size_t>(block);
        entries_[i].look = directions_->look(places[i].view, places[i].light);
        entries_[i].upward = std::cos(std::min(places[i].light.theta, directions_->steepest_light()));
    });
}

void TexturedSphere::find_cells(const std::vector<double>& background) {
    const Size size = scene_->size;
    std::map<std::pair<int, int>, std::vector<ShownPixel>> found;
    for (int row = 0; row < size.height; ++row)
        for (int column = 0; column < size.width; ++column) {
            const PicturePlace place = pixel_place(column, row, size);
            const double coverage = sphere_coverage(std::hypot(place.right, place.up), radius_);
            const SpherePoint point = sphere_point(place.right / radius_, place.up / radius_, *camera_);
            const double lit = dot(point.normal, *light_);
            const size_t index =
                static_cast<size_t>(row) * static_cast<size_t>(size.width) + static_cast<size_t>(column);
            if (coverage <= 0.0 || lit <= 0.0) {
                for (size_t c = 0; c < colours_; ++c)
                    blend_.plane(static_cast<int>(c))[index] =
                        static_cast<float>((1.0 - coverage) * background[c]);
                continue;
            }
            const double turn = 0.5 * std::numbers::inv_pi * point.longitude(),
                         over = (point.latitude() * std::numbers::inv_pi + 0.5) * (sphere_latitudes - 1),
                         around = (turn < 0.0 ? turn + 1.0 : turn) * sphere_longitudes;
            const int west = std::min(static_cast<int>(around), sphere_longitudes - 1),
                      south = std::clamp(static_cast<int>(over), 0, sphere_latitudes - 2);
            const double a = around - west, b = over - south;
            found[{south, west}].push_back(
                {index, coverage, lit, {(1.0 - a) * (1.0 - b), a * (1.0 - b), (1.0 - a) * b, a * b}});
        }
    for (auto& [place, pixels] : found) {
        const auto [south, west] = place;
        const int east = west + 1 == sphere_longitudes ? 0 : west + 1;
        const auto at = [&](int latitude, int longitude) {
            return entry_at_[static_cast<size_t>(latitude) * sphere_longitudes +
                             static_cast<size_t>(longitude)];
        };
        cells_.push_back({{at(south, west), at(south, east), at(south + 1, west), at(south + 1, east)},
                          std::move(pixels)});
    }
}

/// Tones of the entries that have a texture, and moments of what they make of it.
void TexturedSphere::prepare(const Image& texture, const std::vector<int>& entries) {
    std::vector<std::optional<TonedPlane>> planes(colours_);
    if (matched_)
        for_each_block(static_cast<int>(colours_),
                       [&](int c) { planes[static_cast<size_t>(c)].emplace(texture.plane(c)); });
    const std::vector<size_t> pixels = spread_pixels(area(texture.size()), moment_pixels);
    for_each_block(static_cast<int>(entries.size()), [&](int block) {
        Entry& entry = entries_[static_cast<size_t>(entries[static_cast<size_t>(block)])];
        for (size_t c = 0; c < colours_; ++c) {
            const Tone tone = matched_ ? planes[c]->tone(entry.look.mean[c] / entry.upward,
                                                         entry.look.deviation[c] / entry.upward)
                                       : Tone{};
            std::vector<float> values;
            values.reserve(pixels.size());
            for (const size_t pixel : pixels) values.push_back(texture.plane(static_cast<int>(c))[pixel]);
            tone_plane(values, tone);
            double sum = 0.0, squares = 0.0;
            for (const float value : values) sum += static_cast<double>(value);
            const double mean = sum / static_cast<double>(values.size());
            for (float& value : values) {
                value -= static_cast<float>(mean);
                squares += static_cast<double>(value) * static_cast<double>(value);
            }
            entry.tones.push_back(tone);
            entry.mean.push_back(mean);
            entry.deviation.push_back(std::sqrt(squares / static_cast<double>(values.size())));
            entry.moment.push_back(std::move(values));
        }
    });
}

/// Its share of all pixels that show it.
void TexturedSphere::add(const Image& texture, int number) {
    const Size tile = texture.size(), size = scene_->size;
    std::vector<const Cell*> own;
    for (const Cell& cell : cells_)
        if (std::ranges::any_of(
                cell.entries, [&](int e) { return entries_[static_cast<size_t>(e)].look.texture == number; }))
            own.push_back(&cell);
    for_each_block(static_cast<int>(own.size()), [&](int block) {
        const Cell& cell = *own[static_cast<size_t>(block)];
        for (const ShownPixel& pixel : cell.pixels) {
            const auto column = static_cast<int>(pixel.index % static_cast<size_t>(size.width)),
                       row = static_cast<int>(pixel.index / static_cast<size_t>(size.width));
            const PicturePlace middle = pixel_place(column, row, size);
            const SampleCount count = sphere_samples(
                sphere_point(middle.right / radius_, middle.up / radius_, *camera_), texels_ / radius_);
            const int samples = count.across * count.down;
            for (int i = 0; i < samples; ++i) {
                const PicturePlace away = sample_place(i, count.across, count.down);
                const SpherePoint point = sphere_point((middle.right + away.right) / radius_,
                                                       (middle.up + away.up) / radius_, *camera_);
                const TilePlace at(0.5 * (tile.width - 1) + texels_ * point.longitude(),
                                   0.5 * (tile.height - 1) - texels_ * point.latitude(), tile);
                for (size_t c = 0; c < colours_; ++c) {
                    const float value = at.of(texture.plane(static_cast<int>(c)));
                    double sum = 0.0;
                    for (size_t k = 0; k < corners; ++k) {
                        const Entry& entry = entries_[static_cast<size_t>(cell.entries[k])];
                        if (entry.look.texture == number && pixel.weights[k] > 0.0)
                            sum += pixel.weights[k] * static_cast<double>(toned(value, entry.tones[c]));
                    }
                    blend_.plane(static_cast<int>(c))[pixel.index] += static_cast<float>(sum / samples);
                }
            }
        }
    });
}

/// Contrasts that blending took are given back, light falls, and the rim is mixed with what is behind.
void TexturedSphere::finish(const Cell& cell, const std::vector<double>& background, double ring) {
    for (size_t c = 0; c < colours_; ++c) {
        std::array<std::array<double, corners>, corners> covariance{};
        for (size_t i = 0; i < corners; ++i)
            for (size_t j = 0; j <= i; ++j) {
                const std::vector<float>& a = entries_[static_cast<size_t>(cell.entries[i])].moment[c];
                const std::vector<float>& b = entries_[static_cast<size_t>(cell.entries[j])].moment[c];
                double sum = 0.0;
                for (size_t s = 0; s < a.size(); ++s)
                    sum += static_cast<double>(a[s]) * static_cast<double>(b[s]);
                covariance[i][j] = covariance[j][i] = sum / static_cast<double>(a.size());
            }
        for (const ShownPixel& pixel : cell.pixels) {
            double mean = 0.0, deviation = 0.0, variance = 0.0;
            for (size_t i = 0; i < corners; ++i) {
                const Entry& entry = entries_[static_cast<size_t>(cell.entries[i])];
                mean += pixel.weights[i] * entry.mean[c];
                deviation += pixel.weights[i] * entry.deviation[c];
                for (size_t j = 0; j < corners; ++j)
                    variance += pixel.weights[i] * pixel.weights[j] * covariance[i][j];
            }
            const double gain =
                variance > 0.0 ? std::min(deviation / std::sqrt(variance), largest_gain) : 1.0;
            float& value = blend_.plane(static_cast<int>(c))[pixel.index];
            const double shown = std::max(mean + gain * (static_cast<double>(value) - mean), 0.0);
            // Matched, values are those of light over its l_z; else as pictures were, light on the ring.
            const double light = matched_ ? pixel.lit : std::min(1.0, pixel.lit / ring);
            value =
                static_cast<float>((1.0 - pixel.coverage) * background[c] + pixel.coverage * light * shown);
        }
    }
}

Image TexturedSphere::picture(const std::vector<double>& background) {
    find_entries();
    find_cells(background);
    std::map<int, std::vector<int>> entries_of;
    for (size_t i = 0; i < entries_.size(); ++i)
        entries_of[entries_[i].look.texture].push_back(static_cast<int>(i));
    for (const auto& [number, entries] : entries_of) {
        const Image texture = grown_->texture(number);
        prepare(texture, entries);
        add(texture, number);
    }
    const double ring = std::cos(directions_->steepest_light());
    for_each_block(static_cast<int>(cells_.size()),
                   [&](int block) { finish(cells_[static_cast<size_t>(block)], background, ring); });
    return std::move(blend_);
}

}  // namespace

TexturedShape::TexturedShape(Device& device, const BtfTextures& model, Size tile, std::uint64_t seed,
                             bool allow_invalid)
    : grown_(device, model, tile, seed, allow_invalid), directions_(model) {}

Image TexturedShape::plane(const BtfScene& scene, const BtfDirection& view, const BtfDirection& light) const {
    const Image texture = grown_.picture(view, light);
    const PlanePlaces places = plane_places(scene, camera_frame(view), texture.size());
    const double lower =
        std::cos(light.theta) / std::cos(std::min(light.theta, directions_.steepest_light()));
    const int samples = places.across * places.down;
    Image image(scene.size, texture.planes());
    for_each_block(scene.size.height, [&](int row) {
        for (int column = 0; column < scene.size.width; ++column) {
            const PicturePlace middle = pixel_place(column, row, scene.size);
            std::vector<double> sums(static_cast<size_t>(texture.planes()));
            for (int i = 0; i < samples; ++i) {
                const PicturePlace away = sample_place(i, places.across, places.down);
                const double right = middle.right + away.right, up = middle.up + away.up;
                const TilePlace at(places.x + places.xx * right + places.xy * up,
                                   places.y - places.xy * right - places.yy * up, texture.size());
                for (size_t c = 0; c < sums.size(); ++c)
                    sums[c] += static_cast<double>(at.of(texture.plane(static_cast<int>(c))));
            }
            for (size_t c = 0; c < sums.size(); ++c)
                image.at(static_cast<int>(c), row, column) = static_cast<float>(lower * sums[c] / samples);
        }
    });
    return image;
}

Image TexturedShape::sphere(const BtfScene& scene, const CameraFrame& camera, const Vector3& light,
                            const std::vector<double>& background) const {
    return TexturedSphere(grown_, directions_, scene, camera, light).picture(background);
}

}  // namespace btfield::detail

#include "host/btf/picture_texture.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "btfield/error.hpp"
#include "btfield/version.hpp"
#include "host/btf/direction_grid.hpp"
#include "host/btf/texture_code.hpp"

namespace btfield::detail {
namespace {

/// Of a colour's mean: deviations below are rounding.
constexpr double flat = 1e-6;

Image relative(Image picture, const PictureMoments& moments) {
    for (int c = 0; c < picture.planes(); ++c) {
        const double mean = moments.mean[static_cast<std::size_t>(c)];
        const auto scale = static_cast<float>(mean > 0.0 ? 1.0 / mean : 0.0);
        for (float& value : picture.plane(c)) value = std::sqrt(std::max(value, 0.0F) * scale);
    }
    return picture;
}

/// z = 1 everywhere, as a field without variance.
TextureModel flat_texture(const BtfSet& set) {
    const auto planes = static_cast<std::size_t>(set.planes());
    CarModel field;
    field.kind = NeighbourhoodKind::causal;
    field.offsets = {{0, -1}};
    field.planes = set.planes();
    field.coefficients.assign(planes * planes, 0.0);
    field.noise_covariance.assign(planes * planes, 0.0);
    for (std::size_t i = 0; i < planes; ++i) field.noise_covariance[i * planes + i] = 1.0;
    TextureModel texture;
    texture.kind = ModelKind::car3d;
    texture.size = set.size();
    texture.planes = set.planes();
    texture.space = set.space();
    texture.names = set.description().names;
    texture.mean.assign(planes, 1.0);
    LevelModel level;
    level.size = set.size();
    level.models = {field};
    level.gain = 0.0;
    level.certificate.valid = true;
    level.certificate.min_singular = 1.0;
    texture.levels = {level};
    texture.provenance.type = PixelType::float32;
    texture.provenance.software = "btfield " BTFIELD_VERSION;
    return texture;
}

TextureModel fitted(Device& device, const Image& z, const FitOptions& field) {
    Analysis analysis(device, z);
    FitOptions how = field;
    TextureModel best = analysis.fit(how);
    const bool fixed =
        field.choose_model || field.order < 2 || !field.offsets.empty() || field.correlated > 0;
    while (!fixed && !is_valid(best) && how.order > 1) {
        --how.order;
        TextureModel lower = analysis.fit(how);
        if (is_valid(lower)) best = std::move(lower);
    }
    return best;
}

}  // namespace

std::string text_of_pair(const BtfSet& set, const BtfPair& pair) {
    return "the picture of view (" + text_of(set.views()[static_cast<std::size_t>(pair.view)]) +
           ") and light (" + text_of(set.light(pair.view, pair.light)) + ")";
}

PictureTexture picture_texture(Device& device, const BtfSet& set, const BtfPair& pair,
                               const FitOptions& field) {
    Image picture = set.picture(pair.view, pair.light);
    PictureTexture result;
    result.moments = moments_of(picture);
    bool varies = false;
    for (std::size_t c = 0; c < result.moments.mean.size(); ++c)
        varies = varies || result.moments.deviation[c] > flat * result.moments.mean[c];
    if (!varies) {
        result.texture = flat_texture(set);
        return result;
    }
    try {
        result.texture = fitted(device, relative(std::move(picture), result.moments), field);
    } catch (const InputError& error) {
        throw InputError("fit a texture to " + text_of_pair(set, pair), error.found(), error.remedy());
    }
    result.texture = single_precision(result.texture);
    return result;
}

void light_of_relative(Image& z, std::span<const float> means) {
    for (int c = 0; c < z.planes(); ++c) {
        const float mean = means[static_cast<std::size_t>(c)];
        for (float& value : z.plane(c)) {
            // Roots are not negative; a field's values may be.
            value = std::max(value, 0.0F);
            value *= mean * value;
        }
    }
}

}  // namespace btfield::detail

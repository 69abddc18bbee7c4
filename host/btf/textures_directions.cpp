#include "host/btf/textures_directions.hpp"

#include "host/btf/contrast_code.hpp"

namespace btfield::detail {

TexturesDirections::TexturesDirections(const BtfTextures& model) : directions_(model), labels_(model.labels) {
    const auto colours = static_cast<std::size_t>(model.colours);
    for (std::size_t row = 0; row < model.means.size(); row += colours) {
        for (std::size_t c = 0; c < colours; ++c) light_.push_back(model.means[row + c]);
        for (std::size_t c = 0; c < colours; ++c) {
            const double contrast = contrast_of_code(model.contrasts[row + c]);
            light_.push_back(static_cast<float>(contrast * static_cast<double>(model.means[row + c])));
        }
    }
}

std::size_t TexturesDirections::nearest(const BtfDirection& view, const BtfDirection& light) const {
    return directions_.points().nearest({view, light}, 1).front().pair;
}

BtfTextureLook TexturesDirections::look(const BtfDirection& view, const BtfDirection& light) const {
    BtfTextureLook look;
    look.texture = labels_[nearest(view, light)];
    if (light_.empty()) return look;
    const std::vector<double> found =
        directions_.light(directions_.points().interpolate({view, light}), light, light_);
    const auto half = found.begin() + static_cast<std::ptrdiff_t>(found.size() / 2);
    look.mean.assign(found.begin(), half);
    look.deviation.assign(half, found.end());
    return look;
}

}  // namespace btfield::detail

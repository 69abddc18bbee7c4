#include "host/btf/textures_directions.hpp"

#include "host/btf/contrast_code.hpp"

namespace btfield::detail {

TexturesDirections::TexturesDirections(const BtfTextures& model)
    : labels_(model.labels), matched_(model.match == BtfMatch::means) {
    static_cast<BtfMeasured&>(table_) = model;
    table_.colours = matched_ ? 2 * model.colours : 0;
    const auto colours = static_cast<std::size_t>(model.colours);
    for (std::size_t row = 0; matched_ && row < model.means.size(); row += colours) {
        for (std::size_t c = 0; c < colours; ++c) table_.tables.mean.push_back(model.means[row + c]);
        for (std::size_t c = 0; c < colours; ++c) {
            const double contrast = contrast_of_code(model.contrasts[row + c]);
            table_.tables.mean.push_back(
                static_cast<float>(contrast * static_cast<double>(model.means[row + c])));
        }
    }
    table_.tables.offsets.assign(table_.tables.mean.size(), 0);
    directions_ = std::make_unique<DirectionTable>(table_);
}

std::size_t TexturesDirections::nearest(const BtfDirection& view, const BtfDirection& light) const {
    return directions_->nearest(view, light, 1).front().pair;
}

BtfTextureLook TexturesDirections::look(const BtfDirection& view, const BtfDirection& light) const {
    BtfTextureLook look;
    look.texture = labels_[nearest(view, light)];
    if (!matched_) return look;
    const PictureWeights found = directions_->weights(view, light);
    const auto half = found.mean.begin() + static_cast<std::ptrdiff_t>(found.mean.size() / 2);
    look.mean.assign(found.mean.begin(), half);
    look.deviation.assign(half, found.mean.end());
    return look;
}

}  // namespace btfield::detail

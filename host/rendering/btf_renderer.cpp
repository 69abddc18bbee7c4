#include "btfield/btf_renderer.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include "btfield/error.hpp"
#include "host/base/text.hpp"
#include "host/btf/direction_grid.hpp"
#include "host/btf/direction_table.hpp"
#include "host/btf/seen_planes.hpp"
#include "host/rendering/lit_shape.hpp"
#include "host/rendering/lit_table.hpp"
#include "host/rendering/rendering_names.hpp"

namespace btfield {

using namespace detail;

namespace {

const std::string asked = "show a BTF";
/// Of Rec. 709.
constexpr double white_of_xyz[] = {0.95047, 1.0, 1.08883};

void check_scene(const BtfScene& scene) {
    if (scene.size.width < 1 || scene.size.height < 1)
        throw InputError(asked, "the picture is " + detail::text_of(scene.size), "give it a pixel at least");
    if (!(scene.scale > 0.0 && std::isfinite(scene.scale)))
        throw InputError(asked, "the scale is not above 0", "1 shows the material's pixels as they are");
    if (!(scene.background >= 0.0 && std::isfinite(scene.background)))
        throw InputError(asked, "the background is below 0", "give a share of white");
}

}  // namespace

std::string_view name(BtfShape shape) {
    return word_of(shape);
}

int tiles_around(const BtfScene& scene, int tile_width) {
    const double tiles = 2.0 * std::numbers::pi * sphere_radius(scene.size) / (scene.scale * tile_width);
    return static_cast<int>(std::clamp(std::round(tiles), 1.0, 1e6));
}

class BtfRenderer::Impl {
  public:
    Impl(Device& device, const BtfModel& model, const BtfSynthesiser& grown)
        : model_(model),
          tile_(grown.size()),
          tileable_(grown.tileable()),
          planes_(device.impl(), grown.surface(), steepest_view(model_)),
          table_(model_, &planes_),
          shape_(device.impl(), grown.surface(), model.colours) {}

    [[nodiscard]] Image picture(const BtfScene& scene, const BtfDirection& view,
                                const BtfDirection& light) const {
        check_scene(scene);
        check_shown(view, "view", asked);
        check_shown(light, "light", asked);
        const LitView seen{camera_frame(view), light.vector(), table_.measured().steepest_view()};
        Image image;
        if (scene.shape == BtfShape::plane) {
            image = shape_.plane(scene, seen, {1, 1, {lit_weights(table_, view, light)}});
        } else {
            LitTable table = sphere_table(table_, seen.camera.to, seen.light);
            table.background = grey(scene.background);
            image = shape_.sphere(scene, seen, table);
        }
        const auto white = static_cast<float>(1.0 / model_.white);
        if (model_.white != 1.0)
            for (float& value : image.values()) value *= white;
        image.set_space(model_.space);
        image.set_names(model_.names);
        return image;
    }
    [[nodiscard]] Size tile() const { return tile_; }
    [[nodiscard]] bool tileable() const { return tileable_; }

  private:
    [[nodiscard]] std::vector<double> grey(double share) const {
        std::vector<double> result(static_cast<std::size_t>(model_.colours), share * model_.white);
        if (model_.space == ColourSpace::xyz && model_.colours == 3) {
            result[0] *= white_of_xyz[0];
            result[2] *= white_of_xyz[2];
        }
        return result;
    }

    BtfModel model_;
    Size tile_;
    bool tileable_;
    SeenPlanes planes_;
    DirectionTable table_;
    LitShape shape_;
};

BtfRenderer::BtfRenderer(Device& device, const BtfModel& model, Size tile, std::uint64_t seed,
                         bool allow_invalid)
    : impl_(std::make_unique<Impl>(device, model, BtfSynthesiser(device, model, tile, seed, allow_invalid))) {
}

BtfRenderer::BtfRenderer(Device& device, const BtfModel& model, const Image& surface)
    : impl_(std::make_unique<Impl>(device, model, BtfSynthesiser(device, model, surface))) {}

BtfRenderer::~BtfRenderer() = default;
BtfRenderer::BtfRenderer(BtfRenderer&&) noexcept = default;
BtfRenderer& BtfRenderer::operator=(BtfRenderer&&) noexcept = default;

Image BtfRenderer::picture(const BtfScene& scene, const BtfDirection& view, const BtfDirection& light) const {
    return impl_->picture(scene, view, light);
}

Size BtfRenderer::tile() const {
    return impl_->tile();
}

bool BtfRenderer::tileable() const {
    return impl_->tileable();
}

}  // namespace btfield

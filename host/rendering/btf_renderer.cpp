#include "btfield/btf_renderer.hpp"

#include <algorithm>
#include <cmath>
#include <memory>
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
#include "host/rendering/shape_places.hpp"
#include "host/rendering/textured_shape.hpp"

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

namespace detail {

/// A material as it is shown, in the model's own units.
class ShownMaterial {
  public:
    virtual ~ShownMaterial() = default;
    [[nodiscard]] virtual Image plane(const BtfScene& scene, const BtfDirection& view,
                                      const BtfDirection& light) const = 0;
    [[nodiscard]] virtual Image sphere(const BtfScene& scene, const BtfDirection& view,
                                       const BtfDirection& light,
                                       const std::vector<double>& background) const = 0;
    [[nodiscard]] virtual Size tile() const = 0;
    [[nodiscard]] virtual bool tileable() const = 0;

  protected:
    ShownMaterial() = default;
    ShownMaterial(const ShownMaterial&) = default;
    ShownMaterial& operator=(const ShownMaterial&) = default;
};

}  // namespace detail

namespace {

class ShownPlanes : public ShownMaterial {
  public:
    ShownPlanes(Device& device, const BtfModel& model, const BtfSynthesiser& grown)
        : model_(model),
          tile_(grown.size()),
          tileable_(grown.tileable()),
          planes_(device.impl(), grown.surface(), steepest_view(model_)),
          table_(model_, &planes_),
          shape_(device.impl(), grown.surface(), model.colours) {}

    [[nodiscard]] Image plane(const BtfScene& scene, const BtfDirection& view,
                              const BtfDirection& light) const override {
        return shape_.plane(scene, seen(view, light), {1, 1, {lit_weights(table_, view, light)}});
    }
    [[nodiscard]] Image sphere(const BtfScene& scene, const BtfDirection& view, const BtfDirection& light,
                               const std::vector<double>& background) const override {
        const LitView from = seen(view, light);
        LitTable table = sphere_table(table_, from.camera.to, from.light);
        table.background = background;
        return shape_.sphere(scene, from, table);
    }
    [[nodiscard]] Size tile() const override { return tile_; }
    [[nodiscard]] bool tileable() const override { return tileable_; }

  private:
    [[nodiscard]] LitView seen(const BtfDirection& view, const BtfDirection& light) const {
        return {camera_frame(view), light.vector(), table_.measured().steepest_view()};
    }

    BtfModel model_;
    Size tile_;
    bool tileable_;
    SeenPlanes planes_;
    DirectionTable table_;
    LitShape shape_;
};

class ShownTextures : public ShownMaterial {
  public:
    ShownTextures(Device& device, const BtfTextures& model, Size tile, std::uint64_t seed, bool allow_invalid)
        : shape_(device, model, tile, seed, allow_invalid) {}

    [[nodiscard]] Image plane(const BtfScene& scene, const BtfDirection& view,
                              const BtfDirection& light) const override {
        return shape_.plane(scene, view, light);
    }
    [[nodiscard]] Image sphere(const BtfScene& scene, const BtfDirection& view, const BtfDirection& light,
                               const std::vector<double>& background) const override {
        return shape_.sphere(scene, camera_frame(view), light.vector(), background);
    }
    [[nodiscard]] Size tile() const override { return shape_.tile(); }
    [[nodiscard]] bool tileable() const override { return shape_.tileable(); }

  private:
    TexturedShape shape_;
};

}  // namespace

class [[gnu::visibility("hidden")]] BtfRenderer::Impl {
  public:
    Impl(const BtfMeasured& of, std::unique_ptr<const ShownMaterial> material)
        : colours_(of.colours),
          space_(of.space),
          white_(of.white),
          names_(of.names),
          material_(std::move(material)) {}

    [[nodiscard]] Image picture(const BtfScene& scene, const BtfDirection& view, const BtfDirection& light)
        const {
        check_scene(scene);
        check_shown(view, "view", asked);
        check_shown(light, "light", asked);
        Image image = scene.shape == BtfShape::plane
                          ? material_->plane(scene, view, light)
                          : material_->sphere(scene, view, light, grey(scene.background));
        const auto white = static_cast<float>(1.0 / white_);
        if (white_ != 1.0)
            for (float& value : image.values()) value *= white;
        image.set_space(space_);
        image.set_names(names_);
        return image;
    }
    [[nodiscard]] const ShownMaterial& material() const {
        return *material_;
    }

  private:
    [[nodiscard]] std::vector<double> grey(double share) const {
        std::vector<double> result(static_cast<std::size_t>(colours_), share * white_);
        if (space_ == ColourSpace::xyz && colours_ == 3) {
            result[0] *= white_of_xyz[0];
            result[2] *= white_of_xyz[2];
        }
        return result;
    }

    int colours_;
    ColourSpace space_;
    double white_;
    std::vector<std::string> names_;
    std::unique_ptr<const ShownMaterial> material_;
};

BtfRenderer::BtfRenderer(Device& device, const BtfModel& model, Size tile, std::uint64_t seed,
                         bool allow_invalid)
    : impl_(std::make_unique<Impl>(
          model, std::make_unique<ShownPlanes>(device, model,
                                               BtfSynthesiser(device, model, tile, seed, allow_invalid)))) {}

BtfRenderer::BtfRenderer(Device& device, const BtfModel& model, const Image& surface)
    : impl_(std::make_unique<Impl>(
          model, std::make_unique<ShownPlanes>(device, model, BtfSynthesiser(device, model, surface)))) {}

BtfRenderer::BtfRenderer(Device& device, const BtfTextures& model, Size tile, std::uint64_t seed,
                         bool allow_invalid)
    : impl_(std::make_unique<Impl>(
          model, std::make_unique<ShownTextures>(device, model, tile, seed, allow_invalid))) {}

BtfRenderer::~BtfRenderer() = default;
BtfRenderer::BtfRenderer(BtfRenderer&&) noexcept = default;
BtfRenderer& BtfRenderer::operator=(BtfRenderer&&) noexcept = default;

Image BtfRenderer::picture(const BtfScene& scene, const BtfDirection& view, const BtfDirection& light) const {
    return impl_->picture(scene, view, light);
}

Size BtfRenderer::tile() const {
    return impl_->material().tile();
}

bool BtfRenderer::tileable() const {
    return impl_->material().tileable();
}

}  // namespace btfield

#include <cmath>
#include <memory>
#include <mutex>
#include <string>
#include <utility>

#include "btfield/btf_model.hpp"
#include "btfield/error.hpp"
#include "host/base/text.hpp"
#include "host/btf/direction_grid.hpp"
#include "host/btf/direction_table.hpp"
#include "host/btf/seen_planes.hpp"
#include "host/btf/surface_field.hpp"
#include "host/btf/surface_view.hpp"

namespace btfield {

using namespace detail;

class BtfSynthesiser::Impl {
  public:
    Impl(Device& device, const BtfModel& model, GrownSurface grown)
        : device_(&device.impl()),
          model_(model),
          grown_(std::move(grown)),
          table_(model_),
          view_(device.impl(), grown_.surface, model.colours) {}

    [[nodiscard]] Image picture(const BtfDirection& view, const BtfDirection& light) const {
        check_shown(view, "view", "show a BTF");
        check_shown(light, "light", "show a BTF");
        Image image = view_.picture(view.vector(), table_.weights(view, light));
        image.set_space(model_.space);
        image.set_names(model_.names);
        return image;
    }
    [[nodiscard]] const GrownSurface& grown() const { return grown_; }
    [[nodiscard]] const SeenPlanes& planes() const {
        std::call_once(seeing_, [this] {
            planes_ = std::make_unique<SeenPlanes>(*device_, grown_.surface, steepest_view(model_));
        });
        return *planes_;
    }

  private:
    DeviceImpl* device_;
    BtfModel model_;
    GrownSurface grown_;
    DirectionTable table_;
    SurfaceView view_;
    mutable std::once_flag seeing_;
    mutable std::unique_ptr<SeenPlanes> planes_;  ///< made when they are asked for
};

const SeenPlanes& detail::seen_planes(const BtfSynthesiser& grown) {
    return grown.impl_->planes();
}

BtfSynthesiser::BtfSynthesiser(Device& device, const BtfModel& model, Size size, std::uint64_t seed,
                               bool allow_invalid) {
    check(model);
    impl_ =
        std::make_unique<Impl>(device, model, grow_surface(device, model.surface, size, seed, allow_invalid));
}

BtfSynthesiser::BtfSynthesiser(Device& device, const BtfModel& model, const Image& surface) {
    check(model);
    if (surface.planes() != model.planes() + 1)
        throw InputError("show a BTF", "the surface has " + counted(surface.planes(), "plane"),
                         "give the height and the " + counted(model.planes(), "plane") + " of the model");
    impl_ = std::make_unique<Impl>(device, model, GrownSurface{surface, true});
}

BtfSynthesiser::~BtfSynthesiser() = default;
BtfSynthesiser::BtfSynthesiser(BtfSynthesiser&&) noexcept = default;
BtfSynthesiser& BtfSynthesiser::operator=(BtfSynthesiser&&) noexcept = default;

Image BtfSynthesiser::picture(const BtfDirection& view, const BtfDirection& light) const {
    return impl_->picture(view, light);
}

Size BtfSynthesiser::size() const {
    return impl_->grown().surface.size();
}

bool BtfSynthesiser::tileable() const {
    return impl_->grown().tileable;
}

const Image& BtfSynthesiser::surface() const {
    return impl_->grown().surface;
}

}  // namespace btfield

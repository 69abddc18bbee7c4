#include <algorithm>
#include <array>
#include <functional>
#include <string>
#include <utility>

#include "btfield/compound.hpp"
#include "btfield/error.hpp"
#include "host/base/limits.hpp"
#include "host/base/stop.hpp"
#include "host/base/text.hpp"
#include "host/cl/device_impl.hpp"
#include "host/compound/conditional_mean.hpp"
#include "host/compound/control_growth.hpp"
#include "host/compound/region_restorer.hpp"
#include "host/compound/regional_fields.hpp"

namespace btfield {

using namespace detail;

namespace {

using std::size_t;

/// Of the time that a texture takes: 0.8 to 0.4 at 128² to 1024² (cork and bark, PoCL on two cores).
constexpr double field_share = 0.5;

std::vector<const TextureModel*> residuals_of(const CompoundModel& model) {
    std::vector<const TextureModel*> residuals;
    residuals.reserve(model.regions.size());
    for (const CompoundRegion& region : model.regions) residuals.push_back(&region.residual);
    return residuals;
}

}  // namespace

void check_synthesis(const CompoundModel& model, Size size, bool allow_invalid) {
    check(model);
    const std::string asked = "synthesise " + compact_text_of(size) + " from this compound model";
    if (std::min(size.height, size.width) < 16)
        throw InputError(asked, "a side is below 16 pixels, which the roller needs", "ask for a larger one");
    if (std::max(size.height, size.width) > 16384)
        throw InputError(asked, "a side is above 16384 pixels", "ask for a smaller one");
    if (allow_invalid) return;
    for (size_t k = 0; k < model.regions.size(); ++k)
        if (!is_valid(model.regions[k].residual))
            throw InputError(
                asked,
                "a certificate of region " + std::to_string(k) +
                    " fails: it would not have the statistics that were fitted",
                "fit with --local 3d-ma or a causal neighbourhood, or insist with --allow-invalid");
}

class [[gnu::visibility("hidden")]] CompoundSynthesiser::Impl {
  public:
    Impl(Device & device, const CompoundModel& model, Size size, bool allow_invalid)
        : device_(&device.impl()),
          planes_(model.planes),
          regions_(static_cast<int>(model.regions.size())),
          space_(model.space),
          names_(model.names),
          plane_spaces_(model.plane_spaces),
          size_(checked(model, size, allow_invalid)),
          fields_(*device_, residuals_of(model), size),
          mean_(*device_, mean_weights(model)),
          restorer_(*device_, model),
          growth_(device, model) {
        check_memory();
        const ControlField nothing{lattice(), regions_, std::vector<std::uint8_t>(area(lattice()), 0)};
        {
            const DeviceImpl::Rehearsal rehearsal;
            static_cast<void>(grow(0, nothing));
        }
        device_->finish();
    }

    [[nodiscard]] ControlField control_field(std::uint64_t seed,
                                             const std::function<void(double)>& progress = {}) {
        return growth_.grow(lattice(), seed, progress);
    }

    [[nodiscard]] Image synthesise(std::uint64_t seed, const std::function<void(double)>& progress) {
        std::function<void(double)> told;
        if (progress) told = [&](double share) { progress(field_share * share); };
        const ControlField field = control_field(seed, told);
        stop_if_asked();
        Image image = synthesise(seed, field);
        if (progress) progress(1.0);
        return image;
    }

    [[nodiscard]] Image synthesise(std::uint64_t seed, const ControlField& field) {
        return download(checked_grow(seed, field));
    }

    void synthesise_to(std::uint64_t seed, const ControlField& field, const DeviceMemory& target) {
        const auto planes_count = static_cast<size_t>(planes_);
        device_->check_target(target, sizeof(float) * planes_count * area(size_),
                              "a texture of " + text_of(size_) + " with " + counted(planes_, "plane"));
        const DevicePlanes planes = checked_grow(seed, field);
        device_->copy(planes.values, {planes.lattice, 0, planes_count, 0, 0, size_}, target, 0);
        device_->flush();
    }

    [[nodiscard]] Size size() const {
        return size_;
    }
    [[nodiscard]] Size lattice() const {
        return fields_.layout().lattice;
    }
    [[nodiscard]] bool tileable() const {
        return fields_.layout().tiles();
    }

  private:
    [[nodiscard]] DevicePlanes checked_grow(std::uint64_t seed, const ControlField& field) {
        check(field);
        if (field.size != size_ && field.size != lattice())
            throw InputError("synthesise " + compact_text_of(size_) + " on this control field",
                             "it is " + text_of(field.size), "give one of the texture's size");
        if (field.regions > regions_)
            throw InputError(
                "synthesise on this control field",
                "it has " + std::to_string(field.regions) + " regions, the model " + std::to_string(regions_),
                "use labels below " + std::to_string(regions_));
        return grow(seed, field.size == lattice() ? field : on_lattice(field, lattice()));
    }

    static Size checked(const CompoundModel& model, Size size, bool allow_invalid) {
        check_synthesis(model, size, allow_invalid);
        return size;
    }

    void check_memory() const {
        // Levels and their noise, or a spectrum and its room; the mean and what smooths it.
        const double bytes = fields_.layout().bytes(fields_.planes(), false) +
                             sizeof(float) * 2.0 * planes_ * static_cast<double>(area(lattice()));
        if (bytes <= device_->memory_limit()) return;
        throw DeviceError(
            "synthesise " + compact_text_of(size_) + " on device '" + device_->info().name + "'",
            "it takes " + bytes_text(bytes) + " where " + bytes_text(device_->memory_limit()) +
                " may be used",
            "give a smaller size, allow more device memory ($BTFIELD_MEMORY), or take a device that has "
            "more");
    }

    [[nodiscard]] DevicePlanes grow(std::uint64_t seed, const ControlField& field) {
        const Buffer labels = device_->upload(field.labels);
        const std::vector<std::array<std::uint32_t, 2>> words{
            {static_cast<std::uint32_t>(seed), static_cast<std::uint32_t>(seed >> 32)}};
        const DevicePlanes fields = fields_.grow(labels, device_->upload(words));
        return restorer_.restore(fields, mean_.of(labels, field.size), labels, seed);
    }

    [[nodiscard]] Image download(const DevicePlanes& planes) const {
        Image lattice_image(planes.size, planes_, space_);
        lattice_image.set_names(names_);
        lattice_image.set_plane_spaces(plane_spaces_);
        device_->read(planes.values, lattice_image.values().data(), lattice_image.values().size_bytes());
        if (planes.size == size_) return lattice_image;
        Image image(size_, planes_, space_);
        image.set_names(names_);
        image.set_plane_spaces(plane_spaces_);
        const auto width = static_cast<size_t>(size_.width), pitch = static_cast<size_t>(planes.size.width);
        for (int p = 0; p < planes_; ++p)
            for (size_t r = 0; r < static_cast<size_t>(size_.height); ++r)
                std::ranges::copy(lattice_image.plane(p).subspan(r * pitch, width),
                                  image.plane(p).subspan(r * width, width).begin());
        return image;
    }

    DeviceImpl* device_;
    int planes_, regions_;
    ColourSpace space_;
    std::vector<std::string> names_;
    std::vector<ColourSpace> plane_spaces_;
    Size size_;
    RegionalFields fields_;
    ConditionalMean mean_;
    RegionRestorer restorer_;
    ControlGrowth growth_;
};

CompoundSynthesiser::CompoundSynthesiser(Device& device, const CompoundModel& model, Size size,
                                         bool allow_invalid)
    : impl_(std::make_unique<Impl>(device, model, size, allow_invalid)) {}
CompoundSynthesiser::~CompoundSynthesiser() = default;
CompoundSynthesiser::CompoundSynthesiser(CompoundSynthesiser&&) noexcept = default;
CompoundSynthesiser& CompoundSynthesiser::operator=(CompoundSynthesiser&&) noexcept = default;

ControlField CompoundSynthesiser::control_field(std::uint64_t seed) {
    return impl_->control_field(seed);
}
ControlField CompoundSynthesiser::control_field(std::uint64_t seed,
                                                const std::function<void(double)>& progress) {
    return impl_->control_field(seed, progress);
}
Image CompoundSynthesiser::synthesise(std::uint64_t seed) {
    return impl_->synthesise(seed, std::function<void(double)>());
}
Image CompoundSynthesiser::synthesise(std::uint64_t seed, const std::function<void(double)>& progress) {
    return impl_->synthesise(seed, progress);
}
Image CompoundSynthesiser::synthesise(std::uint64_t seed, const ControlField& field) {
    return impl_->synthesise(seed, field);
}
void CompoundSynthesiser::synthesise_to(std::uint64_t seed, const ControlField& field,
                                        const DeviceMemory& target) {
    impl_->synthesise_to(seed, field, target);
}
Size CompoundSynthesiser::size() const {
    return impl_->size();
}
Size CompoundSynthesiser::lattice() const {
    return impl_->lattice();
}
bool CompoundSynthesiser::tileable() const {
    return impl_->tileable();
}

}  // namespace btfield

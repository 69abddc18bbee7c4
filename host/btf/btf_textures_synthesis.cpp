#include <algorithm>
#include <cmath>
#include <list>
#include <mutex>
#include <span>
#include <string>
#include <utility>

#include "btfield/btf_textures.hpp"
#include "btfield/error.hpp"
#include "btfield/synthesis.hpp"
#include "host/base/parallel.hpp"
#include "host/base/text.hpp"
#include "host/btf/direction_grid.hpp"
#include "host/btf/matched_tone.hpp"
#include "host/btf/picture_texture.hpp"
#include "host/btf/textures_directions.hpp"

namespace btfield {

using namespace detail;

namespace detail {

/// A texture in linear light, and what its colours are toned by.
struct GrownTexture {
    Image picture;
    bool tileable = true;
    std::vector<TonedPlane> colours;

    void take(Image image) {
        picture = std::move(image);
        for (int c = 0; c < picture.planes(); ++c) colours.emplace_back(picture.plane(c));
    }
    [[nodiscard]] Image dressed(const BtfTextureLook& look) const {
        Image result = picture;
        if (look.mean.empty()) return result;
        for (std::size_t c = 0; c < colours.size(); ++c)
            tone_plane(result.plane(static_cast<int>(c)), colours[c].tone(look.mean[c], look.deviation[c]));
        return result;
    }
};

struct TextureSlot {
    std::mutex growing;
    std::shared_ptr<const GrownTexture> grown;  ///< under the cache's mutex
};

}  // namespace detail

namespace {

/// Of grown textures that are kept; one at least is.
constexpr std::size_t kept_texture_bytes = std::size_t{512} << 20;
constexpr const char* asked_show = "show a BTF";

}  // namespace

class [[gnu::visibility("hidden")]] BtfTextureSynthesiser::Impl {
  public:
    Impl(Device & device, BtfTextures model, Size size, std::uint64_t seed, bool allow_invalid)
        : device_(&device), model_(std::move(model)), size_(size), seed_(seed), directions_(checked(model_)) {
        options_.allow_invalid = allow_invalid;
        for (std::size_t i = 0; i < model_.textures.size(); ++i) check_texture(i);
        slots_ = std::vector<TextureSlot>(model_.textures.size());
        tileable_ = grown(0)->tileable;
    }

    [[nodiscard]] BtfTextureLook look(const BtfDirection& view, const BtfDirection& light) const {
        check_shown(view, "view", asked_show);
        check_shown(light, "light", asked_show);
        return directions_.look(view, light);
    }
    [[nodiscard]] std::shared_ptr<const GrownTexture> grown(int texture) const;
    [[nodiscard]] Size size() const {
        return size_;
    }
    [[nodiscard]] bool tileable() const {
        return tileable_;
    }
    [[nodiscard]] const BtfTextures& model() const {
        return model_;
    }

  private:
    static const BtfTextures& checked(const BtfTextures& model) {
        check(model);
        return model;
    }
    void check_texture(std::size_t index) const {
        try {
            check_synthesis(model_.textures[index], size_, options_);
        } catch (const InputError& error) {
            throw InputError(
                "grow texture " + std::to_string(index) + " of " + std::to_string(model_.textures.size()),
                error.found(), error.remedy());
        }
    }
    void keep(std::size_t index, std::shared_ptr<const GrownTexture> grown) const;

    Device* device_;
    BtfTextures model_;
    Size size_;
    std::uint64_t seed_;
    TexturesDirections directions_;
    SynthesisOptions options_;
    bool tileable_ = true;
    mutable std::vector<TextureSlot> slots_;
    mutable std::mutex keeping_;
    mutable std::list<std::size_t> recent_;  ///< that are kept, the last used first
};

void BtfTextureSynthesiser::Impl::keep(std::size_t index, std::shared_ptr<const GrownTexture> grown) const {
    const std::size_t each =
        sizeof(float) * area(size_) * static_cast<std::size_t>(std::max(model_.colours, 1));
    const std::lock_guard lock(keeping_);
    slots_[index].grown = std::move(grown);
    recent_.push_front(index);
    while (recent_.size() > std::max<std::size_t>(kept_texture_bytes / each, 1)) {
        slots_[recent_.back()].grown.reset();
        recent_.pop_back();
    }
}

std::shared_ptr<const GrownTexture> BtfTextureSynthesiser::Impl::grown(int texture) const {
    const auto index = static_cast<std::size_t>(texture);
    const auto kept = [&]() -> std::shared_ptr<const GrownTexture> {
        const std::lock_guard lock(keeping_);
        if (slots_[index].grown) {
            const auto at = std::ranges::find(recent_, index);
            recent_.splice(recent_.begin(), recent_, at);
        }
        return slots_[index].grown;
    };
    if (auto found = kept()) return found;
    // Of several threads that want the same texture one grows it.
    const std::lock_guard lock(slots_[index].growing);
    if (auto found = kept()) return found;
    Synthesiser synthesiser(*device_, model_.textures[index], size_, options_);
    Image z = synthesiser.synthesise(seed_);
    light_of_relative(z, std::span(model_.texture_means)
                             .subspan(index * static_cast<std::size_t>(model_.colours),
                                      static_cast<std::size_t>(model_.colours)));
    z.set_space(model_.space);
    z.set_names(model_.names);
    const auto result = std::make_shared<GrownTexture>();
    result->tileable = synthesiser.tileable();
    result->take(std::move(z));
    keep(index, result);
    return result;
}

BtfTextureSynthesiser::BtfTextureSynthesiser(Device& device, BtfTextures model, Size size, std::uint64_t seed,
                                             bool allow_invalid)
    : impl_(std::make_unique<Impl>(device, std::move(model), size, seed, allow_invalid)) {}

BtfTextureSynthesiser::~BtfTextureSynthesiser() = default;
BtfTextureSynthesiser::BtfTextureSynthesiser(BtfTextureSynthesiser&&) noexcept = default;
BtfTextureSynthesiser& BtfTextureSynthesiser::operator=(BtfTextureSynthesiser&&) noexcept = default;

Image BtfTextureSynthesiser::picture(const BtfDirection& view, const BtfDirection& light) const {
    const BtfTextureLook look = impl_->look(view, light);
    return impl_->grown(look.texture)->dressed(look);
}

BtfTextureLook BtfTextureSynthesiser::look(const BtfDirection& view, const BtfDirection& light) const {
    return impl_->look(view, light);
}

Image BtfTextureSynthesiser::texture(int index) const {
    const std::size_t count = impl_->model().textures.size();
    if (index < 0 || static_cast<std::size_t>(index) >= count)
        throw InputError(asked_show, "there is no texture " + std::to_string(index),
                         "the model has 0 to " + std::to_string(count - 1));
    return impl_->grown(index)->picture;
}

Image BtfTextureSynthesiser::dressed(const Image& texture, const BtfTextureLook& look) {
    const auto colours = static_cast<std::size_t>(texture.planes());
    if (!look.mean.empty() && (look.mean.size() != colours || look.deviation.size() != colours))
        throw InputError(asked_show, "the texture has " + counted(colours, "colour") + ", the look others",
                         "give a texture of the model");
    GrownTexture grown;
    grown.take(texture);
    return grown.dressed(look);
}

Size BtfTextureSynthesiser::size() const {
    return impl_->size();
}

bool BtfTextureSynthesiser::tileable() const {
    return impl_->tileable();
}

const BtfTextures& BtfTextureSynthesiser::model() const {
    return impl_->model();
}

}  // namespace btfield

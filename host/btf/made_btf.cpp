#include "btfield/made_btf.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <deque>
#include <memory>
#include <mutex>
#include <span>
#include <string>
#include <utility>

#include "btfield/error.hpp"
#include "host/base/text.hpp"
#include "host/btf/direction_grid.hpp"
#include "host/cl/device_impl.hpp"

namespace btfield {

using namespace detail;

namespace {

using std::size_t;

constexpr const char* asked_make = "make a BTF";
/// Device memory for what views hit, one after the other, and for what each light reaches, which every view
/// asks for.
constexpr double kept_view_bytes = 64e6, kept_light_bytes = 512e6;

void expect_map(const Image& map, Size size, int planes, const std::string& what) {
    if (map.size() != size || map.planes() != planes)
        throw InputError(asked_make,
                         what + " has " + text_of(map.size()) + " pixels and " +
                             counted(map.planes(), "plane") + ", not " + text_of(size) + " and " +
                             std::to_string(planes),
                         "give maps of one surface");
    if (!std::ranges::all_of(map.values(), [](float value) { return std::isfinite(value); }))
        throw InputError(asked_make, what + " has a value that is not a finite number", "repair the map");
}

void check(const BtfMaterial& material, const MadeBtfOptions& options) {
    const Size size = material.albedo.size();
    if (material.albedo.planes() < 1)
        throw InputError(asked_make, "there is no albedo", "give maps of a surface");
    expect_map(material.albedo, size, material.albedo.planes(), "the albedo");
    expect_map(material.normals, size, 3, "the normal map");
    expect_map(material.height, size, 1, "the height");
    if (material.roughness.planes() > 0) expect_map(material.roughness, size, 1, "the roughness");
    for (const auto& [value, what] :
         {std::pair(options.roughness, "roughness"), std::pair(options.reflectance, "reflectance")})
        if (!(value >= 0.0 && value <= 1.0))
            throw InputError(asked_make, std::string(what) + " is " + std::to_string(value), "give 0 to 1");
    if (options.views.empty() || options.lights.empty())
        throw InputError(asked_make, "there is no view or no light", "give directions");
    for (const auto* list : {&options.views, &options.lights})
        for (const BtfDirection& d : *list)
            // Rays closer to the plane would never end.
            if (!std::isfinite(d.phi) || !(d.theta >= 0.0) || !(d.theta <= radians(89.0)))
                throw InputError(asked_make, "a direction is " + text_of(d),
                                 "directions are above the surface: theta from 0 to 89 degrees");
}

/// What was computed, by number, as far as room goes.
class Kept {
  public:
    /// Of numbers that come round and round, what was computed last makes room: the oldest is wanted next.
    enum class Order { ascending, rounds };
    Kept(size_t most, Order order) : most_(most), order_(order) {}
    [[nodiscard]] std::shared_ptr<const std::vector<Buffer>> find(int number) const {
        for (const auto& [own, buffers] : kept_)
            if (own == number) return buffers;
        return nullptr;
    }
    void add(int number, std::shared_ptr<const std::vector<Buffer>> buffers) {
        if (kept_.size() >= most_) {
            if (order_ == Order::ascending)
                kept_.pop_front();
            else
                kept_.pop_back();
        }
        kept_.emplace_back(number, std::move(buffers));
    }

  private:
    size_t most_;
    Order order_;
    std::deque<std::pair<int, std::shared_ptr<const std::vector<Buffer>>>> kept_;
};

using Buffers = std::shared_ptr<const std::vector<Buffer>>;

/// Of kernels that follow rays, each its own way.
BuildParameters scalar() {
    return BuildParameters().set("BTFIELD_VECTOR_WIDTH", 1);
}

std::array<float, 3> floats(const BtfDirection& direction) {
    const auto v = direction.vector();
    return {static_cast<float>(v[0]), static_cast<float>(v[1]), static_cast<float>(v[2])};
}

class MadeBtf : public BtfSource {
  public:
    MadeBtf(Device& device, const BtfMaterial& material, const MadeBtfOptions& options)
        : device_(device.impl()),
          size_(material.albedo.size()),
          planes_(material.albedo.planes() + 4),
          reflectance_(static_cast<float>(options.reflectance)),
          views_(room(planes_ + 2, kept_view_bytes), Kept::Order::ascending),
          lights_(room(1, std::min(kept_light_bytes, 0.25 * device_.memory_limit())), Kept::Order::rounds) {
        description_.format = "made";
        description_.size = size_;
        description_.planes = material.albedo.planes();
        description_.names = material.albedo.names();
        description_.space = planes_ == 7 ? material.albedo.space() : ColourSpace::unspecified;
        if (description_.space == ColourSpace::srgb) description_.space = ColourSpace::linear;
        description_.views = options.views;
        description_.lights = options.lights;
        take_height(material.height);
        Image maps(size_, planes_);
        const auto put = [&](const Image& map, int first) {
            std::ranges::copy(map.values(),
                              maps.values().begin() +
                                  static_cast<std::ptrdiff_t>(static_cast<size_t>(first) * area(size_)));
        };
        put(material.albedo, 0);
        put(material.normals, planes_ - 4);
        if (material.roughness.planes() > 0)
            put(material.roughness, planes_ - 1);
        else
            std::ranges::fill(maps.plane(planes_ - 1), static_cast<float>(options.roughness));
        // A mirror's lobe is a point.
        for (float& value : maps.plane(planes_ - 1)) value = std::clamp(value, 0.05F, 1.0F);
        maps_ = device_.upload(std::span<const float>(maps.values()));
    }

    [[nodiscard]] const BtfDescription& description() const override { return description_; }

    [[nodiscard]] Image picture(int view, int light) const override {
        const Buffers seen = kept(views_, view, [&] { return trace(view); });
        const Buffers lit = kept(lights_, light, [&] { return cast(light); });
        Image image(size_, description_.planes, description_.space);
        image.set_names(description_.names);
        Buffer picture = device_.buffer(image.values().size_bytes());
        const auto v = floats(description_.views[static_cast<size_t>(view)]),
                   l = floats(description_.lights[static_cast<size_t>(light)]);
        const size_t lanes = static_cast<size_t>(device_.vector_width());
        device_.launch(device_.kernel("made_btf", "shade", device_.lanes()),
                       {(area(size_) + lanes - 1) / lanes}, Grain::fine, (*seen)[0], (*seen)[1], (*lit)[0],
                       planes_, v[0], v[1], v[2], l[0], l[1], l[2], reflectance_, picture, size_.width,
                       size_.height);
        device_.read(picture, image.values().data(), image.values().size_bytes());
        return image;
    }

  private:
    /// How many of these many planes are kept.
    [[nodiscard]] size_t room(int planes, double kept_bytes) const {
        const double bytes = sizeof(float) * static_cast<double>(planes) * static_cast<double>(area(size_));
        return static_cast<size_t>(std::max(4.0, kept_bytes / bytes));
    }

    void take_height(const Image& height) {
        double sum = 0.0;
        for (const float value : height.values()) sum += static_cast<double>(value);
        const double mean = sum / static_cast<double>(area(size_));
        description_.height = height;
        for (float& value : description_.height.values())
            value = static_cast<float>(static_cast<double>(value) - mean);
        const auto [low, high] = std::ranges::minmax(description_.height.values());
        lowest_ = low;
        highest_ = high;
        height_ = device_.upload(std::span<const float>(description_.height.values()));
    }

    template <typename Make>
    Buffers kept(Kept& among, int number, const Make& make) const {
        const std::lock_guard lock(mutex_);
        if (Buffers found = among.find(number)) return found;
        Buffers made = make();
        among.add(number, made);
        return made;
    }

    [[nodiscard]] Range pixels() const {
        return {static_cast<size_t>(size_.width), static_cast<size_t>(size_.height)};
    }

    [[nodiscard]] Buffers trace(int view) const {
        const auto d = floats(description_.views[static_cast<size_t>(view)]);
        std::vector<Buffer> made;
        made.push_back(device_.buffer(2 * sizeof(float) * area(size_)));
        made.push_back(device_.buffer(static_cast<size_t>(planes_) * sizeof(float) * area(size_)));
        device_.launch(device_.kernel("made_btf", "trace_view", scalar()), pixels(), Grain::fine, height_,
                       maps_, planes_, d[0], d[1], d[2], lowest_, highest_, made[0], made[1], size_.width,
                       size_.height);
        return std::make_shared<const std::vector<Buffer>>(std::move(made));
    }

    [[nodiscard]] Buffers cast(int light) const {
        const auto d = floats(description_.lights[static_cast<size_t>(light)]);
        std::vector<Buffer> made;
        made.push_back(device_.buffer(sizeof(float) * area(size_)));
        const auto farthest = 3.0F * static_cast<float>(std::max(size_.width, size_.height));
        device_.launch(device_.kernel("made_btf", "cast_light", scalar()), pixels(), Grain::fine, height_,
                       d[0], d[1], d[2], highest_, farthest, made[0], size_.width, size_.height);
        return std::make_shared<const std::vector<Buffer>>(std::move(made));
    }

    DeviceImpl& device_;
    Size size_;
    int planes_;  ///< albedo, normals, roughness
    float reflectance_, lowest_ = 0.0F, highest_ = 0.0F;
    BtfDescription description_;
    Buffer maps_, height_;
    mutable std::mutex mutex_;  ///< of what follows
    mutable Kept views_, lights_;
};

}  // namespace

BtfSet make_btf(Device& device, const BtfMaterial& material, const MadeBtfOptions& options) {
    check(material, options);
    return BtfSet(std::make_shared<MadeBtf>(device, material, options));
}

}  // namespace btfield

#include "btfield/memd.hpp"

#include <bit>
#include <chrono>
#include <cmath>
#include <mutex>
#include <string>
#include <utility>

#include "btfield/error.hpp"
#include "host/base/stop.hpp"
#include "host/base/text.hpp"
#include "host/cl/device_impl.hpp"
#include "host/criteria/colour_tree.hpp"
#include "host/criteria/memd_search.hpp"
#include "host/criteria/metric_names.hpp"

namespace btfield {

using namespace detail;

namespace {

constexpr double units = 255.0;
/// Squares of larger differences, and their sums, could overflow.
constexpr float largest = 1e15F;
/// Spacing of float32 from here on is at least 2⁻⁶², its square no subnormal: devices that flush subnormals
/// to 0 compute the same distances.
constexpr float smallest = 0x1p-39F;

/// Pixels between two times that a caller hears of the search, and may end it.
constexpr std::size_t pixels_between_looks = 4096;

/// y = v · (255 / white), pixel by pixel.
Colours colours_of(const Image& image, double white, const char* which) {
    const std::string asked = std::string("take the colours of picture ") + which;
    if (image.planes() < 1) throw InputError(asked, "it is empty", "give a picture");
    if (area(image.size()) >= ColourTree::none)
        throw InputError(asked, "it has more than 4294967294 pixels", "give a smaller one");
    const auto scale = static_cast<float>(units / white);
    if (!(white > 0.0) || !std::isnormal(scale))
        throw InputError(asked, "its white level is " + std::to_string(white),
                         "give the value that is white, a positive number");
    Colours colours{image.planes(), std::vector<float>(image.values().size())};
    const auto d = static_cast<std::size_t>(image.planes());
    for (int p = 0; p < image.planes(); ++p) {
        const auto plane = image.plane(p);
        float* out = colours.values.data() + p;
        for (std::size_t pixel = 0; pixel < plane.size(); ++pixel, out += d) {
            const float value = plane[pixel] * scale;
            if (!(std::abs(value) <= largest))
                throw InputError(
                    asked,
                    "plane " + std::to_string(p) + " holds " + std::to_string(plane[pixel]) + " at row " +
                        std::to_string(pixel / static_cast<std::size_t>(image.width())) + ", column " +
                        std::to_string(pixel % static_cast<std::size_t>(image.width())),
                    "give finite values below 1e15 units of white / 255");
            *out = std::abs(value) < smallest ? 0.0F : value;
        }
    }
    return colours;
}

/// The distance that a key begins with, as a local error.
double local_error(ColourKey key, Metric metric) {
    const auto distance = static_cast<double>(std::bit_cast<float>(static_cast<std::uint32_t>(key >> 32)));
    return metric == Metric::l2 ? std::sqrt(distance) : distance;
}

}  // namespace

std::string_view name(Metric metric) {
    return word_of(metric);
}

Metric metric(std::string_view text) {
    return value_of<Metric>(text);
}

double memd_max(Metric metric, int planes) {
    switch (metric) {
        case Metric::max:
            return units;
        case Metric::l1:
            return units * planes;
        default:
            return units * std::sqrt(static_cast<double>(planes));
    }
}

class [[gnu::visibility("hidden")]] MemdReference::Impl {
  public:
    Impl(Device & device, const Image& a, const MemdOptions& options)
        : device_(&device.impl()), options_(options), a_(colours_of(a, options.white[0], "A")) {}

    Memd against(const Image& candidate) {
        const auto start = std::chrono::steady_clock::now();
        if (candidate.planes() != a_.planes)
            throw InputError(
                "compare the colours of two pictures",
                "A has " + counted(a_.planes, "plane") + ", B " + std::to_string(candidate.planes()),
                "give pictures with the same number of planes");
        const Colours b = colours_of(candidate, options_.white[1], "B");
        ColourTree tree(b, options_.metric);
        Memd result;
        result.pixels = {a_.pixels(), b.pixels()};
        const std::size_t count = std::min(a_.pixels(), b.pixels());
        if (options_.local_errors) result.local_errors.assign(a_.pixels(), -1.0F);
        double sum = 0.0;
        const auto note = [&](std::size_t pixel, ColourKey key) {
            if (pixel % pixels_between_looks == 0) {
                stop_if_asked();
                if (options_.progress)
                    options_.progress(static_cast<double>(pixel) / static_cast<double>(count));
            }
            const double error = local_error(key, options_.metric);
            sum += error;
            if (options_.local_errors) result.local_errors[pixel] = static_cast<float>(error);
        };
        const MemdSearch search = chosen_search(*device_, options_.search, count, tree.colours());
        if (search == MemdSearch::host_tree) {
            take_all(a_, tree, note);
        } else {
            std::call_once(uploaded_, [&] { on_device_ = device_->upload(a_.values); });
            take_all(*device_, a_, on_device_, tree, options_.metric, device_->tuning().memd, note);
        }
        result.memd = sum / static_cast<double>(count);
        result.memd_star = 100.0 * result.memd / memd_max(options_.metric, a_.planes);
        result.search_seconds =
            std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
        return result;
    }

  private:
    DeviceImpl* device_;
    MemdOptions options_;
    Colours a_;
    std::once_flag uploaded_;
    Buffer on_device_;  ///< a_, once a device has searched
};

MemdReference::MemdReference(Device& device, const Image& a, const MemdOptions& options)
    : impl_(std::make_unique<Impl>(device, a, options)) {}
MemdReference::~MemdReference() = default;
MemdReference::MemdReference(MemdReference&&) noexcept = default;
MemdReference& MemdReference::operator=(MemdReference&&) noexcept = default;
Memd MemdReference::operator()(const Image& candidate) {
    return impl_->against(candidate);
}

Memd memd(Device& device, const Image& a, const Image& b, const MemdOptions& options) {
    return MemdReference(device, a, options)(b);
}

Memd memd(Device& device, const Image& a, const Image& b, Metric metric) {
    return memd(device, a, b, MemdOptions{.metric = metric});
}

}  // namespace btfield

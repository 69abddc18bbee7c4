#include "btfield/pyramid.hpp"

#include <algorithm>
#include <string>

#include "btfield/error.hpp"
#include "host/analysis/pyramid_stages.hpp"
#include "host/base/text.hpp"
#include "host/base/work_part.hpp"

namespace btfield {

using namespace detail;

namespace {

std::vector<float> scaled(const std::vector<double>& weights, double scale) {
    std::vector<float> result(weights.size());
    std::transform(weights.begin(), weights.end(), result.begin(),
                   [&](double w) { return static_cast<float>(w * scale); });
    return result;
}

std::size_t plane_bytes(Size size, int planes) {
    return sizeof(float) * static_cast<std::size_t>(planes) * area(size);
}

/// Of five taps and the like along one axis, for so many values.
LaunchWork tap_work(double bytes, double taps, double values) {
    return {.bytes = bytes, .operations = 2.0 * taps * values};
}

std::size_t vectors(int n, int width) {
    return static_cast<std::size_t>((n + width - 1) / width);
}

DevicePlanes upload(DeviceImpl& device, const Image& image) {
    return {device.upload(image.values()), image.size(), image.size(), image.planes()};
}

Image download(DeviceImpl& device, const DevicePlanes& planes, ColourSpace space) {
    Image image(planes.size, planes.planes, space);
    device.read(planes.values, image.values().data(), image.values().size_bytes());
    return image;
}

}  // namespace

std::vector<Size> pyramid_sizes(Size size, int levels, int factor) {
    if (levels < 1 || factor < 2)
        throw InputError("build a pyramid of " + counted(levels, "level") + " with reduction factor " +
                             std::to_string(factor),
                         levels < 1 ? "there is at least 1 level" : "the factor is at least 2",
                         "give larger numbers");
    std::vector<Size> sizes{size};
    while (static_cast<int>(sizes.size()) < levels) {
        const Size fine = sizes.back();
        const auto reduced = [&](int side) { return side / factor + (side % factor != 0 ? 1 : 0); };
        sizes.push_back({reduced(fine.height), reduced(fine.width)});
    }
    return sizes;
}

std::vector<double> pyramid_kernel(int factor) {
    if (factor < 2)
        throw InputError("build the pyramid kernel of reduction factor " + std::to_string(factor),
                         "the factor is at least 2", "give a larger one");
    if (factor == 2) return {0.05, 0.25, 0.4, 0.25, 0.05};
    const int n = factor;
    // Triangle of height 1/n at 0, falling to 0 at ±n: its sums over the phases modulo n are all 1/n.
    const auto triangle = [n](int t) {
        return std::max(0.0, static_cast<double>(n - std::abs(t))) / (double(n) * n);
    };
    std::vector<double> weights;
    for (int t = -n; t <= n; ++t)
        weights.push_back(0.25 * triangle(t - 1) + 0.5 * triangle(t) + 0.25 * triangle(t + 1));
    return weights;
}

PyramidStages::PyramidStages(DeviceImpl& device, int factor)
    : device_(&device),
      factor_(factor),
      reduce_weights_(device.upload(scaled(pyramid_kernel(factor), 1.0))),
      expand_weights_(device.upload(scaled(pyramid_kernel(factor), factor))) {}

double PyramidStages::taps() const {
    return 2.0 * (factor_ == 2 ? 2 : factor_) + 1.0;
}

Kernel PyramidStages::kernel(const char* name) {
    BuildParameters parameters = device_->lanes();
    parameters.set("BTFIELD_FACTOR", factor_).set("BTFIELD_RADIUS", factor_ == 2 ? 2 : factor_);
    return device_->kernel("pyramid", name, parameters);
}

DevicePlanes PyramidStages::reduce(const DevicePlanes& fine) {
    const Size coarse = pyramid_sizes(fine.size, 2, factor_)[1];
    const Size half{coarse.height, fine.size.width};
    const auto planes = static_cast<std::size_t>(fine.planes);
    const int lanes = device_->vector_width();
    Buffer rows = device_->buffer(plane_bytes(half, fine.planes));
    Buffer values = device_->buffer(plane_bytes(coarse, fine.planes));
    device_->launch(kernel("reduce_rows"),
                    {vectors(half.width, lanes), static_cast<std::size_t>(half.height), planes}, Grain::fine,
                    tap_work(static_cast<double>(plane_bytes(fine.size, fine.planes) + rows.bytes()), taps(),
                             static_cast<double>(planes * area(half))),
                    fine.values, rows, reduce_weights_, fine.size.height, half.height, half.width);
    device_->launch(kernel("reduce_columns"),
                    {vectors(coarse.width, lanes), static_cast<std::size_t>(coarse.height), planes},
                    Grain::fine,
                    tap_work(static_cast<double>(rows.bytes() + values.bytes()), taps(),
                             static_cast<double>(planes * area(coarse))),
                    rows, values, reduce_weights_, fine.size.width, coarse.height, coarse.width);
    return {std::move(values), coarse, coarse, fine.planes};
}

DevicePlanes PyramidStages::add_expanded(DevicePlanes base, const DevicePlanes& coarse, float scale,
                                         int first) {
    const Size fine = base.size;
    const auto planes = static_cast<std::size_t>(base.planes);
    const int lanes = device_->vector_width();
    // Each value is read and written by the same work-item: where the lattice is full, base's memory is the
    // result's.
    Buffer own;
    if (base.lattice != fine) own = device_->buffer(plane_bytes(fine, base.planes));
    const Buffer& target = own ? own : base.values;
    // Rows first, for each coarse column, then columns, then the sum with base.
    const double values = static_cast<double>(planes * area(fine)), n = factor_;
    const LaunchWork work = tap_work(
        static_cast<double>(plane_bytes(coarse.size, base.planes) + 2 * plane_bytes(fine, base.planes)),
        taps() / (n * n) + taps() / n + 1.0, values);
    device_->launch(kernel("add_expanded"),
                    {vectors(coarse.size.width, lanes), static_cast<std::size_t>(fine.height), planes},
                    Grain::fine, work, coarse.values, base.values, target, expand_weights_,
                    coarse.size.height, coarse.size.width, coarse.lattice.height, coarse.lattice.width,
                    base.lattice.height, base.lattice.width, fine.height, fine.width, scale, first);
    return {own ? std::move(own) : std::move(base.values), fine, fine, base.planes};
}

std::vector<Image> decompose(Device& device, const Image& image, int levels, int factor) {
    const std::vector<Size> sizes = pyramid_sizes(image.size(), levels, factor);
    std::vector<Image> result;
    if (levels == 1) {
        result.push_back(image);
        return result;
    }
    DeviceImpl& impl = device.impl();
    PyramidStages stages(impl, factor);
    DevicePlanes fine = upload(impl, image);
    while (static_cast<int>(result.size()) + 1 < levels) {
        DevicePlanes coarse = stages.reduce(fine);
        work_nearer(0.25);
        result.push_back(download(impl, stages.add_expanded(std::move(fine), coarse, -1.0F), image.space()));
        fine = std::move(coarse);
    }
    result.push_back(download(impl, fine, image.space()));
    return result;
}

Image collapse(Device& device, const std::vector<Image>& levels, int factor) {
    if (levels.empty()) throw InputError("collapse a pyramid", "it has no levels", "give at least one");
    const std::vector<Size> sizes =
        pyramid_sizes(levels.front().size(), static_cast<int>(levels.size()), factor);
    for (std::size_t k = 0; k < levels.size(); ++k)
        if (levels[k].size() != sizes[k] || levels[k].planes() != levels.front().planes())
            throw InputError(
                "collapse a pyramid with reduction factor " + std::to_string(factor),
                "level " + std::to_string(k) + " is " + compact_text_of(levels[k].size()) + " with " +
                    counted(levels[k].planes(), "plane"),
                "give " + compact_text_of(sizes[k]) + " with " + counted(levels.front().planes(), "plane"));
    if (levels.size() == 1) return levels.front();
    DeviceImpl& impl = device.impl();
    PyramidStages stages(impl, factor);
    DevicePlanes sum = upload(impl, levels.back());
    for (std::size_t k = levels.size() - 1; k-- > 0;)
        sum = stages.add_expanded(upload(impl, levels[k]), sum, 1.0F);
    return download(impl, sum, levels.front().space());
}

}  // namespace btfield

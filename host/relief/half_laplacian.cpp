#include "host/relief/half_laplacian.hpp"

#include <cmath>
#include <numbers>
#include <vector>

#include "btfield/error.hpp"
#include "host/base/text.hpp"
#include "host/cl/fft.hpp"

namespace btfield::detail {
namespace {

using std::size_t;

/// 4 sin²(πk/n)
std::vector<float> axis_spectrum(int n, size_t count, size_t padded) {
    std::vector<float> values(padded, 1.0F);
    for (size_t k = 0; k < count; ++k) {
        const double s = 2.0 * std::sin(std::numbers::pi * static_cast<double>(k) / n);
        values[k] = static_cast<float>(s * s);
    }
    return values;
}

/// Pixel i of a line of n that goes on mirrored.
int mirrored(int i, int n) {
    i %= 2 * n;
    return i < n ? i : 2 * n - 1 - i;
}

Image on_torus(DeviceImpl& device, const Image& plane, bool inverse) {
    const Size size = plane.size();
    const auto lanes = static_cast<size_t>(device.vector_width());
    const auto pitch = static_cast<size_t>(spectrum_pitch(size.height)),
               width = static_cast<size_t>(size.width);
    const Buffer across = device.upload(axis_spectrum(size.width, width, width));
    const Buffer down =
        device.upload(axis_spectrum(size.height, static_cast<size_t>(size.height) / 2 + 1, pitch));
    Buffer image = device.upload(plane.values());
    const size_t bytes = sizeof(float) * spectrum_floats(size, 1);
    Spectrum spectrum{device.buffer(bytes), device.buffer(bytes)};
    Fft& fft = device.ffts().plan(device, size, device.options().fft);
    fft.forward(device, image, spectrum, 1);
    device.launch(device.kernel("half_laplacian", "scale_spectrum", device.lanes()), {pitch / lanes, width},
                  Grain::fine, spectrum.re, spectrum.im, across, down, inverse ? 1 : 0,
                  static_cast<float>(1.0 / static_cast<double>(area(size))), static_cast<int>(pitch));
    fft.inverse(device, spectrum, image, 1);
    Image result(size, 1);
    device.read(image, result.values().data(), result.values().size_bytes());
    return result;
}

Image filtered(DeviceImpl& device, const Image& plane, SurfaceEdges edges, bool inverse) {
    const Size size = plane.size();
    if (edges == SurfaceEdges::periodic) {
        if (next_fft_size(size.height) != size.height || next_fft_size(size.width) != size.width)
            throw InputError("take the height of a torus of " + text_of(size) + " pixels",
                             "a side has a prime factor over 13",
                             "give " + std::to_string(next_fft_size(size.width)) + " x " +
                                 std::to_string(next_fft_size(size.height)) + " pixels, or mirrored edges");
        return on_torus(device, plane, inverse);
    }
    Image larger({next_fft_size(2 * size.height), next_fft_size(2 * size.width)}, 1);
    for (int r = 0; r < larger.height(); ++r)
        for (int c = 0; c < larger.width(); ++c)
            larger.at(0, r, c) = plane.at(0, mirrored(r, size.height), mirrored(c, size.width));
    return on_torus(device, larger, inverse).crop(0, 0, size);
}

}  // namespace

Image half_laplacian(DeviceImpl& device, const Image& height, SurfaceEdges edges) {
    return filtered(device, height, edges, false);
}

Image inverse_half_laplacian(DeviceImpl& device, const Image& plane, SurfaceEdges edges) {
    return filtered(device, plane, edges, true);
}

}  // namespace btfield::detail

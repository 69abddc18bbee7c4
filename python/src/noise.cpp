#include <array>

#include "host/cl/device_impl.hpp"
#include "host/synthesis/spectral_factors.hpp"
#include "python/src/arrays.hpp"
#include "python/src/device.hpp"
#include "python/src/parts.hpp"

namespace btfield::python {
namespace {

Image noise(Device& device, Size size, int planes, std::uint64_t seed, int level) {
    if (level < 0 || level > 255)
        throw InputError("draw noise", "there is no level " + std::to_string(level),
                         "give one from 0 to 255");
    Image image(size, planes);
    const std::vector<std::array<std::uint32_t, 2>> key{
        {static_cast<std::uint32_t>(seed), static_cast<std::uint32_t>(seed >> 32)}};
    const detail::Buffer values = device.impl().upload(std::span<const float>(image.values())),
                         keys = device.impl().upload(key);
    detail::draw_normal_field(device.impl(), values, keys, size, planes, 1, level);
    device.impl().read(values, image.values().data(), image.values().size_bytes());
    return image;
}

}  // namespace

void add_noise(nb::module_& module) {
    module.def(
        "noise",
        [](PyDevice& device, Size size, int planes, std::uint64_t seed, int level) {
            return unlocked([&] { return noise(*device, size, planes, seed, level); });
        },
        nb::arg("device"), nb::arg("size"), nb::arg("planes") = 1, nb::arg("seed") = 0, nb::kw_only(),
        nb::arg("level") = 0,
        "White noise on the lattice, H x W x planes: independent normals of mean 0 and variance 1, a "
        "function of\n"
        "seed, level, plane, row and column, the same bits on every device (theory 14.2).");
}

}  // namespace btfield::python

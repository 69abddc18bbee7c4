#pragma once

// What the tests of device code have in common: sizes, plane counts, vector widths, and how to open a device
// with one.

#include <gtest/gtest.h>

#include <array>
#include <cstdint>
#include <limits>
#include <memory>
#include <ostream>
#include <random>
#include <string>
#include <vector>

#include "btfield/device.hpp"
#include "btfield/image.hpp"
#include "host/cl/device_impl.hpp"

namespace btfield {

using namespace detail;

/// How GoogleTest names a size.
inline void PrintTo(const Size& size, std::ostream* out) {
    *out << size.height << " rows x " << size.width << " columns";
}

namespace test {

/// Unit roundoff of float32.
inline constexpr double unit_roundoff = std::numeric_limits<float>::epsilon() / 2.0;

/// Lanes that every hot kernel is built for.
inline constexpr std::array vector_widths = {1, 4, 8, 16};

inline constexpr std::array plane_counts = {1, 3, 4, 8};

/// Single pixels, lines, primes, powers of 2 and their neighbours, sides below and beyond every vector width.
inline constexpr std::array lattice_sizes = {
    Size{1, 1},   Size{1, 2},   Size{2, 1},   Size{3, 5},   Size{7, 4},   Size{1, 67},  Size{67, 1},
    Size{13, 11}, Size{16, 16}, Size{17, 31}, Size{33, 20}, Size{32, 65}, Size{37, 101}};

/// A device whose hot kernels have this many lanes; own transforms, because what clFFT launches is its own
/// business.
inline Device device_of_width(int width, FftBackend fft = FftBackend::lanes) {
    DeviceOptions options;
    options.vector_width = width;
    options.fft = fft;
    return Device({}, options);
}

/// White noise, smoothed along both axes and mixed between planes.
inline Image mixed_texture(Size size, int planes, unsigned seed) {
    std::mt19937 engine(seed);
    std::normal_distribution<float> normal;
    Image white(size, planes), image(size, planes);
    for (float& value : white.values()) value = normal(engine);
    for (int p = 0; p < planes; ++p) {
        for (int r = 0; r < size.height; ++r) {
            for (int c = 0; c < size.width; ++c) {
                const int below = (r + 1) % size.height, right = (c + 1) % size.width;
                image.at(p, r, c) = 0.5F + white.at(p, r, c) + 0.7F * white.at(p, below, c) +
                                    0.4F * white.at(p, r, right) + 0.5F * white.at((p + 1) % planes, r, c);
            }
        }
    }
    return image;
}

namespace detail {
/// Opened once, closed after the last test: Oclgrind's own bookkeeping is gone when static objects are
/// destroyed.
class SharedDevice : public testing::Environment {
  public:
    void TearDown() override { opened.reset(); }
    static inline std::unique_ptr<Device> opened;
};
inline const testing::Environment* const shared_device = testing::AddGlobalTestEnvironment(new SharedDevice);
}  // namespace detail

/// The device that is chosen unless told, for tests that ask nothing special of it.
inline Device& default_device() {
    auto& opened = detail::SharedDevice::opened;
    if (!opened) opened = std::make_unique<Device>();
    return *opened;
}

template <class T>
std::vector<T> read_all(Device& device, const Buffer& buffer) {
    std::vector<T> values(buffer.bytes() / sizeof(T));
    device.impl().read(buffer, values.data(), values.size() * sizeof(T));
    return values;
}

/// Seeds as the kernels take them.
inline Buffer upload_seeds(Device& device, const std::vector<std::uint64_t>& seeds) {
    std::vector<std::array<std::uint32_t, 2>> words;
    for (const std::uint64_t seed : seeds)
        words.push_back({static_cast<std::uint32_t>(seed), static_cast<std::uint32_t>(seed >> 32)});
    return device.impl().upload(words);
}

/// Independent values of mean `mean` and standard deviation 1, the same in every run.
inline Image random_image(Size size, int planes, float mean = 0.0F, unsigned seed = 1) {
    Image image(size, planes);
    std::mt19937 generator(seed);
    std::normal_distribution<float> normal(mean, 1.0F);
    for (float& value : image.values()) value = normal(generator);
    return image;
}

inline std::string text(Size size) {
    return std::to_string(size.height) + " x " + std::to_string(size.width);
}

}  // namespace test
}  // namespace btfield

#pragma once

#include <OpenImageIO/imageio.h>

#include <cmath>
#include <filesystem>
#include <stdexcept>
#include <string>
#include <vector>

#include "btfield/image_io.hpp"

namespace btfield::test {

/// Value of one sample on the way to a file of the type: on its grid, so that it must come back exactly.
/// Integer types span [0, 1], half and float go below 0 and above 1.
inline float sample(PixelType type, int p, int r, int c) {
    const int mixed = (37 * p + 101 * r + 13 * c + (r * c) % 7);
    switch (type) {
        case PixelType::uint8:
            return static_cast<float>(mixed % 256) / 255.0F;
        case PixelType::uint16:
            return static_cast<float>(mixed * 97 % 65536) / 65535.0F;
        case PixelType::half:
            return static_cast<float>(mixed % 2048 - 700) / 256.0F;
        case PixelType::float32:
            break;
    }
    return std::sin(static_cast<float>(mixed)) * 1000.0F;
}

inline Image sampled(Size size, int planes, ColourSpace space, PixelType type) {
    Image image(size, planes, space);
    for (int p = 0; p < planes; ++p) {
        for (int r = 0; r < size.height; ++r) {
            for (int c = 0; c < size.width; ++c) image.at(p, r, c) = sample(type, p, r, c);
        }
    }
    return image;
}

/// Writes with OpenImageIO alone what the library does not write itself. Values [row][column][channel].
template <class T>
void write_foreign(const std::filesystem::path& path, const OIIO::ImageSpec& spec,
                   const std::vector<T>& values) {
    const auto output = OIIO::ImageOutput::create(path.string());
    if (!output || !output->open(path.string(), spec)) throw std::runtime_error("open " + path.string());
    if (!output->write_image(OIIO::BaseTypeFromC<T>::value, values.data()) || !output->close()) {
        throw std::runtime_error(output->geterror());
    }
}

}  // namespace btfield::test

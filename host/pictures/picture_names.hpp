#pragma once

#include "btfield/image_io.hpp"
#include "host/base/names.hpp"

namespace btfield::detail {

template <>
struct Names<ColourSpace> {
    static constexpr std::string_view what = "colour space";
    static constexpr auto words = std::to_array<Word<ColourSpace>>({{ColourSpace::unspecified, "unspecified"},
                                                                    {ColourSpace::srgb, "srgb"},
                                                                    {ColourSpace::linear, "linear"},
                                                                    {ColourSpace::xyz, "xyz"}});
};

template <>
struct Names<PixelType> {
    static constexpr std::string_view what = "pixel type";
    static constexpr auto words = std::to_array<Word<PixelType>>({{PixelType::uint8, "uint8"},
                                                                  {PixelType::uint16, "uint16"},
                                                                  {PixelType::half, "half"},
                                                                  {PixelType::float32, "float"}});
};

}  // namespace btfield::detail

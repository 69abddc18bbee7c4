// Names and sizes of PixelType, of image_io.hpp.

#include <algorithm>
#include <array>
#include <string>
#include <string_view>

#include "btfield/error.hpp"
#include "btfield/image_io.hpp"

namespace btfield {
namespace {

constexpr std::array<std::string_view, 4> type_names{"uint8", "uint16", "half", "float"};

}  // namespace

std::string_view name(PixelType type) {
    return type_names.at(static_cast<std::size_t>(type));
}

PixelType pixel_type(std::string_view name) {
    const auto* const found = std::find(type_names.begin(), type_names.end(), name);
    if (found == type_names.end()) {
        throw InputError("find a pixel type", "'" + std::string(name) + "' is not known",
                         "use uint8, uint16, half or float");
    }
    return static_cast<PixelType>(found - type_names.begin());
}

int bytes_per_value(PixelType type) {
    switch (type) {
        case PixelType::uint8:
            return 1;
        case PixelType::uint16:
        case PixelType::half:
            return 2;
        case PixelType::float32:
            break;
    }
    return 4;
}

}  // namespace btfield

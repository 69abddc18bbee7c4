// Names and sizes of PixelType, of image_io.hpp.

#include <string_view>

#include "btfield/image_io.hpp"
#include "host/pictures/picture_names.hpp"

namespace btfield {

std::string_view name(PixelType type) {
    return detail::word_of(type);
}

PixelType pixel_type(std::string_view name) {
    return detail::value_of<PixelType>(name);
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

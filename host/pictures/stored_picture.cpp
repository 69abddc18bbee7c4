#include "host/pictures/stored_picture.hpp"

#include <algorithm>
#include <string>

#include "btfield/error.hpp"
#include "host/pictures/picture_codec.hpp"
#include "host/pictures/png_encode.hpp"
#include "host/pictures/pnm.hpp"
#include "host/pictures/radiance.hpp"

namespace btfield::detail {

constexpr int largest_jpeg_side = 65500;

void store_picture(const std::filesystem::path& path, const Image& image, const Storage& storage,
                   const std::string& asked) {
    switch (storage.format) {
        case PictureFormat::pnm:
            write_pnm(path, image, storage.type, asked);
            return;
        case PictureFormat::hdr:
            write_radiance(path, image, storage, asked);
            return;
        case PictureFormat::png:
            encode_png(path, image, storage, asked);
            return;
        case PictureFormat::jpeg:
            // libjpeg would end the process.
            if (std::max(image.height(), image.width()) > largest_jpeg_side)
                throw InputError(
                    asked,
                    "a side is longer than " + std::to_string(largest_jpeg_side) + " pixels, JPEG's limit",
                    "choose another format or size");
            [[fallthrough]];
        default:
            picture_codec(asked).encode(path, image, storage, asked);
    }
}

}  // namespace btfield::detail

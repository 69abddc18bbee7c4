#include "host/pictures/stored_picture.hpp"

#include <string>

#include "host/pictures/picture_codec.hpp"
#include "host/pictures/png_encode.hpp"
#include "host/pictures/pnm.hpp"
#include "host/pictures/radiance.hpp"

namespace btfield::detail {

void store_picture(const std::filesystem::path& path, const Image& image, const Storage& storage,
                   const std::string& asked) {
    check_sides(storage.format, image.size(), asked);
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
        default:
            picture_codec(asked).encode(path, image, storage, asked);
    }
}

}  // namespace btfield::detail

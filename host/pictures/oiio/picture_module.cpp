#include "host/pictures/picture_codec.hpp"

extern "C" const btfield::detail::PictureCodec* btfield_picture_codec() {
    using namespace btfield::detail;
    static constexpr PictureCodec codec{&decode_picture, &encode_picture, &open_zip, &write_zip};
    return &codec;
}

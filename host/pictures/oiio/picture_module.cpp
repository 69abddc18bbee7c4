#include "host/pictures/picture_codec.hpp"

extern "C" const btfield::PictureCodec* btfield_picture_codec() {
    static constexpr btfield::PictureCodec codec{&btfield::decode_picture, &btfield::encode_picture};
    return &codec;
}

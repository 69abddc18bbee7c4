#include "host/pictures/picture_codec.hpp"

extern "C" const btfield::detail::PictureCodec* btfield_picture_codec() {
    static constexpr btfield::detail::PictureCodec codec{&btfield::detail::decode_picture,
                                                         &btfield::detail::encode_picture};
    return &codec;
}

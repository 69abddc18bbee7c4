#pragma once

/// \file
/// The way to the codecs of host/pictures/oiio. OpenImageIO brings some 260 shared libraries, whose loading
/// takes a third of a second; so a shared btfield keeps them in a module of its own and loads it with the
/// first picture that needs it.

#include <string>

#include "btfield/api.hpp"
#include "host/pictures/oiio/picture_decode.hpp"
#include "host/pictures/oiio/picture_encode.hpp"
#include "host/pictures/oiio/zip_archive.hpp"

namespace btfield::detail {

/// What the module offers.
struct PictureCodec {
    decltype(&decode_picture) decode = nullptr;
    decltype(&encode_picture) encode = nullptr;
    decltype(&open_zip) open_archive = nullptr;
    decltype(&write_zip) write_archive = nullptr;
};

/// The codecs, loaded by the first call in the process, from any thread, and kept until its end. A static
/// btfield has them inside.
/// \param asked  what the caller wanted, for the message
/// \throws InputError when the module cannot be loaded
[[nodiscard]] const PictureCodec& picture_codec(const std::string& asked);

}  // namespace btfield::detail

/// Entry point of the module; never null.
extern "C" BTFIELD_API const btfield::detail::PictureCodec* btfield_picture_codec();

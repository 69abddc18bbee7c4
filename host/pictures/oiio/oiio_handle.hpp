#pragma once

#include <OpenImageIO/half.h>  // before the other, which asks for it
#include <OpenImageIO/imageio.h>

#include <memory>
#include <string>

namespace btfield::detail {

// Enough rows for any codec's block (TIFF strips, EXR blocks of up to 256 lines) at little memory.
constexpr int strip_rows = 256;

/// Takes the pending message, which OpenImageIO would print if nobody did.
struct DropMessage {
    template <class Codec>
    void operator()(Codec* codec) const {
        if (codec->has_error()) static_cast<void>(codec->geterror());
        delete codec;
    }
};
using Reader = std::unique_ptr<OIIO::ImageInput, DropMessage>;
using Writer = std::unique_ptr<OIIO::ImageOutput, DropMessage>;

/// What the codec has to say, or `otherwise`.
template <class Codec>
std::string message_of(Codec& codec, const char* otherwise) {
    const std::string message = codec.has_error() ? codec.geterror() : std::string();
    return message.empty() ? otherwise : message;
}

}  // namespace btfield::detail

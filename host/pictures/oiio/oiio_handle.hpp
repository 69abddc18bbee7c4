#pragma once

#include <OpenImageIO/imageio.h>

#include <memory>
#include <string>

namespace btfield::detail {

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

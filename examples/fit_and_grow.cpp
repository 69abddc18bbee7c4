// Learns a texture from a picture and writes a larger piece of it: fit_and_grow PICTURE WIDTH HEIGHT OUTPUT
#include <cstdio>
#include <cstdlib>

#include "btfield/error.hpp"
#include "btfield/fit.hpp"
#include "btfield/image_io.hpp"
#include "btfield/synthesis.hpp"

int main(int count, char** arguments) {
    if (count != 5) {
        std::fprintf(stderr, "usage: fit_and_grow PICTURE WIDTH HEIGHT OUTPUT\n");
        return 2;
    }
    try {
        const btfield::Size size{std::atoi(arguments[3]), std::atoi(arguments[2])};
        const btfield::Picture picture = btfield::read_picture(arguments[1]);

        btfield::Device device;  // the best that there is, or the one that $BTFIELD_DEVICE names
        const btfield::TextureModel model = btfield::fit(device, picture.image);
        btfield::Synthesiser synthesiser(device, model, size);
        btfield::write_picture(arguments[4], synthesiser.synthesise(/*seed=*/1), picture.type);
        return 0;
    } catch (const btfield::Error& error) {
        std::fprintf(stderr, "%s\n", error.what());
        return 1;
    }
}

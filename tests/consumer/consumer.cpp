// A program outside the project: it sees what an installation offers and nothing else.
#include <btfield/btfield.hpp>
#include <cmath>
#include <cstdio>

static_assert(BTFIELD_VERSION_NUMBER >= 100, "0.1.0 or later");

int main() {
    // A smoothed pseudo-random pattern is texture enough for a fit.
    const btfield::Size size{64, 48};
    btfield::Image noise(size, 1);
    unsigned state = 1;
    for (float& value : noise.values()) {
        state = state * 1664525U + 1013904223U;
        value = static_cast<float>(state >> 8) * 0x1p-24F;
    }
    btfield::Image image(size, 1);
    for (int r = 0; r < size.height; ++r)
        for (int c = 0; c < size.width; ++c)
            image.at(0, r, c) = 0.5F * noise.at(0, r, c) + 0.3F * noise.at(0, r, (c + 1) % size.width) +
                                0.2F * noise.at(0, (r + 1) % size.height, c);
    if (btfield::version() != BTFIELD_VERSION) return 1;
    try {
        btfield::Device device;
        btfield::FitOptions options;
        options.order = 2;
        options.levels = 1;
        const btfield::TextureModel model =
            btfield::from_json(btfield::to_json(btfield::fit(device, image, options)));
        btfield::Synthesiser synthesiser(device, model, {96, 128});
        const btfield::Image texture = synthesiser.synthesise(7);
        double sum = 0.0;
        for (const float value : texture.values()) sum += value;
        const double mean = sum / static_cast<double>(texture.values().size());
        std::printf("mean %.4f\n", mean);
        // The model keeps the mean of the picture, (0.5 + 0.3 + 0.2) / 2; the texture's own mean scatters by
        // well under 0.1.
        return std::abs(mean - 0.5) < 0.1 ? 0 : 1;
    } catch (const btfield::Error& error) {
        std::fprintf(stderr, "%s\n", error.what());
        return 1;
    }
}

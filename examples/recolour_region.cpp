// A material with regions, grown, and grown again with one region changed:
// recolour_region PICTURE OUTPUT CHANGED_OUTPUT
//
// The compound model keeps outlines that show in colour. Both textures have the same regions, since they
// share the control field; the darkest region of the second one is half as bright, with twice the contrast.
#include <cstdio>
#include <string>
#include <vector>

#include "btfield/compound.hpp"
#include "btfield/error.hpp"
#include "btfield/image_io.hpp"

int main(int count, char** arguments) {
    if (count != 4) {
        std::fprintf(stderr, "usage: recolour_region PICTURE OUTPUT CHANGED_OUTPUT\n");
        return 2;
    }
    try {
        const btfield::Picture picture = btfield::read_picture(arguments[1]);
        const btfield::Image& image = picture.image;
        btfield::Device device;
        btfield::CompoundOptions options;
        options.progress = [](std::string_view stage, double seconds) {
            std::printf("%-18s %6.2f s\n", std::string(stage).c_str(), seconds);
        };
        btfield::CompoundModel model = btfield::fit_compound(device, image, options);
        std::printf("regions: %zu\n", model.regions.size());
        for (const btfield::CompoundRegion& region : model.regions)
            std::printf("  %5.1f %% of the pixels\n", 100.0 * region.share);

        btfield::CompoundSynthesiser synthesiser(device, model, model.size);
        const btfield::ControlField field = synthesiser.control_field(/*seed=*/1);
        btfield::write_picture(arguments[2], synthesiser.synthesise(1, field), picture.type);

        std::vector<double> darker = model.regions.front().colour;  // regions are ordered, darkest first
        for (double& value : darker) value *= 0.5;
        recolour(model, 0, darker);
        scale_contrast(model, 0, 2.0);
        btfield::CompoundSynthesiser changed(device, model, model.size);
        btfield::write_picture(arguments[3], changed.synthesise(1, field), picture.type);
        return 0;
    } catch (const btfield::Error& error) {
        std::fprintf(stderr, "%s\n", error.what());
        return 1;
    }
}

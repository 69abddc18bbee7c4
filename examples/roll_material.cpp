// Tiles out of a picture's own pixels, with a second picture that lies on it cut alike:
// roll_material COLOUR OTHER OUTPUT_FOLDER
//
// OTHER (a height, a mask, a roughness map) has COLOUR's size. Patches are chosen on both; each map is then
// applied to each picture, so that what lay on each other still does. Writes a tile and a quilt of 3/2 the
// size.
#include <array>
#include <cstdio>
#include <filesystem>
#include <string>

#include "btfield/error.hpp"
#include "btfield/image_io.hpp"
#include "btfield/roller.hpp"

namespace {

void run(const char* colour, const char* other, const std::filesystem::path& folder) {
    const std::array<btfield::Picture, 2> pictures{btfield::read_picture(colour),
                                                   btfield::read_picture(other)};
    const std::array<btfield::Image, 2> sample{pictures[0].image, pictures[1].image};
    btfield::Device device;
    btfield::Roller roller(device, sample);

    btfield::RollerOptions options;
    options.seed = 1;
    options.progress = [](double share) { std::printf("\rquilt %3.0f %%", 100.0 * share); };
    const btfield::SourceMap tile = roller.tile({}, options);
    const btfield::Size size{3 * sample[0].height() / 2, 3 * sample[0].width() / 2};
    const btfield::SourceMap quilt = roller.quilt(size, options);
    std::printf("\ntile %d x %d, seam %.2f; quilt %d x %d, seam %.2f (1: a cut does not show)\n",
                tile.size.width, tile.size.height, tile.seam, quilt.size.width, quilt.size.height,
                quilt.seam);

    std::filesystem::create_directories(folder);
    const std::array<std::string, 2> names{"colour", "other"};
    for (std::size_t k = 0; k < sample.size(); ++k) {
        btfield::write_picture(folder / (names[k] + "-tile.png"), apply(tile, sample[k]), pictures[k].type);
        btfield::write_picture(folder / (names[k] + "-quilt.png"), apply(quilt, sample[k]), pictures[k].type);
    }
}

}  // namespace

int main(int count, char** arguments) {
    if (count != 4) {
        std::fprintf(stderr, "usage: roll_material COLOUR OTHER OUTPUT_FOLDER\n");
        return 2;
    }
    try {
        run(arguments[1], arguments[2], arguments[3]);
        return 0;
    } catch (const btfield::Error& error) {
        std::fprintf(stderr, "%s\n", error.what());
        return 1;
    }
}

#include "host/cli/relief_report.hpp"

#include <algorithm>
#include <set>

#include "host/base/file_output.hpp"
#include "host/cli/command.hpp"
#include "host/cli/output_names.hpp"
#include "host/relief/relief_names.hpp"

namespace btfield::cli {

namespace fs = std::filesystem;

bool holds_pixels(const std::string& option, const fs::path& file) {
    static const std::set<std::string> floats{".exr", ".tif", ".tiff"};
    static const std::set<std::string> coded{".png", ".pgm", ".pnm"};
    const std::string extension = lower_extension(file);
    if (!floats.contains(extension) && !coded.contains(extension))
        throw UsageError(option + ": '" + file.string() +
                         "' ends neither in .png, for 16 bits, nor in .exr or .tif, for heights in pixels");
    return floats.contains(extension);
}

fs::path side_file(const fs::path& file) {
    return fs::path(file).replace_extension(".json");
}

double range_of(const Image& height) {
    const auto [low, high] = std::ranges::minmax(height.values());
    return static_cast<double>(high) - static_cast<double>(low);
}

void write_height(const fs::path& file, const Image& height, double scale) {
    const bool pixels = holds_pixels("height", file);
    const PixelType type = pixels ? PixelType::float32 : PixelType::uint16;
    WriteOptions how;
    how.source = type;
    how.type = type;
    how.keep_values = true;
    write_picture(file, pixels ? height : encode_height(height, scale), how);
}

Json conventions_json(const Image& height, double scale, SurfaceEdges edges) {
    Json object;
    object["size"] = size_json(height.size());
    object["unit"] = "pixel";
    object["scale"] = number(scale);
    object["mid_grey"] = 32768;
    object["white"] = 65535;
    object["range"] = number(range_of(height));
    object["axes"] = "x right, y up, z to the viewer";
    object["slopes"] = "central differences";
    object["edges"] = std::string(detail::word_of(edges));
    return object;
}

void write_side_file(const fs::path& file, const Json& object) {
    detail::write_file(file, object.dump(2, ' ', false, Json::error_handler_t::replace) + "\n",
                       "write '" + file.string() + "'");
}

}  // namespace btfield::cli

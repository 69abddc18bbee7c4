#include "host/btf/side_file.hpp"

#include <cmath>
#include <nlohmann/json.hpp>

#include "btfield/error.hpp"
#include "btfield/image_io.hpp"
#include "host/base/file_output.hpp"
#include "host/base/strict_json.hpp"

namespace btfield::detail {
namespace {

double above_zero(const nlohmann::json& object, const char* key, const std::string& asked) {
    const auto found = object.find(key);
    if (found == object.end()) return 1.0;
    const double value = found->is_number() ? found->get<double>() : 0.0;
    if (!(value > 0.0) || !std::isfinite(value))
        throw InputError(asked, "its '" + std::string(key) + "' is no number above 0",
                         "repair the file, or remove it");
    return value;
}

}  // namespace

SideFile parse_side_file(std::string_view text, const std::string& asked) {
    const nlohmann::json object = parse_strictly(text, asked);
    const auto refuse = [&](const std::string& found) {
        throw InputError(asked, found, "repair the file, or remove it");
    };
    if (!object.is_object() || object.value("format", nlohmann::json()) != "btfield-btf")
        refuse("its format is not 'btfield-btf'");
    if (object.value("version", nlohmann::json()) != 1)
        throw InputError(asked, "its version is not 1", "read it with a newer btfield");
    SideFile side;
    side.exposure = above_zero(object, "exposure", asked);
    if (object.contains("white")) side.white = above_zero(object, "white", asked);
    if (const auto height = object.find("height"); height != object.end()) {
        if (height->is_string()) side.height = height->get<std::string>();
        if (side.height.empty() || side.height.find('/') != std::string::npos)
            refuse("its 'height' is no name of a file beside it");
    }
    return side;
}

std::string side_file_text(const BtfDescription& set, double exposure) {
    nlohmann::ordered_json object;
    object["format"] = "btfield-btf";
    object["version"] = 1;
    object["exposure"] = exposure;
    object["white"] = set.white;
    object["size"] = {set.size.width, set.size.height};
    if (set.height.planes() == 1) object["height"] = height_file_name;
    return object.dump(2) + "\n";
}

void write_side_file(const std::filesystem::path& folder, const BtfDescription& set, double exposure) {
    if (set.height.planes() == 1) {
        WriteOptions how;
        how.source = PixelType::float32;
        how.type = PixelType::float32;
        how.keep_values = true;
        static_cast<void>(write_picture(folder / height_file_name, set.height, how));
    }
    const std::filesystem::path file = folder / side_file_name;
    write_file(file, side_file_text(set, exposure), "write '" + file.string() + "'");
}

}  // namespace btfield::detail

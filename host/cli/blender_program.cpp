#include <algorithm>
#include <cstddef>
#include <map>
#include <string>
#include <string_view>

#include "host/cli/material_export.hpp"
#include "host/cli/report.hpp"
#include "host/model/model_names.hpp"

namespace btfield::cli {
namespace {

/// What is the same of all materials.
constexpr std::string_view blender_body =
#include "host/cli/blender_program.inc"
    ;

/// As Python has it: what JSON escapes, Python reads alike.
std::string quoted(const std::string& text) {
    return Json(text).dump(-1, ' ', false, Json::error_handler_t::replace);
}

/// "colour", "normal", ... of the first of a role, else the file's name without extension.
std::string maps_text(const ExportedMaterial& material) {
    std::string text = "MAPS = {\n";
    for (const ExportedMap& map : material.maps) {
        const bool first = map.role != MapRole::other && material.find(map.role) == &map;
        const std::string key =
            first ? std::string(name(map.role)) : "map " + std::filesystem::path(map.file).stem().string();
        text += "    " + quoted(key) + ": " + quoted(map.file) + ",\n";
    }
    return text + "}\n";
}

}  // namespace

std::string blender_program(const ExportedMaterial& material) {
    const auto number = [](double value) { return Json(value).dump(); };
    const ExportedMap* height = material.find(MapRole::height);
    const ExportedMap* normal = material.find(MapRole::normal);
    const std::string call = quoted(material.name + ".py");
    std::string text =
        "# A material for Blender, written by btfield " BTFIELD_VERSION ": run it in the text editor, or\n";
    text += "#     blender -b -P " + call + " -- --render plane.png\n";
    text += "#     blender -b -P " + call + " -- --save material.blend\n";
    text +=
        "# It builds the material and a plane that wears it from the maps beside this file. --help tells "
        "more.\n\n";
    text += "NAME = " + quoted(material.name) + "\n";
    text +=
        "# The plane has SIZE[0] * PIXEL by SIZE[1] * PIXEL metres, as often as REPEAT says along each "
        "side.\n";
    text += material.pixel_size
                ? ""
                : "# How large a pixel is was not told: the texture is taken to be a metre wide.\n";
    text += "SIZE = (" + std::to_string(material.size.width) + ", " + std::to_string(material.size.height) +
            ")  # pixels\n";
    text += "PIXEL = " + number(material.pixel()) + "  # metres\n";
    text += "REPEAT = 1\n";
    text += "FACES = " +
            std::to_string(std::clamp(std::max(material.size.width, material.size.height), 16, 512)) +
            "  # along the plane's longer side\n";
    text += std::string("TILES = ") + (material.tileable ? "True" : "False") + "\n\n";
    text += maps_text(material);
    text += "NORMALS = " + quoted(normal != nullptr && normal->directx ? "directx" : "opengl") + "\n";
    const bool known = height != nullptr && height->scale > 0.0;
    text += known ? "# Pixels for each unit of the height map, and its value on the mean plane.\n"
                  : "# Pixels between black and white of the height map: nothing tells. Give a number to "
                    "displace.\n";
    text += "HEIGHT = " + (known ? number(height->scale) : "None") + "\n";
    text += "MIDLEVEL = " + std::string(known && height->floats ? "0.0" : "0.5") + "\n";
    if (material.find(MapRole::roughness) == nullptr) text += "# No map tells.\n";
    text += "ROUGHNESS = 0.8\n";
    return text + std::string(blender_body);
}

}  // namespace btfield::cli

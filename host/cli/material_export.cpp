#include "host/cli/material_export.hpp"

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstring>
#include <span>
#include <string_view>
#include <utility>

#include "btfield/height.hpp"
#include "host/cli/options.hpp"
#include "host/cli/report.hpp"
#include "host/model/model_names.hpp"

namespace btfield::cli {
namespace {

namespace fs = std::filesystem;

/// Of Khronos' numbers.
constexpr int gl_float = 5126, gl_unsigned_short = 5123, gl_vertices = 34962, gl_indices = 34963,
              gl_linear = 9729, gl_trilinear = 9987, gl_repeat = 10497, gl_clamp = 33071;

/// As a URI has it: what is neither a letter, a digit nor one of -._~ by its bytes.
std::string uri_of(const std::string& file) {
    static constexpr std::string_view digits = "0123456789ABCDEF";
    std::string uri;
    for (const char c : file) {
        const bool plain = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') ||
                           std::string_view("-._~").find(c) != std::string_view::npos;
        const auto byte = static_cast<unsigned char>(c);
        if (plain)
            uri += c;
        else
            uri += {'%', digits[byte >> 4U], digits[byte & 15U]};
    }
    return uri;
}

bool is_png(const ExportedMap& map) {
    return fs::path(map.file).extension() == ".png";
}

/// Vectors one after another, in the order of bytes that glTF has.
class Buffer {
  public:
    template <typename Value>
    Json add(std::span<const Value> values, int components, int target) {
        const std::size_t at = bytes_.size(), size = values.size_bytes();
        bytes_.resize(at + size);
        std::memcpy(bytes_.data() + at, values.data(), size);
        views.push_back(Json{{"buffer", 0}, {"byteOffset", at}, {"byteLength", size}, {"target", target}});
        static constexpr std::array<const char*, 4> types{"SCALAR", "VEC2", "VEC3", "VEC4"};
        const auto step = static_cast<std::size_t>(components);
        Json accessor;
        accessor["bufferView"] = views.size() - 1;
        accessor["componentType"] = target == gl_indices ? gl_unsigned_short : gl_float;
        accessor["count"] = values.size() / step;
        accessor["type"] = types[step - 1];
        for (std::size_t c = 0; c < step; ++c) {
            Value low = values[c], high = low;
            for (std::size_t i = c; i < values.size(); i += step) {
                low = std::min(low, values[i]);
                high = std::max(high, values[i]);
            }
            accessor["min"].push_back(low);
            accessor["max"].push_back(high);
        }
        return accessor;
    }
    [[nodiscard]] std::string bytes() const { return bytes_; }
    Json views = Json::array();

  private:
    std::string bytes_;
};

/// x right, y up, z to the viewer, as the maps have it; its middle at the origin.
Json plane(const ExportedMaterial& material, Buffer& buffer, Json& accessors) {
    const auto x = static_cast<float>(0.5 * material.pixel() * material.size.width);
    const auto y = static_cast<float>(0.5 * material.pixel() * material.size.height);
    const std::array<float, 12> positions{-x, -y, 0, x, -y, 0, x, y, 0, -x, y, 0};
    const std::array<float, 12> normals{0, 0, 1, 0, 0, 1, 0, 0, 1, 0, 0, 1};
    const std::array<float, 16> tangents{1, 0, 0, 1, 1, 0, 0, 1, 1, 0, 0, 1, 1, 0, 0, 1};
    const std::array<float, 8> places{0, 1, 1, 1, 1, 0, 0, 0};  // of the picture, from its upper left
    const std::array<std::uint16_t, 6> indices{0, 1, 2, 0, 2, 3};
    Json attributes;
    const auto add = [&](const char* name, std::span<const float> values, int components) {
        attributes[name] = accessors.size();
        accessors.push_back(buffer.add(values, components, gl_vertices));
    };
    add("POSITION", positions, 3);
    add("NORMAL", normals, 3);
    add("TANGENT", tangents, 4);
    add("TEXCOORD_0", places, 2);
    Json primitive;
    primitive["attributes"] = std::move(attributes);
    primitive["indices"] = accessors.size();
    primitive["material"] = 0;
    accessors.push_back(buffer.add(std::span<const std::uint16_t>(indices), 1, gl_indices));
    return Json{{"name", material.name}, {"primitives", Json::array({std::move(primitive)})}};
}

/// What core glTF cannot say: how far the surface stands out.
Json extras(const ExportedMaterial& material) {
    Json object;
    object["pixel_size_metres"] = material.pixel();
    object["pixel_size_known"] = material.pixel_size.has_value();
    object["tileable"] = material.tileable;
    if (const ExportedMap* map = material.find(MapRole::height); map != nullptr) {
        Json height;
        height["file"] = map->file;
        height["note"] = "glTF 2.0 has no displacement: this map is not applied";
        if (map->scale > 0.0) {
            height["mid"] = map->floats ? 0.0 : mid_grey;
            height["scale_metres"] = map->scale * material.pixel();
        }
        object["height"] = std::move(height);
    }
    Json others = left_out_of_gltf(material);
    if (!others.empty()) object["left_out"] = std::move(others);
    return object;
}

struct Textures {
    Json textures = Json::array(), images = Json::array();
    Json add(const std::string& file) {
        textures.push_back(Json{{"sampler", 0}, {"source", images.size()}});
        images.push_back(Json{{"name", file}, {"uri", uri_of(file)}, {"mimeType", "image/png"}});
        return Json{{"index", textures.size() - 1}};
    }
};

Json gltf_material(const ExportedMaterial& material, Textures& textures) {
    const GltfPictures pictures = gltf_pictures(material);
    const auto file = [&](MapRole role, const std::string& own) {
        const ExportedMap* map = material.find(role);
        return !own.empty() ? own : map != nullptr && is_png(*map) ? map->file : std::string();
    };
    Json surface;
    if (const std::string name = file(MapRole::colour, pictures.colour); !name.empty())
        surface["baseColorTexture"] = textures.add(name);
    surface["metallicFactor"] = material.find(MapRole::metalness) != nullptr ? 1.0 : 0.0;
    surface["roughnessFactor"] = 1.0;
    Json packed;
    if (!pictures.packed.empty()) {
        packed = textures.add(pictures.packed);
        if (material.find(MapRole::roughness) != nullptr || material.find(MapRole::metalness) != nullptr)
            surface["metallicRoughnessTexture"] = packed;
    }
    Json object;
    object["name"] = material.name;
    object["pbrMetallicRoughness"] = std::move(surface);
    if (const std::string name = file(MapRole::normal, pictures.normal); !name.empty())
        object["normalTexture"] = textures.add(name);
    if (material.find(MapRole::occlusion) != nullptr) object["occlusionTexture"] = packed;
    object["extras"] = extras(material);
    return object;
}

}  // namespace

bool ExportArguments::wants(MaterialExport format) const {
    return std::ranges::find(formats, format) != formats.end();
}

void add_exports(CLI::App& app, ExportArguments& arguments) {
    const std::string group = "Materials", words = detail::words_of<MaterialExport>("|");
    const auto read = [&arguments, words](const std::vector<std::string>& texts) {
        arguments.formats.clear();
        for (const std::string& text : texts) {
            const auto format = detail::find_value<MaterialExport>(text);
            if (!format) throw CLI::ValidationError("--export", "'" + text + "' is none of " + words);
            if (!arguments.wants(*format)) arguments.formats.push_back(*format);
        }
    };
    app.add_option_function<std::vector<std::string>>(
           "--export", read,
           "also a file that ties the maps together, named after the model: gltf, a plane of glTF 2.0; "
           "blender, a program that builds the material in Blender")
        ->delimiter(',')
        ->type_name("gltf|blender,...")
        ->group(group);
    add_positive(
        app, "--pixel-size", arguments.pixel_size,
        "how large a pixel is, in millimetres, where sizes are told (default: the texture is a metre "
        "wide)")
        ->type_name("MM")
        ->group(group);
}

double ExportedMaterial::pixel() const {
    return pixel_size ? *pixel_size / 1000.0 : 1.0 / size.width;
}

const ExportedMap* ExportedMaterial::find(MapRole role) const {
    const auto found = std::ranges::find(maps, role, &ExportedMap::role);
    return found != maps.end() ? &*found : nullptr;
}

GltfPictures gltf_pictures(const ExportedMaterial& material) {
    GltfPictures pictures;
    const auto named = [&](const char* what) { return material.name + "-gltf-" + what + ".png"; };
    const ExportedMap* colour = material.find(MapRole::colour);
    if (colour != nullptr && !is_png(*colour) && (colour->planes == 1 || colour->planes == 3))
        pictures.colour = named("colour");
    const ExportedMap* normal = material.find(MapRole::normal);
    if (normal != nullptr && normal->directx) pictures.normal = named("normal");
    for (const MapRole role : {MapRole::occlusion, MapRole::roughness, MapRole::metalness})
        if (material.find(role) != nullptr) pictures.packed = named("orm");
    return pictures;
}

Image packed_for_gltf(const ExportedMaterial& material, const std::vector<Image>& images) {
    Image packed(images.front().size(), 3);
    constexpr std::array<std::pair<MapRole, float>, 3> channels{
        {{MapRole::occlusion, 1.0F}, {MapRole::roughness, 1.0F}, {MapRole::metalness, 0.0F}}};
    for (int p = 0; p < 3; ++p) {
        const auto [role, none] = channels[static_cast<std::size_t>(p)];
        const ExportedMap* map = material.find(role);
        if (map == nullptr)
            std::ranges::fill(packed.plane(p), none);
        else
            std::ranges::copy(images[static_cast<std::size_t>(map - material.maps.data())].plane(0),
                              packed.plane(p).begin());
    }
    return packed;
}

std::vector<std::string> left_out_of_gltf(const ExportedMaterial& material) {
    std::vector<std::string> files;
    const GltfPictures pictures = gltf_pictures(material);
    for (const ExportedMap& map : material.maps) {
        const bool first = material.find(map.role) == &map;
        const bool colour = map.role == MapRole::colour && (is_png(map) || !pictures.colour.empty());
        const bool other = map.role == MapRole::normal || map.role == MapRole::roughness ||
                           map.role == MapRole::metalness || map.role == MapRole::occlusion;
        const bool height = map.role == MapRole::height;  // is told by itself
        if (!first || !(colour || other || height)) files.push_back(map.file);
    }
    return files;
}

GltfFiles gltf_files(const ExportedMaterial& material) {
    Buffer buffer;
    Textures textures;
    Json accessors = Json::array(), object;
    object["asset"] = Json{{"version", "2.0"}, {"generator", "btfield " BTFIELD_VERSION}};
    object["scene"] = 0;
    object["scenes"] = Json::array({Json{{"nodes", Json::array({0})}}});
    object["nodes"] = Json::array({Json{{"name", material.name}, {"mesh", 0}}});
    object["meshes"] = Json::array({plane(material, buffer, accessors)});
    object["materials"] = Json::array({gltf_material(material, textures)});
    if (!textures.textures.empty()) {
        const int wrap = material.tileable ? gl_repeat : gl_clamp;
        object["textures"] = std::move(textures.textures);
        object["images"] = std::move(textures.images);
        object["samplers"] = Json::array(
            {Json{{"magFilter", gl_linear}, {"minFilter", gl_trilinear}, {"wrapS", wrap}, {"wrapT", wrap}}});
    }
    object["accessors"] = std::move(accessors);
    object["bufferViews"] = buffer.views;
    object["buffers"] =
        Json::array({Json{{"uri", uri_of(material.name + ".bin")}, {"byteLength", buffer.bytes().size()}}});
    return {object.dump(2, ' ', false, Json::error_handler_t::replace) + "\n", buffer.bytes()};
}

}  // namespace btfield::cli

// btfield synth --export, read back as the programs that it is for would.

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <map>
#include <string>
#include <vector>

#include "btfield/height.hpp"
#include "btfield/image_io.hpp"
#include "tests/cli_cases.hpp"
#include "tests/json_text.hpp"
#include "tests/material_cases.hpp"
#include "tests/temporary_folder.hpp"

namespace btfield {
namespace {

using nlohmann::json;
using test::btfield;
using test::Words;

/// A file of glTF 2.0 that is refused unless it is what the specification wants of all that it has.
class Gltf {
  public:
    Gltf(const std::filesystem::path& folder, const std::string& name)
        : folder_(folder), root(test::parsed(test::bytes_of(folder / name))) {
        only(root, {"asset", "scene", "scenes", "nodes", "meshes", "materials", "textures", "images",
                    "samplers", "accessors", "bufferViews", "buffers"});
        only(root["asset"], {"version", "generator"});
        EXPECT_EQ(root["asset"]["version"], "2.0");
        only(root["buffers"][0], {"uri", "byteLength"});
        bytes_ = test::bytes_of(folder / decoded(root["buffers"][0]["uri"]));
        EXPECT_EQ(root["buffers"].size(), 1U);
        EXPECT_EQ(root["buffers"][0]["byteLength"], bytes_.size());
        EXPECT_EQ(root["scenes"][at("scenes", root["scene"])]["nodes"], json::array({0}));
        only(root["nodes"][0], {"name", "mesh"});
        for (const json& texture : root.value("textures", json::array())) {
            only(texture, {"sampler", "source"});
            at("samplers", texture["sampler"]);
            at("images", texture["source"]);
        }
        for (const json& image : root.value("images", json::array())) {
            only(image, {"name", "uri", "mimeType"});
            EXPECT_EQ(image["mimeType"], "image/png");
            EXPECT_EQ(test::bytes_of(folder / decoded(image["uri"])).substr(0, 8), "\x89PNG\r\n\x1a\n");
        }
        for (const json& sampler : root.value("samplers", json::array()))
            only(sampler, {"magFilter", "minFilter", "wrapS", "wrapT"});
    }
    void only(const json& object, const std::vector<std::string>& keys) const {
        for (const auto& [key, value] : object.items())
            EXPECT_NE(std::find(keys.begin(), keys.end(), key), keys.end()) << key;
    }
    std::size_t at(const char* list, const json& index) const {
        EXPECT_TRUE(index.is_number_unsigned()) << index;
        EXPECT_LT(index.get<std::size_t>(), root[list].size()) << list;
        return index.get<std::size_t>();
    }
    static std::string decoded(const std::string& uri) {
        std::string file;
        for (std::size_t i = 0; i < uri.size(); ++i) {
            EXPECT_GT(static_cast<unsigned char>(uri[i]), 0x20) << uri;
            EXPECT_LT(static_cast<unsigned char>(uri[i]), 0x7f) << uri;
            if (uri[i] == '%') {
                file += static_cast<char>(std::stoi(uri.substr(i + 1, 2), nullptr, 16));
                i += 2;
            } else {
                file += uri[i];
            }
        }
        return file;
    }
    /// The picture of "baseColorTexture": {"index": …} and its like.
    std::filesystem::path picture(const json& info) const {
        only(info, {"index"});
        const json& texture = root["textures"][at("textures", info["index"])];
        return folder_ / decoded(root["images"][texture["source"].get<std::size_t>()]["uri"]);
    }
    /// Components one after another.
    template <typename Value>
    std::vector<Value> values(const json& index, const char* type, std::size_t components, int component_type,
                              int target) const {
        const json& accessor = root["accessors"][at("accessors", index)];
        only(accessor, {"bufferView", "componentType", "count", "type", "min", "max"});
        EXPECT_EQ(accessor["type"], type);
        EXPECT_EQ(accessor["componentType"], component_type);
        const json& view = root["bufferViews"][at("bufferViews", accessor["bufferView"])];
        only(view, {"buffer", "byteOffset", "byteLength", "target"});
        EXPECT_EQ(view["buffer"], 0);
        EXPECT_EQ(view["target"], target);
        const auto offset = view["byteOffset"].get<std::size_t>(),
                   length = view["byteLength"].get<std::size_t>();
        EXPECT_EQ(offset % 4, 0U);
        EXPECT_LE(offset + length, bytes_.size());
        std::vector<Value> result(accessor["count"].get<std::size_t>() * components);
        EXPECT_EQ(result.size() * sizeof(Value), length);
        std::memcpy(result.data(), bytes_.data() + offset, length);
        for (std::size_t c = 0; c < components; ++c) {
            Value low = result[c], high = low;
            for (std::size_t i = c; i < result.size(); i += components) {
                low = std::min(low, result[i]);
                high = std::max(high, result[i]);
            }
            EXPECT_EQ(accessor["min"][c].get<Value>(), low);
            EXPECT_EQ(accessor["max"][c].get<Value>(), high);
        }
        return result;
    }

  private:
    std::filesystem::path folder_;
    std::string bytes_;

  public:
    json root;
};

Image numbers_of(const std::filesystem::path& file) {
    ReadOptions raw;
    raw.keep_values = true;
    return read_picture(file, raw).image;
}

void expect_near(std::span<const float> a, std::span<const float> b, float most) {
    ASSERT_EQ(a.size(), b.size());
    for (std::size_t i = 0; i < a.size(); ++i) ASSERT_NEAR(a[i], b[i], most) << i;
}

class CliExport : public testing::Test {
  protected:
    void SetUp() override {
        test::put_material(folder_.path());
        test::put_scalar_maps(folder_.path());
    }
    json object(const Words& words) {
        return test::expect_object(words, {.folder = folder_.path().string()});
    }
    test::TemporaryFolder folder_;
};

TEST_F(CliExport, GltfIsWhatTheSpecificationWants) {
    object({"fit", "s_albedo.png", "s_normal.png", "s_height.png", "s_roughness.png", "s_metalness.png",
            "s_ao.png", "--joint", "-o", "a stone.json"});
    const json grown = object(
        {"synth", "a stone.json", "-o", "out", "--size", "96x64", "--export", "gltf", "--pixel-size", "2"});
    EXPECT_EQ(grown["outputs"].size(), 6U);
    EXPECT_EQ(grown["exports"], json({"out/a stone-gltf-orm.png", "out/a stone.gltf", "out/a stone.bin"}));
    EXPECT_EQ(test::parsed(test::bytes_of(folder_ / "out/material.json"))["pixel_size_mm"], 2.0);
    const Gltf file(folder_ / "out", "a stone.gltf");
    // A plane of 96 × 64 pixels, each 2 mm, with the picture's upper left where x is least and y most.
    const json& mesh = file.root["meshes"][file.at("meshes", file.root["nodes"][0]["mesh"])];
    const json& part = mesh["primitives"][0];
    file.only(part, {"attributes", "indices", "material"});
    file.only(part["attributes"], {"POSITION", "NORMAL", "TANGENT", "TEXCOORD_0"});
    const auto read = [&](const char* name, const char* type, std::size_t components) {
        return file.values<float>(part["attributes"][name], type, components, 5126, 34962);
    };
    const std::vector<float> positions = read("POSITION", "VEC3", 3), normals = read("NORMAL", "VEC3", 3),
                             tangents = read("TANGENT", "VEC4", 4), places = read("TEXCOORD_0", "VEC2", 2);
    ASSERT_EQ(positions.size(), 12U);
    for (std::size_t v = 0; v < 4; ++v) {
        EXPECT_NEAR(positions[3 * v], (places[2 * v] - 0.5F) * 0.192F, 1e-7F);
        EXPECT_NEAR(positions[3 * v + 1], (0.5F - places[2 * v + 1]) * 0.128F, 1e-7F);
        EXPECT_EQ(positions[3 * v + 2], 0.0F);
        EXPECT_EQ(std::vector<float>(&normals[3 * v], &normals[3 * v] + 3), (std::vector<float>{0, 0, 1}));
        EXPECT_EQ(std::vector<float>(&tangents[4 * v], &tangents[4 * v] + 4),
                  (std::vector<float>{1, 0, 0, 1}));
    }
    const auto indices = file.values<std::uint16_t>(part["indices"], "SCALAR", 1, 5123, 34963);
    ASSERT_EQ(indices.size(), 6U);
    for (std::size_t t = 0; t < 6; t += 3) {  // counter-clockwise as seen from z
        const auto x = [&](std::size_t k) { return positions[3 * indices[t + k]]; };
        const auto y = [&](std::size_t k) { return positions[3 * indices[t + k] + 1]; };
        EXPECT_NEAR((x(1) - x(0)) * (y(2) - y(0)) - (x(2) - x(0)) * (y(1) - y(0)), 0.192F * 0.128F, 1e-6F);
    }
    const json& material = file.root["materials"][file.at("materials", part["material"])];
    file.only(material, {"name", "pbrMetallicRoughness", "normalTexture", "occlusionTexture", "extras"});
    const json& surface = material["pbrMetallicRoughness"];
    file.only(surface, {"baseColorTexture", "metallicRoughnessTexture", "metallicFactor", "roughnessFactor"});
    EXPECT_EQ(surface["metallicFactor"], 1.0);
    EXPECT_EQ(surface["roughnessFactor"], 1.0);
    EXPECT_EQ(file.root["samplers"][0]["wrapS"], 10497);
    EXPECT_EQ(file.root["samplers"][0]["wrapT"], 10497);
    EXPECT_EQ(file.picture(surface["baseColorTexture"]), folder_ / "out/s_albedo.png");
    EXPECT_EQ(file.picture(material["normalTexture"]), folder_ / "out/s_normal.png");
    EXPECT_EQ(file.picture(material["occlusionTexture"]), file.picture(surface["metallicRoughnessTexture"]));
    const Image packed = numbers_of(file.picture(material["occlusionTexture"]));
    ASSERT_EQ(packed.planes(), 3);
    expect_near(packed.plane(0), numbers_of(folder_ / "out/s_ao.png").plane(0), 1e-6F);
    expect_near(packed.plane(1), numbers_of(folder_ / "out/s_roughness.png").plane(0), 1e-6F);
    expect_near(packed.plane(2), numbers_of(folder_ / "out/s_metalness.png").plane(0), 1e-6F);
    const json side = test::parsed(test::bytes_of(folder_ / "out/material.json"));
    const json& told = material["extras"]["height"];
    EXPECT_EQ(told["file"], "s_height.png");
    EXPECT_NEAR(told["scale_metres"].get<double>(), side["maps"][2]["scale"].get<double>() * 0.002, 1e-9);
    EXPECT_NEAR(told["mid"].get<double>(), mid_grey, 1e-9);
}

TEST_F(CliExport, GltfGetsPicturesThatItCanRead) {
    object(
        {"fit", "s_albedo.png", "s_normal.png", "s_height.png", "s_opacity.png", "--joint", "-o", "s.json"});
    // Maps of floats, green down, a window that does not tile, several.
    const Words words{"synth",        "s.json", "-o",    "out",     "--size", "41x31",        "--export",
                      "gltf,blender", "--type", "float", "--count", "2",      "--convention", "directx"};
    const test::Ended ended = btfield(words, {.folder = folder_.path().string()});
    ASSERT_EQ(ended.code, 0) << ended.err;
    EXPECT_NE(ended.err.find("'s_opacity-0.exr' is not in the glTF file"), std::string::npos) << ended.err;
    for (const std::string number : {"0", "1"}) {
        const Gltf file(folder_ / "out", "s-" + number + ".gltf");
        const json& material = file.root["materials"][0];
        EXPECT_EQ(material["pbrMetallicRoughness"]["metallicFactor"], 0.0);
        EXPECT_FALSE(material["pbrMetallicRoughness"].contains("metallicRoughnessTexture"));
        EXPECT_FALSE(material.contains("occlusionTexture"));
        EXPECT_EQ(file.root["samplers"][0]["wrapS"], 33071);
        EXPECT_EQ(material["extras"]["left_out"], json({"s_opacity-" + number + ".exr"}));
        EXPECT_EQ(material["extras"]["pixel_size_metres"], 1.0 / 41);
        // Heights in pixels: of those that have no black and white.
        EXPECT_EQ(material["extras"]["height"]["mid"], 0.0);
        EXPECT_NEAR(material["extras"]["height"]["scale_metres"].get<double>(), 1.0 / 41, 1e-12);
        const Image up = numbers_of(file.picture(material["normalTexture"]));
        const Image down = numbers_of(folder_ / ("out/s_normal-" + number + ".png"));
        for (std::size_t i = 0; i < up.plane(1).size(); ++i)
            ASSERT_NEAR(up.plane(1)[i], 1.0F - down.plane(1)[i], 2.0F / 65535.0F);
        expect_near(up.plane(0), down.plane(0), 1e-6F);
        // sRGB of what the map has in linear light.
        const Picture base = read_picture(file.picture(material["pbrMetallicRoughness"]["baseColorTexture"]));
        const Image linear = numbers_of(folder_ / ("out/s_albedo-" + number + ".exr"));
        for (std::size_t i = 0; i < linear.plane(0).size(); ++i) {
            const double v = std::clamp(static_cast<double>(base.image.plane(0)[i]), 0.0, 1.0);
            const double expected = v <= 0.04045 ? v / 12.92 : std::pow((v + 0.055) / 1.055, 2.4);
            ASSERT_NEAR(std::clamp(static_cast<double>(linear.plane(0)[i]), 0.0, 1.0), expected, 0.01);
        }
    }
}

TEST_F(CliExport, BlenderGetsWhatTheSideFileTells) {
    object({"fit", "s_albedo.png", "s_normal.png", "s_height.png", "--joint", "-o", "s.json"});
    const json grown = object({"synth", "s.json", "-o", "out", "--export", "blender"});
    EXPECT_EQ(grown["exports"], json({"out/s.py"}));
    const std::string program = test::bytes_of(folder_ / "out/s.py");
    const json side = test::parsed(test::bytes_of(folder_ / "out/material.json"));
    for (const std::string& line :
         {std::string("\nSIZE = (64, 64)"), std::string("\nPIXEL = 0.015625 "),
          std::string("\nTILES = True\n"), "\nHEIGHT = " + side["maps"][2]["scale"].dump() + "\n",
          std::string("\nMIDLEVEL = 0.5\n"), std::string("\nNORMALS = \"opengl\"\n"),
          std::string("\n    \"normal\": \"s_normal.png\",\n")})
        EXPECT_NE(program.find(line), std::string::npos) << line;
    // A height whose scale nothing tells displaces nothing.
    ASSERT_EQ(btfield({"fit", "s_albedo.png", "s_height.png", "--joint", "-o", "flat.json"},
                      {.folder = folder_.path().string()})
                  .code,
              0);
    object({"synth", "flat.json", "-o", "flat", "--export", "blender", "--overwrite"});
    EXPECT_NE(test::bytes_of(folder_ / "flat/flat.py").find("\nHEIGHT = None\n"), std::string::npos);
}

TEST_F(CliExport, RefusalsLeaveNothing) {
    object({"fit", "s_albedo.png", "s_normal.png", "s_height.png", "--joint", "-o", "s.json"});
    test::put_model(folder_ / "plain.json");
    const Words before = folder_.names();
    const test::Surroundings here{.folder = folder_.path().string()};
    test::expect_failure({"synth", "plain.json", "-o", "t.png", "--export", "gltf"}, 2, "plain.json", here);
    test::expect_failure({"synth", "plain.json", "-o", "t.png", "--pixel-size", "1"}, 2, "--pixel-size",
                         here);
    test::expect_failure({"synth", "s.json", "-o", "out", "--export", "obj"}, 2, "gltf|blender", here);
    test::expect_failure({"synth", "s.json", "-o", "out", "--export", "gltf", "--pixel-size", "0"}, 2,
                         "--pixel-size", here);
    EXPECT_EQ(folder_.names(), before);
    // A model is not replaced by what is written about it.
    std::filesystem::create_directories(folder_ / "out");
    std::filesystem::copy_file(folder_ / "s.json", folder_ / "out/s.gltf");
    test::expect_failure({"synth", "s.json", "-o", "out", "--export", "gltf"}, 1, "a model is there", here);
    EXPECT_EQ(test::bytes_of(folder_ / "out/s.gltf"), test::bytes_of(folder_ / "s.json"));
}

}  // namespace
}  // namespace btfield

#pragma once

/// \file
/// Materials for other programs: files beside the maps that tie them together.

#include <CLI/CLI.hpp>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "btfield/image.hpp"
#include "btfield/models.hpp"
#include "host/base/names.hpp"

namespace btfield::cli {

enum class MaterialExport { gltf, blender };

struct ExportArguments {
    std::vector<MaterialExport> formats;
    /// Side of a pixel in millimetres; nothing: the texture is a metre wide.
    std::optional<double> pixel_size;
    [[nodiscard]] bool wants(MaterialExport format) const;
};

/// --export and --pixel-size.
void add_exports(CLI::App& app, ExportArguments& arguments);

/// A map as its file has it.
struct ExportedMap {
    std::string file;  ///< name, without folders
    MapRole role = MapRole::other;
    int planes = 0;
    bool floats = false;
    bool directx = false;  ///< of normals: green points down
    double scale = 0.0;    ///< of heights: pixels between black and white, or 1 of floats; 0: not known
};

/// Maps of one texture, in a folder.
struct ExportedMaterial {
    std::string model;  ///< file name, without folders
    std::string name;   ///< of the files that are written, without extension
    Size size;
    bool tileable = false;
    std::optional<double> pixel_size;  ///< millimetres
    std::vector<ExportedMap> maps;
    /// Side of a pixel in metres.
    [[nodiscard]] double pixel() const;
    /// The first map of this role; null: there is none.
    [[nodiscard]] const ExportedMap* find(MapRole role) const;
};

/// Pictures that glTF needs beside the maps: names in their folder, empty where the map's own file does.
struct GltfPictures {
    std::string colour;  ///< a map of floats as PNG
    std::string normal;  ///< green up
    std::string packed;  ///< occlusion, roughness and metalness in red, green and blue
};
[[nodiscard]] GltfPictures gltf_pictures(const ExportedMaterial& material);

/// Red, green and blue of GltfPictures::packed: white, white and black where there is no map.
/// \param images  of the maps, in their order
[[nodiscard]] Image packed_for_gltf(const ExportedMaterial& material, const std::vector<Image>& images);

/// NAME.gltf: a plane with this material, and the bytes of NAME.bin, its buffer.
struct GltfFiles {
    std::string text, buffer;
};
[[nodiscard]] GltfFiles gltf_files(const ExportedMaterial& material);
/// Maps that glTF has no place for.
[[nodiscard]] std::vector<std::string> left_out_of_gltf(const ExportedMaterial& material);

/// NAME.py: a program that builds the material in Blender.
[[nodiscard]] std::string blender_program(const ExportedMaterial& material);

}  // namespace btfield::cli

namespace btfield::detail {

template <>
struct Names<cli::MaterialExport> {
    static constexpr std::string_view what = "export";
    static constexpr auto words = std::to_array<Word<cli::MaterialExport>>(
        {{cli::MaterialExport::gltf, "gltf"}, {cli::MaterialExport::blender, "blender"}});
};

}  // namespace btfield::detail

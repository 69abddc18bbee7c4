#pragma once

/// \file
/// Maps of one material: read as one picture, written as one file each.

#include <CLI/CLI.hpp>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "btfield/height.hpp"
#include "btfield/image_io.hpp"
#include "btfield/models.hpp"
#include "btfield/picture_batch.hpp"
#include "host/cli/material_export.hpp"
#include "host/cli/picture_options.hpp"
#include "host/cli/run_files.hpp"

namespace btfield::cli {

struct JointArguments {
    bool joint = false;
    std::vector<MapRole> roles;
    std::optional<NormalConvention> normals;
};

/// --joint, --roles and --convention, of commands that fit.
void add_joint(CLI::App& app, JointArguments& arguments);

/// \throws UsageError when there are not as many roles as pictures, or roles or a convention without --joint
void check_joint(const JointArguments& arguments, std::size_t pictures);

/// Whether these are maps of one material by their names: a height or normals, and something else.
[[nodiscard]] bool are_maps(const std::vector<std::filesystem::path>& pictures);

/// Pictures that look like maps of one material and are not said to be: one warning.
void hint_at_joint(const JointArguments& arguments, const std::vector<std::string>& pictures);

/// What to do where several pictures are to have one model.
[[nodiscard]] std::string remedy_for_one_model(const std::vector<std::string>& pictures);

/// \throws InputError where a picture's name is that of a folder, telling what to give instead
void refuse_folders(const std::vector<std::string>& pictures);

/// A warning where values of whole numbers are no unit vectors towards the viewer: a picture, perhaps.
void warn_of_no_normals(const std::string& file, const Picture& picture);

/// A material as one picture, and where it comes from.
struct JointPicture {
    Picture picture;
    Provenance provenance;
};

/// \throws InputError when a map cannot be read, or join_maps() refuses them
[[nodiscard]] JointPicture read_joint(Device& device, const std::vector<std::string>& files,
                                      const JointArguments& arguments, const ReadOptions& options);

/// Files of a material's textures in a folder.
class MaterialFiles {
  public:
    /// \param normals  how they are written; nothing: as they were read
    /// \param model  its file, whose name exports have
    MaterialFiles(const Provenance& provenance, const std::filesystem::path& model,
                  std::filesystem::path folder, const WritingArguments& writing,
                  std::optional<NormalConvention> normals, ExportArguments exports);

    /// Names of one texture's maps, after those of the maps that the model was fitted to.
    /// \param number  of a texture among `count`; nothing: the only one
    [[nodiscard]] std::vector<std::filesystem::path> names(std::optional<int> number, int count) const;
    /// Of --export: files that tie one texture's maps together, and pictures that they need beside the maps.
    struct Exports {
        std::vector<std::filesystem::path> texts, pictures;
    };
    [[nodiscard]] Exports exports(std::optional<int> number, int count) const;
    /// What they have in common, as JSON.
    [[nodiscard]] std::filesystem::path side_file() const { return folder_ / "material.json"; }
    /// \throws what write_picture() would throw for these names
    void check(const std::vector<std::filesystem::path>& names, Size size) const;
    /// \param window  in the texture; of all of it, its edges: periodic where it tiles
    /// \param material  of these maps
    /// \returns number of pixels that were clamped in any map
    std::uintmax_t write(Device& device, PictureBatch& pictures,
                         const std::vector<std::filesystem::path>& names, const Image& texture,
                         SurfaceEdges edges, const std::optional<Crop>& window,
                         const ExportedMaterial& material, WrittenRemarks& remarks) const;
    void write_side_file(Size size, bool tileable) const;
    /// Files of exports(), but for the pictures that write() has written.
    /// \returns what they leave out, one sentence each
    [[nodiscard]] std::vector<std::string> write_exports(const ExportedMaterial& material) const;
    /// As exports tell of it.
    [[nodiscard]] ExportedMaterial exported(std::optional<int> number, int count, Size size,
                                            bool tileable) const;

  private:
    void write_pictures(PictureBatch& batch, const ExportedMaterial& material,
                        const std::vector<Image>& images) const;
    [[nodiscard]] PixelType type_of(const MaterialMap& map) const;
    [[nodiscard]] NormalConvention convention(const MaterialMap& map) const;

    std::vector<MaterialMap> maps_;
    std::vector<PlaneLimits> limits_;
    std::string model_;
    std::filesystem::path folder_;
    WritingArguments writing_;
    std::optional<NormalConvention> normals_;
    ExportArguments exports_;
};

}  // namespace btfield::cli

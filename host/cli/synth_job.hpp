#pragma once

/// \file
/// What `btfield synth` is asked for, and what comes of it model by model.

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "btfield/compound.hpp"
#include "btfield/control_field.hpp"
#include "btfield/error.hpp"
#include "btfield/synthesis.hpp"
#include "host/cli/material_export.hpp"
#include "host/cli/material_files.hpp"
#include "host/cli/options.hpp"
#include "host/cli/picture_options.hpp"

namespace btfield::cli {

struct SynthArguments {
    std::vector<std::string> models;
    std::string output, control, labels_output, device;
    std::optional<Size> size, period;
    std::optional<Offset> offset;
    std::uint64_t seed = 0;
    std::optional<int> count;
    std::optional<Shard> shard;
    SynthesisOptions synthesis;
    WritingArguments writing;
    std::optional<NormalConvention> normals;
    ExportArguments exports;
    bool profile = false, overwrite = false, json = false;
};

/// One model's textures.
struct SynthJob {
    std::string file;
    std::variant<TextureModel, CompoundModel> model;
    Size size;
    Size plane;  ///< that is grown; larger where textures are windows of it
    std::optional<Offset> offset;
    std::vector<std::filesystem::path> outputs, labels_outputs, exports;
    std::optional<MaterialFiles> material;  ///< outputs are its maps, texture by texture
    std::optional<ControlField> control;
    std::vector<double> shares;  ///< of a compound model's regions, summed over textures
    std::vector<std::uint64_t> seeds;
    int first = 0;  ///< number of the first texture in the batch, of which this may be a shard
    bool tileable = false;
    Size lattice;
    std::uintmax_t clamped_pixels = 0;
    WrittenRemarks remarks;
    double rate = 0.0;  ///< textures per second, from the first one's beginning to the last one's end
    double setup = 0.0, synthesis = 0.0, write = 0.0, total = 0.0;
};

[[nodiscard]] int planes_of(const SynthJob& job);

/// What the error says, of this model where there are several.
template <class Work>
void about(const SynthArguments& options, const std::string& file, Work work) {
    try {
        work();
    } catch (const InputError& error) {
        if (options.models.size() == 1 || error.asked().find(file) != std::string::npos) throw;
        throw InputError("'" + file + "': " + error.asked(), error.found(), error.remedy());
    }
}

/// Reads and checks all models and all names of outputs, before any work is done.
[[nodiscard]] std::vector<SynthJob> plan(const SynthArguments& options);

}  // namespace btfield::cli

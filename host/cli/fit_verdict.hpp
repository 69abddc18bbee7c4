#pragma once

/// \file
/// What a model keeps of its picture, for people.

#include <functional>
#include <span>
#include <string>
#include <vector>

#include "btfield/compound.hpp"
#include "btfield/device.hpp"
#include "btfield/fit.hpp"
#include "btfield/image.hpp"
#include "btfield/material.hpp"
#include "btfield/models.hpp"

namespace btfield::cli {

/// How far a texture of the model is from the picture, at most 512 × 512 of both.
struct FitVerdict {
    double lag_covariance_error = 0.0;
    double structure_distance = 0.0;  ///< NaN where a side is below 8
    /// The same of each map of a material by itself, but for those that are constant.
    struct OfMap {
        std::string name;
        MapRole role = MapRole::other;
        double structure_distance = 0.0;
    };
    std::vector<OfMap> maps;
    /// Shapes of the picture are missing, and one sees that (docs/selection.md).
    [[nodiscard]] bool loses_shapes() const { return structure_distance > noticeable_structure; }
    /// Textures of random fields are this far from pictures without shapes at most.
    static constexpr double noticeable_structure = 0.07;
};

/// \param maps  of a material, whose height is judged with its gains and by its normals; empty: of a picture
/// \param grow  makes a texture of the model, which is valid
[[nodiscard]] FitVerdict verdict_on(Device& device, const Image& picture, std::span<const MaterialMap> maps,
                                    const std::function<Image(Size)>& grow);

/// One paragraph: what was kept, what is lost, what would keep more and what that costs.
/// \param options that the model was fitted with: nothing of them is proposed again
[[nodiscard]] std::string verdict_text(const FitVerdict& verdict, const TextureModel& model,
                                       const FitOptions& options);
/// The same of a model with regions.
[[nodiscard]] std::string verdict_text(const FitVerdict& verdict, const CompoundModel& model);

}  // namespace btfield::cli

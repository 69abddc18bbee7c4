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

/// How far textures of a model are from the picture.
struct FitVerdict {
    /// What the model promises, where that is known (theory 14.6), else what a texture has.
    double lag_covariance_error = 0.0;
    /// Of the picture, or of each map that is modelled, how much of its deviation textures have.
    struct Deviation {
        std::string of;  ///< a map's name; empty: the picture
        double share = 1.0;
    };
    std::vector<Deviation> deviations;
    /// Of patches, at most 512 × 512 of both.
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

/// Maps of a material are judged as they are written: heights with their gains and by their normals.
/// \param grow  makes a texture of the model, which is valid
[[nodiscard]] FitVerdict verdict_on(Device& device, const Image& picture, const TextureModel& model,
                                    const std::function<Image(Size)>& grow);
[[nodiscard]] FitVerdict verdict_on(Device& device, const Image& picture, const CompoundModel& model,
                                    const std::function<Image(Size)>& grow);

/// One paragraph: what was kept, what is lost and how much of it, what would keep more and what that costs.
/// \param options that the model was fitted with: nothing of them is proposed again
[[nodiscard]] std::string verdict_text(const FitVerdict& verdict, const TextureModel& model,
                                       const FitOptions& options);
/// The same of a model with regions.
[[nodiscard]] std::string verdict_text(const FitVerdict& verdict, const CompoundModel& model);

}  // namespace btfield::cli

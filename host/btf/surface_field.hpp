#pragma once

// What grows a BTF's surface: height and planes as one picture (theory 21.2).

#include <cstdint>

#include "btfield/btf_model.hpp"
#include "btfield/image.hpp"

namespace btfield::detail {

using SurfaceField = decltype(BtfModel::surface);

struct GrownSurface {
    Image surface;
    bool tileable = true;
};

/// \param surface  height in pixels, then T
/// \param look     the surface as it is seen from above: what regions are told apart by
[[nodiscard]] SurfaceField fit_surface(Device& device, const Image& surface, const Image& look,
                                       const BtfFitOptions& options);

/// \throws InputError naming the first defect
/// \param planes  T
void check_surface(const SurfaceField& field, int planes);

/// Height as rough as the sample's, T with mean 0 and covariance 1.
[[nodiscard]] GrownSurface grow_surface(Device& device, const SurfaceField& field, Size size,
                                        std::uint64_t seed, bool allow_invalid);

}  // namespace btfield::detail

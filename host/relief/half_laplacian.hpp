#pragma once

// Heights as planes of random fields: (−Δ)^{1/2} h, whose variance is that of the slopes (theory 20.3).

#include "btfield/height.hpp"
#include "btfield/image.hpp"
#include "host/cl/device_impl.hpp"

namespace btfield::detail {

/// (−Δ)^{1/2} of one plane, Δ of forward differences; its mean is 0.
/// \param edges  periodic: a torus; else the surface goes on mirrored, over twice its size or a little more
/// \throws InputError when a torus has a side with a prime factor over 13
[[nodiscard]] Image half_laplacian(DeviceImpl& device, const Image& height, SurfaceEdges edges);

/// (−Δ)^{-1/2}: takes that back, about 0.
/// \throws InputError as half_laplacian()
[[nodiscard]] Image inverse_half_laplacian(DeviceImpl& device, const Image& plane, SurfaceEdges edges);

}  // namespace btfield::detail

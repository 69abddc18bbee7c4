#pragma once

/// \file
/// The last station of synthesis: from Gaussian eigenplanes to the planes of a picture, on the device.

#include <span>

#include "btfield/marginals.hpp"
#include "btfield/spectral_basis.hpp"
#include "host/cl/device_impl.hpp"
#include "host/cl/device_planes.hpp"

namespace btfield::detail {

/// y = D Tᵀ q(M x) + μ, pixel by pixel (kernels/synthesis/plane_restorer.cl).
class PlaneRestorer {
  public:
    /// \param marginals  one to each eigenplane, with equal numbers of knots, or none: then q(x) = x
    /// \param whitening  M, r × r row-major; empty is the identity
    /// \throws InputError when basis or marginals are defective (their check()), or do not belong together
    PlaneRestorer(DeviceImpl& device, const SpectralBasis& basis, std::span<const Marginal> marginals,
                  std::span<const double> whitening = {});

    /// [texture · r + eigenplane] → [texture · d + plane], over the whole lattice. Takes over the memory
    /// where r = d.
    [[nodiscard]] DevicePlanes restore(DevicePlanes eigenplanes);
    /// The same of one texture, to memory of its own.
    void restore(const DevicePlanes& eigenplanes, int texture, const Buffer& target);
    [[nodiscard]] int planes() const { return planes_; }
    [[nodiscard]] int rank() const { return rank_; }
    /// Bytes that restore() takes beside its argument.
    [[nodiscard]] std::size_t scratch_bytes(Size lattice, int textures) const;

  private:
    void restore(const DevicePlanes& eigenplanes, const Buffer& target, int first, int textures);

    DeviceImpl* device_;
    int planes_, rank_, knots_ = 0;
    Buffer tables_, basis_;
};

}  // namespace btfield::detail

#pragma once

// Synthesis of moving averages by direct convolution of white noise on the torus (theory 14.4; P4 eq. 14,
// 16).

#include <array>
#include <vector>

#include "btfield/models.hpp"
#include "host/cl/device_impl.hpp"

namespace btfield::detail {

/// The representative of s modulo n that is nearest to 0: |result| <= n/2.
[[nodiscard]] int nearest_shift(int s, int n);

class Convolution {
  public:
    /// How work-items read the noise.
    enum class Reads {
        automatic,  ///< tiles on GPUs where they fit into local memory, else direct
        direct,
        tiles,
    };

    /// \param field    coefficients at the offsets where an impulse shows; planes that nothing couples are
    ///                 computed apart
    /// \param lattice  any size; the support wraps and may be larger than it
    /// \param scale    of the noise, the level's gain
    /// \param mean     added to every pixel, one per plane
    /// \throws DeviceError when tiles are asked for and local memory cannot hold one
    Convolution(DeviceImpl& device, const LinearField& field, Size lattice, double scale,
                const std::vector<double>& mean, Reads reads = Reads::automatic);

    /// Textures of a batch: images [texture · planes + plane][row][column], one seed (two words) per texture,
    /// noise as draw_normal_field() draws it.
    void draw(DeviceImpl& device, const Buffer& images, const Buffer& keys, int batch, int level) const;
    /// The same from noise that lies on the device, laid out as the images, which it must not be.
    void filter(DeviceImpl& device, const Buffer& noise, const Buffer& images, int batch) const;

    [[nodiscard]] bool uses_tiles() const { return tiles_; }

  private:
    [[nodiscard]] std::size_t tile_bytes(const DeviceImpl& device) const;

    int planes_, blocks_;  ///< planes of a block, blocks of a texture
    int rows_;             ///< that a work-item makes
    int offsets_count_;
    Size lattice_;
    std::array<int, 4> reach_{};  ///< as the kernel takes it
    bool tiles_ = false;
    Buffer coefficients_, offsets_, mean_;
};

}  // namespace btfield::detail

#pragma once

// Synthesis of causal autoregressive models by recursion in raster order (theory 6.3; P4 eq. 10).

#include <vector>

#include "btfield/models.hpp"
#include "host/cl/device_impl.hpp"
#include "host/synthesis/recursion_stability.hpp"

namespace btfield::detail {

/// \throws InputError when the support is not causal, the recursion is not stable or an offset is too long:
///     the message says where it grows and what to do
void check_recursion(const LinearField& field);

class CausalRecursion {
  public:
    /// How work is shared out; the fields are the same.
    enum class Schedule {
        automatic,  ///< whole fields where the batch keeps every compute unit busy
        whole,      ///< a work-item makes a plane block of a texture from its first row to its last
        waves,      ///< skewed wavefronts of groups of rows, one launch each
    };

    /// \param field planes that nothing couples are computed apart
    /// \param size  of the textures; the recursion begins recursion_margins() outside, with zeros
    /// \param scale of the noise, the level's gain
    /// \param mean  added to every pixel, one per plane
    /// \throws InputError as check_recursion() does
    CausalRecursion(DeviceImpl& device, const LinearField& field, Size size, double scale,
                    const std::vector<double>& mean, Schedule schedule = Schedule::automatic);

    /// Textures of a batch: images [texture · planes + plane][row][column], one seed (two words) per texture.
    /// The noise of a pixel is that of draw_normal_field() on domain().
    void draw(DeviceImpl& device, const Buffer& images, const Buffer& keys, int batch, int level) const;
    /// In place on the whole domain, from unit white noise to the field without its mean.
    void run(DeviceImpl& device, const Buffer& field, int batch) const;

    [[nodiscard]] Size domain() const { return domain_; }
    [[nodiscard]] const RecursionMargins& margins() const { return margins_; }

  private:
    int planes_ = 0, blocks_ = 0;  ///< planes of a block, blocks of a texture
    int offsets_count_;
    Size size_, domain_;
    RecursionMargins margins_;
    Schedule schedule_;
    int lag_ = 1, reach_ = 0, back_ = 1;
    Buffer coefficients_, displacements_, mean_;
};

}  // namespace btfield::detail

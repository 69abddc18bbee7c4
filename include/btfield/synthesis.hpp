#pragma once

/// \file
/// From a model to new texture of any size (theory 14).

#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <vector>

#include "btfield/api.hpp"
#include "btfield/device.hpp"
#include "btfield/image.hpp"
#include "btfield/models.hpp"

namespace btfield {

/// Where the white noise is drawn (theory 14.2). Both have the model's covariance; the pictures differ.
enum class NoiseDomain {
    frequency,  ///< the half spectrum directly: no forward transform
    spatial,    ///< noise on the lattice, then its transform (the papers' steps 1 and 2)
};

/// On what a causal autoregressive model lives (theory 6.3).
enum class SynthesisMethod {
    torus,   ///< every model; opposite edges can continue each other
    raster,  ///< pixel after pixel from the rows above, as the papers do (P4 eq. 10), begun beyond the
             ///< border; noise is drawn on the lattice. Same covariance, other pictures; does not tile. CAR
             ///< only
};

/// How a moving average is grown from noise that was drawn on the lattice (theory 14.4). The pictures agree
/// to 1e-5 of full scale.
enum class MovingAverageRoute {
    automatic,    ///< whichever is expected to be faster for the model's support
    convolution,  ///< summed up offset by offset
    transfer,     ///< multiplied in frequency by the transfer function
};

struct SynthesisOptions {
    NoiseDomain noise_domain = NoiseDomain::frequency;
    bool allow_invalid = false;  ///< synthesise although a certificate fails
    SynthesisMethod method = SynthesisMethod::torus;
    /// Counts where the noise is spatial only: drawn in frequency, it takes the transfer function.
    MovingAverageRoute moving_average = MovingAverageRoute::automatic;
};

/// Whether a model can be grown as asked, as far as that can be told without a device.
/// \throws InputError when check() refuses the model, a certificate fails (unless allowed), a side is < 1 or
///     too long, or raster is asked of a model that is not CAR or whose recursion is not stable
BTFIELD_API void check_synthesis(const TextureModel& model, Size size, const SynthesisOptions& options = {});

/// Holds plans and per-frequency factors for one model and size; textures of a seed or a batch of seeds reuse
/// them. Any number of threads may ask one for textures at a time.
class BTFIELD_API Synthesiser {
  public:
    /// \param device is to outlive it; the model need not
    /// \param size   of the textures: any
    /// \throws InputError as check_synthesis() does
    /// \throws DeviceError when the device's memory cannot hold the work: the message says which square would
    ///     fit
    Synthesiser(Device& device, const TextureModel& model, Size size, const SynthesisOptions& options = {});
    ~Synthesiser();
    Synthesiser(Synthesiser&&) noexcept;
    Synthesiser& operator=(Synthesiser&&) noexcept;

    /// Texture of one seed: a pure function of (model, size, method, noise domain, seed), to 1e-5 of full
    /// scale on any device. In units of the analysed picture's values, not clamped, of its planes and colour
    /// space.
    [[nodiscard]] Image synthesise(std::uint64_t seed);
    /// One texture per seed, each equal to synthesise(seed).
    [[nodiscard]] std::vector<Image> synthesise(std::span<const std::uint64_t> seeds);
    /// synthesise(seeds) that tells, in the caller's thread, the share of the textures that are done whenever
    /// some are; what `progress` throws ends the work.
    [[nodiscard]] std::vector<Image> synthesise(std::span<const std::uint64_t> seeds,
                                                const std::function<void(double)>& progress);
    /// The textures in device memory, [texture][plane][row][column], float32 without padding. Returns when
    /// all is enqueued: what is enqueued on the device's queue later sees them, and Device::finish() waits.
    /// \throws InputError when the memory is of another device's context or too small
    void synthesise_to(std::span<const std::uint64_t> seeds, const DeviceMemory& target);

    [[nodiscard]] Size size() const;
    /// Lattice that is computed before cropping; on a torus it equals size() when that suits pyramid and FFT.
    [[nodiscard]] Size lattice() const;
    /// True when opposite edges of the result continue each other.
    [[nodiscard]] bool tileable() const;
    /// Seeds that are computed together at most, as the device's memory and caches allow.
    [[nodiscard]] int batch() const;

  private:
    class Impl;
    std::unique_ptr<Impl> impl_;
};

}  // namespace btfield

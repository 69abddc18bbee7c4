#pragma once

/// \file
/// From a model to new texture of any size (MODELS section 11).

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "btfield/device.hpp"
#include "btfield/image.hpp"
#include "btfield/models.hpp"

namespace btfield {

/// Where the white noise is drawn. Both have the model's covariance; the pictures differ.
enum class NoiseDomain {
    frequency,  ///< the half spectrum directly: no forward transform
    spatial,    ///< noise on the lattice, then its transform (the papers' steps 1 and 2)
};

struct SynthesisOptions {
    NoiseDomain noise_domain = NoiseDomain::frequency;
    bool allow_invalid = false;  ///< synthesise although a certificate fails
};

/// Holds plans and per-frequency factors for one model and size; textures of a seed or a batch of seeds reuse
/// them.
class Synthesiser {
  public:
    /// \throws InputError when a certificate fails (unless allowed) or a side is < 1; DeviceError when the
    /// device's
    ///         memory cannot hold the work: the message says which square would fit.
    Synthesiser(Device& device, const TextureModel& model, Size size, const SynthesisOptions& options = {});
    ~Synthesiser();
    Synthesiser(Synthesiser&&) noexcept;
    Synthesiser& operator=(Synthesiser&&) noexcept;

    /// Texture of one seed: a pure function of (model, size, noise domain, seed), to 1e-5 of full scale on
    /// any device.
    [[nodiscard]] Image synthesise(std::uint64_t seed);
    /// One texture per seed, each equal to synthesise(seed).
    [[nodiscard]] std::vector<Image> synthesise(std::span<const std::uint64_t> seeds);

    [[nodiscard]] Size size() const;
    /// Lattice that is computed before cropping; equals size() when that suits pyramid and FFT.
    [[nodiscard]] Size lattice() const;
    /// True when opposite edges of the result continue each other.
    [[nodiscard]] bool tileable() const;
    /// Seeds that are computed together at most, as the device's memory allows.
    [[nodiscard]] int batch() const;

  private:
    class Impl;
    std::unique_ptr<Impl> impl_;
};

}  // namespace btfield

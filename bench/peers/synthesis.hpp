#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "btfield/image.hpp"
#include "btfield/models.hpp"

namespace btfield::peer {

/// Spectral synthesis of an autoregressive texture model with FFTW and factors computed once: factor 2, sides
/// divisible by 2^(levels − 1), width even at every level.
class Synthesiser {
  public:
    Synthesiser(const TextureModel& model, Size size);
    ~Synthesiser();

    /// One texture, its planes and rows shared by the threads.
    void synthesise(std::uint64_t seed, Image& out);
    /// One texture a thread at a time.
    void synthesise(std::span<const std::uint64_t> seeds, std::vector<Image>& out);

  private:
    class Impl;
    std::unique_ptr<Impl> impl_;
};

}  // namespace btfield::peer

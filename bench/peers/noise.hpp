#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

namespace btfield::peer {

/// White Gaussian noise: xoshiro128++ in lanes, Box-Muller with polynomials that vectorise.
class NoiseSource {
  public:
    static constexpr int lanes = 16;

    explicit NoiseSource(std::uint64_t seed);
    /// Fills with independent N(0, 1). The size must be a multiple of 2 · lanes.
    void fill(std::span<float> out);

  private:
    std::array<std::array<std::uint32_t, lanes>, 4> state_;
};

/// One source per thread.
void fill_noise(std::uint64_t seed, std::span<float> out);

}  // namespace btfield::peer

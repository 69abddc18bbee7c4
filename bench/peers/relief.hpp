#pragma once

#include <array>
#include <memory>
#include <span>
#include <vector>

#include "btfield/image.hpp"

namespace btfield::peer {

struct PixelNormals {
    Image normals;
    Image albedo;    ///< of the mean over planes
    Image residual;  ///< Σ |I − model| / Σ I
};

/// b = A⁺ I of each pixel of grey pictures: blocks of pixels that stay in the cache, vectorised over pixels.
[[nodiscard]] PixelNormals least_squares(std::span<const Image> pictures,
                                         std::span<const std::array<double, 3>> lights);

/// Twelve steps of reweighted least squares from there, as theory 19.3 has them, with true medians.
[[nodiscard]] PixelNormals huber(std::span<const Image> pictures,
                                 std::span<const std::array<double, 3>> lights);

/// Height of periodic slopes by FFTW.
class Integrator {
  public:
    explicit Integrator(Size size);
    ~Integrator();
    [[nodiscard]] Image operator()(const Image& slopes);

  private:
    class Impl;
    std::unique_ptr<Impl> impl_;
};

}  // namespace btfield::peer

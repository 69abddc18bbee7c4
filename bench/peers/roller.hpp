#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "btfield/image.hpp"

namespace btfield::peer {

/// Image quilting (Efros and Freeman 2001) on a torus, in raster order; correlations by FFTW on both threads.
class Roller {
  public:
    /// \param sample three planes; its sides hold several blocks
    Roller(const Image& sample, int block, int overlap);
    ~Roller();
    /// [row][column]: row · sample's width + column of the sample's pixel
    std::vector<std::uint32_t> quilt(Size size, unsigned seed);

  private:
    class Impl;
    std::unique_ptr<Impl> impl_;
};

}  // namespace btfield::peer

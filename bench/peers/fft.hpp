#pragma once

#include <memory>

#include "btfield/image.hpp"

namespace btfield::peer {

/// FFTW on both threads: transforms of some planes at once, half spectra of interleaved complex numbers.
class Fft {
  public:
    Fft(Size size, int planes);
    ~Fft();
    void inverse();
    void forward();

  private:
    class Impl;
    std::unique_ptr<Impl> impl_;
};

}  // namespace btfield::peer

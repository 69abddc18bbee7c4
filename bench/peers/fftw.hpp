#pragma once

/// \file
/// FFTW for the peers: aligned memory and plans.

#include <fftw3.h>

#include <cstddef>
#include <memory>

#include "btfield/image.hpp"

namespace btfield::peer {

struct FftwFree {
    void operator()(void* p) const { fftwf_free(p); }
};
template <typename T>
using Buffer = std::unique_ptr<T[], FftwFree>;

template <typename T>
Buffer<T> allocate(std::size_t n) {
    return Buffer<T>(static_cast<T*>(fftwf_malloc(n * sizeof(T))));
}

/// Complex numbers in the half spectrum of one plane: [row frequency][column frequency 0 … W/2].
[[nodiscard]] inline std::size_t spectrum_size(Size size) {
    return static_cast<std::size_t>(size.height) * static_cast<std::size_t>(size.width / 2 + 1);
}

/// Measured plan for `planes` planes, in either direction; reusable on other memory of the same alignment.
class Plan {
  public:
    enum class Direction { inverse, forward };
    Plan(Size size, int planes, Direction direction, int plan_threads);
    Plan(const Plan&) = delete;
    Plan& operator=(const Plan&) = delete;
    ~Plan() { fftwf_destroy_plan(plan_); }

    void inverse(fftwf_complex* spectrum, float* image) const {
        fftwf_execute_dft_c2r(plan_, spectrum, image);
    }
    void forward(float* image, fftwf_complex* spectrum) const {
        fftwf_execute_dft_r2c(plan_, image, spectrum);
    }

  private:
    fftwf_plan plan_;
};

}  // namespace btfield::peer

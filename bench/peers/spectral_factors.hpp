#pragma once

#include <fftw3.h>

#include <vector>

#include "bench/peers/noise.hpp"
#include "btfield/image.hpp"
#include "btfield/models.hpp"

namespace btfield::peer {

/// Λ_t⁻¹ Σ^{1/2} of one level at every frequency of the half spectrum, scaled for an unnormalised transform.
class SpectralFactors {
  public:
    SpectralFactors(const LinearField& field, Size size, double gain);

    /// Spectra of all planes for blocks [begin, end) of frequencies: factor times white noise.
    void draw(NoiseSource& source, int begin, int end, fftwf_complex* spectrum) const;
    [[nodiscard]] int blocks() const;
    [[nodiscard]] Size size() const { return size_; }

  private:
    Size size_;
    int planes_;
    std::vector<float> values_;  ///< [block][i][j][re, im][frequency in block]
};

}  // namespace btfield::peer

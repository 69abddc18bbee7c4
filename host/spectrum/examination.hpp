#pragma once

#include "btfield/certificate.hpp"
#include "host/spectrum/certificate_text.hpp"
#include "host/spectrum/spectral_form.hpp"

namespace btfield::detail {

/// A certificate with what else its evaluations give.
struct Examination {
    Certificate certificate;
    /// Mean ln |det Λ| over the torus; meaningful when the certificate is valid.
    double log_determinant = 0.0;
    /// Side of a frequency grid over which sums are integrals to about a percent, so far as any up to 512 is.
    int grid = 0;
};

[[nodiscard]] Examination examine(const SpectralForm& form, const LagCovariance& data);

}  // namespace btfield::detail

#pragma once

// Whether a causal autoregressive model can be run as a raster recursion, and how far from the border it has
// forgotten where it began (theory 6.4, 6.5).

#include <string>

#include "btfield/image.hpp"
#include "btfield/models.hpp"

namespace btfield::detail {

/// The recursion y(r) = Σ_s A_s y(r + s) + e(r) with a non-symmetric half-plane support is stable (bounded
/// noise gives a bounded field) iff
///   (1) the recursion along a row on its own is: det(I − Σ_{s1 = 0} A_s z^{|s2|}) has no zero in |z| <= 1,
///   and (2) for every column frequency ω2 the recursion from row to row is: with
///       P_m(ω2) = Σ_{s1 = −m} A_s e^{√−1 ω2 s2},
///       det(I − P_0(ω2) − Σ_{m > 0} P_m(ω2) z^m) has no zero in |z| <= 1
/// (Ekstrom and Woods 1976; Huang 1972 for the quarter-plane). Both are eigenvalues of companion matrices.
struct RecursionStability {
    bool stable = false;
    double along_rows = 0.0;        ///< (1): largest |eigenvalue|, growth per column; stable below 1
    double down_rows = 0.0;         ///< (2): the largest over ω2, growth per row; NaN when (1) fails
    double column_frequency = 0.0;  ///< where that is, radians per pixel
    std::string explanation;        ///< one clause, for a message
};

/// \throws InputError when an offset does not precede the centre in raster order
[[nodiscard]] RecursionStability recursion_stability(const LinearField& field);

/// Rows above and columns beside the wanted part that a recursion is begun with.
struct RecursionMargins {
    int top = 0, left = 0, right = 0;
    double missing = 0.0;  ///< share of the variance that the nearest pixels still lack, as far as was looked
};

/// From the impulse response: beyond the margins lies at most `tolerance` of its energy on each side, unless
/// that needs more than `largest` pixels. Precondition: stable.
[[nodiscard]] RecursionMargins recursion_margins(const LinearField& field, double tolerance = 1e-3,
                                                 int largest = 256);

}  // namespace btfield::detail

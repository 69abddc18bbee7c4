#pragma once

// The standard normal distribution, float64.

namespace btfield::detail {

/// φ(x).
[[nodiscard]] double normal_density(double x);
/// Φ(x), to full relative accuracy in the lower tail.
[[nodiscard]] double normal_cumulative(double x);
/// Φ(b) − Φ(a), to full relative accuracy in both tails. a <= b, infinities allowed.
[[nodiscard]] double normal_probability(double a, double b);
/// Φ⁻¹(u) for 0 < u < 1, to 1e-15 relative (Wichura, Algorithm AS 241, PPND16).
[[nodiscard]] double normal_quantile(double u);

}  // namespace btfield::detail

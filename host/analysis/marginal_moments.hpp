#pragma once

// Moments of piecewise-linear maps of normals (theory 13.4).

#include <span>
#include <vector>

#include "btfield/marginals.hpp"

namespace btfield::detail {

/// Knot k of n.
[[nodiscard]] double knot(int k, int n);

/// Hat functions h_k over the knots (1 at knot k, 0 at the others; the first and the last one stay 1 beyond
/// their end) of a normal of mean 0: they add up to 1, and q = Σ_k q_k h_k.
struct HatMoments {
    std::vector<double> mean;     ///< E h_k
    std::vector<double> square;   ///< E h_k²
    std::vector<double> product;  ///< E h_k h_{k+1}; all other products are 0
};
[[nodiscard]] HatMoments hat_moments(int knots, double variance);

/// E q(x) and Var q(x).
struct MappedMoments {
    double mean = 0.0, variance = 0.0;
};
[[nodiscard]] MappedMoments mapped_moments(const Marginal& marginal, const HatMoments& hats);

/// Covariances of mapped planes from those of jointly normal planes of mean 0:
/// Cov(q_i(x), q_j(y)) = Σ_{n>=1} a_n^i a_n^j ρⁿ (Mehler), a_n = E q(x) He_n(x/σ)/√n!.
class MappedCovariance {
  public:
    /// \param variances  of the normal planes, which need not be 1
    MappedCovariance(std::span<const Marginal> marginals, std::span<const double> variances);

    /// Of planes i and j where the normal planes' covariance is c. Accurate to 1e-4 √(Var_i Var_j); c = Var
    /// x_i of i = j is exact.
    [[nodiscard]] double operator()(int i, int j, double c) const;
    /// [lag][i][j] → [lag][i][j].
    [[nodiscard]] std::vector<double> operator()(std::span<const double> covariances) const;
    /// E q_i(x).
    [[nodiscard]] double mean(int i) const { return planes_[static_cast<std::size_t>(i)].mean; }
    [[nodiscard]] int planes() const { return static_cast<int>(planes_.size()); }

  private:
    struct Plane {
        double deviation = 0.0;  ///< of the normal plane
        double mean = 0.0;
        double remainder = 0.0;      ///< Var q(x) − Σ a_n²
        std::vector<double> series;  ///< a_1, a_2, …
    };
    std::vector<Plane> planes_;
};

}  // namespace btfield::detail

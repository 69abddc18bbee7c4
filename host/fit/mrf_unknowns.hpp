#pragma once

// The unknowns of Markov random fields as coefficients of Hermitian matrices, and second derivatives by them.

#include <cstdint>
#include <vector>

#include "btfield/models.hpp"
#include "host/base/dense.hpp"
#include "host/base/eigen.hpp"
#include "host/spectrum/lag_transform.hpp"
#include "host/spectrum/lane_matrix.hpp"

namespace btfield::detail {

/// One real unknown x: the polynomial holds x · E, E = sign · weight · (e_i e_jᵀ e^{iω·s} + e_j e_iᵀ
/// e^{−iω·s}). Lags of the support have sign −1 and weight 1; constants (s = 0) sign +1 and weight ½ on the
/// diagonal, so that E is e_i e_iᵀ.
struct MrfUnknown {
    Offset offset;
    int i = 0, j = 0;
    [[nodiscard]] bool constant() const { return offset == Offset{}; }
    [[nodiscard]] double scale() const { return constant() ? (i == j ? 0.5 : 1.0) : -1.0; }
};

/// The half of a symmetric support, and where its offsets are in the whole one.
struct HalfSupport : Support {
    std::vector<std::size_t> position;  ///< of each offset in the whole support
    std::vector<std::size_t> mirror;    ///< of −s in the whole support
    Offset reach;                       ///< largest |row|, |column|
};
/// \throws InputError when the support is empty, lacks −s for some s, repeats an offset or holds the centre,
///     when an offset does not fit the statistic's box, or when the pairs of s and −s do not mirror each
///     other
[[nodiscard]] HalfSupport half_support(const LagCovariance& statistic, const Support& support,
                                       const char* asked);

/// Unknowns of the constant (none, diagonal or all) and of the lags, in this order.
enum class ConstantForm { none, diagonal, full };
[[nodiscard]] std::vector<MrfUnknown> mrf_unknowns(const HalfSupport& support, int planes,
                                                   ConstantForm constant);

/// x → polynomial; the constant is left as it is where it has no unknowns.
void assign(const std::vector<MrfUnknown>& unknowns, const Eigen::VectorXd& x,
            HermitianPolynomial& polynomial);
/// polynomial → x
[[nodiscard]] Eigen::VectorXd collect(const std::vector<MrfUnknown>& unknowns,
                                      const HermitianPolynomial& polynomial);

/// mean_t tr(K_t E) for every unknown, from the Fourier coefficients of the Hermitian K: function
/// first + i (i + 1)/2 + j of the means is K_ij, i >= j.
[[nodiscard]] Eigen::VectorXd traces(const std::vector<MrfUnknown>& unknowns, const LagMeans& means,
                                     Eigen::Index first = 0);
/// Rows of the lower triangle of K for LagSums::add.
void lower_triangle(const LaneMatrix& matrix, RowMajorMatrix& rows);

/// Products Φ_{ab,cd} of entries of matrix functions with Φ_{ab,cd} = Φ_{cd,ab} and Φ_{ba,dc} = conj
/// Φ_{ab,cd}: the distinct ones only, about d⁴/4.
class PairTable {
  public:
    struct Pair {
        int a, b, c, d;
    };
    explicit PairTable(int planes);
    [[nodiscard]] const std::vector<Pair>& pairs() const { return pairs_; }
    /// rows += scale · x_ab y_cd for every pair. The sum of all that is added has to have the two symmetries.
    void add_products(const LaneMatrix& x, const LaneMatrix& y, double scale, RowMajorMatrix& rows) const;
    /// Φ̂_{ab,cd}(u)
    [[nodiscard]] double at(const LagMeans& means, int a, int b, int c, int d, Offset u) const {
        const int entry = ((a * planes_ + b) * planes_ + c) * planes_ + d;
        const int place = index_[static_cast<std::size_t>(entry)];
        return place >= 0 ? means(place, u) : means(-1 - place, -u);
    }

  private:
    int planes_;
    std::vector<Pair> pairs_;
    std::vector<int> index_;
};

/// H_pq = mean_t Σ_{abcd} (E_p)_da (E_q)_bc Φ_{ab,cd}, that is mean tr(E_p X E_q Y) for Φ_{ab,cd} = X_ab
/// Y_cd.
[[nodiscard]] Eigen::MatrixXd second_traces(const std::vector<MrfUnknown>& unknowns, const PairTable& table,
                                            const LagMeans& means);

}  // namespace btfield::detail

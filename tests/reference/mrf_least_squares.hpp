#pragma once

// Least squares of the Markov random fields pixel by pixel, in the papers' own unknowns (P4 eq. 46, 47).

#include <Eigen/Core>
#include <vector>

#include "btfield/image.hpp"
#include "btfield/neighbourhood.hpp"

namespace btfield::reference {

struct MrfIterate {
    std::vector<Eigen::MatrixXd> a;  ///< A_s per offset
    Eigen::MatrixXd sigma;           ///< mean_r e_r e_rᵀ
};

/// P4's form: unknowns a_{s,i,i} of one of each ±s, and a_{s,i,j} of every s for i < j; the rest follows from
/// a_{−s,j,i} = (σ_j/σ_i) a_{s,i,j}. Ratios are 1 in the first iteration.
MrfIterate mmrf_diagonal(const Image& image, const std::vector<Offset>& offsets, int iterations);

/// Full noise: unknowns are the entries of Q_s = Σ⁻¹ A_s of one of each ±s, Q_{−s} = Q_sᵀ; e_rᵀ Σ⁻¹ e_r is
/// minimised with the Σ of the last iteration, C(0) at first.
MrfIterate mmrf_full(const Image& image, const std::vector<Offset>& offsets, int iterations);

}  // namespace btfield::reference

#pragma once

// What the Whittle likelihood of a PMRF with unequal Σ needs of a picture beside its lag covariances
// (theory 11.2).

#include <vector>

#include "btfield/image.hpp"
#include "host/spectrum/frequency_grid.hpp"
#include "host/spectrum/lane_matrix.hpp"

namespace btfield::detail {

/// The picture's periodogram I_t = Ỹ_t Ỹ_tᴴ / (H W) (means removed, so mean_t I_t is C(0) and mean_t
/// conj(I_t) e^{iω·s} is C(s)), averaged over rectangular cells of frequencies: a Hermitian positive
/// semidefinite matrix for each cell. Averages of neighbouring ordinates, not every so-manieth one, which
/// would throw the others away, and not the transform of truncated covariances, which need not be positive.
/// Cells are single frequencies near 0, where spectra of pictures are steep, and grow to 1/12 of their
/// distance from 0 and at most 1/100 of a turn, so that their number hardly grows with the picture.
struct FoldedPeriodogram {
    FrequencyGrid grid;            ///< centres of the cells and shares of frequencies
    std::vector<LaneMatrix> rows;  ///< I for every row of cells
};

/// \throws InputError when the picture is empty
[[nodiscard]] FoldedPeriodogram folded_periodogram(const Image& image);

}  // namespace btfield::detail

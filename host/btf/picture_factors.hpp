#pragma once

// All pictures of a set as one product of two matrices (theory 21.5).

#include <cstdint>
#include <functional>
#include <vector>

#include "btfield/btf_set.hpp"
#include "host/base/eigen.hpp"

namespace btfield::detail {

/// A ≈ U Vᵀ, a row of A being a colour of a picture: U has orthonormal columns, those of V are orthogonal and
/// as long as the singular values.
struct PictureFactors {
    std::vector<double> singular;  ///< descending
    RowMajorMatrix rows;           ///< U, [colour + colours · picture][component]
    RowMajorMatrix pixels;         ///< V, [pixel][component]
    double energy = 0.0;           ///< Σ A²
    double left = 0.0;             ///< Σ (A − U Vᵀ)²
};

/// As many as all pictures can have.
[[nodiscard]] std::uint64_t most_components(const BtfSet& set);

/// Reads every picture factor_readings times. The result does not depend on the number of threads.
/// \param components  1 to most_components()
/// \param prepared  what a picture becomes before it is factored
/// \param progress  told how many pictures are read, of all readings
[[nodiscard]] PictureFactors factor_pictures(const BtfSet& set, int components,
                                             const std::function<Image(Image)>& prepared,
                                             const std::function<void(std::uint64_t)>& progress);
inline constexpr int factor_readings = 3;

/// Bytes that this takes at most.
[[nodiscard]] double factor_bytes(const BtfSet& set, int components);

}  // namespace btfield::detail

#pragma once

// Fourier coefficients of functions of frequency: what covariances and derivatives of likelihoods are made
// of.

#include <complex>
#include <cstddef>
#include <utility>
#include <vector>

#include "btfield/image.hpp"
#include "btfield/neighbourhood.hpp"
#include "host/base/dense.hpp"
#include "host/base/eigen.hpp"
#include "host/spectrum/frequency_grid.hpp"

namespace btfield::detail {

/// x̂(u) = Re mean_t x_t e^{iω·u}, |u| <= box, of several functions with x_{−t} = conj x_t.
class LagMeans {
  public:
    /// \param sums [lag row][lag column, function]
    LagMeans(RowMajorMatrix sums, Offset box)
        : sums_(std::move(sums)), box_(box), functions_(sums_.cols() / (2 * Eigen::Index{box.column} + 1)) {}
    [[nodiscard]] double operator()(Eigen::Index function, Offset u) const { return at(u)[function]; }
    /// Those of all functions.
    [[nodiscard]] const double* at(Offset u) const {
        return sums_.row(u.row + box_.row).data() + (u.column + box_.column) * functions_;
    }

  private:
    RowMajorMatrix sums_;
    Offset box_;
    Eigen::Index functions_;
};

class LagSums;

/// The tables of a transform on half a grid of frequencies.
class LagTransform {
  public:
    LagTransform(const FrequencyGrid& grid, Offset box);
    /// \param grid rows × columns of a uniform one
    LagTransform(Size grid, Offset box);
    [[nodiscard]] Offset box() const { return box_; }

  private:
    friend class LagSums;
    friend LagMeans means_of(std::vector<LagSums>& parts);
    [[nodiscard]] Eigen::Index rows() const { return 2 * Eigen::Index{box_.row} + 1; }
    [[nodiscard]] Eigen::Index columns() const { return 2 * Eigen::Index{box_.column} + 1; }

    Offset box_;
    double frequencies_ = 1.0;                 ///< that sums are divided by to become means
    RowMajorMatrix waves_;                     ///< weighted cos of c ω2, then sin, [n][c = 0 … box.column]
    std::vector<std::complex<double>> turns_;  ///< weighted e^{iω1 r}, [m][r = −box.row … box.row]
};

/// The share of one block of rows. Two transforms as matrix products: each row along the columns of the grid
/// when it comes, all of them along its rows once the block is complete.
class LagSums {
  public:
    /// \param rows of the block, at most
    LagSums(const LagTransform& transform, Eigen::Index functions, int rows);
    /// \param values row 2k: real part of function k along the grid's row m; row 2k + 1: its imaginary part
    void add(std::size_t m, const ConstRows& values);

  private:
    friend LagMeans means_of(std::vector<LagSums>& parts);
    void complete();

    const LagTransform* transform_;
    Eigen::Index functions_, capacity_, filled_ = 0;
    RowMajorMatrix columns_;  ///< of the row that has come
    RowMajorMatrix along_;    ///< [row of the grid: re, im][lag column, function]
    RowMajorMatrix turns_;    ///< [lag row][row of the grid: re, −im]
    RowMajorMatrix sums_;
};

/// Parts of a whole grid, in order. Spoils them.
[[nodiscard]] LagMeans means_of(std::vector<LagSums>& parts);

}  // namespace btfield::detail

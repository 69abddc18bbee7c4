#pragma once

/// \file
/// The sufficient statistic of every least-squares and maximum-likelihood fit (theory 5).

#include <cstddef>
#include <span>
#include <vector>

#include "btfield/api.hpp"
#include "btfield/image.hpp"
#include "btfield/neighbourhood.hpp"

namespace btfield {

/// C_ij(s) = mean_r (y_i(r) − μ_i)(y_j(r ⊕ s) − μ_j) for |s1| <= box.row, |s2| <= box.column (theory 5.1), in
/// squared units of the values. Half of the lags are stored (C_ij(−s) = C_ji(s)); float64.
class BTFIELD_API LagCovariance {
  public:
    LagCovariance() = default;
    /// All covariances zero.
    /// \throws InputError when there is no plane, or the box is negative or too large
    LagCovariance(int planes, Size size, Offset box);

    [[nodiscard]] int planes() const { return planes_; }
    /// Lattice that the mean was taken over.
    [[nodiscard]] Size size() const { return size_; }
    [[nodiscard]] Offset box() const { return box_; }
    [[nodiscard]] bool contains(Offset s) const {
        return s.row <= box_.row && -s.row <= box_.row && s.column <= box_.column && -s.column <= box_.column;
    }
    /// μ, one per plane.
    [[nodiscard]] std::span<double> mean() { return mean_; }
    [[nodiscard]] std::span<const double> mean() const { return mean_; }

    /// C_ij(s). Precondition: contains(s).
    [[nodiscard]] double operator()(int i, int j, Offset s) const {
        return in_half(s) ? values_[index(i, j, s)] : values_[index(j, i, -s)];
    }
    /// Sets C_ij(s) and with it C_ji(−s). Precondition: contains(s).
    void set(int i, int j, Offset s, double value);

  private:
    static bool in_half(Offset s) { return s.row > 0 || (s.row == 0 && s.column >= 0); }
    [[nodiscard]] std::size_t index(int i, int j, Offset s) const {
        const auto d = static_cast<std::size_t>(planes_);
        return ((static_cast<std::size_t>(s.row) * static_cast<std::size_t>(2 * box_.column + 1) +
                 static_cast<std::size_t>(s.column + box_.column)) *
                    d +
                static_cast<std::size_t>(i)) *
                   d +
               static_cast<std::size_t>(j);
    }
    int planes_ = 0;
    Size size_;
    Offset box_;
    std::vector<double> mean_;
    std::vector<double> values_;
};

/// One pass over the picture. Lags may exceed the picture's sides: they wrap.
/// \throws InputError when the picture is empty or the box negative or too large
[[nodiscard]] BTFIELD_API LagCovariance lag_covariance(const Image& image, Offset box);

/// Auto- and cross-covariances at the listed lags only, in their order: [lag][i][j], means removed.
/// \throws InputError when the picture is empty
[[nodiscard]] BTFIELD_API std::vector<double> covariances_at(const Image& image,
                                                             std::span<const Offset> lags);

/// Lags that level gains and comparisons look at (theory 5.4): (0, 0) and (0, h), (h, 0), (h, h), (h, −h) for
/// h = 1, 2, 4, 8, 16 as far as h is less than half of both sides.
[[nodiscard]] BTFIELD_API std::vector<Offset> probe_lags(Size size);

}  // namespace btfield

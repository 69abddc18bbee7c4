#include "host/compound/regional_averages.hpp"

#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>
#include <vector>

#include "btfield/error.hpp"
#include "host/analysis/lag_matrices.hpp"
#include "host/base/eigen.hpp"
#include "host/spectrum/spectral_form.hpp"

namespace btfield::detail {
namespace {

using Eigen::Index;
using Eigen::MatrixXcd;
using Eigen::MatrixXd;
using std::size_t;

/// Frequencies along an axis: enough for all lags of the box, and as many again so that the root's tails do
/// not come round to the support.
int frequencies(int box) {
    return 4 * box + 2;
}

std::complex<double> turn(int lag, int frequency, int count) {
    return std::polar(1.0, 2.0 * std::numbers::pi * lag * frequency / count);
}

MatrixXcd positive_root(const MatrixXcd& density) {
    const Eigen::SelfAdjointEigenSolver<MatrixXcd> eigen(density);
    const Eigen::VectorXd values = eigen.eigenvalues().cwiseMax(0.0).cwiseSqrt();
    const MatrixXcd scaled = eigen.eigenvectors() * values.asDiagonal();
    return scaled * eigen.eigenvectors().adjoint();
}

/// Σ C(s)ᵀ e^{−iω·s} over a box of lags, [row frequency][column frequency] of the upper half.
class Density {
  public:
    explicit Density(const LagCovariance& statistic)
        : planes_(statistic.planes()),
          rows_(frequencies(statistic.box().row)),
          columns_(frequencies(statistic.box().column)),
          lag_rows_(statistic.box().row) {
        const int reach = statistic.box().column;
        along_rows_.reserve(static_cast<size_t>(lag_rows_ + 1) * static_cast<size_t>(columns_));
        for (int row = 0; row <= lag_rows_; ++row)
            for (int n = 0; n < columns_; ++n) {
                MatrixXcd sum = MatrixXcd::Zero(planes_, planes_);
                for (int column = -reach; column <= reach; ++column)
                    sum += turn(-column, n, columns_) * lag_matrix(statistic, {row, column}).transpose();
                along_rows_.push_back(std::move(sum));
            }
    }
    [[nodiscard]] int rows() const { return rows_; }
    [[nodiscard]] int columns() const { return columns_; }
    [[nodiscard]] MatrixXcd at(int m, int n) const {
        MatrixXcd half = MatrixXcd::Zero(planes_, planes_);  // C(−s) = C(s)ᵀ makes up the rest
        for (int row = 1; row <= lag_rows_; ++row) half += turn(-row, m, rows_) * line(row, n);
        return line(0, n) + half + half.adjoint();
    }

  private:
    [[nodiscard]] const MatrixXcd& line(int row, int n) const {
        return along_rows_[static_cast<size_t>(row) * static_cast<size_t>(columns_) + static_cast<size_t>(n)];
    }
    int planes_, rows_, columns_, lag_rows_;
    std::vector<MatrixXcd> along_rows_;  ///< [row][column frequency]
};

/// Coefficients of the root at these offsets.
std::vector<MatrixXd> root_of(const LagCovariance& statistic, const std::vector<Offset>& offsets) {
    const Density density(statistic);
    const int rows = density.rows(), columns = density.columns();
    std::vector<MatrixXd> a(offsets.size(), MatrixXd::Zero(statistic.planes(), statistic.planes()));
    for (int m = 0; m <= rows / 2; ++m)
        for (int n = 0; n < columns; ++n) {
            const MatrixXcd root = positive_root(density.at(m, n));
            const double weight = (m == 0 || 2 * m == rows ? 1.0 : 2.0) / (rows * columns);
            const MatrixXd real = weight * root.real(), imaginary = weight * root.imag();
            for (size_t k = 0; k < a.size(); ++k) {
                const std::complex<double> wave =
                    turn(offsets[k].row, m, rows) * turn(offsets[k].column, n, columns);
                a[k] += wave.real() * real - wave.imag() * imaginary;
            }
        }
    return a;
}

}  // namespace

MaModel averages_of_covariances(const LagCovariance& statistic, const Support& support) {
    const Index d = statistic.planes();
    MaModel model;
    model.planes = statistic.planes();
    model.kind = support.kind;
    model.offsets = support.offsets;
    if (std::find(model.offsets.begin(), model.offsets.end(), Offset{}) == model.offsets.end())
        model.offsets.insert(std::upper_bound(model.offsets.begin(), model.offsets.end(), Offset{}),
                             Offset{});
    const std::vector<MatrixXd> a = root_of(statistic, model.offsets);
    MatrixXd got = MatrixXd::Zero(d, d);
    for (const MatrixXd& block : a) got += block * block.transpose();
    const MatrixXd target = lag_zero(statistic);
    if (!(target.diagonal().minCoeff() > 0.0) || !(got.diagonal().minCoeff() > 0.0))
        throw InputError("fit moving averages to covariances", "a plane has no variance",
                         "remove that plane or use a picture that varies");
    const MatrixXd matching = matching_matrix(got, target);
    for (const MatrixXd& block : a) {
        const RowMajorMatrix own = matching * block;
        model.coefficients.insert(model.coefficients.end(), own.data(), own.data() + own.size());
    }
    const MatrixXd noise = MatrixXd::Identity(d, d);
    model.noise_covariance.assign(noise.data(), noise.data() + noise.size());
    return model;
}

}  // namespace btfield::detail

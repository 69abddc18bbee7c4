#include "host/spectral_density.hpp"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>

#include "btfield/error.hpp"
#include "host/parallel.hpp"

namespace btfield {
namespace {

using std::size_t;
using Complex = std::complex<double>;
using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

/// cos and sin of 2π k / n, exact in the multiples of a quarter turn that grids share.
Complex root_of_unity(long long k, long long n) {
    k = ((k % n) + n) % n;
    const double angle = 2.0 * std::numbers::pi * static_cast<double>(k) / static_cast<double>(n);
    return {std::cos(angle), std::sin(angle)};
}

/// out = a b − c e, complex, along n.
struct Factor {
    const double* real;
    const double* imaginary;
};

void subtract_products(Factor a, Factor b, Factor c, Factor e, double* real, double* imaginary, int count) {
    for (int n = 0; n < count; ++n) {
        real[n] = a.real[n] * b.real[n] - a.imaginary[n] * b.imaginary[n] -
                  (c.real[n] * e.real[n] - c.imaginary[n] * e.imaginary[n]);
        imaginary[n] = a.real[n] * b.imaginary[n] + a.imaginary[n] * b.real[n] -
                       (c.real[n] * e.imaginary[n] + c.imaginary[n] * e.real[n]);
    }
}

/// Rows m = 0 … rows/2 stand for all: S(−ω) = conj S(ω).
double row_weight(int row, int rows) {
    return row == 0 || 2 * row == rows ? 1.0 : 2.0;
}

struct RowBlocks {
    int rows, per_block, count;
    explicit RowBlocks(int grid_rows)
        : rows(grid_rows / 2 + 1),
          per_block(std::max(1, (rows + 31) / 32)),
          count((rows + per_block - 1) / per_block) {}
    [[nodiscard]] int first(int block) const { return block * per_block; }
    [[nodiscard]] int last(int block) const { return std::min(rows, (block + 1) * per_block); }
};

}  // namespace

SpectralRow::SpectralRow(const SpectralForm& form, int columns)
    : kind_(form.kind),
      planes_(form.planes()),
      columns_(columns),
      offsets_(form.lambda.offsets),
      coefficients_(form.lambda.coefficients),
      left_(form.left),
      right_(form.right),
      lambda_(planes_ * planes_, columns),
      determinant_(1, columns),
      inverse_(planes_ * planes_, columns) {
    for (const Offset s : offsets_) column_offsets_.push_back(s.column);
    std::sort(column_offsets_.begin(), column_offsets_.end());
    column_offsets_.erase(std::unique(column_offsets_.begin(), column_offsets_.end()), column_offsets_.end());
    for (const int s : column_offsets_) {
        for (int n = 0; n < columns; ++n) {
            const Complex turn = root_of_unity(static_cast<long long>(s) * n, columns);
            cosine_.push_back(turn.real());
            sine_.push_back(turn.imag());
        }
    }
    const Eigen::MatrixXd noise = noise_matrix(form.lambda);
    switch (kind_) {
        case SpectralForm::Kind::autoregressive:
            noise_ = noise.llt().matrixL();
            break;
        case SpectralForm::Kind::moving_average:
            noise_ = symmetric_root(noise);
            break;
        case SpectralForm::Kind::mmrf:
        case SpectralForm::Kind::pmrf:
            noise_ = noise;
            break;
    }
}

void SpectralRow::evaluate(double row_frequency) {
    const int entries = planes_ * planes_;
    const auto distinct = column_offsets_.size();
    // B_c = Σ over offsets with s2 = c of A_s e^{iω1 s1}: what is left is a sum over few distinct s2.
    std::vector<Complex> sums(distinct * static_cast<size_t>(entries));
    for (size_t s = 0; s < offsets_.size(); ++s) {
        const auto found =
            std::lower_bound(column_offsets_.begin(), column_offsets_.end(), offsets_[s].column);
        const auto c = static_cast<size_t>(found - column_offsets_.begin());
        const Complex turn = std::polar(1.0, row_frequency * offsets_[s].row);
        for (size_t e = 0; e < static_cast<size_t>(entries); ++e) {
            sums[c * static_cast<size_t>(entries) + e] +=
                turn * coefficients_[s * static_cast<size_t>(entries) + e];
        }
    }
    for (int e = 0; e < entries; ++e) {
        double* real = lambda_.real(e);
        double* imaginary = lambda_.imaginary(e);
        std::fill_n(real, columns_, e % (planes_ + 1) == 0 ? 1.0 : 0.0);
        std::fill_n(imaginary, columns_, 0.0);
        for (size_t c = 0; c < distinct; ++c) {
            const Complex b = sums[c * static_cast<size_t>(entries) + static_cast<size_t>(e)];
            const double re = b.real(), im = b.imag();
            const double* cosine = cosine_.data() + c * static_cast<size_t>(columns_);
            const double* sine = sine_.data() + c * static_cast<size_t>(columns_);
            for (int n = 0; n < columns_; ++n) {
                real[n] -= re * cosine[n] - im * sine[n];
                imaginary[n] -= re * sine[n] + im * cosine[n];
            }
        }
    }
    if (planes_ <= 3) {
        invert_small();
    } else {
        invert_general();
    }
}

void SpectralRow::invert_small() {
    const int d = planes_;
    const auto entry = [&](int i, int j) {
        return Factor{lambda_.real(i * d + j), lambda_.imaginary(i * d + j)};
    };
    // Adjugate first.
    if (d == 1) {
        std::fill_n(inverse_.real(0), columns_, 1.0);
        std::fill_n(inverse_.imaginary(0), columns_, 0.0);
    } else if (d == 2) {
        const auto copy = [&](int from, int to, double sign) {
            for (int n = 0; n < columns_; ++n) {
                inverse_.real(to)[n] = sign * lambda_.real(from)[n];
                inverse_.imaginary(to)[n] = sign * lambda_.imaginary(from)[n];
            }
        };
        copy(3, 0, 1.0);
        copy(1, 1, -1.0);
        copy(2, 2, -1.0);
        copy(0, 3, 1.0);
    } else {
        for (int i = 0; i < 3; ++i) {
            for (int j = 0; j < 3; ++j) {
                const int i1 = (i + 1) % 3, i2 = (i + 2) % 3, j1 = (j + 1) % 3, j2 = (j + 2) % 3;
                subtract_products(entry(i1, j1), entry(i2, j2), entry(i1, j2), entry(i2, j1),
                                  inverse_.real(j * 3 + i), inverse_.imaginary(j * 3 + i), columns_);
            }
        }
    }
    double* det_real = determinant_.real(0);
    double* det_imaginary = determinant_.imaginary(0);
    std::fill_n(det_real, columns_, 0.0);
    std::fill_n(det_imaginary, columns_, 0.0);
    for (int j = 0; j < d; ++j) {
        const Factor a = entry(0, j);
        const double* b_real = inverse_.real(j * d);
        const double* b_imaginary = inverse_.imaginary(j * d);
        for (int n = 0; n < columns_; ++n) {
            det_real[n] += a.real[n] * b_real[n] - a.imaginary[n] * b_imaginary[n];
            det_imaginary[n] += a.real[n] * b_imaginary[n] + a.imaginary[n] * b_real[n];
        }
    }
    for (int e = 0; e < d * d; ++e) {
        double* real = inverse_.real(e);
        double* imaginary = inverse_.imaginary(e);
        for (int n = 0; n < columns_; ++n) {
            const double scale = 1.0 / (det_real[n] * det_real[n] + det_imaginary[n] * det_imaginary[n]);
            const double re = real[n], im = imaginary[n];
            real[n] = (re * det_real[n] + im * det_imaginary[n]) * scale;
            imaginary[n] = (im * det_real[n] - re * det_imaginary[n]) * scale;
        }
    }
}

void SpectralRow::invert_general() {
    const int d = planes_;
    Eigen::MatrixXcd matrix(d, d);
    for (int n = 0; n < columns_; ++n) {
        for (int e = 0; e < d * d; ++e) matrix(e / d, e % d) = {lambda_.real(e)[n], lambda_.imaginary(e)[n]};
        const Eigen::PartialPivLU<Eigen::MatrixXcd> lu(matrix);
        const Complex det = lu.determinant();
        determinant_.real(0)[n] = det.real();
        determinant_.imaginary(0)[n] = det.imag();
        matrix = lu.inverse();
        for (int e = 0; e < d * d; ++e) {
            inverse_.real(e)[n] = matrix(e / d, e % d).real();
            inverse_.imaginary(e)[n] = matrix(e / d, e % d).imag();
        }
    }
}

namespace {

/// out = a M, M real, lanes along n. Lanes is SpectralRow's.
template <class Lanes>
void times_real(const Lanes& a, const Eigen::MatrixXd& m, Lanes& out, int columns) {
    const auto d = static_cast<int>(m.rows());
    for (int i = 0; i < d; ++i) {
        for (int k = 0; k < d; ++k) {
            double* real = out.real(i * d + k);
            double* imaginary = out.imaginary(i * d + k);
            std::fill_n(real, columns, 0.0);
            std::fill_n(imaginary, columns, 0.0);
            for (int j = 0; j < d; ++j) {
                const double factor = m(j, k);
                if (factor == 0.0) continue;
                const double* x = a.real(i * d + j);
                const double* y = a.imaginary(i * d + j);
                for (int n = 0; n < columns; ++n) {
                    real[n] += factor * x[n];
                    imaginary[n] += factor * y[n];
                }
            }
        }
    }
}

/// out_ij += a_ik conj(b_jk) (b conjugated and transposed) or a_ik b_kj, along n.
struct Product {
    const double *ar, *ai, *br, *bi;
    void add(double* real, double* imaginary, int columns, bool conjugate) const {
        const double sign = conjugate ? -1.0 : 1.0;
        for (int n = 0; n < columns; ++n) {
            real[n] += ar[n] * br[n] - sign * ai[n] * bi[n];
            imaginary[n] += ai[n] * br[n] + sign * ar[n] * bi[n];
        }
    }
};

}  // namespace

void SpectralRow::square_coloured() {
    const int d = planes_;
    for (int i = 0; i < d; ++i) {
        for (int j = i; j < d; ++j) {
            double* real = density_.real(i * d + j);
            double* imaginary = density_.imaginary(i * d + j);
            std::fill_n(real, columns_, 0.0);
            std::fill_n(imaginary, columns_, 0.0);
            for (int k = 0; k < d; ++k) {
                const Product product{coloured_.real(i * d + k), coloured_.imaginary(i * d + k),
                                      coloured_.real(j * d + k), coloured_.imaginary(j * d + k)};
                product.add(real, imaginary, columns_, true);
            }
        }
    }
}

void SpectralRow::evaluate_density() {
    const int d = planes_;
    if (density_.real(0) == nullptr) {
        coloured_ = Lanes(d * d, columns_);
        density_ = Lanes(d * d, columns_);
        if (kind_ == SpectralForm::Kind::pmrf) second_ = Lanes(d * d, columns_);
    }
    switch (kind_) {
        case SpectralForm::Kind::autoregressive:
            times_real(inverse_, noise_, coloured_, columns_);
            square_coloured();
            break;
        case SpectralForm::Kind::moving_average:
            times_real(lambda_, noise_, coloured_, columns_);
            square_coloured();
            break;
        case SpectralForm::Kind::mmrf:
            times_real(inverse_, noise_, density_, columns_);
            break;
        case SpectralForm::Kind::pmrf: {
            // (Λ⁻¹ left) Λ, then times right, then times Λ⁻ᴴ.
            times_real(inverse_, left_, coloured_, columns_);
            for (int i = 0; i < d; ++i) {
                for (int j = 0; j < d; ++j) {
                    double* real = second_.real(i * d + j);
                    double* imaginary = second_.imaginary(i * d + j);
                    std::fill_n(real, columns_, 0.0);
                    std::fill_n(imaginary, columns_, 0.0);
                    for (int k = 0; k < d; ++k) {
                        Product{coloured_.real(i * d + k), coloured_.imaginary(i * d + k),
                                lambda_.real(k * d + j), lambda_.imaginary(k * d + j)}
                            .add(real, imaginary, columns_, false);
                    }
                }
            }
            times_real(second_, right_, coloured_, columns_);
            for (int i = 0; i < d; ++i) {
                for (int j = i; j < d; ++j) {
                    double* real = density_.real(i * d + j);
                    double* imaginary = density_.imaginary(i * d + j);
                    std::fill_n(real, columns_, 0.0);
                    std::fill_n(imaginary, columns_, 0.0);
                    for (int k = 0; k < d; ++k) {
                        Product{coloured_.real(i * d + k), coloured_.imaginary(i * d + k),
                                inverse_.real(j * d + k), inverse_.imaginary(j * d + k)}
                            .add(real, imaginary, columns_, true);
                    }
                }
            }
            break;
        }
    }
}

std::complex<double> SpectralRow::determinant(int n) const {
    return {determinant_.real(0)[n], determinant_.imaginary(0)[n]};
}

double SpectralRow::log_determinant(int n) const {
    return std::log(std::abs(determinant(n)));
}

double SpectralRow::inverse_norm(int n) const {
    double sum = 0.0;
    for (int e = 0; e < planes_ * planes_; ++e) {
        const double re = inverse_.real(e)[n], im = inverse_.imaginary(e)[n];
        sum += re * re + im * im;
    }
    return std::sqrt(sum);
}

SpectralMeans spectral_means(const SpectralForm& form, Size grid,
                             const std::function<void(int m, const SpectralRow& row)>& visit) {
    const int d = form.planes();
    const RowBlocks blocks(grid.height);
    std::vector<SpectralMeans> partial(static_cast<size_t>(blocks.count));
    for_each_block(blocks.count, [&](int block) {
        SpectralRow row(form, grid.width);
        SpectralMeans& sums = partial[static_cast<size_t>(block)];
        sums.covariance.setZero(d, d);
        for (int m = blocks.first(block); m < blocks.last(block); ++m) {
            row.evaluate(2.0 * std::numbers::pi * m / grid.height);
            row.evaluate_density();
            if (visit) visit(m, row);
            const double weight = row_weight(m, grid.height);
            double log_determinant = 0.0;
            for (int n = 0; n < grid.width; ++n) log_determinant += row.log_determinant(n);
            sums.log_determinant += weight * log_determinant;
            for (int i = 0; i < d; ++i) {
                for (int j = i; j < d; ++j) {
                    const double* density = row.density(i, j);
                    double sum = 0.0;
                    for (int n = 0; n < grid.width; ++n) sum += density[n];
                    sums.covariance(i, j) += weight * sum;
                }
            }
        }
    });
    SpectralMeans means;
    means.covariance.setZero(d, d);
    for (const SpectralMeans& sums : partial) {
        means.covariance += sums.covariance;
        means.log_determinant += sums.log_determinant;
    }
    const double count = static_cast<double>(area(grid));
    means.covariance = Eigen::MatrixXd(means.covariance.selfadjointView<Eigen::Upper>()) / count;
    means.log_determinant /= count;
    return means;
}

namespace {

/// Column c is cos(2π c n / N), column c + B + 1 the sine, c = 0 … B.
RowMajor waves(int columns, int largest_lag) {
    RowMajor table(columns, 2 * (largest_lag + 1));
    for (int n = 0; n < columns; ++n) {
        for (int c = 0; c <= largest_lag; ++c) {
            const Complex turn = root_of_unity(static_cast<long long>(c) * n, columns);
            table(n, c) = turn.real();
            table(n, c + largest_lag + 1) = turn.imag();
        }
    }
    return table;
}

}  // namespace

LagCovariance model_covariance(const SpectralForm& form, Size torus, Offset box) {
    if (torus.height < 1 || torus.width < 1) {
        throw InputError("covariances of a model on a torus",
                         std::to_string(torus.height) + " x " + std::to_string(torus.width) + " has no pixel",
                         "use positive sides");
    }
    const int d = form.planes();
    LagCovariance result(d, torus, box);
    const RowMajor table = waves(torus.width, box.column);
    const RowBlocks blocks(torus.height);
    const Eigen::Index lag_rows = 2 * box.row + 1, lag_columns = 2 * box.column + 1, pairs = d * (d + 1) / 2;
    // Two small transforms in a row, as matrix products: along the columns of the grid, then along its rows.
    std::vector<RowMajor> partial(static_cast<size_t>(blocks.count));
    for_each_block(blocks.count, [&](int block) {
        SpectralRow row(form, torus.width);
        const int first = blocks.first(block);
        const Eigen::Index rows = std::max(0, blocks.last(block) - first);
        RowMajor along(2 * rows, pairs * lag_columns);  // real and imaginary parts of Σ_n conj(S) e^{iω2 s2}
        RowMajor turns(lag_rows, 2 * rows);  // those of e^{iω1 s1}, such that the product is the real part
        RowMajor t;
        for (Eigen::Index k = 0; k < rows; ++k) {
            const int m = first + static_cast<int>(k);
            row.evaluate(2.0 * std::numbers::pi * m / torus.height);
            row.evaluate_density();
            t.noalias() = row.densities() * table;
            Eigen::Index place = 0;
            for (int i = 0; i < d; ++i) {
                for (int j = i; j < d; ++j) {
                    const Eigen::Index entry = Eigen::Index{2} * (i * d + j);
                    const auto real = t.row(entry), imaginary = t.row(entry + 1);
                    for (int s2 = -box.column; s2 <= box.column; ++s2, ++place) {
                        const int cosine = s2 < 0 ? -s2 : s2, sine = cosine + box.column + 1;
                        const double sign = s2 < 0 ? -1.0 : 1.0;
                        along(2 * k, place) = real[cosine] + sign * imaginary[sine];
                        along(2 * k + 1, place) = sign * real[sine] - imaginary[cosine];
                    }
                }
            }
            const double weight = row_weight(m, torus.height);
            for (int s1 = -box.row; s1 <= box.row; ++s1) {
                const Complex turn = root_of_unity(static_cast<long long>(m) * s1, torus.height);
                turns(s1 + box.row, 2 * k) = weight * turn.real();
                turns(s1 + box.row, 2 * k + 1) = -weight * turn.imag();
            }
        }
        partial[static_cast<size_t>(block)].noalias() = turns * along;
    });
    RowMajor total = RowMajor::Zero(lag_rows, pairs * lag_columns);
    for (const RowMajor& sums : partial) total += sums;
    total /= static_cast<double>(area(torus));
    Eigen::Index place = 0;
    for (int i = 0; i < d; ++i) {
        for (int j = i; j < d; ++j, place += lag_columns) {
            for (int s1 = -box.row; s1 <= box.row; ++s1) {
                for (int s2 = -box.column; s2 <= box.column; ++s2) {
                    result.set(i, j, {s1, s2}, total(s1 + box.row, place + s2 + box.column));
                }
            }
        }
    }
    return result;
}

LagCovariance level_covariance(const LevelModel& level, Size torus, Offset box) {
    if (level.models.size() == 1) return model_covariance(level.models.front(), torus, box);
    LagCovariance result(static_cast<int>(level.models.size()), torus, box);
    for (int p = 0; p < result.planes(); ++p) {
        const LagCovariance own = model_covariance(level.models[static_cast<size_t>(p)], torus, box);
        for (int row = -box.row; row <= box.row; ++row) {
            for (int column = -box.column; column <= box.column; ++column)
                result.set(p, p, {row, column}, own(0, 0, {row, column}));
        }
    }
    return result;
}

}  // namespace btfield

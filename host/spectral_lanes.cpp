#include "host/spectral_lanes.hpp"

#include <algorithm>
#include <cmath>

namespace btfield {
namespace {

using Complex = std::complex<double>;
using Eigen::Index;
using std::size_t;

/// (re, im) −= a conj(b)
void subtract_conjugate_product(const double* ar, const double* ai, const double* br, const double* bi,
                                double* re, double* im, size_t count) {
    for (size_t n = 0; n < count; ++n) {
        re[n] -= ar[n] * br[n] + ai[n] * bi[n];
        im[n] -= ai[n] * br[n] - ar[n] * bi[n];
    }
}

}  // namespace

void LaneMatrix::complete_hermitian() {
    for (int i = 0; i < planes(); ++i) {
        for (int j = i + 1; j < planes(); ++j) {
            std::copy_n(real(j, i), lanes_, real(i, j));
            std::transform(imaginary(j, i), imaginary(j, i) + lanes_, imaginary(i, j),
                           [](double v) { return -v; });
        }
    }
}

LaneMatrix product(const LaneMatrix& a, const LaneMatrix& b) {
    const int d = a.planes();
    LaneMatrix c(d, a.lanes());
    for (int i = 0; i < d; ++i) {
        for (int j = 0; j < d; ++j) {
            double* re = c.real(i, j);
            double* im = c.imaginary(i, j);
            for (int k = 0; k < d; ++k) {
                const double* ar = a.real(i, k);
                const double* ai = a.imaginary(i, k);
                const double* br = b.real(k, j);
                const double* bi = b.imaginary(k, j);
                for (size_t n = 0; n < a.lanes(); ++n) {
                    re[n] += ar[n] * br[n] - ai[n] * bi[n];
                    im[n] += ar[n] * bi[n] + ai[n] * br[n];
                }
            }
        }
    }
    return c;
}

LaneMatrix adjoint(const LaneMatrix& a) {
    LaneMatrix result(a.planes(), a.lanes());
    for (int i = 0; i < a.planes(); ++i) {
        for (int j = 0; j < a.planes(); ++j) {
            std::copy_n(a.real(j, i), a.lanes(), result.real(i, j));
            std::transform(a.imaginary(j, i), a.imaginary(j, i) + a.lanes(), result.imaginary(i, j),
                           [](double v) { return -v; });
        }
    }
    return result;
}

Waves::Waves(const std::vector<double>& frequencies, int largest) : lanes_(frequencies.size()) {
    for (int c = 0; c <= largest; ++c) {
        for (const double w : frequencies) values_.push_back(std::cos(c * w));
        for (const double w : frequencies) values_.push_back(std::sin(c * w));
    }
}

void evaluate(const HermitianPolynomial& polynomial, double row_frequency, const Waves& waves,
              LaneMatrix& result) {
    const int d = polynomial.planes();
    int reach = 0;
    for (const Offset s : polynomial.offsets) reach = std::max(reach, std::abs(s.column));
    const size_t lanes = result.lanes();
    // Coefficient of e^{i c ω2}, c = −reach … reach.
    std::vector<Complex> sums(static_cast<size_t>(2 * reach + 1));
    for (int i = 0; i < d; ++i) {
        for (int j = 0; j <= i; ++j) {
            std::fill(sums.begin(), sums.end(), Complex{});
            for (size_t s = 0; s < polynomial.offsets.size(); ++s) {
                const Offset offset = polynomial.offsets[s];
                const Complex turn = std::polar(1.0, row_frequency * offset.row);
                const int right = reach + offset.column, left = reach - offset.column;
                sums[static_cast<size_t>(right)] -= turn * polynomial.terms[s](i, j);
                sums[static_cast<size_t>(left)] -= std::conj(turn) * polynomial.terms[s](j, i);
            }
            const Complex constant = polynomial.centre(i, j) + sums[static_cast<size_t>(reach)];
            double* real = result.real(i, j);
            double* imaginary = result.imaginary(i, j);
            std::fill_n(real, lanes, constant.real());
            std::fill_n(imaginary, lanes, i == j ? 0.0 : constant.imag());
            for (int c = 1; c <= reach; ++c) {
                const int right = reach + c, left = reach - c;
                const Complex plus = sums[static_cast<size_t>(right)],
                              minus = sums[static_cast<size_t>(left)];
                const Complex even = plus + minus, odd = Complex{0.0, 1.0} * (plus - minus);
                const double er = even.real(), ei = even.imag(), pr = odd.real(), pi = odd.imag();
                const double* cosine = waves.cosine(c);
                const double* sine = waves.sine(c);
                for (size_t n = 0; n < lanes; ++n) real[n] += er * cosine[n] + pr * sine[n];
                if (i == j) continue;
                for (size_t n = 0; n < lanes; ++n) imaginary[n] += ei * cosine[n] + pi * sine[n];
            }
        }
    }
}

bool factorise_positive(LaneMatrix& matrix, double* log_determinant) {
    const int d = matrix.planes();
    const size_t lanes = matrix.lanes();
    // L of L Lᴴ in the lower triangle; the diagonal holds 1 / L_jj.
    for (int j = 0; j < d; ++j) {
        double* pivot = matrix.real(j, j);
        for (int k = 0; k < j; ++k) {
            const double* re = matrix.real(j, k);
            const double* im = matrix.imaginary(j, k);
            for (size_t n = 0; n < lanes; ++n) pivot[n] -= re[n] * re[n] + im[n] * im[n];
        }
        double lowest = 1.0;
        for (size_t n = 0; n < lanes; ++n) lowest = pivot[n] > 0.0 ? std::min(lowest, pivot[n]) : -1.0;
        if (!(lowest > 0.0)) return false;
        for (size_t n = 0; n < lanes; ++n) log_determinant[n] += std::log(pivot[n]);
        for (size_t n = 0; n < lanes; ++n) pivot[n] = 1.0 / std::sqrt(pivot[n]);
        for (int i = j + 1; i < d; ++i) {
            double* re = matrix.real(i, j);
            double* im = matrix.imaginary(i, j);
            for (int k = 0; k < j; ++k) {
                subtract_conjugate_product(matrix.real(i, k), matrix.imaginary(i, k), matrix.real(j, k),
                                           matrix.imaginary(j, k), re, im, lanes);
            }
            for (size_t n = 0; n < lanes; ++n) {
                re[n] *= pivot[n];
                im[n] *= pivot[n];
            }
        }
    }
    return true;
}

bool invert_positive(LaneMatrix& matrix, double* log_determinant) {
    if (!factorise_positive(matrix, log_determinant)) return false;
    const int d = matrix.planes();
    const size_t lanes = matrix.lanes();
    // L⁻¹ in place: column j below the diagonal, from the top; X_ij = −(Σ_{j<=k<i} L_ik X_kj) / L_ii. Column
    // j of L is needed no more once its own column of X is being written from the bottom of what it reads, so
    // go by columns from the last one, which are the only ones that read L_ik with k > j.
    std::vector<double> re_column(lanes * static_cast<size_t>(d)), im_column(lanes * static_cast<size_t>(d));
    for (int j = 0; j < d; ++j) {
        // X_ij for i > j uses L_ij (its own place, read first) and L_ik, k > j, which are still L.
        for (int i = j + 1; i < d; ++i) {
            double* re = matrix.real(i, j);
            double* im = matrix.imaginary(i, j);
            const double* own = matrix.real(j, j);
            for (size_t n = 0; n < lanes; ++n) {
                re[n] *= own[n];
                im[n] *= own[n];
            }
            for (int k = j + 1; k < i; ++k) {
                const double* ar = matrix.real(i, k);
                const double* ai = matrix.imaginary(i, k);
                const double* br = matrix.real(k, j);
                const double* bi = matrix.imaginary(k, j);
                for (size_t n = 0; n < lanes; ++n) {
                    re[n] += ar[n] * br[n] - ai[n] * bi[n];
                    im[n] += ar[n] * bi[n] + ai[n] * br[n];
                }
            }
            const double* scale = matrix.real(i, i);
            for (size_t n = 0; n < lanes; ++n) {
                re[n] *= -scale[n];
                im[n] *= -scale[n];
            }
        }
    }
    // S = L⁻ᴴ L⁻¹: S_ij = Σ_{k >= i} conj(X_ki) X_kj, i >= j. Rows of S from the top read only rows k >= i of
    // X, and S_ij replaces X_ij, which later entries of the same row do not read when j runs downwards from
    // i.
    for (int i = 0; i < d; ++i) {
        for (int j = 0; j <= i; ++j) {
            double* re = re_column.data() + static_cast<size_t>(j) * lanes;
            double* im = im_column.data() + static_cast<size_t>(j) * lanes;
            std::fill_n(re, lanes, 0.0);
            std::fill_n(im, lanes, 0.0);
            for (int k = i; k < d; ++k) {
                const double* ar = matrix.real(k, i);
                const double* br = matrix.real(k, j);
                const double* ai = matrix.imaginary(k, i);
                const double* bi = matrix.imaginary(k, j);
                for (size_t n = 0; n < lanes; ++n) {
                    re[n] += ar[n] * br[n] + ai[n] * bi[n];
                    im[n] += ar[n] * bi[n] - ai[n] * br[n];
                }
            }
        }
        for (int j = 0; j <= i; ++j) {
            std::copy_n(re_column.data() + static_cast<size_t>(j) * lanes, lanes, matrix.real(i, j));
            std::copy_n(im_column.data() + static_cast<size_t>(j) * lanes, lanes, matrix.imaginary(i, j));
        }
    }
    matrix.complete_hermitian();
    return true;
}

LagTransform::LagTransform(const FrequencyGrid& grid, Offset box)
    : box_(box), grid_(&grid), table_(static_cast<Index>(grid.column.size()), Index{2} * (box.column + 1)) {
    for (size_t n = 0; n < grid.column.size(); ++n) {
        for (int c = 0; c <= box.column; ++c) {
            const auto row = static_cast<Index>(n);
            table_(row, c) = grid.column_weight[n] * std::cos(c * grid.column[n]);
            table_(row, c + box.column + 1) = grid.column_weight[n] * std::sin(c * grid.column[n]);
        }
    }
}

void LagTransform::add(size_t m, const Eigen::Ref<const RowMajor>& values, RowMajor& sums) const {
    const RowMajor along = values * table_;
    const Index functions = values.rows() / 2, width = columns();
    Eigen::RowVectorXd real(functions * width), imaginary(functions * width);
    for (Index e = 0; e < functions; ++e) {
        for (int c = -box_.column; c <= box_.column; ++c) {
            const Index cosine = c < 0 ? -c : c, sine = cosine + box_.column + 1;
            const double sign = c < 0 ? -1.0 : 1.0;
            const Index place = e * width + c + box_.column;
            real[place] = along(2 * e, cosine) - sign * along(2 * e + 1, sine);
            imaginary[place] = along(2 * e + 1, cosine) + sign * along(2 * e, sine);
        }
    }
    for (int r = -box_.row; r <= box_.row; ++r) {
        const Complex turn = grid_->row_weight[m] * std::polar(1.0, grid_->row[m] * r);
        sums.row(r + box_.row) += turn.real() * real - turn.imag() * imaginary;
    }
}

}  // namespace btfield

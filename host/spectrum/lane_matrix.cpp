#include "host/spectrum/lane_matrix.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "host/base/lane_inverse.hpp"

namespace btfield::detail {
namespace {

using Complex = std::complex<double>;
using std::size_t;

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
            for (int k = 0; k < d; ++k) add_lane_product(a.real(i, k), b.real(k, j), c.real(i, j), a.lanes());
        }
    }
    return c;
}

LaneMatrix product(const Eigen::MatrixXd& a, const LaneMatrix& b) {
    const int d = b.planes();
    LaneMatrix c(d, b.lanes());
    for (int i = 0; i < d; ++i) {
        for (int k = 0; k < d; ++k) {
            if (a(i, k) == 0.0) continue;
            for (int j = 0; j < d; ++j) add_scaled(a(i, k), b.real(k, j), c.real(i, j), 2 * b.lanes());
        }
    }
    return c;
}

void add(LaneMatrix& a, const LaneMatrix& b, double scale) {
    const auto d = static_cast<size_t>(a.planes());
    add_scaled(scale, b.real(0, 0), a.real(0, 0), 2 * d * d * a.lanes());
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
    std::vector<Complex> sums(static_cast<size_t>(2 * reach + 1)), turns;
    for (const Offset s : polynomial.offsets) turns.push_back(std::polar(1.0, row_frequency * s.row));
    for (int i = 0; i < d; ++i) {
        for (int j = 0; j <= i; ++j) {
            std::fill(sums.begin(), sums.end(), Complex{});
            for (size_t s = 0; s < polynomial.offsets.size(); ++s) {
                const Offset offset = polynomial.offsets[s];
                const Complex turn = turns[s];
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
                add_scaled(er, cosine, real, lanes);
                add_scaled(pr, sine, real, lanes);
                if (i == j) continue;
                add_scaled(ei, cosine, imaginary, lanes);
                add_scaled(pi, sine, imaginary, lanes);
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
            double* const entry = matrix.real(i, j);
            for (int k = 0; k < j; ++k)
                add_lane_conjugate_product(matrix.real(i, k), matrix.real(j, k), entry, lanes, -1.0);
            scale_lanes(pivot, entry, lanes);
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
    std::vector<double> row(2 * lanes * static_cast<size_t>(d));
    for (int j = 0; j < d; ++j) {
        // X_ij for i > j uses L_ij (its own place, read first) and L_ik, k > j, which are still L.
        for (int i = j + 1; i < d; ++i) {
            double* const entry = matrix.real(i, j);
            scale_lanes(matrix.real(j, j), entry, lanes);
            for (int k = j + 1; k < i; ++k)
                add_lane_product(matrix.real(i, k), matrix.real(k, j), entry, lanes);
            scale_lanes(matrix.real(i, i), entry, lanes);
            for (size_t n = 0; n < 2 * lanes; ++n) entry[n] = -entry[n];
        }
    }
    // S = L⁻ᴴ L⁻¹: S_ij = Σ_{k >= i} conj(X_ki) X_kj, i >= j. Rows of S from the top read only rows k >= i of
    // X, and S_ij replaces X_ij, which later entries of the same row do not read when j runs downwards from
    // i.
    for (int i = 0; i < d; ++i) {
        for (int j = 0; j <= i; ++j) {
            double* const entry = row.data() + 2 * static_cast<size_t>(j) * lanes;
            std::fill_n(entry, 2 * lanes, 0.0);
            for (int k = i; k < d; ++k)
                add_lane_conjugate_product(matrix.real(k, j), matrix.real(k, i), entry, lanes);
        }
        for (int j = 0; j <= i; ++j)
            std::copy_n(row.data() + 2 * static_cast<size_t>(j) * lanes, 2 * lanes, matrix.real(i, j));
    }
    matrix.complete_hermitian();
    return true;
}

double mean_trace(const LaneMatrix& a, const LaneMatrix& b, const std::vector<double>& weights) {
    std::vector<double> traces(2 * a.lanes());
    for (int i = 0; i < a.planes(); ++i) {
        for (int j = 0; j < a.planes(); ++j)
            add_lane_product(a.real(i, j), b.real(j, i), traces.data(), a.lanes());
    }
    return std::inner_product(weights.begin(), weights.end(), traces.begin(), 0.0);
}

}  // namespace btfield::detail

#include "host/spectrum/positive_everywhere.hpp"

#include <algorithm>
#include <cmath>
#include <complex>
#include <limits>
#include <numbers>
#include <utility>

#include "host/base/decompositions.hpp"
#include "host/base/parallel.hpp"

namespace btfield::detail {
namespace {

using Complex = std::complex<double>;
using Eigen::MatrixXcd;
using std::size_t;
using std::numbers::pi;
constexpr int base_side = 32;
// Half-widths down to π/32/2^40, 1e-13: beyond that Λ is singular in float64.
constexpr int finest_square_division = 40;
constexpr size_t most_squares = 200000;

struct Square {
    double row, column;
};

struct Verdict {
    bool positive = false, excluded = false;
    double lowest = 0.0;
};

Verdict judge(const HermitianPolynomial& polynomial, double curvature, Square at, double half) {
    MatrixXcd value = polynomial.centre.cast<Complex>();
    MatrixXcd by_row = MatrixXcd::Zero(value.rows(), value.cols()), by_column = by_row;
    for (size_t s = 0; s < polynomial.offsets.size(); ++s) {
        const Offset o = polynomial.offsets[s];
        const Complex turn = std::polar(1.0, at.row * o.row + at.column * o.column);
        const MatrixXcd forward = turn * polynomial.terms[s];
        const MatrixXcd slope = Complex{0.0, 1.0} * forward;
        value -= forward + forward.adjoint();
        by_row -= o.row * (slope + slope.adjoint());
        by_column -= o.column * (slope + slope.adjoint());
    }
    Verdict verdict;
    const auto [lowest, root] = hermitian_root(value);
    verdict.lowest = lowest;
    verdict.positive = lowest > 0.0;
    if (!verdict.positive) return verdict;
    // The Frobenius norm bounds the spectral one.
    const double slope = (root * by_row * root).norm() + (root * by_column * root).norm();
    verdict.excluded = half * slope + 0.5 * half * half * curvature / verdict.lowest < 1.0;
    return verdict;
}

}  // namespace

PositiveDefiniteness positive_everywhere(const HermitianPolynomial& polynomial) {
    double curvature = 0.0;
    for (size_t s = 0; s < polynomial.offsets.size(); ++s) {
        const Offset o = polynomial.offsets[s];
        const double reach = std::abs(o.row) + std::abs(o.column);
        curvature += 2.0 * polynomial.terms[s].norm() * reach * reach;
    }
    PositiveDefiniteness result;
    result.min_eigenvalue = std::numeric_limits<double>::infinity();
    double half = pi / base_side;
    std::vector<Square> squares;
    for (int m = 0; m <= base_side / 2; ++m) {
        for (int n = 0; n < base_side; ++n) squares.push_back({2.0 * half * m, 2.0 * half * n});
    }
    size_t visited = 0;
    for (int division = 0; !squares.empty(); ++division, half *= 0.5) {
        visited += squares.size();
        if (division > finest_square_division || visited > most_squares) return result;
        std::vector<Verdict> verdicts(squares.size());
        constexpr size_t chunk = 32;
        for_each_block(static_cast<int>((squares.size() + chunk - 1) / chunk), [&](int block) {
            const size_t first = static_cast<size_t>(block) * chunk;
            for (size_t k = first; k < std::min(first + chunk, squares.size()); ++k)
                verdicts[k] = judge(polynomial, curvature, squares[k], half);
        });
        std::vector<Square> open;
        for (size_t k = 0; k < squares.size(); ++k) {
            result.min_eigenvalue = std::min(result.min_eigenvalue, verdicts[k].lowest);
            if (!verdicts[k].positive) return result;
            if (verdicts[k].excluded) continue;
            for (const double down : {-0.5, 0.5}) {
                for (const double right : {-0.5, 0.5})
                    open.push_back({squares[k].row + down * half, squares[k].column + right * half});
            }
        }
        squares = std::move(open);
    }
    result.proven = true;
    return result;
}

}  // namespace btfield::detail

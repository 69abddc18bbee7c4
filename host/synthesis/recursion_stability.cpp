#include "host/synthesis/recursion_stability.hpp"

#include <algorithm>
#include <cmath>
#include <complex>
#include <cstdio>
#include <limits>
#include <numbers>
#include <vector>

#include "btfield/error.hpp"
#include "host/base/decompositions.hpp"
#include "host/base/parallel.hpp"
#include "host/base/text.hpp"
#include "host/synthesis/independent_planes.hpp"

namespace btfield::detail {
namespace {

using Complex = std::complex<double>;
using Eigen::Index;
using Eigen::MatrixXcd;
using Eigen::MatrixXd;
using std::size_t;

Eigen::Map<const RowMajorMatrix> block(const LinearField& field, size_t s) {
    const Index d = field.planes;
    return {field.coefficients.data() + static_cast<std::ptrdiff_t>(s) * d * d, d, d};
}

void require_causal(const LinearField& field) {
    for (const Offset s : field.offsets) {
        if (!(s < Offset{}))
            throw InputError("raster recursion",
                             "the offset " + text_of(s) + " does not precede the centre in raster order",
                             "use a causal or unilateral neighbourhood, or the torus method");
    }
}

/// Largest |eigenvalue| of x(n) = Σ_m C_m x(n − m), C_1 first.
double growth(const std::vector<MatrixXcd>& c) {
    if (c.empty()) return 0.0;
    const Index d = c.front().rows(), terms = static_cast<Index>(c.size());
    MatrixXcd companion = MatrixXcd::Zero(d * terms, d * terms);
    for (Index m = 0; m < terms; ++m) companion.block(0, m * d, d, d) = c[static_cast<size_t>(m)];
    for (Index m = 1; m < terms; ++m) companion.block(m * d, (m - 1) * d, d, d).setIdentity();
    return spectral_radius(companion);
}

double growth_along_rows(const LinearField& field) {
    int longest = 0;
    for (const Offset s : field.offsets)
        if (s.row == 0) longest = std::max(longest, -s.column);
    std::vector<MatrixXcd> c(static_cast<size_t>(longest), MatrixXcd::Zero(field.planes, field.planes));
    for (size_t s = 0; s < field.offsets.size(); ++s) {
        if (field.offsets[s].row == 0)
            c[static_cast<size_t>(-field.offsets[s].column - 1)] += block(field, s).cast<Complex>();
    }
    return growth(c);
}

double growth_down_rows(const LinearField& field, double column_frequency) {
    int highest = 0;
    for (const Offset s : field.offsets) highest = std::max(highest, -s.row);
    const Index d = field.planes;
    MatrixXcd here = MatrixXcd::Identity(d, d);
    std::vector<MatrixXcd> above(static_cast<size_t>(highest), MatrixXcd::Zero(d, d));
    for (size_t s = 0; s < field.offsets.size(); ++s) {
        const Offset at = field.offsets[s];
        const MatrixXcd term =
            std::polar(1.0, column_frequency * at.column) * block(field, s).cast<Complex>();
        if (at.row == 0)
            here -= term;
        else
            above[static_cast<size_t>(-at.row - 1)] += term;
    }
    const Eigen::PartialPivLU<MatrixXcd> factor(here);
    for (MatrixXcd& p : above) p = factor.solve(p).eval();
    return growth(above);
}

/// The maximum near a grid point, by golden section between its neighbours.
double refined(const LinearField& field, double low, double high, double& best) {
    constexpr double golden = 0.6180339887498949;
    double a = high - golden * (high - low), b = low + golden * (high - low);
    double at_a = growth_down_rows(field, a), at_b = growth_down_rows(field, b);
    for (int round = 0; round < 24; ++round) {
        if (at_a > at_b) {
            high = b;
            b = a;
            at_b = at_a;
            a = high - golden * (high - low);
            at_a = growth_down_rows(field, a);
        } else {
            low = a;
            a = b;
            at_a = at_b;
            b = low + golden * (high - low);
            at_b = growth_down_rows(field, b);
        }
    }
    best = at_a > at_b ? a : b;
    return std::max(at_a, at_b);
}

std::string number(double value) {
    char text[32];
    static_cast<void>(std::snprintf(text, sizeof(text), "%.4g", value));
    return text;
}

/// Σ_ij h_ij(row, column)² of the responses to L e, rows 0 … n − 1, columns −n … n.
std::vector<double> response_energy(const LinearField& field, const MatrixXd& root, int n) {
    const int d = field.planes, width = 2 * n + 1;
    const auto cells = static_cast<size_t>(n) * static_cast<size_t>(width);
    std::vector<std::vector<double>> parts(static_cast<size_t>(d));
    for_each_block(d, [&](int impulse) {
        std::vector<double> h(cells * static_cast<size_t>(d), 0.0);
        std::vector<double>& energy = parts[static_cast<size_t>(impulse)];
        energy.assign(cells, 0.0);
        for (int r = 0; r < n; ++r) {
            for (int c = 0; c < width; ++c) {
                const auto cell =
                    static_cast<size_t>(r) * static_cast<size_t>(width) + static_cast<size_t>(c);
                double* y = h.data() + cell * static_cast<size_t>(d);
                if (r == 0 && c == n)
                    for (int i = 0; i < d; ++i) y[i] = root(i, impulse);
                for (size_t s = 0; s < field.offsets.size(); ++s) {
                    const int row = r + field.offsets[s].row, column = c + field.offsets[s].column;
                    if (row < 0 || column < 0 || column >= width) continue;
                    const double* x = h.data() + (static_cast<size_t>(row) * static_cast<size_t>(width) +
                                                  static_cast<size_t>(column)) *
                                                     static_cast<size_t>(d);
                    const double* a = field.coefficients.data() + s * static_cast<size_t>(d * d);
                    for (int i = 0; i < d; ++i)
                        for (int j = 0; j < d; ++j) y[i] += a[i * d + j] * x[j];
                }
                for (int i = 0; i < d; ++i) energy[cell] += y[i] * y[i];
            }
        }
    });
    for (int p = 1; p < d; ++p)
        for (size_t k = 0; k < cells; ++k) parts[0][k] += parts[static_cast<size_t>(p)][k];
    return std::move(parts.front());
}

/// Smallest m such that what lies at distance m and beyond is at most the allowed energy.
int tail(const std::vector<double>& by_distance, double allowed) {
    double sum = 0.0;
    auto m = static_cast<int>(by_distance.size());
    while (m > 0 && sum + by_distance[static_cast<size_t>(m - 1)] <= allowed)
        sum += by_distance[static_cast<size_t>(--m)];
    return m;
}

}  // namespace

RecursionStability recursion_stability(const LinearField& field) {
    require_causal(field);
    RecursionStability result;
    result.along_rows = growth_along_rows(field);
    // Closer to 1 than this a recursion has no variance that any margin would bring about.
    constexpr double limit = 1.0 - 1e-9;
    if (!(result.along_rows < limit)) {
        result.down_rows = std::numeric_limits<double>::quiet_NaN();
        result.explanation =
            "the recursion along a row grows by a factor of " + number(result.along_rows) + " a column";
        return result;
    }
    // Coefficients are real: ω2 and −ω2 agree.
    constexpr int steps = 64;
    std::vector<double> grid(steps + 1);
    const auto frequency = [](int k) { return std::numbers::pi * k / steps; };
    for_each_block(steps + 1,
                   [&](int k) { grid[static_cast<size_t>(k)] = growth_down_rows(field, frequency(k)); });
    std::vector<int> peaks;
    for (int k = 0; k <= steps; ++k) {
        const double here = grid[static_cast<size_t>(k)];
        if (!(here <= result.down_rows)) {
            result.down_rows = here;
            result.column_frequency = frequency(k);
        }
        if ((k == 0 || here >= grid[static_cast<size_t>(k - 1)]) &&
            (k == steps || here >= grid[static_cast<size_t>(k) + 1]))
            peaks.push_back(k);
    }
    std::vector<double> heights(peaks.size()), places(peaks.size());
    for_each_block(static_cast<int>(peaks.size()), [&](int p) {
        const auto at = static_cast<size_t>(p);
        heights[at] = refined(field, frequency(peaks[at] - 1), frequency(peaks[at] + 1), places[at]);
    });
    for (size_t p = 0; p < peaks.size(); ++p) {
        if (heights[p] > result.down_rows) {
            result.down_rows = heights[p];
            result.column_frequency = std::abs(places[p]);
        }
    }
    result.stable = result.down_rows < limit;
    if (!result.stable)
        result.explanation = "the recursion from row to row grows by a factor of " +
                             number(result.down_rows) + " a row at the column frequency " +
                             number(result.column_frequency) + " radians per pixel";
    return result;
}

RecursionMargins recursion_margins(const LinearField& field, double tolerance, int largest) {
    const MatrixXd root = noise_root(field);
    for (int n = std::min(32, largest);; n = std::min(2 * n, largest)) {
        const std::vector<double> energy = response_energy(field, root, n);
        std::vector<double> down(static_cast<size_t>(n)), right(static_cast<size_t>(n + 1)),
            left(static_cast<size_t>(n + 1));
        double total = 0.0;
        size_t cell = 0;
        for (size_t r = 0; r < static_cast<size_t>(n); ++r) {
            for (int c = -n; c <= n; ++c, ++cell) {
                total += energy[cell];
                down[r] += energy[cell];
                if (c > 0) right[static_cast<size_t>(c)] += energy[cell];
                if (c < 0) left[static_cast<size_t>(-c)] += energy[cell];
            }
        }
        // The response's rows to the right come from noise on the left.
        const RecursionMargins margins{.top = tail(down, tolerance * total),
                                       .left = tail(right, tolerance * total),
                                       .right = tail(left, tolerance * total),
                                       .missing = tolerance};
        const int widest = std::max({margins.top, margins.left, margins.right});
        // Half of what was looked at is empty: what was not looked at is emptier.
        if (2 * widest <= n) return margins;
        if (n == largest) {
            const double outer = down.back() / std::max(total, std::numeric_limits<double>::min()) * n;
            return {margins.top, margins.left, margins.right, std::max(tolerance, outer)};
        }
    }
}

}  // namespace btfield::detail

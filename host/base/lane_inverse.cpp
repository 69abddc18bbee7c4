#include "host/base/lane_inverse.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "host/base/wide.hpp"

namespace btfield::detail {

using std::size_t;

BTFIELD_WIDE void add_lane_product(const double* __restrict a, const double* __restrict b,
                                   double* __restrict sum, size_t lanes, double scale) {
    const double* const ai = a + lanes;
    const double* const bi = b + lanes;
    double* const imaginary = sum + lanes;
    for (size_t n = 0; n < lanes; ++n) {
        sum[n] += scale * (a[n] * b[n] - ai[n] * bi[n]);
        imaginary[n] += scale * (a[n] * bi[n] + ai[n] * b[n]);
    }
}

BTFIELD_WIDE void add_lane_conjugate_product(const double* __restrict a, const double* __restrict b,
                                             double* __restrict sum, size_t lanes, double scale) {
    const double* const ai = a + lanes;
    const double* const bi = b + lanes;
    double* const imaginary = sum + lanes;
    for (size_t n = 0; n < lanes; ++n) {
        sum[n] += scale * (a[n] * b[n] + ai[n] * bi[n]);
        imaginary[n] += scale * (ai[n] * b[n] - a[n] * bi[n]);
    }
}

BTFIELD_WIDE void set_lane_product(const double* __restrict a, const double* __restrict b,
                                   double* __restrict product, size_t lanes) {
    const double* const ai = a + lanes;
    const double* const bi = b + lanes;
    double* const imaginary = product + lanes;
    for (size_t n = 0; n < lanes; ++n) {
        product[n] = a[n] * b[n] - ai[n] * bi[n];
        imaginary[n] = a[n] * bi[n] + ai[n] * b[n];
    }
}

BTFIELD_WIDE void scale_lanes(const double* __restrict factors, double* __restrict values, size_t lanes) {
    for (size_t n = 0; n < lanes; ++n) {
        values[n] *= factors[n];
        values[lanes + n] *= factors[n];
    }
}

BTFIELD_WIDE void add_scaled(double factor, const double* __restrict values, double* __restrict sum,
                             size_t count) {
    for (size_t n = 0; n < count; ++n) sum[n] += factor * values[n];
}

BTFIELD_WIDE void add_squared_moduli(const double* __restrict values, double* __restrict sums, size_t lanes) {
    for (size_t n = 0; n < lanes; ++n)
        sums[n] += values[n] * values[n] + values[lanes + n] * values[lanes + n];
}

/// a b − c e
BTFIELD_WIDE void set_lane_minor(const double* __restrict a, const double* __restrict b,
                                 const double* __restrict c, const double* __restrict e,
                                 double* __restrict result, size_t lanes) {
    for (size_t n = 0; n < lanes; ++n) {
        const double ai = a[lanes + n], bi = b[lanes + n], ci = c[lanes + n], ei = e[lanes + n];
        result[n] = a[n] * b[n] - ai * bi - (c[n] * e[n] - ci * ei);
        result[lanes + n] = a[n] * bi + ai * b[n] - (c[n] * ei + ci * e[n]);
    }
}

/// values /= divisor, complex
BTFIELD_WIDE void divide_lanes(const double* __restrict divisor, double* __restrict values, size_t lanes) {
    for (size_t n = 0; n < lanes; ++n) {
        const double re = divisor[n], im = divisor[lanes + n], scale = 1.0 / (re * re + im * im);
        const double x = values[n], y = values[lanes + n];
        values[n] = (x * re + y * im) * scale;
        values[lanes + n] = (y * re - x * im) * scale;
    }
}

namespace {

void invert_by_adjugate(size_t d, size_t lanes, const double* matrix, double* inverse, double* determinant) {
    const auto entry = [&](size_t i, size_t j) { return matrix + 2 * (i * d + j) * lanes; };
    const auto out = [&](size_t i, size_t j) { return inverse + 2 * (i * d + j) * lanes; };
    const auto negated = [](double v) { return -v; };
    if (d == 1) {
        std::fill_n(inverse, lanes, 1.0);
        std::fill_n(inverse + lanes, lanes, 0.0);
    } else if (d == 2) {
        std::copy_n(entry(1, 1), 2 * lanes, out(0, 0));
        std::copy_n(entry(0, 0), 2 * lanes, out(1, 1));
        std::transform(entry(0, 1), entry(0, 1) + 2 * lanes, out(0, 1), negated);
        std::transform(entry(1, 0), entry(1, 0) + 2 * lanes, out(1, 0), negated);
    } else {
        for (size_t i = 0; i < 3; ++i) {
            for (size_t j = 0; j < 3; ++j) {
                const size_t i1 = (i + 1) % 3, i2 = (i + 2) % 3, j1 = (j + 1) % 3, j2 = (j + 2) % 3;
                set_lane_minor(entry(i1, j1), entry(i2, j2), entry(i1, j2), entry(i2, j1), out(j, i), lanes);
            }
        }
    }
    std::fill_n(determinant, 2 * lanes, 0.0);
    for (size_t j = 0; j < d; ++j) add_lane_product(entry(0, j), out(j, 0), determinant, lanes);
    for (size_t e = 0; e < d * d; ++e) divide_lanes(determinant, inverse + 2 * e * lanes, lanes);
}

/// Lanes that are worked on together: the matrices of a block stay in the nearest cache.
constexpr size_t block = 16;

/// Rows p and k change places, `count` complex entries of each, where row p has the larger pivot.
BTFIELD_WIDE void exchange_rows(const double* __restrict larger, double* __restrict k, double* __restrict p,
                                size_t count) {
    for (size_t e = 0; e < 2 * count; ++e, k += block, p += block)
        for (size_t n = 0; n < block; ++n) {
            const double x = k[n], y = p[n];
            k[n] = larger[n] > 0.0 ? y : x;
            p[n] = larger[n] > 0.0 ? x : y;
        }
}

/// larger = |p|² − |k|²; a determinant changes its sign with every exchange.
BTFIELD_WIDE void compare_pivots(const double* __restrict k, const double* __restrict p,
                                 double* __restrict larger, double* __restrict determinant) {
    for (size_t n = 0; n < block; ++n) {
        larger[n] = p[n] * p[n] + p[block + n] * p[block + n] - (k[n] * k[n] + k[block + n] * k[block + n]);
        const double sign = larger[n] > 0.0 ? -1.0 : 1.0;
        determinant[n] *= sign;
        determinant[block + n] *= sign;
    }
}

/// row −= factor · pivot row
BTFIELD_WIDE void clear_row(const double* __restrict factor, const double* __restrict pivot_row,
                            double* __restrict row, size_t count) {
    for (size_t e = 0; e < count; ++e, pivot_row += 2 * block, row += 2 * block)
        for (size_t n = 0; n < block; ++n) {
            const double re = factor[n], im = factor[block + n];
            const double x = pivot_row[n], y = pivot_row[block + n];
            row[n] -= re * x - im * y;
            row[block + n] -= re * y + im * x;
        }
}

/// Gauss and Jordan's elimination with the largest of each column as its pivot, lane by lane.
/// \param a  a block of matrices, used up
void eliminate(size_t d, double* a, double* inverse, double* determinant) {
    constexpr size_t entry = 2 * block;
    const auto at = [&](double* m, size_t i, size_t j) { return m + (i * d + j) * entry; };
    std::fill_n(inverse, d * d * entry, 0.0);
    for (size_t i = 0; i < d; ++i) std::fill_n(at(inverse, i, i), block, 1.0);
    std::fill_n(determinant, block, 1.0);
    std::fill_n(determinant + block, block, 0.0);
    std::array<double, block> larger{};
    std::array<double, entry> factor{};
    for (size_t k = 0; k < d; ++k) {
        double* const pivot = at(a, k, k);
        for (size_t p = k + 1; p < d; ++p) {
            compare_pivots(pivot, at(a, p, k), larger.data(), determinant);
            exchange_rows(larger.data(), pivot, at(a, p, k), d - k);
            exchange_rows(larger.data(), at(inverse, k, 0), at(inverse, p, 0), d);
        }
        std::array<double, entry> product{};
        set_lane_product(determinant, pivot, product.data(), block);
        std::copy(product.begin(), product.end(), determinant);
        for (size_t j = k + 1; j < d; ++j) divide_lanes(pivot, at(a, k, j), block);
        for (size_t j = 0; j < d; ++j) divide_lanes(pivot, at(inverse, k, j), block);
        for (size_t p = 0; p < d; ++p) {
            if (p == k) continue;
            std::copy_n(at(a, p, k), entry, factor.data());
            clear_row(factor.data(), at(a, k, k) + entry, at(a, p, k) + entry, d - k - 1);
            clear_row(factor.data(), at(inverse, k, 0), at(inverse, p, 0), d);
        }
    }
}

/// What lanes of the last block are not there for is inverted as 1.
void invert_by_elimination(size_t d, size_t lanes, const double* matrix, double* inverse,
                           double* determinant) {
    const size_t entries = d * d;
    std::vector<double> a(entries * 2 * block), b(entries * 2 * block);
    std::array<double, 2 * block> det{};
    for (size_t first = 0; first < lanes; first += block) {
        const size_t count = std::min(block, lanes - first);
        for (size_t e = 0; e < 2 * entries; ++e) {
            const bool one = e % 2 == 0 && e / 2 % (d + 1) == 0;
            std::copy_n(matrix + e * lanes + first, count, a.data() + e * block);
            std::fill_n(a.data() + e * block + count, block - count, one ? 1.0 : 0.0);
        }
        eliminate(d, a.data(), b.data(), det.data());
        for (size_t e = 0; e < 2 * entries; ++e)
            std::copy_n(b.data() + e * block, count, inverse + e * lanes + first);
        for (size_t part = 0; part < 2; ++part)
            std::copy_n(det.data() + part * block, count, determinant + part * lanes + first);
    }
}

}  // namespace

void invert_lanes(int planes, size_t lanes, const double* matrix, double* inverse, double* determinant) {
    const auto d = static_cast<size_t>(planes);
    if (d <= 3)
        invert_by_adjugate(d, lanes, matrix, inverse, determinant);
    else
        invert_by_elimination(d, lanes, matrix, inverse, determinant);
}

double sum_of_logarithms(const double* values, size_t count) {
    const auto moderate = [](double value) { return value > 1e-140 && value < 1e140; };
    double sum = 0.0;
    size_t n = 0;
    for (; n + 4 <= count; n += 4) {
        const double first = values[n] * values[n + 1], second = values[n + 2] * values[n + 3];
        if (moderate(first) && moderate(second)) {
            sum += std::log(first * second);
        } else {
            for (size_t k = n; k < n + 4; ++k) sum += std::log(values[k]);
        }
    }
    for (; n < count; ++n) sum += std::log(values[n]);
    return sum;
}

}  // namespace btfield::detail

#include "host/base/lane_inverse.hpp"

#include <algorithm>
#include <cmath>
#include <complex>

#include "host/base/eigen.hpp"
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

void invert_by_elimination(int d, size_t lanes, const double* matrix, double* inverse, double* determinant) {
    Eigen::MatrixXcd one(d, d);
    for (size_t n = 0; n < lanes; ++n) {
        for (int e = 0; e < d * d; ++e) {
            const size_t place = 2 * static_cast<size_t>(e) * lanes + n;
            one(e / d, e % d) = {matrix[place], matrix[place + lanes]};
        }
        const Eigen::PartialPivLU<Eigen::MatrixXcd> lu(one);
        const std::complex<double> det = lu.determinant();
        determinant[n] = det.real();
        determinant[lanes + n] = det.imag();
        one = lu.inverse();
        for (int e = 0; e < d * d; ++e) {
            const size_t place = 2 * static_cast<size_t>(e) * lanes + n;
            inverse[place] = one(e / d, e % d).real();
            inverse[place + lanes] = one(e / d, e % d).imag();
        }
    }
}

}  // namespace

void invert_lanes(int planes, size_t lanes, const double* matrix, double* inverse, double* determinant) {
    if (planes <= 3) {
        invert_by_adjugate(static_cast<size_t>(planes), lanes, matrix, inverse, determinant);
    } else {
        invert_by_elimination(planes, lanes, matrix, inverse, determinant);
    }
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

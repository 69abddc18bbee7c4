#include "host/relief/fourier_basis.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "host/base/dense.hpp"
#include "host/base/parallel.hpp"

namespace btfield::detail {
namespace {

using Map = Eigen::Map<RowMajorMatrix>;

/// Frequency of row k of the basis: 0, 1, 1, 2, 2, …
int frequency_of_row(int k) {
    return (k + 1) / 2;
}

/// Orthonormal: 1, then cosine and sine of each frequency, and at last what alternates.
RowMajorMatrix fourier_basis(int n) {
    std::vector<double> cosines(static_cast<std::size_t>(n)), sines(cosines.size());
    for (int k = 0; k < n; ++k) {
        const double angle = 2.0 * std::numbers::pi * k / n;
        cosines[static_cast<std::size_t>(k)] = std::cos(angle);
        sines[static_cast<std::size_t>(k)] = std::sin(angle);
    }
    RowMajorMatrix basis(n, n);
    for (int k = 0; k < n; ++k) {
        const int frequency = frequency_of_row(k);
        const bool single = frequency == 0 || 2 * frequency == n;
        const double scale = std::sqrt((single ? 1.0 : 2.0) / n);
        const std::vector<double>& wave = k % 2 == 0 && k > 0 ? sines : cosines;
        std::size_t at = 0;
        for (int i = 0; i < n; ++i) {
            basis(k, i) = scale * wave[at];
            at = (at + static_cast<std::size_t>(frequency)) % static_cast<std::size_t>(n);
        }
    }
    return basis;
}

/// a b, rows shared among the cores.
RowMajorMatrix wide_product(const RowMajorMatrix& a, const RowMajorMatrix& b) {
    RowMajorMatrix result = RowMajorMatrix::Zero(a.rows(), b.cols());
    constexpr Eigen::Index rows = 64;
    const auto blocks = static_cast<int>((a.rows() + rows - 1) / rows);
    for_each_block(blocks, [&](int block) {
        const Eigen::Index first = block * rows, count = std::min(rows, a.rows() - first);
        add_product(a.middleRows(first, count), b, result.middleRows(first, count));
    });
    return result;
}

}  // namespace

std::vector<double> difference_spectrum(int n, bool mirror) {
    std::vector<double> spectrum(static_cast<std::size_t>(n));
    for (int k = 0; k < n; ++k) {
        const double s = std::sin((mirror ? 1.0 : 2.0) * std::numbers::pi * k / n);
        spectrum[static_cast<std::size_t>(k)] = k == 0 || (!mirror && 2 * k == n) ? 0.0 : s * s;
    }
    return spectrum;
}

void divide_by_bases(std::vector<double>& values, Size size, const std::vector<double>& across,
                     const std::vector<double>& down, double weight, double low) {
    const RowMajorMatrix rows = fourier_basis(size.height);
    const RowMajorMatrix columns = size.width == size.height ? rows : fourier_basis(size.width);
    Map image(values.data(), size.height, size.width);
    RowMajorMatrix spectrum = wide_product(wide_product(rows, image), columns.transpose());
    for (int k = 0; k < size.height; ++k)
        for (int l = 0; l < size.width; ++l) {
            const double lambda = down[static_cast<std::size_t>(frequency_of_row(k))] +
                                  across[static_cast<std::size_t>(frequency_of_row(l))];
            const double divisor = lambda + weight;
            const double kept = low > 0.0 ? lambda * lambda / (lambda * lambda + low * low) : 1.0;
            spectrum(k, l) *= divisor > 0.0 ? kept / divisor : 0.0;
        }
    image = wide_product(wide_product(rows.transpose(), spectrum), columns);
}

}  // namespace btfield::detail

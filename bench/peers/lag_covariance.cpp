#include "bench/peers/lag_covariance.hpp"

#include <algorithm>
#include <array>
#include <numeric>

#include "bench/peers/parallel.hpp"

namespace btfield::peer {
namespace {

/// Σ_c a[c] b[c + k] for k = 0 … K − 1: one load of a serves K lags.
template <int K>
void correlate(const double* a, const double* b, int n, double* sums) {
    std::array<double, K> partial{};
    for (int c = 0; c < n; ++c)
        for (int k = 0; k < K; ++k) partial[static_cast<std::size_t>(k)] += a[c] * b[c + k];
    for (int k = 0; k < K; ++k) sums[k] += partial[static_cast<std::size_t>(k)];
}

void correlate(const double* a, const double* b, int n, int lags, double* sums) {
    for (; lags >= 5; lags -= 5, b += 5, sums += 5) correlate<5>(a, b, n, sums);
    for (; lags > 0; --lags, ++b, ++sums) correlate<1>(a, b, n, sums);
}

}  // namespace

std::vector<double> lag_covariance(const Image& image, Offset box) {
    const int h = image.height(), w = image.width(), d = image.planes(), shifts = 2 * box.column + 1;
    const int padded = w + 2 * box.column;
    // Mean-free rows in float64, continued on both sides so that no lag wraps inside a row.
    std::vector<double> rows(static_cast<std::size_t>(d) * static_cast<std::size_t>(h) *
                             static_cast<std::size_t>(padded));
    const auto row = [&](int p, int r) {
        return rows.data() +
               (static_cast<std::size_t>(p) * static_cast<std::size_t>(h) + static_cast<std::size_t>(r)) *
                   static_cast<std::size_t>(padded);
    };
    std::vector<double> mean(static_cast<std::size_t>(d));
    for (int p = 0; p < d; ++p) {
        const auto values = image.plane(p);
        mean[static_cast<std::size_t>(p)] =
            std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
    }
    parallel([&](int t) {
        for (int p = 0; p < d; ++p)
            for (int r = share(h, t); r < share(h, t + 1); ++r)
                for (int c = 0; c < padded; ++c) {
                    const int column = ((c - box.column) % w + w) % w;
                    row(p, r)[c] =
                        static_cast<double>(image.at(p, r, column)) - mean[static_cast<std::size_t>(p)];
                }
    });

    const auto size = static_cast<std::size_t>(box.row + 1) * static_cast<std::size_t>(d * d * shifts);
    std::vector<std::vector<double>> sums(threads, std::vector<double>(size));
    parallel([&](int t) {
        double* sum = sums[static_cast<std::size_t>(t)].data();
        for (int r = share(h, t); r < share(h, t + 1); ++r)
            for (int s = 0; s <= box.row; ++s)
                for (int i = 0; i < d; ++i)
                    for (int j = 0; j < d; ++j) {
                        const int first = s == 0 ? box.column : 0;
                        correlate(row(i, r) + box.column, row(j, (r + s) % h) + first, w, shifts - first,
                                  sum + ((s * d + i) * d + j) * shifts + first);
                    }
    });

    std::vector<double> result(size);
    const double scale = 1.0 / static_cast<double>(area(image.size()));
    for (int s = 0; s <= box.row; ++s)
        for (int k = 0; k < shifts; ++k)
            for (int p = 0; p < d * d; ++p) {
                double total = 0.0;
                for (const auto& part : sums)
                    total += part[static_cast<std::size_t>((s * d * d + p) * shifts + k)];
                result[static_cast<std::size_t>((s * shifts + k) * d * d + p)] = total * scale;
            }
    return result;
}

}  // namespace btfield::peer

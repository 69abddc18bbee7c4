#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <random>
#include <span>
#include <vector>

#include "btfield/criteria.hpp"
#include "host/base/dense.hpp"
#include "host/base/normal_distribution.hpp"
#include "host/base/parallel.hpp"

namespace btfield {

using namespace detail;

namespace {

using std::size_t;

constexpr int patch_side = 8, scales = 3, directions = 128;
constexpr size_t most_patches = 4096;

/// Numbers that the standard fixes to the bit.
class Random {
  public:
    explicit Random(std::uint64_t seed) : engine_(seed) {}
    /// In (0, 1).
    double uniform() { return (static_cast<double>(engine_() >> 11) + 0.5) * 0x1p-53; }
    double normal() { return normal_quantile(uniform()); }

  private:
    std::mt19937_64 engine_;
};

/// Columns are directions in the space of patches, [plane][row][column]: every other one smooth, so that
/// edges and blobs count and not only grain.
RowMajorMatrix patch_directions(int planes, Random& random) {
    constexpr int pixels = patch_side * patch_side;
    RowMajorMatrix result(planes * pixels, directions);
    for (int k = 0; k < directions; ++k) {
        for (int i = 0; i < planes * pixels; ++i) result(i, k) = random.normal();
        if (k % 2 == 0) continue;
        for (int p = 0; p < planes; ++p)
            for (const int stride : {1, patch_side}) {  // [1 1 1]/3 along both axes, periodic
                std::vector<double> from(pixels);
                for (int i = 0; i < pixels; ++i) from[static_cast<size_t>(i)] = result(p * pixels + i, k);
                for (int i = 0; i < pixels; ++i) {
                    const int place = i / stride % patch_side, begin = i - place * stride;
                    double sum = 0.0;
                    for (const int step : {patch_side - 1, 0, 1}) {
                        const int at = begin + (place + step) % patch_side * stride;
                        sum += from[static_cast<size_t>(at)];
                    }
                    result(p * pixels + i, k) = sum / 3.0;
                }
            }
    }
    for (int k = 0; k < directions; ++k) {
        double squares = 0.0;
        for (int i = 0; i < result.rows(); ++i) squares += result(i, k) * result(i, k);
        const double norm = std::sqrt(squares);
        for (int i = 0; i < result.rows(); ++i) result(i, k) /= norm;
    }
    return result;
}

/// A row per patch, at the places that the fractions give.
RowMajorMatrix patches_at(const Image& image, std::span<const double> fractions) {
    const auto count = static_cast<int>(fractions.size() / 2);
    RowMajorMatrix result(count, image.planes() * patch_side * patch_side);
    for (int n = 0; n < count; ++n) {
        const auto place = [&](int side, double fraction) {
            return std::min(side - patch_side, static_cast<int>(fraction * (side - patch_side + 1)));
        };
        const int row = place(image.height(), fractions[static_cast<size_t>(n) * 2]);
        const int column = place(image.width(), fractions[static_cast<size_t>(n) * 2 + 1]);
        double* to = result.row(n).data();
        for (int p = 0; p < image.planes(); ++p)
            for (int r = 0; r < patch_side; ++r)
                for (int c = 0; c < patch_side; ++c)
                    *to++ = static_cast<double>(image.at(p, row + r, column + c));
    }
    return result;
}

/// |patch − its mean|.
void take_contrast(RowMajorMatrix& patches) {
    for (int n = 0; n < patches.rows(); ++n) {
        double* row = patches.row(n).data();
        double sum = 0.0;
        for (int i = 0; i < patches.cols(); ++i) sum += row[i];
        const double mean = sum / static_cast<double>(patches.cols());
        for (int i = 0; i < patches.cols(); ++i) row[i] = std::abs(row[i] - mean);
    }
}

RowMajorMatrix projected(const RowMajorMatrix& patches, const RowMajorMatrix& onto) {
    constexpr int block_rows = 256;
    RowMajorMatrix result(patches.rows(), onto.cols());
    result.setZero();
    const int rows = static_cast<int>(patches.rows());
    for_each_block((rows + block_rows - 1) / block_rows, [&](int block) {
        const int begin = block * block_rows, count = std::min(block_rows, rows - begin);
        add_product(patches.middleRows(begin, count), onto, result.middleRows(begin, count));
    });
    return result;
}

/// Of projections, in deviations of A's pixels: what hardly varies, as regular patterns at coarser scales, is
/// not to count more than all the rest.
constexpr double least_deviation = 0.02;

/// Mean over the columns of the distance of transport between the two sets of numbers, in A's deviations.
double transport(const RowMajorMatrix& a, const RowMajorMatrix& b) {
    std::vector<double> of_column(static_cast<size_t>(a.cols()));
    for_each_block(static_cast<int>(a.cols()), [&](int k) {
        const auto column = [&](const RowMajorMatrix& of) {
            std::vector<double> values(static_cast<size_t>(of.rows()));
            for (int n = 0; n < of.rows(); ++n) values[static_cast<size_t>(n)] = of(n, k);
            std::sort(values.begin(), values.end());
            return values;
        };
        const std::vector<double> x = column(a), y = column(b);
        double sum = 0.0, distance = 0.0, squares = 0.0;
        for (size_t n = 0; n < x.size(); ++n) {
            sum += x[n];
            distance += std::abs(x[n] - y[n]);
        }
        const double count = static_cast<double>(x.size()), mean = sum / count;
        for (const double v : x) squares += (v - mean) * (v - mean);
        of_column[static_cast<size_t>(k)] =
            distance / count / std::max(std::sqrt(squares / count), least_deviation);
    });
    double total = 0.0;
    for (const double v : of_column) total += v;
    return total / static_cast<double>(of_column.size());
}

/// Means of 2 × 2 pixels; an odd last row or column is left out.
Image halved(const Image& image) {
    Image result({image.height() / 2, image.width() / 2}, image.planes());
    for (int p = 0; p < image.planes(); ++p)
        for (int r = 0; r < result.height(); ++r)
            for (int c = 0; c < result.width(); ++c)
                result.at(p, r, c) =
                    0.25F * (image.at(p, 2 * r, 2 * c) + image.at(p, 2 * r, 2 * c + 1) +
                             image.at(p, 2 * r + 1, 2 * c) + image.at(p, 2 * r + 1, 2 * c + 1));
    return result;
}

/// Planes that vary in A, divided by A's deviations.
Image scaled(const Image& image, const Comparison& comparison) {
    std::vector<int> varying;
    for (int p = 0; p < image.planes(); ++p)
        if (!std::isnan(comparison.planes[static_cast<size_t>(p)].std_ratio)) varying.push_back(p);
    Image result(image.size(), static_cast<int>(varying.size()));
    for (int q = 0; q < result.planes(); ++q) {
        const int p = varying[static_cast<size_t>(q)];
        const auto& plane = comparison.planes[static_cast<size_t>(p)];
        std::ranges::transform(image.plane(p), result.plane(q).begin(), [&](float v) {
            return static_cast<float>((static_cast<double>(v) - plane.mean[0]) / plane.std[0]);
        });
    }
    return result;
}

int shortest_side(const Image& a, const Image& b) {
    return std::min({a.height(), a.width(), b.height(), b.width()});
}

}  // namespace

double structure_distance(const Image& a, const Image& b) {
    const Comparison comparison = compare(a, b);
    if (shortest_side(a, b) < patch_side) return std::numeric_limits<double>::quiet_NaN();
    Random random(1);
    Image first = scaled(a, comparison), second = scaled(b, comparison);
    double sum = 0.0;
    int terms = 0;
    for (int scale = 0; scale < scales && shortest_side(first, second) >= (scale == 0 ? 1 : 2) * patch_side;
         ++scale) {
        const size_t count = std::min(most_patches, std::min(area(first.size()), area(second.size())));
        std::vector<double> fractions(2 * count);
        for (double& fraction : fractions) fraction = random.uniform();
        const RowMajorMatrix onto = patch_directions(first.planes(), random);
        RowMajorMatrix of_a = patches_at(first, fractions), of_b = patches_at(second, fractions);
        sum += transport(projected(of_a, onto), projected(of_b, onto));
        take_contrast(of_a);
        take_contrast(of_b);
        RowMajorMatrix weights = onto;
        for (int i = 0; i < weights.rows(); ++i)
            for (int k = 0; k < weights.cols(); ++k) weights(i, k) = std::abs(weights(i, k));
        sum += transport(projected(of_a, weights), projected(of_b, weights));
        terms += 2;
        first = halved(first);
        second = halved(second);
    }
    return sum / terms;
}

}  // namespace btfield

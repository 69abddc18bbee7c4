#include "btfield/light_trend.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "btfield/error.hpp"
#include "btfield/spectral_basis.hpp"
#include "host/base/eigen.hpp"
#include "host/base/parallel.hpp"
#include "host/base/srgb_curve.hpp"
#include "host/relief/relief_names.hpp"

namespace btfield {

using namespace detail;

namespace {

using std::size_t;

bool is_colour(const Image& image, int p) {
    return image.plane_space(p) != ColourSpace::unspecified;
}

/// A plane as light is added up in it.
std::vector<double> linear_values(const Image& image, int p) {
    const std::span<const float> plane = image.plane(p);
    std::vector<double> values(plane.begin(), plane.end());
    if (image.plane_space(p) == ColourSpace::srgb)
        for (double& v : values) v = srgb_decoded(v);
    return values;
}

/// Place of pixel n of so many, on [−1, 1].
double place(int n, int count) {
    return (2.0 * n + 1.0) / count - 1.0;
}

/// x, y, x², y², xy without their means on a lattice, where they are orthogonal to each other and to 1.
class Shapes {
  public:
    explicit Shapes(Size size)
        : size_(size), rows_(mean_square(size.height)), columns_(mean_square(size.width)) {}
    [[nodiscard]] std::array<double, 5> at(int row, int column) const {
        const double x = place(column, size_.width), y = place(row, size_.height);
        return {x, y, x * x - columns_, y * y - rows_, x * y};
    }

  private:
    static double mean_square(int count) {
        double sum = 0.0;
        for (int n = 0; n < count; ++n) sum += place(n, count) * place(n, count);
        return sum / count;
    }
    Size size_;
    double rows_, columns_;
};

size_t terms(Flattening flattening) {
    return flattening == Flattening::plane ? 2 : 5;
}

/// The polynomial that fits the values of a lattice best.
class Trend {
  public:
    Trend(std::span<const double> values, Size size, Flattening flattening) : shapes_(size) {
        std::array<double, 5> squares{};
        for (int r = 0; r < size.height; ++r)
            for (int c = 0; c < size.width; ++c) {
                const double value =
                    values[static_cast<size_t>(r) * static_cast<size_t>(size.width) + static_cast<size_t>(c)];
                const std::array<double, 5> shape = shapes_.at(r, c);
                mean_ += value;
                for (size_t k = 0; k < terms(flattening); ++k) {
                    weights_[k] += value * shape[k];
                    squares[k] += shape[k] * shape[k];
                }
            }
        mean_ /= static_cast<double>(area(size));
        for (size_t k = 0; k < weights_.size(); ++k)
            if (squares[k] > 0.0) weights_[k] /= squares[k];
        const double first = (*this)(0, 0);
        lowest_ = highest_ = first;
        for (int r = 0; r < size.height; ++r)
            for (int c = 0; c < size.width; ++c) {
                const double own = (*this)(r, c);
                lowest_ = std::min(lowest_, own);
                highest_ = std::max(highest_, own);
            }
    }
    [[nodiscard]] double operator()(int row, int column) const {
        const std::array<double, 5> shape = shapes_.at(row, column);
        double sum = mean_;
        for (size_t k = 0; k < weights_.size(); ++k) sum += weights_[k] * shape[k];
        return sum;
    }
    [[nodiscard]] double mean() const { return mean_; }
    [[nodiscard]] double lowest() const { return lowest_; }
    [[nodiscard]] double range() const { return highest_ - lowest_; }

  private:
    Shapes shapes_;
    double mean_ = 0.0, lowest_ = 0.0, highest_ = 0.0;
    std::array<double, 5> weights_{};
};

constexpr int blocks = 8;

/// Means of the blocks of the brightness of all colours, [row][column]; their mean is 1.
std::vector<double> block_means(const Image& image) {
    constexpr size_t all = static_cast<size_t>(blocks) * static_cast<size_t>(blocks);
    std::vector<double> sums(all), counts(all);
    const auto block_of = [](int n, int count) {
        return static_cast<size_t>(static_cast<long long>(n) * blocks / count);
    };
    for (int p = 0; p < image.planes(); ++p) {
        if (!is_colour(image, p)) continue;
        const std::vector<double> values = linear_values(image, p);
        auto value = values.begin();
        for (int r = 0; r < image.height(); ++r)
            for (int c = 0; c < image.width(); ++c) {
                const size_t at = block_of(r, image.height()) * blocks + block_of(c, image.width());
                sums[at] += *value++;
                counts[at] += 1.0;
            }
    }
    double mean = 0.0;
    for (size_t b = 0; b < sums.size(); ++b)
        mean += (sums[b] /= counts[b]) / static_cast<double>(sums.size());
    for (double& sum : sums) sum /= mean;
    return sums;
}

/// Share of the blocks' variance that a trend explains, and its F statistic.
struct Explained {
    double share, statistic;
};

Explained explained(const std::vector<double>& means, const Trend& trend, size_t terms) {
    double all = 0.0, left = 0.0;
    auto value = means.begin();
    for (int r = 0; r < blocks; ++r)
        for (int c = 0; c < blocks; ++c, ++value) {
            all += (*value - trend.mean()) * (*value - trend.mean());
            left += (*value - trend(r, c)) * (*value - trend(r, c));
        }
    if (!(all > 0.0)) return {0.0, 0.0};
    const auto unknowns = static_cast<double>(terms);
    const double freedom = blocks * blocks - unknowns - 1.0;
    return {1.0 - left / all, (all - left) / unknowns / std::max(left / freedom, 1e-30)};
}

}  // namespace

std::optional<LightTrend> light_trend(const Image& image) {
    constexpr int smallest_side = 8 * blocks;
    constexpr double least_range = 0.05, largest_range = 0.6;  // beyond, it is the material
    if (std::min(image.height(), image.width()) < smallest_side) return std::nullopt;
    bool colours = false;
    for (int p = 0; p < image.planes(); ++p) colours = colours || is_colour(image, p);
    if (!colours) return std::nullopt;
    const std::vector<double> means = block_means(image);
    if (!std::isfinite(means.front())) return std::nullopt;
    struct Test {
        Flattening shape;
        double share, statistic;
    };
    // Chances of 2e-6 and 2e-7 among independent blocks. Materials vary in the large, too: the largest values
    // of pictures in even light were 0.33 and 15, 0.47 and 10.
    for (const Test& test : {Test{Flattening::plane, 0.4, 16.0}, Test{Flattening::low, 0.48, 11.0}}) {
        const Trend trend(means, {blocks, blocks}, test.shape);
        const Explained found = explained(means, trend, terms(test.shape));
        if (found.share < test.share || found.statistic < test.statistic) continue;
        // The blocks' centres do not reach the borders.
        const double range = trend.range() * blocks / (blocks - 1.0);
        if (range >= least_range && range <= largest_range) return LightTrend{test.shape, range};
    }
    return std::nullopt;
}

namespace {

constexpr double darkest = 0.1;  // of a trend, over its mean

/// Whether light of this shape can be divided out of all colours.
bool divisible(const Image& image, Flattening flattening) {
    for (int p = 0; p < image.planes(); ++p) {
        if (!is_colour(image, p)) continue;
        const Trend trend(linear_values(image, p), image.size(), flattening);
        if (!(trend.lowest() > darkest * trend.mean())) return false;
    }
    return true;
}

double variance_of(std::span<const double> values, double mean) {
    double squares = 0.0;
    for (const double v : values) squares += (v - mean) * (v - mean);
    return squares / static_cast<double>(values.size());
}

/// Refuses a picture of which flattening leaves planes without variance alone.
void refuse_empty(const FlattenedPicture& flat, const std::string& asked, Flattening flattening) {
    bool taken = false;
    for (int p = 0; p < flat.image.planes(); ++p) {
        const std::span<const float> plane = flat.image.plane(p);
        if (std::ranges::any_of(plane, [&](float v) { return v != plane.front(); })) return;
        taken = taken || flat.left[static_cast<size_t>(p)] == 0.0;
    }
    if (taken)
        throw InputError(asked,
                         flattening == Flattening::plane ? "it is nothing but a slope"
                                                         : "it is nothing but a slope and a bowl",
                         "use a picture of a material, or do not flatten it");
}

}  // namespace

FlattenedPicture flattened(const Image& image, Flattening flattening) {
    const std::string asked = "flatten a picture";
    if (flattening == Flattening::none) throw InputError(asked, "no shape is given", "give plane or low");
    FlattenedPicture result{image, 0.0, std::vector<double>(static_cast<size_t>(image.planes()), 1.0)};
    bool colours = false;
    for (int p = 0; p < image.planes(); ++p) colours = colours || is_colour(image, p);
    std::vector<double> ranges(static_cast<size_t>(image.planes()));
    std::vector<char> dark(ranges.size());
    for_each_block(image.planes(), [&](int p) {
        if (colours && !is_colour(image, p)) return;
        std::vector<double> values = linear_values(image, p);
        const Trend trend(values, image.size(), flattening);
        const double mean = trend.mean();
        const double variance = variance_of(values, mean);
        if (!(variance > 0.0)) return;
        const auto at = static_cast<size_t>(p);
        if (colours && !(trend.lowest() > darkest * mean)) {
            dark[at] = 1;
            return;
        }
        ranges[at] = trend.range() / (colours ? mean : std::sqrt(variance));
        double sum = 0.0;
        auto value = values.begin();
        for (int r = 0; r < image.height(); ++r)
            for (int c = 0; c < image.width(); ++c, ++value) {
                *value = colours ? *value * mean / trend(r, c) : *value - trend(r, c) + mean;
                sum += *value;
            }
        const double now = sum / static_cast<double>(values.size()), again = mean / now;
        const double left = variance_of(values, now) / variance;
        const bool empty = left < smallest_relative_variance;
        result.left[at] = empty ? 0.0 : left;
        const bool encoded = image.plane_space(p) == ColourSpace::srgb;
        const std::span<float> target = result.image.plane(p);
        for (size_t n = 0; n < values.size(); ++n) {
            const double own = empty ? mean : colours ? values[n] * again : values[n];
            target[n] = static_cast<float>(encoded ? srgb_encoded(own) : own);
        }
    });
    for (size_t p = 0; p < ranges.size(); ++p) {
        if (dark[p] != 0) {
            const Flattening other = flattening == Flattening::low ? Flattening::plane : Flattening::low;
            throw InputError(
                asked,
                "the trend of plane " + std::to_string(p) + " comes near 0: its light cannot be divided out",
                divisible(image, other) ? "use " + std::string(word_of(other)) + ", or a part of the picture"
                                        : "use a part of the picture");
        }
        result.range = std::max(result.range, ranges[p]);
    }
    refuse_empty(result, asked, flattening);
    return result;
}

}  // namespace btfield

#include "host/compound/conditional_mean.hpp"

#include <algorithm>
#include <cstddef>
#include <utility>

#include "host/base/dense.hpp"
#include "host/base/stop.hpp"
#include "host/base/wide.hpp"
#include "host/base/work_part.hpp"
#include "host/roller/features.hpp"

namespace btfield::detail {
namespace {

using std::size_t;

/// Pixels that the regression looks at: far more than it has unknowns.
constexpr size_t most_observations = 65536;
/// Relative to the number of observations. Labels and their smoothed forms nearly repeat each other; of up to
/// 1e-4 it makes no difference to what is explained where there are pixels enough, and weights stay small.
/// Where there are few, weights that fit them fit nothing else, and textures have too much contrast.
constexpr std::array<double, 6> ridges{1e-6, 1e-5, 1e-4, 1e-3, 1e-2, 1e-1};
/// Parts of the picture, bands of rows, each of which is told from the others.
constexpr size_t folds = 4;
/// Of ridges whose errors are the least or hardly more, the largest counts.
constexpr double hardly_more = 1.002;
/// The pixel itself and what is smoothed; pairs of neighbours come after.
constexpr int smoothed_filters = context_filters - context_pairs;

/// Pixels at random places, away from where the picture's opposite edges meet and labels say nothing.
std::vector<size_t> observed_pixels(Size size) {
    const auto margin = [](int side) { return std::min(2 << context_scales, side / 8); };
    const int top = margin(size.height), left = margin(size.width);
    const size_t inside =
        static_cast<size_t>(size.height - 2 * top) * static_cast<size_t>(size.width - 2 * left);
    std::vector<size_t> pixels;
    for (int r = top; r < size.height - top; ++r) {
        for (int c = left; c < size.width - left; ++c) {
            const size_t at =
                static_cast<size_t>(r) * static_cast<size_t>(size.width) + static_cast<size_t>(c);
            if (inside <= most_observations || draw(0, at) % inside < most_observations) pixels.push_back(at);
        }
    }
    return pixels;
}

/// out(x) = t0 in(x) + t1 (in(x − b) + in(x + b)) + t2 (in(x − a) + in(x + a)), lines given.
BTFIELD_WIDE void combine_context_lines(const std::array<const float*, 5>& lines,
                                        const std::array<float, 3>& taps, float* out, size_t count) {
    for (size_t x = 0; x < count; ++x)
        out[x] = taps[0] * lines[2][x] + taps[1] * (lines[1][x] + lines[3][x]) +
                 taps[2] * (lines[0][x] + lines[4][x]);
}

size_t around(int i, int n) {
    const int rest = i % n;
    return static_cast<size_t>(rest < 0 ? rest + n : rest);
}

/// One plane, smoothed from scale to scale on the torus.
class SmoothedPlane {
  public:
    SmoothedPlane(Size size, std::vector<float> values)
        : size_(size), values_(std::move(values)), other_(values_.size()) {}

    void smooth(int scale) {
        const int step = 1 << scale;
        const std::array<double, 3> exact = smoothing_taps(scale);
        const std::array<float, 3> taps{static_cast<float>(exact[0]), static_cast<float>(exact[1]),
                                        static_cast<float>(exact[2])};
        const auto width = static_cast<size_t>(size_.width);
        std::array<const float*, 5> lines;
        for (int r = 0; r < size_.height; ++r) {
            int tap = r - 2 * step;
            for (const float*& of : lines) {
                of = values_.data() + around(tap, size_.height) * width;
                tap += step;
            }
            combine_context_lines(lines, taps, other_.data() + static_cast<size_t>(r) * width, width);
        }
        const size_t reach = 2 * static_cast<size_t>(step);
        std::vector<float> line(width + 2 * reach);
        for (int r = 0; r < size_.height; ++r) {
            const float* from = other_.data() + static_cast<size_t>(r) * width;
            for (size_t x = 0; x < line.size(); ++x)
                line[x] = from[(x + width * (1 + reach / width) - reach) % width];
            for (size_t t = 0; t < 5; ++t) lines[t] = line.data() + t * static_cast<size_t>(step);
            combine_context_lines(lines, taps, values_.data() + static_cast<size_t>(r) * width, width);
        }
    }
    [[nodiscard]] float at(size_t pixel) const { return values_[pixel]; }
    /// Half the difference of the pixels `rows` and `columns` on and back.
    [[nodiscard]] float slope(size_t pixel, int rows, int columns) const {
        return 0.5F * (beside(pixel, rows, columns) - beside(pixel, -rows, -columns));
    }
    /// Half their sum.
    [[nodiscard]] float opposite(size_t pixel, int rows, int columns) const {
        return 0.5F * (beside(pixel, rows, columns) + beside(pixel, -rows, -columns));
    }

  private:
    [[nodiscard]] float beside(size_t pixel, int rows, int columns) const {
        const int r = static_cast<int>(pixel / static_cast<size_t>(size_.width));
        const int c = static_cast<int>(pixel % static_cast<size_t>(size_.width));
        return values_[around(r + rows, size_.height) * static_cast<size_t>(size_.width) +
                       around(c + columns, size_.width)];
    }
    Size size_;
    std::vector<float> values_, other_;
};

/// What the regression knows of each observed pixel, [unknown][observation]: filters of every region, 1, and
/// the picture's planes.
class Observations {
  public:
    Observations(const Image& image, const ControlField& field)
        : pixels_(observed_pixels(image.size())),
          unknowns_(static_cast<size_t>(field.regions * context_filters) + 1),
          rows_(unknowns_ + static_cast<size_t>(image.planes())),
          values_(rows_ * pixels_.size()) {
        const WorkPart share(0.4);
        for_each_part(field.regions, [&](int k) { observe_region(field, k); });
        std::fill_n(row(unknowns_ - 1), pixels_.size(), 1.0F);
        for (int p = 0; p < image.planes(); ++p) {
            const std::span<const float> plane = image.plane(p);
            float* to = row(unknowns_ + static_cast<size_t>(p));
            for (size_t n = 0; n < pixels_.size(); ++n) to[n] = plane[pixels_[n]];
        }
    }

    /// Sums of all products of two rows, over each fold.
    [[nodiscard]] std::vector<RowMajorMatrix> products() const {
        constexpr size_t chunk = 512, chunks_per_block = 8;
        const auto rows = static_cast<Eigen::Index>(rows_);
        struct Block {
            size_t fold, begin, end;
        };
        std::vector<Block> blocks;
        for (size_t fold = 0; fold < folds; ++fold) {
            const size_t end = pixels_.size() * (fold + 1) / folds;
            for (size_t at = pixels_.size() * fold / folds; at < end; at += chunk * chunks_per_block)
                blocks.push_back({fold, at, std::min(end, at + chunk * chunks_per_block)});
        }
        std::vector<RowMajorMatrix> parts(blocks.size());
        const WorkPart share(0.4);
        for_each_part(static_cast<int>(blocks.size()), [&](int n) {
            const Block& block = blocks[static_cast<size_t>(n)];
            RowMajorMatrix& sum = parts[static_cast<size_t>(n)];
            sum = RowMajorMatrix::Zero(rows, rows);
            for (size_t begin = block.begin; begin < block.end; begin += chunk) {
                const size_t count = std::min(chunk, block.end - begin);
                RowMajorMatrix z(rows, static_cast<Eigen::Index>(count));
                for (size_t i = 0; i < rows_; ++i)
                    for (size_t j = 0; j < count; ++j)
                        z(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j)) =
                            static_cast<double>(values_[i * pixels_.size() + begin + j]);
                const RowMajorMatrix transposed = z.transpose();
                add_product(z, transposed, sum);
            }
        });
        std::vector<RowMajorMatrix> sums(folds, RowMajorMatrix::Zero(rows, rows));
        for (size_t n = 0; n < blocks.size(); ++n) sums[blocks[n].fold] += parts[n];
        return sums;
    }
    [[nodiscard]] size_t unknowns() const { return unknowns_; }
    [[nodiscard]] size_t count() const { return pixels_.size(); }

  private:
    float* row(size_t unknown) { return values_.data() + unknown * pixels_.size(); }

    void observe_region(const ControlField& field, int k) {
        std::vector<float> indicator(field.labels.size());
        for (size_t n = 0; n < indicator.size(); ++n) indicator[n] = field.labels[n] == k ? 1.0F : 0.0F;
        SmoothedPlane plane(field.size, std::move(indicator));
        const size_t first = static_cast<size_t>(k) * static_cast<size_t>(context_filters);
        float* to = row(first);
        for (size_t n = 0; n < pixels_.size(); ++n) to[n] = plane.at(pixels_[n]);
        constexpr std::array<Offset, context_pairs> pairs{{{1, 0}, {0, 1}, {1, 1}, {1, -1}}};
        for (size_t pair = 0; pair < pairs.size(); ++pair) {
            float* both = row(first + static_cast<size_t>(smoothed_filters) + pair);
            for (size_t n = 0; n < pixels_.size(); ++n)
                both[n] = plane.opposite(pixels_[n], pairs[pair].row, pairs[pair].column);
        }
        for (int scale = 0; scale < context_scales; ++scale) {
            plane.smooth(scale);
            const int step = 1 << scale;
            const size_t filter = first + 1 + 3 * static_cast<size_t>(scale);
            float *value = row(filter), *down = row(filter + 1), *across = row(filter + 2);
            for (size_t n = 0; n < pixels_.size(); ++n) {
                value[n] = plane.at(pixels_[n]);
                down[n] = plane.slope(pixels_[n], step, 0);
                across[n] = plane.slope(pixels_[n], 0, step);
            }
        }
    }

    std::vector<size_t> pixels_;
    size_t unknowns_, rows_;
    std::vector<float> values_;
};

/// Ridge regression of the planes on the unknowns.
class Regression {
  public:
    /// \param products of unknowns, the constant last, and planes, over each fold
    Regression(std::vector<RowMajorMatrix> products, size_t unknowns, size_t count)
        : products_(std::move(products)),
          sum_(products_.front()),
          unknowns_(static_cast<Eigen::Index>(unknowns)),
          planes_(sum_.rows() - unknowns_),
          count_(static_cast<double>(count)) {
        for (size_t fold = 1; fold < products_.size(); ++fold) sum_ += products_[fold];
    }

    /// [unknown][plane], with the ridge that tells folds best.
    [[nodiscard]] Eigen::MatrixXd solve() const {
        std::array<double, ridges.size()> errors{};
        const WorkPart share(0.1);
        for_each_part(static_cast<int>(ridges.size()), [&](int n) {
            errors[static_cast<size_t>(n)] = error_of(ridges[static_cast<size_t>(n)]);
        });
        size_t chosen = 0;
        const double least = *std::min_element(errors.begin(), errors.end());
        for (size_t n = 0; n < ridges.size(); ++n)
            if (errors[n] <= hardly_more * least) chosen = n;
        return solution(sum_, ridges[chosen] * count_);
    }

  private:
    [[nodiscard]] Eigen::MatrixXd solution(const RowMajorMatrix& products, double diagonal) const {
        Eigen::MatrixXd system = products.topLeftCorner(unknowns_, unknowns_);
        for (Eigen::Index i = 0; i + 1 < unknowns_; ++i) system(i, i) += diagonal;
        // Of a single observation, which is in one fold, the others have none.
        if (!(system(unknowns_ - 1, unknowns_ - 1) > 0.0)) system(unknowns_ - 1, unknowns_ - 1) = 1.0;
        const Cholesky factor(system);
        Eigen::MatrixXd result(unknowns_, planes_);
        for (Eigen::Index p = 0; p < planes_; ++p) {
            const Eigen::VectorXd right = products.col(unknowns_ + p).head(unknowns_);
            result.col(p) = factor.solve(right);
        }
        return result;
    }

    /// Squared error of each fold by what the others tell, over that of the planes' means, summed.
    [[nodiscard]] double error_of(double ridge) const {
        double sum = 0.0;
        for (const RowMajorMatrix& own : products_) {
            stop_if_asked();
            const double held = own(unknowns_ - 1, unknowns_ - 1);
            const RowMajorMatrix others = sum_ - own;
            const Eigen::MatrixXd weights = solution(others, ridge * (count_ - held));
            const Eigen::MatrixXd inner = own.topLeftCorner(unknowns_, unknowns_);
            for (Eigen::Index p = 0; p < planes_; ++p) {
                const Eigen::VectorXd w = weights.col(p), right = own.col(unknowns_ + p).head(unknowns_);
                const Eigen::VectorXd image = inner * w;
                const double mean = sum_(unknowns_ - 1, unknowns_ + p) / count_;
                const double variance = sum_(unknowns_ + p, unknowns_ + p) / count_ - mean * mean;
                const double error = own(unknowns_ + p, unknowns_ + p) - 2.0 * w.dot(right) + w.dot(image);
                if (variance > 0.0) sum += error / variance;
            }
        }
        return sum;
    }

    std::vector<RowMajorMatrix> products_;
    RowMajorMatrix sum_;
    Eigen::Index unknowns_, planes_;
    double count_;
};

/// Models are kept in float32: what is fitted is what a file gives back.
double kept(double value) {
    return static_cast<double>(static_cast<float>(value));
}

}  // namespace

std::array<double, 3> smoothing_taps(int scale) {
    // Two passes of [p, 1 − 2p, p]: variance 4p steps², 1 at the first scale and 3/4 at the others.
    const double p = scale == 0 ? 0.25 : 0.1875;
    return {(1 - 2 * p) * (1 - 2 * p) + 2 * p * p, 2 * p * (1 - 2 * p), p * p};
}

MeanWeights fit_conditional_mean(const Image& image, const ControlField& field) {
    const Observations observations(image, field);
    const Regression regression(observations.products(), observations.unknowns(), observations.count());
    const Eigen::MatrixXd solution = regression.solve();
    const auto d = static_cast<size_t>(image.planes());
    const size_t per_region = static_cast<size_t>(context_filters);
    const auto n = static_cast<Eigen::Index>(observations.unknowns());
    MeanWeights result;
    result.regions.assign(static_cast<size_t>(field.regions), std::vector<double>(per_region * d));
    for (size_t p = 0; p < d; ++p) {
        const auto plane = static_cast<Eigen::Index>(p);
        result.mean.push_back(kept(solution(n - 1, plane)));
        for (size_t k = 0; k < result.regions.size(); ++k)
            for (size_t f = 0; f < per_region; ++f)
                result.regions[k][f * d + p] =
                    kept(solution(static_cast<Eigen::Index>(k * per_region + f), plane));
    }
    return result;
}

MeanWeights regional_means(const Image& image, const ControlField& field) {
    const auto d = static_cast<size_t>(image.planes());
    MeanWeights result;
    result.mean.assign(d, 0.0);
    std::vector<std::vector<double>> sums(static_cast<size_t>(field.regions), std::vector<double>(d, 0.0));
    std::vector<double> counts(sums.size(), 0.0);
    for (const std::uint8_t label : field.labels) counts[label] += 1.0;
    for (size_t p = 0; p < d; ++p) {
        const std::span<const float> plane = image.plane(static_cast<int>(p));
        for (size_t n = 0; n < plane.size(); ++n) sums[field.labels[n]][p] += static_cast<double>(plane[n]);
    }
    for (size_t k = 0; k < sums.size(); ++k)
        for (double& sum : sums[k]) sum = kept(counts[k] > 0.0 ? sum / counts[k] : 0.0);
    result.regions = std::move(sums);
    return result;
}

MeanWeights mean_weights(const CompoundModel& model) {
    MeanWeights weights{model.mean, {}};
    weights.regions.reserve(model.regions.size());
    for (const CompoundRegion& region : model.regions) weights.regions.push_back(region.weights);
    return weights;
}

ConditionalMean::ConditionalMean(DeviceImpl& device, const MeanWeights& weights)
    : device_(&device),
      planes_(static_cast<int>(weights.mean.size())),
      filters_(static_cast<int>(weights.regions.front().size() / weights.mean.size())) {
    std::vector<float> numbers;
    for (const std::vector<double>& region : weights.regions)
        for (std::size_t w = 0; w < region.size(); ++w) {
            numbers.push_back(static_cast<float>(region[w]));
            if ((w + 1) % weights.mean.size() == 0) numbers.resize((numbers.size() + 3) / 4 * 4, 0.0F);
        }
    weights_ = device.upload(numbers);
    std::vector<float> mean;
    for (const double m : weights.mean) mean.push_back(static_cast<float>(m));
    mean_ = device.upload(mean);
}

DevicePlanes ConditionalMean::of(const Buffer& labels, Size size) const {
    const auto lanes = static_cast<size_t>(device_->vector_width());
    const size_t vectors = (static_cast<size_t>(size.width) + lanes - 1) / lanes;
    const auto height = static_cast<size_t>(size.height), planes = static_cast<size_t>(planes_);
    const size_t bytes = sizeof(float) * planes * area(size);
    Buffer values = device_->buffer(bytes);
    Buffer other;
    BuildParameters parameters = device_->lanes();
    parameters.set("BTFIELD_PLANES", planes_);
    const auto kernel = [&](const char* name) {
        return device_->kernel("conditional_mean", name, parameters);
    };
    int accumulate = 0;
    const auto add = [&](int step, int filter, int pairs) {
        device_->launch(kernel("add_context"), {vectors, height, 1}, Grain::fine, values, labels, weights_,
                        filters_, filter, pairs, mean_, step, accumulate, size.height, size.width);
        accumulate = 1;
    };
    if (filters_ > 1) {
        other = device_->buffer(bytes);
        for (int scale = context_scales - 1; scale >= 0; --scale) {
            const int step = 1 << scale;
            add(step, 1 + 3 * scale, 0);
            const std::array<double, 3> taps = smoothing_taps(scale);
            const auto t0 = static_cast<float>(taps[0]), t1 = static_cast<float>(taps[1]),
                       t2 = static_cast<float>(taps[2]);
            device_->launch(kernel("smooth_down"), {vectors, height, planes}, Grain::fine, values, other, t0,
                            t1, t2, step, size.height, size.width);
            device_->launch(kernel("smooth_across"), {vectors, height, planes}, Grain::fine, other, values,
                            t0, t1, t2, step, size.height, size.width);
        }
    }
    add(0, 0, filters_ > 1 ? smoothed_filters : 0);
    return {std::move(values), size, size, planes_};
}

Image conditional_mean(DeviceImpl& device, const MeanWeights& weights, const ControlField& field) {
    const Buffer labels = device.upload(field.labels);
    const DevicePlanes planes = ConditionalMean(device, weights).of(labels, field.size);
    Image image(field.size, planes.planes);
    device.read(planes.values, image.values().data(), image.values().size_bytes());
    return image;
}

}  // namespace btfield::detail

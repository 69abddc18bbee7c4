#include "host/compound/regional_fit.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>
#include <vector>

#include "btfield/error.hpp"
#include "btfield/pyramid.hpp"
#include "host/analysis/lag_matrices.hpp"
#include "host/base/eigen.hpp"
#include "host/base/parallel.hpp"
#include "host/base/text.hpp"
#include "host/base/work_part.hpp"
#include "host/compound/flat_regions.hpp"
#include "host/compound/regional_averages.hpp"
#include "host/compound/regional_covariance.hpp"
#include "host/compound/regional_gains.hpp"
#include "host/fit/analysed_picture.hpp"
#include "host/fit/level_fit.hpp"
#include "host/fit/random_decrement.hpp"
#include "host/roller/features.hpp"
#include "host/spectrum/examination.hpp"
#include "host/spectrum/spectral_density.hpp"

namespace btfield::detail {
namespace {

using std::size_t;

constexpr int usual_levels = 3;  // P1's
/// Fewer pixels of a level than this tell nothing of a region: it takes the model of all regions together.
constexpr size_t fewest_pixels = 100;

/// Deviations of a region below this part of the residual's own are replaced by noise of that size: what does
/// not vary has no model. A residual below a hundredth of the picture's deviation counts as if it had that:
/// of a picture with one colour to a region it is rounding.
constexpr double smallest_deviation = 1e-4, smallest_residual = 1e-2;

/// What the regional models are fitted to, and how it came about.
struct ModelledPlanes {
    SpectralBasis basis;                           ///< without planes where values are modelled as they are
    std::vector<std::vector<Marginal>> marginals;  ///< [region][eigenplane], or none
    Image planes;
};

std::vector<std::vector<size_t>> pixels_of(const ControlField& field) {
    std::vector<std::vector<size_t>> pixels(static_cast<size_t>(field.regions));
    for (size_t n = 0; n < field.labels.size(); ++n) pixels[field.labels[n]].push_back(n);
    return pixels;
}

std::vector<double> deviations_of(const Image& image) {
    const std::vector<std::uint8_t> same(area(image.size()), 0);
    std::vector<double> result = regional_variances(image, same, 1);
    for (double& value : result) value = std::sqrt(std::max(0.0, value));
    return result;
}

/// Adds noise to regions in which a plane hardly varies.
/// \param deviations of the planes of what the image is taken from
void stir(Image& image, const std::vector<std::vector<size_t>>& pixels, std::span<const double> deviations) {
    for (int p = 0; p < image.planes(); ++p) {
        const std::span<float> plane = image.plane(p);
        const auto deviation = [&](const std::vector<size_t>& of) {
            double sum = 0.0, squares = 0.0;
            for (const size_t n : of) {
                sum += static_cast<double>(plane[n]);
                squares += static_cast<double>(plane[n]) * static_cast<double>(plane[n]);
            }
            const double count = static_cast<double>(of.size());
            return count > 0.0 ? std::sqrt(std::max(0.0, squares / count - sum * sum / (count * count)))
                               : 0.0;
        };
        double largest = smallest_residual * deviations[static_cast<size_t>(p)];
        for (const auto& region : pixels) largest = std::max(largest, deviation(region));
        const auto least = static_cast<float>(smallest_deviation * largest);
        for (const auto& region : pixels) {
            if (deviation(region) >= static_cast<double>(least)) continue;
            for (const size_t n : region) {
                const auto word = static_cast<float>(draw(static_cast<std::uint64_t>(p), n) >> 40);
                plane[n] += least * 3.4F * (word / 16777216.0F - 0.5F);
            }
        }
    }
}

/// Each region's eigenplanes become standard normal ones.
ModelledPlanes gaussianised(Image eigenplanes, SpectralBasis basis,
                            const std::vector<std::vector<size_t>>& pixels) {
    ModelledPlanes result{std::move(basis), std::vector<std::vector<Marginal>>(pixels.size()),
                          std::move(eigenplanes)};
    stir(result.planes, pixels, deviations_of(result.planes));
    for_each_block(static_cast<int>(pixels.size()), [&](int k) {
        const std::vector<size_t>& own = pixels[static_cast<size_t>(k)];
        if (own.empty()) return;
        Image packed(Size{1, static_cast<int>(own.size())}, result.planes.planes());
        for (int p = 0; p < packed.planes(); ++p)
            for (size_t n = 0; n < own.size(); ++n) packed.plane(p)[n] = result.planes.plane(p)[own[n]];
        GaussianPlanes gaussian = gaussianise(packed);
        for (int p = 0; p < packed.planes(); ++p)
            for (size_t n = 0; n < own.size(); ++n)
                result.planes.plane(p)[own[n]] = gaussian.planes.plane(p)[n];
        for (Marginal& marginal : gaussian.marginals)
            for (double& value : marginal.values) value = static_cast<double>(static_cast<float>(value));
        result.marginals[static_cast<size_t>(k)] = std::move(gaussian.marginals);
    });
    return result;
}

ModelledPlanes modelled(const Image& picture, const Image& residual,
                        const std::vector<std::vector<size_t>>& pixels, const FitOptions& local) {
    Image stirred = residual;
    stir(stirred, pixels, deviations_of(picture));
    if (local.marginals == MarginalMode::none && !is_2d(local.model)) {
        SpectralBasis varying = varying_planes(stirred);
        Image planes = varying.planes == 0 ? std::move(stirred) : to_eigenplanes(varying, stirred);
        return {std::move(varying), {}, std::move(planes)};
    }
    SpectralBasis basis = spectral_basis(stirred);
    Image eigenplanes = to_eigenplanes(basis, stirred);
    if (local.marginals == MarginalMode::none) return {std::move(basis), {}, std::move(eigenplanes)};
    return gaussianised(std::move(eigenplanes), std::move(basis), pixels);
}

/// A level of the residual with its labels.
struct RegionalLevel {
    Image image;
    std::vector<std::uint8_t> labels;
    std::vector<size_t> counts;
};

std::vector<std::uint8_t> mask_of(const std::vector<std::uint8_t>& labels, int region) {
    std::vector<std::uint8_t> inside(labels.size());
    std::transform(labels.begin(), labels.end(), inside.begin(),
                   [&](std::uint8_t label) { return static_cast<std::uint8_t>(label == region); });
    return inside;
}

/// White noise of these covariances, for regions in which random decrement finds nothing to average, or no
/// noise that would do.
MaModel white_noise(const LagCovariance& statistic, NoiseForm noise) {
    MaModel model;
    model.planes = statistic.planes();
    model.kind = NeighbourhoodKind::custom;
    model.offsets = {Offset{}};
    const Eigen::MatrixXd covariance = lag_zero(statistic);
    for (int i = 0; i < model.planes; ++i)
        for (int j = 0; j < model.planes; ++j) {
            model.coefficients.push_back(i == j ? 1.0 : 0.0);
            model.noise_covariance.push_back(i == j || noise == NoiseForm::full ? covariance(i, j) : 0.0);
        }
    return model;
}

/// Moving averages of one region at one level.
/// \param inside empty: all pixels
LevelModel fit_averages(const RegionalLevel& data, const LagCovariance& statistic,
                        std::span<const std::uint8_t> inside, const FitOptions& local,
                        AveragesEstimator estimator, const Support& support) {
    LevelModel level;
    level.size = data.image.size();
    const bool root = estimator == AveragesEstimator::spectral_root;
    level.estimator = root ? Estimator::spectral_root : Estimator::random_decrement;
    level.log_likelihood = std::numeric_limits<double>::quiet_NaN();
    level.certificate.valid = true;
    level.certificate.min_singular = std::numeric_limits<double>::infinity();
    const bool apart = is_2d(local.model);
    for (int p = 0; p < (apart ? data.image.planes() : 1); ++p) {
        const LagCovariance own = apart ? plane_statistic(statistic, p) : statistic;
        MaModel model;
        try {
            model = root ? averages_of_covariances(own, support)
                         : fit_ma(apart ? plane_image(data.image, p) : data.image, own, support, local.noise,
                                  local.moving_average, inside);
            const size_t diagonal = static_cast<size_t>(model.planes) + 1;
            for (size_t e = 0; e < model.noise_covariance.size(); e += diagonal)
                if (!(model.noise_covariance[e] > 0.0)) model = white_noise(own, local.noise);
        } catch (const InputError&) {
            if (inside.empty()) throw;
            model = white_noise(own, local.noise);
        }
        for (double& a : model.coefficients) a = static_cast<double>(static_cast<float>(a));
        const Certificate certificate = examine(Model(model), own).certificate;
        level.certificate.valid = level.certificate.valid && certificate.valid;
        level.certificate.min_singular = std::min(level.certificate.min_singular, certificate.min_singular);
        level.certificate.variance_ratio.insert(level.certificate.variance_ratio.end(),
                                                certificate.variance_ratio.begin(),
                                                certificate.variance_ratio.end());
        level.models.emplace_back(std::move(model));
    }
    return level;
}

/// The level with the region's deviations and 0 outside, scaled such that its variance is the region's: its
/// periodogram stands for the region's.
Image masked(const RegionalLevel& data, const LagCovariance& statistic, int region) {
    Image image(data.image.size(), data.image.planes());
    const double pixels = static_cast<double>(data.labels.size());
    const auto scale =
        static_cast<float>(std::sqrt(pixels / static_cast<double>(data.counts[static_cast<size_t>(region)])));
    for (int p = 0; p < image.planes(); ++p) {
        const auto mean = static_cast<float>(statistic.mean()[static_cast<size_t>(p)]);
        for (size_t n = 0; n < data.labels.size(); ++n)
            image.plane(p)[n] = data.labels[n] == region ? scale * (data.image.plane(p)[n] - mean) : 0.0F;
    }
    return image;
}

/// Other families: from the covariances of pairs inside the region, or, where those are not a field's, from
/// those of the region's deviations with 0 outside.
LevelModel fit_covariances(const RegionalLevel& data, int region, int regions, Offset box,
                           std::array<std::vector<LagCovariance>, 2>& statistics, const FitOptions& local,
                           const Support& support) {
    std::optional<LevelModel> last;
    for (const PairCount count : {PairCount::pairs, PairCount::pixels}) {
        auto& own = statistics[static_cast<size_t>(count)];
        if (own.empty()) own = regional_covariances(data.image, data.labels, regions, box, count);
        const LagCovariance& statistic = own[static_cast<size_t>(region)];
        AnalysedLevel analysed(masked(data, statistic, region), statistic);
        try {
            LevelModel level = fit_level(analysed, local, support).level;
            const auto& ratios = level.certificate.variance_ratio;
            const bool sound = level.certificate.valid &&
                               std::ranges::all_of(ratios, [](double r) { return r > 0.5 && r < 2.0; });
            if (sound) return level;
            last = std::move(level);
        } catch (const InputError&) {
            if (count == PairCount::pixels && !last) throw;
        }
    }
    return *std::move(last);
}

/// Of the time that a level takes.
constexpr double share_of_covariances = 0.3;

class RegionalEstimator {
  public:
    /// \param flat  which regions hardly vary: they are white noise
    RegionalEstimator(const ControlField& field, const FitOptions& local, AveragesEstimator averages,
                      const Support& support, std::vector<bool> flat)
        : regions_(field.regions),
          flat_(std::move(flat)),
          local_(&local),
          averages_(averages),
          support_(&support),
          box_(difference_box(support.offsets)) {}

    /// Models of one level, one to each region.
    [[nodiscard]] std::vector<LevelModel> fit(const RegionalLevel& data, size_t depth,
                                              std::vector<std::string>& reasons) const {
        const bool averages = family(local_->model) == Family::ma;
        std::array<std::vector<LagCovariance>, 2> statistics;
        auto& pairs = statistics[static_cast<size_t>(PairCount::pairs)];
        const bool decrement = averages && averages_ == AveragesEstimator::random_decrement;
        {
            const WorkPart share(share_of_covariances);
            pairs = regional_covariances(data.image, data.labels, regions_, decrement ? Offset{} : box_,
                                         PairCount::pairs);
        }
        std::optional<LevelModel> all;
        std::vector<LevelModel> models(static_cast<size_t>(regions_));
        std::vector<int> own;
        std::string small;
        for (int k = 0; k < regions_; ++k) {
            if (!averages && flat_[static_cast<size_t>(k)]) {
                models[static_cast<size_t>(k)] =
                    white_level(data.image.size(), pairs[static_cast<size_t>(k)], *local_, *support_);
                continue;
            }
            if (data.counts[static_cast<size_t>(k)] >= needed(data)) {
                own.push_back(k);
                continue;
            }
            if (!all) all = fit_all(data);
            models[static_cast<size_t>(k)] = *all;
            small += (small.empty() ? "" : ", ") + std::to_string(k);
        }
        if (!small.empty())
            reasons.push_back("at level " + std::to_string(depth) + " regions with fewer than " +
                              counted(needed(data), "pixel") + " have the model of all: " + small);
        const auto one = [&](int n) {
            WorkPart share((1.0 - share_of_covariances) / static_cast<double>(own.size()));
            const int k = own[static_cast<size_t>(n)];
            models[static_cast<size_t>(k)] =
                averages ? fit_averages(data, pairs[static_cast<size_t>(k)], mask_of(data.labels, k), *local_,
                                        averages_, *support_)
                         : fit_covariances(data, k, regions_, box_, statistics, *local_, *support_);
            share.done(1.0);
        };
        if (averages)
            for_each_block(static_cast<int>(own.size()), one);
        else
            for (int n = 0; n < static_cast<int>(own.size()); ++n) one(n);
        return models;
    }

  private:
    [[nodiscard]] size_t needed(const RegionalLevel& data) const {
        if (family(local_->model) == Family::ma) return fewest_pixels;
        const auto planes = static_cast<size_t>(is_2d(local_->model) ? 1 : data.image.planes());
        return 20 * support_->offsets.size() * planes;
    }
    [[nodiscard]] LevelModel fit_all(const RegionalLevel& data) const {
        const std::vector<std::uint8_t> same(data.labels.size(), 0);
        if (family(local_->model) == Family::ma) {
            const auto statistic = regional_covariances(data.image, same, 1, box_, PairCount::pairs);
            return fit_averages(data, statistic.front(), {}, *local_, averages_, *support_);
        }
        AnalysedLevel analysed(data.image);
        return fit_level(analysed, *local_, *support_).level;
    }

    int regions_;
    std::vector<bool> flat_;
    const FitOptions* local_;
    AveragesEstimator averages_;
    const Support* support_;
    Offset box_;
};

/// Levels that are asked for, or as many of three as the picture has room for.
int levels_of(Size size, const FitOptions& local, const Support& support) {
    Offset reach;
    for (const Offset s : support.offsets)
        reach = {std::max(reach.row, std::abs(s.row)), std::max(reach.column, std::abs(s.column))};
    const int wanted = local.levels > 0 ? local.levels : usual_levels;
    int fitting = 0;
    for (const Size level : pyramid_sizes(size, wanted, local.factor)) {
        const int least = local.levels > 0 || fitting == 0 ? 0 : 16;
        if (level.height <= std::max(least, 2 * reach.row) ||
            level.width <= std::max(least, 2 * reach.column))
            break;
        ++fitting;
    }
    if (fitting == 0 || (local.levels > 0 && fitting < wanted))
        throw InputError("fit " + counted(wanted, "level") + " to a picture of " + text_of(size),
                         "level " + std::to_string(fitting + 1) +
                             " is too small for a support that reaches " +
                             counted(std::max(reach.row, reach.column), "pixel"),
                         fitting == 0 ? "use a lower order or a larger picture"
                                      : "use at most " + std::to_string(fitting) + ", or a lower order");
    return fitting;
}

}  // namespace

RegionalFit fit_regions(Device& device, const Image& picture, const Image& residual,
                        const ControlField& field, const FitOptions& local, AveragesEstimator averages) {
    const Support support = support_of(local);
    const int levels = levels_of(residual.size(), local, support);
    const std::vector<std::vector<size_t>> pixels = pixels_of(field);
    std::optional<WorkPart> beginning(std::in_place, 0.05);
    const ModelledPlanes planes = modelled(picture, residual, pixels, local);
    TextureModel common;
    common.kind = local.model;
    common.size = residual.size();
    common.planes = residual.planes();
    common.space = residual.space();
    common.factor = local.factor;
    common.noise = local.noise;
    common.basis = planes.basis;
    common.mean = planes.basis.planes > 0 ? planes.basis.mean
                                          : std::vector<double>(static_cast<size_t>(common.planes), 0.0);
    common.provenance.software = "btfield " BTFIELD_VERSION;
    RegionalFit result{std::vector<TextureModel>(static_cast<size_t>(field.regions), common), {}};
    for (size_t k = 0; k < planes.marginals.size(); ++k) result.residuals[k].marginals = planes.marginals[k];

    std::vector<Image> pyramid = levels > 1 ? decompose(device, planes.planes, levels, local.factor)
                                            : std::vector<Image>{planes.planes};
    const std::vector<bool> flat = flat_regions(residual, field, deviations_of(picture));
    if (const std::string text = flat_reason(flat); family(local.model) != Family::ma && !text.empty())
        result.reasons.push_back(text);
    const RegionalEstimator estimator(field, local, averages, support, flat);
    std::vector<std::vector<double>> variances;
    int step = 1;
    double all = 0.0;
    for (const Image& level : pyramid) all += static_cast<double>(area(level.size()));
    beginning.reset();
    for (size_t l = 0; l < pyramid.size(); ++l, step *= local.factor) {
        // Covariances take time by the pixel, likelihoods the same at every level.
        WorkPart share(0.35 * (static_cast<double>(area(pyramid[l].size())) / all +
                               1.0 / static_cast<double>(pyramid.size())));
        RegionalLevel data{std::move(pyramid[l]), {}, std::vector<size_t>(pixels.size(), 0)};
        data.labels = coarse_labels(field, step);
        for (const std::uint8_t label : data.labels) ++data.counts[label];
        variances.push_back(regional_variances(data.image, data.labels, field.regions));
        std::vector<LevelModel> models = estimator.fit(data, l, result.reasons);
        for (size_t k = 0; k < models.size(); ++k) result.residuals[k].levels.push_back(std::move(models[k]));
        share.done(1.0);
    }
    balance_levels(device, planes.planes, field, variances, local.gains, result.residuals);
    return result;
}

}  // namespace btfield::detail

#include "host/compound/regional_gains.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <optional>
#include <variant>

#include "btfield/pyramid.hpp"
#include "host/analysis/lag_matrices.hpp"
#include "host/base/eigen.hpp"
#include "host/base/non_negative.hpp"
#include "host/base/work_part.hpp"
#include "host/compound/regional_covariance.hpp"
#include "host/compound/regional_fields.hpp"
#include "host/spectrum/spectral_form.hpp"

namespace btfield::detail {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using std::size_t;

constexpr std::array<std::uint64_t, 2> balance_seeds{0x5ca1ab1e, 0x0ddba11};
/// What other regions' coarse levels bring along can be more than a region has there: some of its own stays.
constexpr double largest_gain = 4.0;

/// What one level of every region becomes at full size, over some seeds.
struct GrownLevel {
    std::vector<MatrixXd> covariance;            ///< C(0) of each region
    std::vector<std::vector<double>> variances;  ///< in each level of the pyramid, [region][plane]
};

class LevelGrowth {
  public:
    LevelGrowth(Device& device, const ControlField& field, const std::vector<TextureModel>& residuals)
        : device_(&device),
          field_(&field),
          regions_(pointers(residuals)),
          factor_(residuals.front().factor),
          fields_(device.impl(), regions_, field.size),
          labels_(device.impl().upload(on_lattice(field, fields_.layout().lattice).labels)) {}

    [[nodiscard]] GrownLevel grow(size_t level, int levels, bool in_levels) {
        GrownLevel result{std::vector<MatrixXd>(regions_.size()), {}};
        const double share = 1.0 / static_cast<double>(balance_seeds.size());
        for (const std::uint64_t seed : balance_seeds) {
            const Image image = field_of(level, seed);
            const auto covariances =
                regional_covariances(image, field_->labels, field_->regions, {}, PairCount::pairs);
            for (size_t k = 0; k < covariances.size(); ++k) {
                const MatrixXd own = share * lag_zero(covariances[k]);
                MatrixXd& sum = result.covariance[k];
                sum = sum.size() == 0 ? own : MatrixXd(sum + own);
            }
            if (!in_levels) continue;
            result.variances.resize(
                static_cast<size_t>(levels),
                std::vector<double>(regions_.size() * static_cast<size_t>(image.planes()), 0.0));
            const std::vector<Image> pyramid = decompose(*device_, image, levels, factor_);
            int step = 1;
            for (size_t l = 0; l < pyramid.size(); ++l, step *= factor_) {
                const std::vector<double> own =
                    regional_variances(pyramid[l], coarse_labels(*field_, step), field_->regions);
                for (size_t n = 0; n < own.size(); ++n) result.variances[l][n] += share * own[n];
            }
        }
        return result;
    }

  private:
    static std::vector<const TextureModel*> pointers(const std::vector<TextureModel>& residuals) {
        std::vector<const TextureModel*> regions;
        regions.reserve(residuals.size());
        for (const TextureModel& residual : residuals) regions.push_back(&residual);
        return regions;
    }

    [[nodiscard]] Image field_of(size_t level, std::uint64_t seed) {
        DeviceImpl& device = device_->impl();
        const std::vector<std::array<std::uint32_t, 2>> words{
            {static_cast<std::uint32_t>(seed), static_cast<std::uint32_t>(seed >> 32)}};
        const DevicePlanes grown = fields_.grow_alone(level, labels_, device.upload(words));
        Image lattice(grown.lattice, grown.planes);
        device.read(grown.values, lattice.values().data(), lattice.values().size_bytes());
        return lattice.crop(0, 0, field_->size);
    }

    Device* device_;
    const ControlField* field_;
    std::vector<const TextureModel*> regions_;
    int factor_;
    RegionalFields fields_;
    Buffer labels_;
};

/// Squares of the gains for which what the levels add up to has these variances in the pyramid, or what comes
/// nearest to them in proportion; all 1 where a level does not vary.
/// \param first, count which numbers of a level count, together
VectorXd squared_gains(const std::vector<GrownLevel>& grown, const std::vector<std::vector<double>>& wanted,
                       size_t first, size_t count) {
    const auto levels = static_cast<Index>(grown.size());
    const auto sum = [&](const std::vector<double>& variances) {
        double result = 0.0;
        for (size_t n = first; n < first + count; ++n) result += variances[n];
        return result;
    };
    MatrixXd system(levels, levels);
    for (Index m = 0; m < levels; ++m) {
        const auto at = static_cast<size_t>(m);
        for (Index l = 0; l < levels; ++l)
            system(m, l) = sum(grown[static_cast<size_t>(l)].variances[at]) / sum(wanted[at]);
    }
    VectorXd squares = VectorXd::Ones(levels);
    if (!system.allFinite()) return squares;
    constexpr double largest = largest_gain * largest_gain;
    squares = non_negative_least_squares(system, squares).cwiseMax(1.0 / largest).cwiseMin(largest);
    return squares;
}

double kept(double value) {
    return static_cast<double>(static_cast<float>(value));
}

/// Multiplies what each plane of a level of moving averages becomes.
void scale_planes(LevelModel& level, const VectorXd& gains) {
    Index first = 0;
    for (Model& part : level.models) {
        auto& model = std::get<MaModel>(part);
        const auto d = static_cast<size_t>(model.planes);
        for (size_t n = 0; n < model.coefficients.size(); ++n)
            model.coefficients[n] =
                kept(gains[first + static_cast<Index>(n / d % d)] * model.coefficients[n]);
        first += model.planes;
    }
}

/// Gives a region's levels its proportions; C(0) of what they add up to then.
MatrixXd balance_region(TextureModel& residual, const std::vector<GrownLevel>& grown, size_t region,
                        const std::vector<std::vector<double>>& wanted) {
    const Index planes = grown.front().covariance[region].rows();
    const auto d = static_cast<size_t>(planes);
    const bool averages = family(residual.kind) == Family::ma;
    MatrixXd gains(planes, static_cast<Index>(grown.size()));  // [plane][level]
    for (Index p = 0; p < planes; ++p) {
        const size_t first = region * d + (averages ? static_cast<size_t>(p) : 0);
        gains.row(p) = squared_gains(grown, wanted, first, averages ? 1 : d).cwiseSqrt().transpose();
    }
    MatrixXd sum = MatrixXd::Zero(planes, planes);
    for (size_t l = 0; l < grown.size(); ++l) {
        const VectorXd own = gains.col(static_cast<Index>(l));
        sum += own.asDiagonal() * grown[l].covariance[region] * own.asDiagonal();
        if (averages)
            scale_planes(residual.levels[l], own);
        else
            residual.levels[l].gain = kept(own[0]);
    }
    return sum;
}

}  // namespace

std::vector<double> regional_variances(const Image& image, std::span<const std::uint8_t> labels,
                                       int regions) {
    const auto k = static_cast<size_t>(regions), d = static_cast<size_t>(image.planes());
    std::vector<double> counts(k, 0.0), result(k * d, 0.0);
    for (const std::uint8_t label : labels) counts[label] += 1.0;
    for (size_t p = 0; p < d; ++p) {
        const std::span<const float> plane = image.plane(static_cast<int>(p));
        std::vector<double> sums(k, 0.0), squares(k, 0.0);
        for (size_t n = 0; n < plane.size(); ++n) {
            const auto value = static_cast<double>(plane[n]);
            sums[labels[n]] += value;
            squares[labels[n]] += value * value;
        }
        for (size_t i = 0; i < k; ++i) {
            if (counts[i] == 0.0) continue;
            const double mean = sums[i] / counts[i];
            result[i * d + p] = squares[i] / counts[i] - mean * mean;
        }
    }
    return result;
}

std::vector<std::uint8_t> coarse_labels(const ControlField& field, int step) {
    std::vector<std::uint8_t> labels;
    for (int r = 0; r < field.size.height; r += step)
        for (int c = 0; c < field.size.width; c += step)
            labels.push_back(field.labels[static_cast<size_t>(r) * static_cast<size_t>(field.size.width) +
                                          static_cast<size_t>(c)]);
    return labels;
}

void balance_levels(Device& device, const Image& planes, const ControlField& field,
                    const std::vector<std::vector<double>>& variances, GainMode gains,
                    std::vector<TextureModel>& residuals) {
    const size_t levels = variances.size();
    const bool balanced = gains == GainMode::match && levels > 1;
    std::vector<GrownLevel> grown;
    std::optional<WorkPart> share(std::in_place, 0.17);
    {
        LevelGrowth growth(device, field, residuals);
        share.reset();
        share.emplace(0.07);
        for (size_t l = 0; l < levels; ++l) {
            WorkPart part(1.0 / static_cast<double>(levels));
            grown.push_back(growth.grow(l, static_cast<int>(levels), balanced));
            part.done(1.0);
        }
    }
    share.reset();
    share.emplace(0.01);
    const auto wanted = regional_covariances(planes, field.labels, field.regions, {}, PairCount::pairs);
    for (size_t k = 0; k < residuals.size(); ++k) {
        TextureModel& residual = residuals[k];
        MatrixXd sum = MatrixXd::Zero(planes.planes(), planes.planes());
        if (balanced)
            sum = balance_region(residual, grown, k, variances);
        else
            for (const GrownLevel& level : grown) sum += level.covariance[k];
        const MatrixXd target = lag_zero(wanted[k]);
        if (!residual.marginals.empty()) {
            const MatrixXd m = matching_matrix(sum, target);
            residual.whitening.clear();
            for (const double value : m.reshaped()) residual.whitening.push_back(kept(value));
            continue;
        }
        const double gain = std::sqrt(target.trace() / sum.trace());
        if (std::isfinite(gain))
            for (LevelModel& level : residual.levels) level.gain *= gain;
    }
}

}  // namespace btfield::detail

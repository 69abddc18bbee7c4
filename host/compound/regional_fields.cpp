#include "host/compound/regional_fields.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <utility>

#include "host/base/eigen.hpp"
#include "host/base/stop.hpp"
#include "host/base/work_part.hpp"
#include "host/spectrum/spectral_form.hpp"
#include "host/synthesis/convolution.hpp"
#include "host/synthesis/independent_planes.hpp"

namespace btfield::detail {
namespace {

using std::size_t;

int most_planes(std::span<const TextureModel* const> regions) {
    int planes = 0;
    for (const TextureModel* region : regions) planes = std::max(planes, modelled_planes(*region));
    return planes;
}

/// Lattices of the region that has most levels serve all.
SynthesisLayout layout_of(std::span<const TextureModel* const> regions, Size size) {
    const TextureModel* deepest = *std::max_element(
        regions.begin(), regions.end(),
        [](const TextureModel* a, const TextureModel* b) { return a->levels.size() < b->levels.size(); });
    return {*deepest, size, std::vector<LevelRoute>(deepest->levels.size(), LevelRoute::spectrum)};
}

/// Coefficients of the moving averages of one level, gathered on all offsets that any of them has.
class GatheredAverages {
  public:
    GatheredAverages(size_t regions, int planes, Size lattice)
        : regions_(regions), planes_(planes), lattice_(lattice) {}

    void add(size_t region, const LinearField& field, double gain) {
        // The root that single textures take of Σ, so that regions with one model are one texture.
        const Eigen::MatrixXd root = gain * symmetric_root(noise_matrix(field));
        const Eigen::Index d = field.planes;
        for (size_t s = 0; s < field.offsets.size(); ++s) {
            const Eigen::Map<const RowMajorMatrix> a(
                field.coefficients.data() + static_cast<std::ptrdiff_t>(s) * d * d, d, d);
            const Offset at{nearest_shift(field.offsets[s].row, lattice_.height),
                            nearest_shift(field.offsets[s].column, lattice_.width)};
            auto& own = sums_.try_emplace(at, regions_ * square(), 0.0F).first->second;
            const RowMajorMatrix product = a * root;
            for (Eigen::Index i = 0; i < d; ++i)
                for (Eigen::Index j = 0; j < d; ++j)
                    own[region * square() + static_cast<size_t>(i) * static_cast<size_t>(planes_) +
                        static_cast<size_t>(j)] += static_cast<float>(product(i, j));
        }
    }
    [[nodiscard]] bool empty() const { return sums_.empty(); }
    [[nodiscard]] std::vector<float> coefficients() const {
        std::vector<float> result;
        for (size_t region = 0; region < regions_; ++region)
            for (const auto& [offset, values] : sums_) {
                const auto own = values.begin() + static_cast<std::ptrdiff_t>(region * square());
                result.insert(result.end(), own, own + static_cast<std::ptrdiff_t>(square()));
            }
        return result;
    }
    [[nodiscard]] std::vector<std::array<int, 2>> offsets() const {
        std::vector<std::array<int, 2>> result;
        for (const auto& [offset, values] : sums_) result.push_back({offset.row, offset.column});
        return result;
    }

  private:
    [[nodiscard]] size_t square() const {
        return static_cast<size_t>(planes_) * static_cast<size_t>(planes_);
    }
    size_t regions_;
    int planes_;
    Size lattice_;
    std::map<Offset, std::vector<float>> sums_;  ///< [region][i][j] per offset
};

Range range_of(const DeviceImpl& device, Size lattice) {
    const auto lanes = static_cast<size_t>(device.vector_width());
    return {(static_cast<size_t>(lattice.width) + lanes - 1) / lanes, static_cast<size_t>(lattice.height), 1};
}

/// Whoever may want no more of it does not wait for all regions of a large picture.
void let_stop(DeviceImpl& device) {
    if (StopScope::current() == nullptr) return;
    device.finish();
    stop_if_asked();
}

}  // namespace

RegionalFields::RegionalFields(DeviceImpl& device, std::span<const TextureModel* const> regions, Size size)
    : device_(&device),
      planes_(most_planes(regions)),
      factor_(regions.front()->factor),
      layout_(layout_of(regions, size)),
      stages_(device, factor_) {
    for (size_t k = 0; k < layout_.sizes.size(); ++k) {
        const double share = static_cast<double>(regions.size() * layout_.sizes.size());
        WorkPart part(1.0 / static_cast<double>(layout_.sizes.size()));
        add_level(regions, k, device.memory_limit() / (4.0 * share));
    }
}

void RegionalFields::add_level(std::span<const TextureModel* const> regions, size_t k, double budget) {
    const Size t = layout_.transforms[k];
    Level level;
    GatheredAverages averages(regions.size(), planes_, t);
    for (size_t region = 0; region < regions.size(); ++region) {
        work_done(static_cast<double>(region) / static_cast<double>(regions.size()));
        const TextureModel& model = *regions[region];
        if (k >= model.levels.size()) continue;
        const LevelModel& own = model.levels[k];
        if (family(model.kind) == Family::ma) {
            averages.add(region, joined_planes(own.models), own.gain);
            continue;
        }
        const double variance = 1.0 / (2.0 * static_cast<double>(area(t)));
        const int planes = modelled_planes(model);
        level.spectral.push_back(
            {static_cast<int>(region), planes,
             SpectralFactors(*device_, std::vector<SpectralForm>(own.models.begin(), own.models.end()), t,
                             own.gain * std::sqrt(variance),
                             std::vector<double>(static_cast<size_t>(planes), 0.0), budget)});
        level.spectral.back().factors.store(*device_);
        let_stop(*device_);
        static_cast<void>(device_->ffts().plan(*device_, t, device_->options().fft));
    }
    if (averages.empty()) averages.add(0, {{NeighbourhoodKind::custom, {{}}, {}}, 1, {0.0}, {1.0}}, 0.0);
    const std::vector<std::array<int, 2>> offsets = averages.offsets();
    for (const auto& [row, column] : offsets) level.reach = std::max(level.reach, std::abs(column));
    level.offsets_count = static_cast<int>(offsets.size());
    level.offsets = device_->upload(offsets);
    level.coefficients = device_->upload(averages.coefficients());
    levels_.push_back(std::move(level));
}

DevicePlanes RegionalFields::grow(const Buffer& labels, const Buffer& keys) {
    DevicePlanes sum;
    for (size_t k = levels_.size(); k-- > 0;) {
        DevicePlanes level = grow_level(k, labels, keys);
        sum = sum.values ? stages_.add_expanded(std::move(level), sum, 1.0F) : std::move(level);
    }
    return sum;
}

DevicePlanes RegionalFields::grow_alone(size_t level, const Buffer& labels, const Buffer& keys) {
    DevicePlanes sum = grow_level(level, labels, keys);
    for (size_t k = level; k-- > 0;) {
        const Size t = layout_.transforms[k];
        const size_t bytes = sizeof(float) * static_cast<size_t>(planes_) * area(t);
        DevicePlanes nothing{device_->buffer(bytes), layout_.sizes[k], t, planes_};
        device_->fill(nothing.values, [&](std::byte* to) { std::fill_n(to, bytes, std::byte{0}); });
        sum = stages_.add_expanded(std::move(nothing), sum, 1.0F);
    }
    return sum;
}

DevicePlanes RegionalFields::grow_level(size_t k, const Buffer& labels, const Buffer& keys) {
    const Level& level = levels_[k];
    const Size t = layout_.transforms[k], fine = layout_.sizes.front();
    const size_t bytes = sizeof(float) * static_cast<size_t>(planes_) * area(t);
    int step = 1;
    for (size_t l = 0; l < k; ++l) step *= factor_;
    DevicePlanes result{device_->buffer(bytes), layout_.sizes[k], t, planes_};
    {
        const Buffer noise = device_->buffer(bytes);
        draw_normal_field(*device_, noise, keys, t, planes_, 1, static_cast<int>(k));
        BuildParameters parameters = device_->lanes();
        parameters.set("BTFIELD_PLANES", planes_);
        device_->launch(device_->kernel("regional_fields", "convolve_regions", parameters),
                        range_of(*device_, t), Grain::fine, noise, result.values, labels, level.coefficients,
                        level.offsets, level.offsets_count, t.height, t.width, fine.height, fine.width, step,
                        level.reach);
    }
    for (const SpectralRegion& own : level.spectral) {
        add_spectral(own, k, labels, keys, result.values);
        let_stop(*device_);
    }
    return result;
}

void RegionalFields::add_spectral(const SpectralRegion& own, size_t k, const Buffer& labels,
                                  const Buffer& keys, const Buffer& sum) {
    const Size t = layout_.transforms[k], fine = layout_.sizes.front();
    int step = 1;
    for (size_t l = 0; l < k; ++l) step *= factor_;
    const size_t half = sizeof(float) * spectrum_floats(t, own.planes);
    Spectrum spectrum{device_->buffer(half), device_->buffer(half)};
    own.factors.draw(*device_, spectrum, keys, 1, static_cast<int>(k));
    Buffer image = device_->buffer(sizeof(float) * static_cast<size_t>(own.planes) * area(t));
    device_->ffts().plan(*device_, t, device_->options().fft).inverse(*device_, spectrum, image, own.planes);
    BuildParameters parameters = device_->lanes();
    parameters.set("BTFIELD_PLANES", planes_);
    device_->launch(device_->kernel("regional_fields", "take_region", parameters), range_of(*device_, t),
                    Grain::fine, image, sum, labels, own.region, own.planes, t.height, t.width, fine.height,
                    fine.width, step);
}

}  // namespace btfield::detail

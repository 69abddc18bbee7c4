#include "host/compound/region_restorer.hpp"

#include <algorithm>
#include <array>
#include <string>
#include <utility>

#include "btfield/error.hpp"
#include "host/analysis/plane_kinds.hpp"

namespace btfield::detail {
namespace {

using std::size_t;

/// Times that pixels change places across borders: they get two or three pixels far.
constexpr std::uint32_t swap_rounds = 2;

void append(std::vector<float>& numbers, const std::vector<double>& values) {
    for (const double value : values) numbers.push_back(static_cast<float>(value));
}

/// r × c, of which the first rows and columns are given; without any, the identity.
std::vector<double> padded(const std::vector<double>& matrix, size_t given, int rows, int columns) {
    const auto r = static_cast<size_t>(rows), c = static_cast<size_t>(columns);
    std::vector<double> result(r * c, 0.0);
    if (matrix.empty()) {
        for (size_t i = 0; i < std::min(r, c); ++i) result[i * c + i] = 1.0;
        return result;
    }
    for (size_t e = 0; e < matrix.size(); ++e) result[e / given * c + e % given] = matrix[e];
    return result;
}

/// The kernel has one number of knots to a region.
void check_knots(const TextureModel& residual, size_t region) {
    for (const Marginal& marginal : residual.marginals) {
        const size_t first = residual.marginals.front().values.size(), own = marginal.values.size();
        if (own == first) continue;
        throw InputError(
            "restore region " + std::to_string(region),
            "one marginal has " + std::to_string(first) + " knots, another " + std::to_string(own),
            "give all the same number");
    }
}

}  // namespace

RegionRestorer::RegionRestorer(DeviceImpl& device, const CompoundModel& model)
    : device_(&device), borders_(model.borders), planes_(model.planes), rank_(0), knot_stride_(1) {
    for (const CompoundRegion& region : model.regions) {
        rank_ = std::max(rank_, modelled_planes(region.residual));
        for (const Marginal& marginal : region.residual.marginals)
            knot_stride_ = std::max(knot_stride_, static_cast<int>(marginal.values.size()));
    }
    std::vector<float> numbers;
    const size_t table = 2 * static_cast<size_t>(knot_stride_);
    std::vector<float> tables(model.regions.size() * static_cast<size_t>(rank_) * table, 0.0F);
    for (size_t k = 0; k < model.regions.size(); ++k) {
        const CompoundRegion& region = model.regions[k];
        const TextureModel& residual = region.residual;
        check_knots(residual, k);
        const bool mapped = !residual.marginals.empty();
        append(numbers, {region.contrast, region.structure,
                         mapped ? static_cast<double>(residual.marginals.front().values.size()) : 0.0});
        append(numbers, region.colour);
        append(numbers, residual.mean);
        const auto own = static_cast<size_t>(modelled_planes(residual));
        append(numbers, padded(residual.whitening, own, rank_, rank_));
        append(numbers, padded(scaled_matrix(residual.basis), static_cast<size_t>(planes_), rank_, planes_));
        for (size_t i = 0; i < residual.marginals.size(); ++i) {
            const std::vector<double>& q = residual.marginals[i].values;
            float* to = tables.data() + (k * static_cast<size_t>(rank_) + i) * table;
            for (size_t n = 0; n < q.size(); ++n) {
                to[2 * n] = static_cast<float>(q[n]);
                to[2 * n + 1] = n + 1 < q.size() ? static_cast<float>(q[n + 1] - q[n]) : 0.0F;
            }
        }
    }
    numbers_ = device.upload(numbers);
    tables_ = device.upload(tables);
}

DevicePlanes RegionRestorer::restore(const DevicePlanes& planes, DevicePlanes mean, const Buffer& labels,
                                     std::uint64_t seed) const {
    const auto lanes = static_cast<size_t>(device_->vector_width());
    BuildParameters parameters = device_->lanes();
    parameters.set("BTFIELD_PLANES", planes_).set("BTFIELD_RANK", rank_);
    const Size size = mean.size;
    device_->launch(
        device_->kernel("region_restorer", "restore_regions", parameters),
        {(static_cast<size_t>(size.width) + lanes - 1) / lanes, static_cast<size_t>(size.height), 1},
        Grain::fine, planes.values, mean.values, labels, numbers_, tables_, knot_stride_,
        static_cast<float>(marginal_reach), size.height, size.width, planes.lattice.height,
        planes.lattice.width);
    return borders_ == Borders::swap ? treat_borders(std::move(mean), labels, seed) : std::move(mean);
}

DevicePlanes RegionRestorer::treat_borders(DevicePlanes planes, const Buffer& labels,
                                           std::uint64_t seed) const {
    BuildParameters parameters = device_->lanes();
    parameters.set("BTFIELD_PLANES", planes_).set("BTFIELD_RANK", rank_);
    const std::array<std::uint32_t, 2> words{static_cast<std::uint32_t>(seed),
                                             static_cast<std::uint32_t>(seed >> 32)};
    const Size size = planes.size;
    std::uint32_t turn = 0;
    for (std::uint32_t round = 0; round < swap_rounds; ++round)
        for (const int parity : {0, 1})
            for (const int across : {1, 0}) {
                const auto side = static_cast<size_t>(across == 1 ? size.width : size.height);
                const auto other = static_cast<size_t>(across == 1 ? size.height : size.width);
                device_->launch(device_->kernel("region_restorer", "swap_pixels", parameters),
                                {(side + 1) / 2, other, 1}, Grain::fine, planes.values, labels, words, turn++,
                                across, parity, size.height, size.width);
            }
    DevicePlanes smooth{device_->buffer(sizeof(float) * static_cast<size_t>(planes_) * area(size)), size,
                        size, planes_};
    device_->launch(device_->kernel("region_restorer", "smooth_borders", parameters),
                    {static_cast<size_t>(size.width), static_cast<size_t>(size.height), 1}, Grain::fine,
                    planes.values, smooth.values, labels, size.height, size.width);
    return smooth;
}

}  // namespace btfield::detail

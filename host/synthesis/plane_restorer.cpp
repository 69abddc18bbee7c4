#include "host/synthesis/plane_restorer.hpp"

#include <string>
#include <utility>
#include <vector>

#include "btfield/error.hpp"
#include "host/analysis/plane_kinds.hpp"
#include "host/base/text.hpp"

namespace btfield::detail {

PlaneRestorer::PlaneRestorer(DeviceImpl& device, const SpectralBasis& basis,
                             std::span<const Marginal> marginals, std::span<const double> whitening)
    : device_(&device), planes_(basis.planes), rank_(basis.rank) {
    check(basis);
    const std::string asked = "restore " + counted(rank_, "eigenplane");
    std::vector<float> tables;
    if (!marginals.empty()) {
        if (marginals.size() != static_cast<std::size_t>(rank_))
            throw InputError(asked, "there are " + counted(marginals.size(), "marginal"), "give one to each");
        const std::vector<double>& first = marginals.front().values;
        for (const Marginal& marginal : marginals) {
            check(marginal);
            const std::vector<double>& q = marginal.values;
            if (q.size() != first.size())
                throw InputError(asked,
                                 "one marginal has " + counted(first.size(), "knot") + ", another " +
                                     std::to_string(q.size()),
                                 "give all the same number");
            for (std::size_t k = 0; k < q.size(); ++k) {
                tables.push_back(static_cast<float>(q[k]));
                tables.push_back(k + 1 < q.size() ? static_cast<float>(q[k + 1] - q[k]) : 0.0F);
            }
        }
        knots_ = static_cast<int>(first.size());
    } else {
        tables.push_back(0.0F);  // a buffer cannot be empty
    }
    tables_ = device.upload(tables);
    std::vector<float> numbers;
    for (const double t : scaled_matrix(basis)) numbers.push_back(static_cast<float>(t));
    for (const double m : basis.mean) numbers.push_back(static_cast<float>(m));
    const auto r = static_cast<std::size_t>(rank_);
    if (!whitening.empty() && whitening.size() != r * r)
        throw InputError(asked, "the whitening has " + counted(whitening.size(), "number"),
                         "give " + std::to_string(r * r));
    for (std::size_t e = 0; e < r * r; ++e) {
        const double identity = e % (r + 1) == 0 ? 1.0 : 0.0;
        numbers.push_back(static_cast<float>(whitening.empty() ? identity : whitening[e]));
    }
    basis_ = device.upload(numbers);
}

std::size_t PlaneRestorer::scratch_bytes(Size lattice, int textures) const {
    if (rank_ == planes_) return 0;
    return sizeof(float) * static_cast<std::size_t>(textures) * static_cast<std::size_t>(planes_) *
           area(lattice);
}

DevicePlanes PlaneRestorer::restore(DevicePlanes eigenplanes) {
    const int textures = eigenplanes.planes / rank_;
    Buffer own;
    if (rank_ != planes_) own = device_->buffer(scratch_bytes(eigenplanes.lattice, textures));
    restore(eigenplanes, own ? own : eigenplanes.values, 0, textures);
    return {own ? std::move(own) : std::move(eigenplanes.values), eigenplanes.size, eigenplanes.lattice,
            textures * planes_};
}

void PlaneRestorer::restore(const DevicePlanes& eigenplanes, int texture, const Buffer& target) {
    restore(eigenplanes, target, texture, 1);
}

void PlaneRestorer::restore(const DevicePlanes& eigenplanes, const Buffer& target, int first, int textures) {
    const std::size_t pixels = area(eigenplanes.lattice);
    const auto lanes = static_cast<std::size_t>(device_->vector_width());
    BuildParameters parameters = device_->lanes();
    parameters.set("BTFIELD_PLANES", planes_).set("BTFIELD_RANK", rank_).set("BTFIELD_KNOTS", knots_);
    const double scale = (knots_ - 1) / (2.0 * marginal_reach);
    const double values = static_cast<double>(pixels) * textures, r = rank_, d = planes_;
    // Places among the knots: where there are 16 lanes, all steps in full.
    const double mapping = knots_ == 0 ? 0.0 : 2.0 * r + (lanes == 16 ? 5.0 * (knots_ - 1) : 8.0);
    const LaunchWork work{.bytes = sizeof(float) * values * (r + d),
                          .operations = values * r * (mapping + 2.0 * d)};
    device_->launch(device_->kernel("plane_restorer", "restore_planes", parameters),
                    {(pixels + lanes - 1) / lanes, static_cast<std::size_t>(textures)}, Grain::fine, work,
                    eigenplanes.values, target, tables_, static_cast<float>(scale), basis_,
                    static_cast<int>(pixels), first);
}

}  // namespace btfield::detail

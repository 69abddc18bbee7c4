#pragma once

// What lies between the entries of a lattice of directions, as a page in a browser has it (theory 23.2).

#include <cmath>
#include <vector>

#include "host/rendering/direction_lattice.hpp"

namespace btfield::reference {

/// Linear along all four axes, of the logarithm of the mean.
inline detail::PictureWeights between(const detail::DirectionLattice& lattice, const BtfDirection& view,
                                      const BtfDirection& light) {
    const auto v = lattice.views.place(view), l = lattice.lights.place(light);
    const auto weight = [](double at, int node) { return std::max(0.0, 1.0 - std::abs(at - node)); };
    detail::PictureWeights sum = lattice.entries.front();
    for (auto* part : {&sum.mean, &sum.offsets, &sum.weights}) std::ranges::fill(*part, 0.0);
    const int views = lattice.views.side, lights = lattice.lights.side;
    for (int a = 0; a < lattice.views.count(); ++a)
        for (int b = 0; b < lattice.lights.count(); ++b) {
            const double share = weight(v[0], a % views) * weight(v[1], a / views) *
                                 weight(l[0], b % lights) * weight(l[1], b / lights);
            if (share == 0.0) continue;
            const auto& entry = lattice.entries[static_cast<std::size_t>(a * lattice.lights.count() + b)];
            for (std::size_t i = 0; i < sum.mean.size(); ++i) {
                sum.mean[i] += share * std::log(entry.mean[i]);
                sum.offsets[i] += share * entry.offsets[i];
            }
            for (std::size_t i = 0; i < sum.weights.size(); ++i) sum.weights[i] += share * entry.weights[i];
        }
    for (double& mean : sum.mean) mean = std::exp(mean);
    return sum;
}

}  // namespace btfield::reference

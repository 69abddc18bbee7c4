#include "host/rendering/direction_lattice.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "host/base/parallel.hpp"
#include "host/rendering/lit_table.hpp"

namespace btfield::detail {
namespace {

constexpr double quarter = 0.25 * std::numbers::pi;

}  // namespace

BtfDirection DirectionSquare::at(int index) const {
    const int column = index % side, row = index / side;
    const double half = 0.5 * (side - 1), x = column / half - 1.0, y = row / half - 1.0;
    const double out = std::max(std::abs(x), std::abs(y));
    if (out == 0.0) return {};
    const double phi = std::abs(x) >= std::abs(y) ? quarter * y / x + (x < 0.0 ? 4.0 * quarter : 0.0)
                                                  : quarter * (2.0 - x / y) + (y < 0.0 ? 4.0 * quarter : 0.0);
    return {out * steepest, phi};
}

std::array<double, 2> DirectionSquare::place(const BtfDirection& direction) const {
    const double half = 0.5 * (side - 1), step = steepest / half;
    double out = steepest > 0.0 ? half * std::min(direction.theta / steepest, 1.0) : 0.0;
    if (tangents && out < half) {
        const double ring = std::floor(out), below = std::tan(ring * step),
                     above = std::tan((ring + 1.0) * step);
        out = ring + (std::tan(direction.theta) - below) / (above - below);
    }
    // An eighth of a turn before phi, in quarters: 0 right, 1 up, 2 left, 3 down.
    const double turn = direction.phi / (2.0 * std::numbers::pi) + 0.125,
                 eighths = 8.0 * (turn - std::floor(turn));
    const int sector = std::min(static_cast<int>(eighths / 2.0), 3);
    const double along = (eighths - 2.0 * sector - 1.0) * out;  // from −out to out, with phi
    const double x = sector == 0 ? out : sector == 1 ? -along : sector == 2 ? -out : along;
    const double y = sector == 0 ? along : sector == 1 ? out : sector == 2 ? -along : -out;
    return {half + x, half + y};
}

DirectionLattice direction_lattice(const DirectionTable& table, int side, std::size_t planes,
                                   const std::function<void(double)>& progress) {
    DirectionLattice lattice{
        {side, table.measured().steepest_view(), false}, {side, table.measured().steepest_light(), true}, {}};
    const int count = lattice.views.count();
    lattice.entries.resize(static_cast<std::size_t>(count) * static_cast<std::size_t>(count));
    for (int v = 0; v < count; ++v) {
        const std::size_t first = static_cast<std::size_t>(v) * static_cast<std::size_t>(count);
        for_each_block(count, [&](int l) {
            lattice.entries[first + static_cast<std::size_t>(l)] =
                first_planes(lit_weights(table, lattice.views.at(v), lattice.lights.at(l)), planes);
        });
        if (progress) progress((v + 1.0) / count);
    }
    return lattice;
}

}  // namespace btfield::detail

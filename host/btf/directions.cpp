#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <numbers>
#include <vector>

#include "btfield/btf_set.hpp"
#include "host/btf/direction_grid.hpp"

namespace btfield {

using namespace detail;

std::array<double, 3> BtfDirection::vector() const {
    return {std::sin(theta) * std::cos(phi), std::sin(theta) * std::sin(phi), std::cos(theta)};
}

double angle_between(const BtfDirection& a, const BtfDirection& b) {
    const auto u = a.vector(), v = b.vector();
    // Exact for small angles, where the arc cosine is not.
    const double apart = std::hypot(u[0] - v[0], u[1] - v[1], u[2] - v[2]);
    return 2.0 * std::asin(std::min(1.0, apart / 2.0));
}

namespace {

struct Ring {
    double theta;  ///< degrees
    int count;
    double first;  ///< phi of its first direction, degrees
};

std::vector<BtfDirection> rings(std::initializer_list<Ring> all) {
    std::vector<BtfDirection> directions;
    for (const Ring& ring : all)
        for (int k = 0; k < ring.count; ++k)
            directions.push_back({radians(ring.theta), radians(ring.first + 360.0 * k / ring.count)});
    return directions;
}

}  // namespace

std::vector<BtfDirection> btf_directions_81() {
    return rings({{0, 1, 0}, {15, 6, 0}, {30, 12, 0}, {45, 18, 0}, {60, 20, 0}, {75, 24, 0}});
}

std::vector<BtfDirection> btf_directions_151() {
    return rings({{0, 1, 0},
                  {11, 6, 15},
                  {23.5, 12, 0},
                  {30, 12, 15},
                  {37.5, 12, 0},
                  {45, 18, 0},
                  {52.5, 18, 7.5},
                  {60, 24, 0},
                  {67.5, 24, 7.5},
                  {75, 24, 0}});
}

}  // namespace btfield

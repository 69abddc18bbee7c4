#include "bench/peers/plane_restorer.hpp"

#include <algorithm>
#include <array>

#include "bench/peers/parallel.hpp"

namespace btfield::peer {
namespace {

float mapped(float x, const float* table, int knots) {
    const float last = static_cast<float>(knots - 1);
    const float u = std::min(std::max(x * last / 7.0F + 0.5F * last, 0.0F), last);
    const int k = std::min(static_cast<int>(u), knots - 2);
    return table[2 * k] + (u - static_cast<float>(k)) * table[2 * k + 1];
}

}  // namespace

void restore(Image& planes, const std::vector<float>& tables, int knots, const std::vector<float>& basis,
             const std::vector<float>& mean) {
    const auto pixels = static_cast<int>(area(planes.size()));
    const std::array<float*, 3> at{planes.plane(0).data(), planes.plane(1).data(), planes.plane(2).data()};
    const float* t = basis.data();
    const std::array<const float*, 3> table{tables.data(), tables.data() + 2 * knots,
                                            tables.data() + 4 * knots};
    parallel([&](int thread) {
        for (int p = share(pixels, thread); p < share(pixels, thread + 1); ++p) {
            const float a = mapped(at[0][p], table[0], knots);
            const float b = mapped(at[1][p], table[1], knots);
            const float c = mapped(at[2][p], table[2], knots);
            at[0][p] = mean[0] + t[0] * a + t[3] * b + t[6] * c;
            at[1][p] = mean[1] + t[1] * a + t[4] * b + t[7] * c;
            at[2][p] = mean[2] + t[2] * a + t[5] * b + t[8] * c;
        }
    });
}

}  // namespace btfield::peer

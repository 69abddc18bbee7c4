#pragma once

// Moving average on the torus in float64: y_i(r) = Σ_s Σ_j a_{s,i,j} e_j(r ⊖ s), e = L n (P4 eq. 16).

#include <Eigen/Core>
#include <span>
#include <vector>

#include "btfield/models.hpp"

namespace btfield::reference {

/// \param noise n, [plane][row][column]
inline std::vector<double> moving_average(const LinearField& field, const Eigen::MatrixXd& root, Size size,
                                          std::span<const float> noise) {
    const int d = field.planes;
    const auto at = [&](int plane, int r, int c) {
        const auto turn = [](int value, int side) { return (value % side + side) % side; };
        return (static_cast<std::size_t>(plane) * static_cast<std::size_t>(size.height) +
                static_cast<std::size_t>(turn(r, size.height))) *
                   static_cast<std::size_t>(size.width) +
               static_cast<std::size_t>(turn(c, size.width));
    };
    std::vector<double> e(noise.size(), 0.0), y(noise.size(), 0.0);
    for (int r = 0; r < size.height; ++r)
        for (int c = 0; c < size.width; ++c)
            for (int i = 0; i < d; ++i)
                for (int j = 0; j < d; ++j)
                    e[at(i, r, c)] += root(i, j) * static_cast<double>(noise[at(j, r, c)]);
    for (int r = 0; r < size.height; ++r)
        for (int c = 0; c < size.width; ++c)
            for (std::size_t s = 0; s < field.offsets.size(); ++s)
                for (int i = 0; i < d; ++i)
                    for (int j = 0; j < d; ++j)
                        y[at(i, r, c)] += field.coefficients[(s * static_cast<std::size_t>(d) +
                                                              static_cast<std::size_t>(i)) *
                                                                 static_cast<std::size_t>(d) +
                                                             static_cast<std::size_t>(j)] *
                                          e[at(j, r - field.offsets[s].row, c - field.offsets[s].column)];
    return y;
}

}  // namespace btfield::reference

#pragma once

// Raster recursion in float64, pixel after pixel: y(r) = Σ_s A_s y(r + s) + L n(r), 0 beyond the domain (P4
// eq. 10).

#include <Eigen/Core>
#include <span>
#include <vector>

#include "btfield/models.hpp"

namespace btfield::reference {

/// \param noise n, [plane][row][column]
inline std::vector<double> causal_recursion(const LinearField& field, const Eigen::MatrixXd& root, Size size,
                                            std::span<const float> noise) {
    const int d = field.planes;
    const auto at = [&](int plane, int r, int c) {
        return (static_cast<std::size_t>(plane) * static_cast<std::size_t>(size.height) +
                static_cast<std::size_t>(r)) *
                   static_cast<std::size_t>(size.width) +
               static_cast<std::size_t>(c);
    };
    std::vector<double> y(noise.size(), 0.0);
    for (int r = 0; r < size.height; ++r)
        for (int c = 0; c < size.width; ++c)
            for (int i = 0; i < d; ++i) {
                double sum = 0.0;
                for (int j = 0; j < d; ++j) sum += root(i, j) * static_cast<double>(noise[at(j, r, c)]);
                for (std::size_t s = 0; s < field.offsets.size(); ++s) {
                    const int row = r + field.offsets[s].row, column = c + field.offsets[s].column;
                    if (row < 0 || column < 0 || column >= size.width) continue;
                    for (int j = 0; j < d; ++j)
                        sum += field.coefficients[(s * static_cast<std::size_t>(d) +
                                                   static_cast<std::size_t>(i)) *
                                                      static_cast<std::size_t>(d) +
                                                  static_cast<std::size_t>(j)] *
                               y[at(j, row, column)];
                }
                y[at(i, r, c)] = sum;
            }
    return y;
}

}  // namespace btfield::reference

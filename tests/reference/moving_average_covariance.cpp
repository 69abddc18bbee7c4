#include "tests/reference/moving_average_covariance.hpp"

#include <Eigen/Core>

namespace btfield::reference {

LagCovariance moving_average_covariance(const LinearField& field, Size lattice, Offset box) {
    const int d = field.planes;
    using Rows = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
    const auto block = [&](std::size_t s) {
        return Eigen::Map<const Rows>(field.coefficients.data() + static_cast<std::ptrdiff_t>(s) * d * d, d,
                                      d);
    };
    const Eigen::Map<const Rows> noise(field.noise_covariance.data(), d, d);
    LagCovariance result(d, lattice, box);
    for (std::size_t s = 0; s < field.offsets.size(); ++s) {
        const Eigen::MatrixXd coloured = block(s) * noise;
        for (std::size_t t = 0; t < field.offsets.size(); ++t) {
            const Offset u = field.offsets[t] - field.offsets[s];
            if (!result.contains(u) || u < Offset{}) continue;
            const Eigen::MatrixXd product = coloured * block(t).transpose();
            for (int i = 0; i < d; ++i) {
                // At u = 0 an entry and its mirror are one place.
                for (int j = u == Offset{} ? i : 0; j < d; ++j)
                    result.set(i, j, u, result(i, j, u) + product(i, j));
            }
        }
    }
    return result;
}

}  // namespace btfield::reference

#include "bench/peers/spectral_root.hpp"

#include <Eigen/Core>
#include <Eigen/Eigenvalues>
#include <stdexcept>

#include "bench/peers/parallel.hpp"

namespace btfield::peer {
namespace {

template <int d>
void run(const std::vector<std::complex<float>>& matrices, const std::vector<float>& root,
         std::vector<std::complex<float>>& factors) {
    // Eigen has no row-major column vectors; for one plane the order is the same.
    constexpr int order = d == 1 ? Eigen::ColMajor : Eigen::RowMajor;
    using Matrix = Eigen::Matrix<std::complex<float>, d, d, order>;
    const Matrix left =
        Eigen::Map<const Eigen::Matrix<float, d, d, order>>(root.data()).template cast<std::complex<float>>();
    const int count = static_cast<int>(matrices.size()) / (d * d);
    parallel([&](int t) {
        Eigen::SelfAdjointEigenSolver<Matrix> solver;
        for (int n = share(count, t); n < share(count, t + 1); ++n) {
            const auto at = static_cast<std::ptrdiff_t>(n) * d * d;
            solver.compute(Eigen::Map<const Matrix>(matrices.data() + at));
            Eigen::Map<Matrix>(factors.data() + at) = left * solver.operatorInverseSqrt();
        }
    });
}

}  // namespace

void mmrf_factors(int planes, const std::vector<std::complex<float>>& matrices,
                  const std::vector<float>& root, std::vector<std::complex<float>>& factors) {
    switch (planes) {
        case 1:
            return run<1>(matrices, root, factors);
        case 3:
            return run<3>(matrices, root, factors);
        case 6:
            return run<6>(matrices, root, factors);
        default:
            throw std::invalid_argument("no peer for that many planes");
    }
}

}  // namespace btfield::peer

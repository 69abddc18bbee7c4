// Eigen's templates have the same names here as inside the library, but another layout in memory where the
// processor has wider registers: each must use its own.
#include <Eigen/Dense>
#include <btfield/error.hpp>
#include <btfield/fit.hpp>
#include <cstdio>
#include <random>

// Whole, so that none of it is inlined away.
template class Eigen::PartialPivLU<Eigen::MatrixXcd>;
template Eigen::PartialPivLU<Eigen::MatrixXcd>::PartialPivLU(const Eigen::EigenBase<Eigen::MatrixXcd>&);
template class Eigen::LLT<Eigen::MatrixXd>;
template class Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>;

namespace {

template <class Matrix>
double own_factors(int size) {
    const Matrix matrix = Matrix::Random(size, size) + size * Matrix::Identity(size, size);
    const Matrix square = matrix * matrix.adjoint();
    return std::abs(Eigen::PartialPivLU<Matrix>(matrix).determinant()) +
           Eigen::LLT<Matrix>(square).matrixLLT().norm() + Eigen::LDLT<Matrix>(square).vectorD().norm() +
           Eigen::SelfAdjointEigenSolver<Matrix>(square).eigenvalues().norm();
}

}  // namespace

int main() {
    // Four planes and more are inverted by Eigen inside.
    btfield::Image image({48, 40}, 4);
    std::mt19937 engine(1);
    std::normal_distribution<float> normal;
    for (float& value : image.values()) value = normal(engine);
    try {
        btfield::Device device;
        btfield::Analysis analysis(device, image);
        double sum = own_factors<Eigen::MatrixXd>(7) + own_factors<Eigen::MatrixXcd>(7);
        for (const btfield::ModelKind kind : btfield::model_kinds()) {
            btfield::FitOptions options;
            options.model = kind;
            options.order = 1;
            options.levels = 1;
            options.marginals = btfield::MarginalMode::none;
            sum += analysis.fit(options).levels.front().certificate.min_singular;
        }
        std::printf("%.3g\n", sum);
        return sum > 0.0 ? 0 : 1;
    } catch (const btfield::Error& error) {
        std::fprintf(stderr, "%s\n", error.what());
        return 1;
    }
}

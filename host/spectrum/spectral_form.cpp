#include "host/spectrum/spectral_form.hpp"

#include <cstddef>
#include <utility>

#include "host/base/dense.hpp"

namespace btfield::detail {
namespace {

using Eigen::MatrixXd;
using std::size_t;

}  // namespace

MatrixXd noise_matrix(const LinearField& field) {
    return Eigen::Map<const RowMajorMatrix>(field.noise_covariance.data(), field.planes, field.planes);
}

MatrixXd symmetric_root(const MatrixXd& matrix) {
    const Eigen::SelfAdjointEigenSolver<MatrixXd> solver(matrix);
    const MatrixXd& vectors = solver.eigenvectors();
    return vectors * solver.eigenvalues().cwiseMax(0.0).cwiseSqrt().asDiagonal() * vectors.transpose();
}

MatrixXd inverse_symmetric_root(const MatrixXd& matrix) {
    const Eigen::SelfAdjointEigenSolver<MatrixXd> solver(matrix);
    const MatrixXd& vectors = solver.eigenvectors();
    const double lowest = 1e-12 * solver.eigenvalues().maxCoeff();
    return vectors * solver.eigenvalues().cwiseMax(lowest).cwiseSqrt().cwiseInverse().asDiagonal() *
           vectors.transpose();
}

MatrixXd matching_matrix(const MatrixXd& s, const MatrixXd& c) {
    const MatrixXd root = symmetric_root(s), inverse = inverse_symmetric_root(s);
    const MatrixXd middle = congruent(root, c);
    const MatrixXd inner = symmetric_root(0.5 * (middle + middle.transpose()));
    const MatrixXd m = congruent(inverse, inner);
    return 0.5 * (m + m.transpose());
}

LinearField change_basis(const LinearField& field, const MatrixXd& basis, const MatrixXd& inverse) {
    LinearField turned = field;
    turned.active.clear();
    const auto block = static_cast<size_t>(field.planes) * static_cast<size_t>(field.planes);
    for (size_t s = 0; s < field.offsets.size(); ++s) {
        Eigen::Map<RowMajorMatrix> a(turned.coefficients.data() + s * block, field.planes, field.planes);
        a = product(basis, a, inverse);
    }
    Eigen::Map<RowMajorMatrix> noise(turned.noise_covariance.data(), field.planes, field.planes);
    const MatrixXd product = congruent(basis, noise);
    noise = 0.5 * (product + product.transpose());
    return turned;
}

LinearField transfer_field(const MaModel& model) {
    LinearField field = model;
    field.kind = NeighbourhoodKind::custom;
    field.active.clear();
    const auto d = static_cast<size_t>(model.planes);
    for (double& a : field.coefficients) a = -a;
    bool centre = false;
    for (size_t s = 0; s < field.offsets.size(); ++s) {
        field.offsets[s] = -field.offsets[s];
        if (field.offsets[s] != Offset{}) continue;
        centre = true;
        for (size_t i = 0; i < d; ++i) field.coefficients[(s * d + i) * d + i] += 1.0;
    }
    if (!centre) {
        field.offsets.emplace_back();
        for (size_t e = 0; e < d * d; ++e) field.coefficients.push_back(e % (d + 1) == 0 ? 1.0 : 0.0);
    }
    return field;
}

SpectralForm::SpectralForm(const LinearField& field) : lambda(field) {}
SpectralForm::SpectralForm(const CarModel& model) : lambda(model) {}
SpectralForm::SpectralForm(const SarModel& model) : lambda(model) {}
SpectralForm::SpectralForm(const MaModel& model)
    : kind(Kind::moving_average), lambda(transfer_field(model)) {}
SpectralForm::SpectralForm(const MrfModel& model)
    : kind(model.form == MrfForm::mmrf ? Kind::mmrf : Kind::pmrf), lambda(model) {
    if (kind == Kind::pmrf) left = right = symmetric_root(noise_matrix(model));
}
SpectralForm::SpectralForm(const Model& model)
    : SpectralForm(std::visit([](const auto& m) { return SpectralForm(m); }, model)) {}

SpectralForm change_basis(const SpectralForm& form, const MatrixXd& basis, const MatrixXd& inverse) {
    SpectralForm turned = form;
    turned.lambda = change_basis(form.lambda, basis, inverse);
    if (form.kind == SpectralForm::Kind::pmrf) {
        turned.left = product(basis, form.left, inverse);
        turned.right = congruent(basis, form.right);
    }
    return turned;
}

}  // namespace btfield::detail

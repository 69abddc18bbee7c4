#include "btfield/certificate.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <string>

#include "btfield/error.hpp"
#include "host/analysis/lag_matrices.hpp"
#include "host/analysis/working_basis.hpp"
#include "host/base/decompositions.hpp"
#include "host/base/dense.hpp"
#include "host/spectrum/examination.hpp"
#include "host/spectrum/local_lambda.hpp"
#include "host/spectrum/positive_everywhere.hpp"
#include "host/spectrum/spectral_density.hpp"
#include "host/spectrum/torus_search.hpp"

namespace btfield {

using namespace detail;

namespace {

using Eigen::MatrixXcd;
using Eigen::MatrixXd;
using std::size_t;

constexpr int base_side = 128;
constexpr Size half_grid = {base_side / 2, base_side / 2};

double smallest_singular_value_at(const LocalLambda<Eigen::Dynamic>& lambda, double row, double column) {
    const MatrixXcd value = lambda.at(row, column);
    if (lambda.planes() == 1) return std::abs(value(0, 0));
    if (lambda.planes() <= 4) return smallest_singular_value(value);
    // Power iteration on (Λᴴ Λ)⁻¹; it approaches 1/σ_min² from below, so the result is never too small.
    const Eigen::PartialPivLU<MatrixXcd> lu(value);
    const MatrixXcd inverse = lu.inverse();
    Eigen::VectorXcd x = Eigen::VectorXcd::Ones(lambda.planes()).normalized();
    double largest = 0.0;
    for (int k = 0; k < 12; ++k) {
        const Eigen::VectorXcd y = inverse * x;
        largest = y.norm();
        x = (inverse.adjoint() * y).normalized();
    }
    return largest > 0.0 && std::isfinite(largest) ? 1.0 / largest : 0.0;
}

/// Descends from a node by looking around at ever smaller distances. In a narrow winding valley it would
/// creep on for long with little to show: it stops after a fixed number of looks.
double refine_minimum(const LocalLambda<Eigen::Dynamic>& lambda, double row, double column) {
    double lowest = smallest_singular_value_at(lambda, row, column);
    double step = std::numbers::pi / base_side;
    for (int looks = 0; looks < 160 && step > 1e-7;) {
        bool better = false;
        for (const auto& [down, right] : {std::pair{1.0, 0.0}, {-1.0, 0.0}, {0.0, 1.0}, {0.0, -1.0}}) {
            ++looks;
            const double value = smallest_singular_value_at(lambda, row + step * down, column + step * right);
            if (!(value < lowest)) continue;
            lowest = value;
            row += step * down;
            column += step * right;
            better = true;
            break;
        }
        // A smooth minimum is flat: near it smaller steps change nothing that anyone reads.
        if (!better) step *= 0.25;
    }
    return lowest;
}

double minimum_singular_value(const LinearField& field, const NodeValues& nodes) {
    struct Candidate {
        double norm;
        int row, column;
    };
    const int side = nodes.side;
    // Row −1 is row 1 mirrored, row side/2 + 1 is row side/2 − 1 mirrored.
    const auto norm_at = [&](int m, int n) {
        if (m < 0 || m > side / 2) {
            m = m < 0 ? -m : side - m;
            n = -n;
        }
        n = ((n % side) + side) % side;
        const double norm =
            nodes.inverse_norm[static_cast<size_t>(m) * static_cast<size_t>(side) + static_cast<size_t>(n)];
        return norm < std::numeric_limits<double>::infinity() ? norm : std::numeric_limits<double>::max();
    };
    std::vector<Candidate> candidates;
    for (int m = 0; m <= side / 2; ++m) {
        for (int n = 0; n < side; ++n) {
            const double here = norm_at(m, n);
            bool peak = true;
            for (int down = -1; down <= 1 && peak; ++down) {
                for (int right = -1; right <= 1; ++right) peak = peak && norm_at(m + down, n + right) <= here;
            }
            if (peak) candidates.push_back({here, m, n});
        }
    }
    constexpr size_t kept = 4;
    std::sort(candidates.begin(), candidates.end(), [](const Candidate& a, const Candidate& b) {
        return std::tuple(-a.norm, a.row, a.column) < std::tuple(-b.norm, b.row, b.column);
    });
    if (candidates.size() > kept) candidates.resize(kept);
    const LocalLambda<Eigen::Dynamic> lambda(field);
    double lowest = std::numeric_limits<double>::infinity();
    const double spacing = 2.0 * std::numbers::pi / side;
    for (const Candidate& c : candidates) {
        lowest = std::min(lowest, refine_minimum(lambda, spacing * c.row, spacing * c.column));
    }
    return lowest;
}

/// Λ in the basis in which it is Hermitian, so that its singular values are the moduli of its eigenvalues;
/// Λ itself where it is not Hermitian in any.
LinearField hermitian_form(const SpectralForm& form) {
    if (form.kind != SpectralForm::Kind::mmrf) return form.lambda;
    const MatrixXd root = symmetric_root(noise_matrix(form.lambda));
    return change_basis(form.lambda, root.inverse(), root);
}

/// Whether the eigenvalues of a Markov model's Λ are positive at frequency 0. Where det Λ has no zero they
/// then are at every frequency: they depend on it continuously.
bool is_positive_at_zero(const SpectralForm& form) {
    const LocalLambda<Eigen::Dynamic> lambda(hermitian_form(form));
    const MatrixXd value = lambda.at(0.0, 0.0).real();
    const Eigen::SelfAdjointEigenSolver<MatrixXd> solver(MatrixXd(0.5 * (value + value.transpose())),
                                                         Eigen::EigenvaluesOnly);
    return solver.eigenvalues().minCoeff() > 0.0;
}

bool is_positive_everywhere(const SpectralForm& form) {
    const LinearField field = hermitian_form(form);
    const int d = field.planes;
    HermitianPolynomial lambda{MatrixXd::Identity(d, d), {}, {}};
    for (size_t s = 0; s < field.offsets.size(); ++s) {
        if (field.offsets[s] < Offset{}) continue;
        const auto start = static_cast<std::ptrdiff_t>(s) * d * d;
        lambda.offsets.push_back(field.offsets[s]);
        lambda.terms.emplace_back(Eigen::Map<const RowMajorMatrix>(field.coefficients.data() + start, d, d));
    }
    return positive_everywhere(lambda).proven;
}

/// Means over the nodes; `nodes` gets what the search reads of each.
SpectralMeans visit_nodes(const SpectralForm& form, NodeValues& nodes) {
    nodes.side = base_side;
    const auto count = static_cast<size_t>(base_side / 2 + 1) * static_cast<size_t>(base_side);
    nodes.inverse_norm.resize(count);
    nodes.determinant.resize(count);
    return spectral_means(form, {base_side, base_side}, [&](int m, const SpectralRow& row) {
        for (int n = 0; n < base_side; ++n) {
            const auto place =
                static_cast<size_t>(m) * static_cast<size_t>(base_side) + static_cast<size_t>(n);
            nodes.inverse_norm[place] = row.inverse_norm(n);
            nodes.determinant[place] = row.determinant(n);
        }
    });
}

/// What is known of the zeros of det Λ.
struct Proof {
    TorusSearch search;
    bool positive = true;  ///< at frequency 0, where that matters
    [[nodiscard]] bool complete() const { return search.zeros == 0 && search.decided && positive; }
};

/// \param turned the form in the working basis, which nodes are of
Proof prove(const SpectralForm& form, const SpectralForm& turned, const NodeValues& nodes) {
    Proof proof;
    // A moving average is a field whatever its transfer function does: there is nothing to search.
    if (form.kind != SpectralForm::Kind::moving_average) proof.search = search_torus(turned, nodes);
    proof.positive = !form.is_markov() || is_positive_at_zero(form);
    // Cholesky factors of a Hermitian Λ bound its change more tightly than its inverse does: they decide what
    // the search leaves open where Λ is nearly singular.
    if (form.is_markov() && proof.search.zeros == 0 && !proof.search.decided && proof.positive)
        proof.search.decided = is_positive_everywhere(form);
    return proof;
}

/// Adds what the search found between the nodes, unless the nodes resolve the spectrum.
/// \param inverse takes the working basis back
/// \return side of a grid that resolves it, to about a percent
int complete_means(const SpectralForm& turned, const MatrixXd& inverse, const TorusSearch& search,
                   SpectralMeans& means) {
    const auto in_planes = [&](const MatrixXd& c) -> MatrixXd { return congruent(inverse, c); };
    const int d = turned.planes();
    int grid = d <= 4 ? 2 * base_side : base_side;
    // Sums over a grid converge geometrically once they resolve the spectrum: the error of twice the points
    // is the square of what it was. Where halving the grid shows that they do, and the search has found no
    // peak between its nodes, they are better than what the search adds.
    const MatrixXd fine = in_planes(means.covariance),
                   coarse = in_planes(spectral_means(turned, half_grid).covariance);
    const MatrixXd found = in_planes(search.covariance);
    bool resolved = true;
    for (int i = 0; i < d; ++i) {
        resolved = resolved && std::abs(fine(i, i) - coarse(i, i)) <= 1e-2 * fine(i, i) &&
                   std::abs(found(i, i)) <= 0.05 * fine(i, i);
        if (!(std::abs(found(i, i)) <= 0.01 * fine(i, i))) grid = d <= 4 ? 4 * base_side : 2 * base_side;
    }
    if (!resolved) {
        means.covariance += search.covariance;
        means.log_determinant += search.log_determinant;
    }
    return grid;
}

/// Model's variances over the data's.
std::vector<double> variance_ratios(const MatrixXd& covariance, const LagCovariance& data) {
    std::vector<double> ratios;
    ratios.reserve(static_cast<std::size_t>(data.planes()));
    for (int i = 0; i < data.planes(); ++i) ratios.push_back(covariance(i, i) / data(i, i, {}));
    return ratios;
}

}  // namespace

Examination detail::examine(const SpectralForm& form, const LagCovariance& data) {
    const int d = form.planes();
    if (d != data.planes()) {
        throw InputError("certificate of a model of " + std::to_string(d) + " planes",
                         "the data have " + std::to_string(data.planes()),
                         "use the data that it was fitted to");
    }
    // Where the planes are uncorrelated with variance one, coefficients are smallest and bounds tightest. The
    // floor keeps the basis from multiplying rounding by more than a thousand.
    const WorkingBasis white = working_basis(lag_zero(data), Turn::nearest, {.absolute = 1e-6});
    const SpectralForm turned = change_basis(form, white.forward, white.inverse);
    NodeValues nodes;
    SpectralMeans means = visit_nodes(turned, nodes);
    const Proof proof = prove(form, turned, nodes);

    Examination result;
    result.grid = d <= 4 ? 2 * base_side : base_side;
    if (proof.complete() && form.kind != SpectralForm::Kind::moving_average)
        result.grid = complete_means(turned, white.inverse, proof.search, means);
    result.log_determinant = means.log_determinant;
    Certificate& certificate = result.certificate;
    certificate.variance_ratio = variance_ratios(congruent(white.inverse, means.covariance), data);
    const bool credible = std::ranges::all_of(certificate.variance_ratio, [](double ratio) {
        return ratio > 0.0 && ratio <= largest_variance_ratio;
    });
    certificate.zeros = proof.search.zeros;
    certificate.min_singular = minimum_singular_value(hermitian_form(form), nodes);
    if (!proof.positive) certificate.min_singular = -certificate.min_singular;
    certificate.valid = proof.complete() && credible;
    return result;
}

Certificate certify(const Model& model, const LagCovariance& data) {
    return examine(model, data).certificate;
}

}  // namespace btfield

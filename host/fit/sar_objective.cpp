#include "host/fit/sar_objective.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <utility>

#include "host/base/lane_inverse.hpp"

namespace btfield::detail {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using std::size_t;

Offset sum(Offset a, Offset b) {
    return {a.row + b.row, a.column + b.column};
}

/// S = B⁻¹ B⁻ᴴ along one row of frequencies, entry (j, l) at field first + j·d + l.
void fill_density(const RowMajorMatrix& inverse, Index d, RowMajorMatrix& fields, Index first) {
    const Index count = inverse.cols();
    for (Index j = 0; j < d; ++j) {
        for (Index l = 0; l < d; ++l) {
            double* const density = fields.row(2 * (first + j * d + l)).data();
            std::fill_n(density, 2 * count, 0.0);
            for (Index k = 0; k < d; ++k) {
                add_lane_conjugate_product(inverse.row(2 * (j * d + k)).data(),
                                           inverse.row(2 * (l * d + k)).data(), density,
                                           static_cast<size_t>(count));
            }
        }
    }
}

void multiply_fields(const RowMajorMatrix& a, Index field_a, const RowMajorMatrix& b, Index field_b,
                     RowMajorMatrix& c, Index field_c) {
    set_lane_product(a.row(2 * field_a).data(), b.row(2 * field_b).data(), c.row(2 * field_c).data(),
                     static_cast<size_t>(a.cols()));
}

}  // namespace

SarObjective::SarObjective(Layout layout, MatrixXd moments)
    : layout_(std::move(layout)), moments_(std::move(moments)) {
    for (const Offset s : layout_.terms) {
        reach_.row = std::max(reach_.row, std::abs(s.row));
        reach_.column = std::max(reach_.column, std::abs(s.column));
    }
}

void SarObjective::set_grid(int side) {
    if (spectrum_ && spectrum_->side() == side) return;
    spectrum_ = std::make_unique<InverseSpectrum>(layout_.planes, layout_.terms, side);
}

VectorXd SarObjective::entries(const VectorXd& x) const {
    VectorXd b(static_cast<Index>(layout_.place.size()));
    for (size_t k = 0; k < layout_.place.size(); ++k) {
        b[static_cast<Index>(k)] = layout_.place[k] < 0 ? 0.0 : x[layout_.place[k]];
    }
    return b;
}

double SarObjective::value(const VectorXd& x) {
    constexpr double outside = std::numeric_limits<double>::infinity();
    const Index d = layout_.planes, terms = static_cast<Index>(layout_.terms.size());
    b_ = entries(x);
    const InverseSpectrum::Value at = spectrum_->evaluate(b_);
    if (!std::isfinite(at.log_determinant) || !at.variance.allFinite() || (layout_.real && !at.positive))
        return outside;
    likelihood_ = -2.0 * at.log_determinant;
    MatrixXd stacked(terms * d, d);
    for (Index s = 0; s < terms; ++s) {
        for (Index i = 0; i < d; ++i) {
            for (Index j = 0; j < d; ++j) stacked(s * d + j, i) = b_[(s * d + i) * d + j];
        }
    }
    likelihood_ += stacked.cwiseProduct(moments_ * stacked).sum();
    excess_ = (at.variance.array() - guard_.tolerated).max(0.0);
    return likelihood_ + 0.5 * guard_.strength * excess_.squaredNorm();
}

/// Which fields' moments the derivatives are made of: B⁻¹, products of two of its entries, and B⁻¹_{mi}
/// S_{jm} for every plane m whose variance is guarded.
struct SarObjective::Fields {
    bool twice;  ///< the products are among them
    Index entries, first_guard, count;
    std::vector<Index> pair_place;  ///< of the product of entries e and f, at [e · entries + f]
    std::vector<Index> guarded;     ///< planes

    Fields(Index d, bool with_products, std::vector<Index> guarded_planes)
        : twice(with_products),
          entries(d * d),
          pair_place(static_cast<size_t>(entries * entries)),
          guarded(std::move(guarded_planes)) {
        Index field = entries;
        for (Index e = 0; e < entries; ++e) {
            for (Index f = e; twice && f < entries; ++f, ++field) {
                pair_place[static_cast<size_t>(e * entries + f)] = field;
                pair_place[static_cast<size_t>(f * entries + e)] = field;
            }
        }
        first_guard = field;
        count = field + static_cast<Index>(guarded.size()) * entries;
    }

    /// \param values rows 2k and 2k + 1 for field k
    void fill(const RowMajorMatrix& inverse, Index d, RowMajorMatrix& values) const {
        values.topRows(2 * entries) = inverse;
        Index field = entries;
        for (Index e = 0; e < entries; ++e) {
            for (Index f = e; twice && f < entries; ++f, ++field)
                multiply_fields(inverse, e, inverse, f, values, field);
        }
        if (guarded.empty()) return;
        RowMajorMatrix density(2 * entries, inverse.cols());
        fill_density(inverse, d, density, 0);
        for (const Index m : guarded) {
            for (Index i = 0; i < d; ++i) {
                for (Index j = 0; j < d; ++j, ++field)
                    multiply_fields(inverse, m * d + i, density, j * d + m, values, field);
            }
        }
    }
};

SarObjective::Derivatives SarObjective::differentiate(bool twice) const {
    const Index d = layout_.planes;
    std::vector<Index> guarded;
    for (Index m = 0; m < d && guard_.strength > 0.0; ++m) {
        if (excess_[m] > 0.0) guarded.push_back(m);
    }
    const Fields fields(d, twice, std::move(guarded));
    const Offset box = twice ? Offset{2 * reach_.row, 2 * reach_.column} : reach_;
    const LagMeans means = spectrum_->moments(
        fields.count, box,
        [&](const RowMajorMatrix& inverse, RowMajorMatrix& values) { fields.fill(inverse, d, values); });
    Derivatives result;
    result.gradient = likelihood_gradient(means);
    const MatrixXd slopes = guard_slopes(fields, means);
    for (Index g = 0; g < slopes.cols(); ++g)
        result.gradient += guard_.strength * excess_[fields.guarded[static_cast<size_t>(g)]] * slopes.col(g);
    if (!twice) return result;
    result.hessian = logarithm_hessian(fields, means);
    add_quadratic(result.hessian);
    for (Index g = 0; g < slopes.cols(); ++g) {
        const VectorXd slope = slopes.col(g);
        result.hessian.selfadjointView<Eigen::Lower>().rankUpdate(slope, guard_.strength);
    }
    return result;
}

VectorXd SarObjective::likelihood_gradient(const LagMeans& means) const {
    const Index d = layout_.planes, terms = static_cast<Index>(layout_.terms.size());
    VectorXd gradient = VectorXd::Zero(layout_.unknowns);
    for (Index s = 0; s < terms; ++s) {
        const double* const at = means.at(layout_.terms[static_cast<size_t>(s)]);
        for (Index i = 0; i < d; ++i) {
            for (Index j = 0; j < d; ++j) {
                const Index x = layout_.place[static_cast<size_t>((s * d + i) * d + j)];
                if (x < 0) continue;
                double along = 0.0;
                for (Index t = 0; t < terms; ++t) {
                    for (Index l = 0; l < d; ++l)
                        along += moments_(s * d + j, t * d + l) * b_[(t * d + i) * d + l];
                }
                gradient[x] += 2.0 * (along - at[j * d + i]);
            }
        }
    }
    return gradient;
}

MatrixXd SarObjective::guard_slopes(const Fields& fields, const LagMeans& means) const {
    const Index d = layout_.planes, terms = static_cast<Index>(layout_.terms.size());
    MatrixXd slopes = MatrixXd::Zero(layout_.unknowns, static_cast<Index>(fields.guarded.size()));
    for (Index s = 0; s < terms; ++s) {
        const double* const at = means.at(layout_.terms[static_cast<size_t>(s)]);
        for (Index i = 0; i < d; ++i) {
            for (Index j = 0; j < d; ++j) {
                const Index x = layout_.place[static_cast<size_t>((s * d + i) * d + j)];
                if (x < 0) continue;
                // ∂P_mm/∂b_{s,ij} = −2 Re mean B⁻¹_{mi} S_{jm} e^{iωs}
                for (Index g = 0; g < slopes.cols(); ++g)
                    slopes(x, g) -= 2.0 * at[fields.first_guard + (g * d + i) * d + j];
            }
        }
    }
    return slopes;
}

MatrixXd SarObjective::logarithm_hessian(const Fields& fields, const LagMeans& means) const {
    const Index d = layout_.planes, entries = d * d, terms = static_cast<Index>(layout_.terms.size());
    // 2 Re mean [B⁻¹]_{li} [B⁻¹]_{jk} e^{iω(s+t)}
    MatrixXd hessian = MatrixXd::Zero(layout_.unknowns, layout_.unknowns);
    for (Index s = 0; s < terms; ++s) {
        for (Index t = 0; t < terms; ++t) {
            const Offset lag =
                sum(layout_.terms[static_cast<size_t>(s)], layout_.terms[static_cast<size_t>(t)]);
            const double* at = means.at(lag);
            for (Index p = 0; p < entries; ++p) {
                const Index x = layout_.place[static_cast<size_t>(s * entries + p)];
                if (x < 0) continue;
                const Index i = p / d, j = p % d;
                for (Index q = 0; q < entries; ++q) {
                    const Index y = layout_.place[static_cast<size_t>(t * entries + q)];
                    if (y < 0 || y > x) continue;
                    const Index k = q / d, l = q % d;
                    hessian(x, y) +=
                        2.0 * at[fields.pair_place[static_cast<size_t>((l * d + i) * entries + j * d + k)]];
                }
            }
        }
    }
    return hessian;
}

void SarObjective::add_quadratic(MatrixXd& hessian) const {
    const Index d = layout_.planes, terms = static_cast<Index>(layout_.terms.size());
    for (Index i = 0; i < d; ++i) {
        for (Index a = 0; a < terms * d; ++a) {
            const Index x = layout_.place[static_cast<size_t>((a / d * d + i) * d + a % d)];
            if (x < 0) continue;
            for (Index c = 0; c < terms * d; ++c) {
                const Index y = layout_.place[static_cast<size_t>((c / d * d + i) * d + c % d)];
                if (y >= 0 && y <= x) hessian(x, y) += 2.0 * moments_(a, c);
            }
        }
    }
}

}  // namespace btfield::detail

#include "host/fit/mrf_unknowns.hpp"

#include <algorithm>
#include <set>
#include <string>

#include "btfield/error.hpp"
#include "host/base/lane_inverse.hpp"
#include "host/base/parallel.hpp"
#include "host/base/text.hpp"

namespace btfield::detail {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using std::size_t;

Index triangle(int i, int j) {
    return Index{i} * (i + 1) / 2 + j;
}

}  // namespace

HalfSupport half_support(const LagCovariance& statistic, const Support& support, const char* asked) {
    const std::vector<Offset>& offsets = support.offsets;
    const std::vector<std::uint8_t>& active = support.active;
    const int d = statistic.planes();
    if (d < 1) throw InputError(asked, "the lag covariances have no planes", "compute them from a picture");
    if (offsets.empty()) throw InputError(asked, "the support is empty", "give at least one pair of offsets");
    const auto block = static_cast<size_t>(d) * static_cast<size_t>(d);
    if (!active.empty() && active.size() != offsets.size() * block) {
        throw InputError(asked,
                         std::to_string(active.size()) + " entries of per-pair sets for " +
                             std::to_string(offsets.size()) + " offsets and " + std::to_string(d) + " planes",
                         "give one for every offset and pair of planes, or none");
    }
    HalfSupport half;
    half.kind = NeighbourhoodKind::half;
    std::set<Offset> seen;
    for (size_t k = 0; k < offsets.size(); ++k) {
        const Offset s = offsets[k];
        if (s == Offset{} || !seen.insert(s).second) {
            throw InputError(
                asked, "the offset " + text_of(s) + (s == Offset{} ? " is the centre" : " occurs twice"),
                "list every neighbour once, without the centre");
        }
        if (!statistic.contains(s)) {
            throw InputError(asked, "the lag covariances do not reach the offset " + text_of(s),
                             "compute them for a larger box");
        }
        const auto found = std::find(offsets.begin(), offsets.end(), -s);
        if (found == offsets.end()) {
            throw InputError(asked, "the support has the offset " + text_of(s) + " but not its opposite",
                             "a Markov field needs a symmetric neighbourhood");
        }
        const auto mirror = static_cast<size_t>(found - offsets.begin());
        if (!active.empty()) {
            for (size_t e = 0; e < block; ++e) {
                const size_t transposed =
                    e % static_cast<size_t>(d) * static_cast<size_t>(d) + e / static_cast<size_t>(d);
                if ((active[k * block + e] != 0) == (active[mirror * block + transposed] != 0)) continue;
                throw InputError(
                    asked, "the offset " + text_of(s) + " has a pair of planes whose mirror image is missing",
                    "list s for planes (i, j) together with -s for planes (j, i)");
            }
        }
        if (s < Offset{}) continue;
        half.offsets.push_back(s);
        if (!active.empty()) {
            const auto first = active.begin() + static_cast<std::ptrdiff_t>(k * block);
            half.active.insert(half.active.end(), first, first + static_cast<std::ptrdiff_t>(block));
        }
        half.position.push_back(k);
        half.mirror.push_back(mirror);
        half.reach = {std::max(half.reach.row, std::abs(s.row)),
                      std::max(half.reach.column, std::abs(s.column))};
    }
    return half;
}

std::vector<MrfUnknown> mrf_unknowns(const HalfSupport& support, int planes, ConstantForm constant) {
    std::vector<MrfUnknown> unknowns;
    for (int i = 0; i < planes; ++i) {
        if (constant == ConstantForm::none) break;
        for (int j = i; j < planes; ++j) {
            if (i == j || constant == ConstantForm::full) unknowns.push_back({{}, i, j});
        }
    }
    for (size_t s = 0; s < support.offsets.size(); ++s) {
        for (int i = 0; i < planes; ++i) {
            for (int j = 0; j < planes; ++j) {
                if (support.has(s, static_cast<size_t>(i), static_cast<size_t>(j),
                                static_cast<size_t>(planes)))
                    unknowns.push_back({support.offsets[s], i, j});
            }
        }
    }
    return unknowns;
}

void assign(const std::vector<MrfUnknown>& unknowns, const VectorXd& x, HermitianPolynomial& polynomial) {
    size_t term = 0;
    for (size_t k = 0; k < unknowns.size(); ++k) {
        const auto& [s, i, j] = unknowns[k];
        const double value = x[static_cast<Index>(k)];
        if (unknowns[k].constant()) {
            polynomial.centre(i, j) = value;
            polynomial.centre(j, i) = value;
            continue;
        }
        while (polynomial.offsets[term] != s) ++term;
        polynomial.terms[term](i, j) = value;
    }
}

VectorXd collect(const std::vector<MrfUnknown>& unknowns, const HermitianPolynomial& polynomial) {
    VectorXd x(static_cast<Index>(unknowns.size()));
    size_t term = 0;
    for (size_t k = 0; k < unknowns.size(); ++k) {
        const auto& [s, i, j] = unknowns[k];
        if (unknowns[k].constant()) {
            x[static_cast<Index>(k)] = polynomial.centre(i, j);
            continue;
        }
        while (polynomial.offsets[term] != s) ++term;
        x[static_cast<Index>(k)] = polynomial.terms[term](i, j);
    }
    return x;
}

void lower_triangle(const LaneMatrix& matrix, RowMajorMatrix& rows) {
    const auto lanes = static_cast<Index>(matrix.lanes());
    const int d = matrix.planes();
    rows.resize(2 * triangle(d, 0), lanes);
    for (int i = 0; i < d; ++i) {
        for (int j = 0; j <= i; ++j) {
            std::copy_n(matrix.real(i, j), lanes, rows.row(2 * triangle(i, j)).data());
            std::copy_n(matrix.imaginary(i, j), lanes, rows.row(2 * triangle(i, j) + 1).data());
        }
    }
}

VectorXd traces(const std::vector<MrfUnknown>& unknowns, const LagMeans& means, Index first) {
    VectorXd values(static_cast<Index>(unknowns.size()));
    for (size_t k = 0; k < unknowns.size(); ++k) {
        const auto& [s, i, j] = unknowns[k];
        // tr(K E) = scale · 2 Re K_ji e^{iω·s}; K_ij = conj K_ji.
        const double mean = j >= i ? means(first + triangle(j, i), s) : means(first + triangle(i, j), -s);
        values[static_cast<Index>(k)] = 2.0 * unknowns[k].scale() * mean;
    }
    return values;
}

PairTable::PairTable(int planes) : planes_(planes) {
    const int entries = planes * planes;
    const auto transposed = [&](int e) { return e % planes * planes + e / planes; };
    index_.assign(static_cast<size_t>(entries) * static_cast<size_t>(entries), 0);
    const auto place = [&](int e, int f) -> int& {
        return index_[static_cast<size_t>(e) * static_cast<size_t>(entries) + static_cast<size_t>(f)];
    };
    for (int e = 0; e < entries; ++e) {
        for (int f = e; f < entries; ++f) {
            const int g = std::min(transposed(e), transposed(f)), h = std::max(transposed(e), transposed(f));
            const bool mirrored = g < e || (g == e && h < f);
            if (!mirrored) {
                place(e, f) = static_cast<int>(pairs_.size());
                pairs_.push_back({e / planes, e % planes, f / planes, f % planes});
            } else {
                place(e, f) = -1 - place(g, h);
            }
            place(f, e) = place(e, f);
        }
    }
}

void PairTable::add_products(const LaneMatrix& x, const LaneMatrix& y, double scale,
                             RowMajorMatrix& rows) const {
    const size_t lanes = x.lanes();
    for (size_t p = 0; p < pairs_.size(); ++p) {
        const auto [a, b, c, d] = pairs_[p];
        add_lane_product(x.real(a, b), y.real(c, d), rows.row(2 * static_cast<Index>(p)).data(), lanes,
                         scale);
    }
}

MatrixXd second_traces(const std::vector<MrfUnknown>& unknowns, const PairTable& table,
                       const LagMeans& means) {
    const auto count = static_cast<Index>(unknowns.size());
    MatrixXd h(count, count);
    for_each_block(static_cast<int>(count), [&](int p) {
        const auto& [s, i, j] = unknowns[static_cast<size_t>(p)];
        for (Index q = 0; q <= p; ++q) {
            const auto& [t, k, l] = unknowns[static_cast<size_t>(q)];
            // tr(e_i e_jᵀ X e_k e_lᵀ Y) e^{iω·(s+t)} = X_jk Y_li e^{iω·(s+t)}, and so on; the two others are
            // conjugate.
            const Offset sum{s.row + t.row, s.column + t.column};
            const double mean = table.at(means, j, k, l, i, sum) + table.at(means, j, l, k, i, s - t);
            const double value = 2.0 * unknowns[static_cast<size_t>(p)].scale() *
                                 unknowns[static_cast<size_t>(q)].scale() * mean;
            h(p, q) = value;
        }
    });
    h.triangularView<Eigen::StrictlyUpper>() = h.transpose();
    return h;
}

}  // namespace btfield::detail

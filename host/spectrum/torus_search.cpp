#include "host/spectrum/torus_search.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <numbers>
#include <optional>
#include <span>
#include <utility>

#include "host/base/eigen.hpp"
#include "host/base/parallel.hpp"
#include "host/spectrum/half_grid.hpp"
#include "host/spectrum/local_lambda.hpp"
#include "host/spectrum/spectral_points.hpp"

namespace btfield::detail {
namespace {

using std::size_t;
using Complex = std::complex<double>;
using std::numbers::pi;

// Half-widths from π/side to π/(side · 3^10), 4e-7 at side 128.
constexpr int finest_division = 10;
// Turns are first counted at this division.
constexpr int first_count = 2;
// So few squares are counted at once, however their number grew.
constexpr size_t few = 64;
// ‖Λ⁻¹‖ beyond which Λ is singular in float64.
constexpr double singular = 1e13;
// Steps along the edges of one square after which following the argument is given up: Λ is then near singular
// along an edge.
constexpr int most_steps = 1000;
// κ below which a square's density is taken as that of its centre, and below which it holds no zero.
constexpr double resolved = 0.25, excluded = 1.0;
// Densities are resolved within a budget of squares; the proof that there is no zero may take so many times
// it.
constexpr size_t proof_share = 16;

struct Point {
    double row = 0.0, column = 0.0;
};

struct Cell {
    Point centre;
    double half = 0.0;
    int weight = 1;  ///< 2 where the mirrored cell at −ω is not visited
    int base = 0;    ///< node that it descends from
};

/// Λ around one point.
struct Surroundings {
    Complex determinant;
    double inverse_norm = 0.0;
    double by_row = 0.0, by_column = 0.0;  ///< ‖Λ⁻¹ ∂Λ‖_F
};

template <int Planes>
class Bounds {
  public:
    using Matrix = typename LocalLambda<Planes>::Matrix;
    explicit Bounds(const SpectralForm& form) : lambda_(form.lambda) {
        for (const auto& term : lambda_.terms()) {
            const Eigen::MatrixXd a = term.coefficient;
            // Two bounds of the spectral norm; neither is always the smaller one.
            const double mixed =
                std::sqrt(a.cwiseAbs().rowwise().sum().maxCoeff() * a.cwiseAbs().colwise().sum().maxCoeff());
            const double norm = std::min(a.norm(), mixed);
            const double row = std::abs(term.offset.row), column = std::abs(term.offset.column);
            slope_ += norm * (row + column);
            curvature_ += norm * (row + column) * (row + column);
            row_curvature_ += norm * row * row;
            column_curvature_ += norm * column * column;
        }
        step_ = 0.95 * std::min(1.0, 2.0 / std::sqrt(static_cast<double>(form.planes())));
    }
    [[nodiscard]] double slope() const { return slope_; }

    [[nodiscard]] Surroundings around(Point p) const {
        Matrix value, by_row, by_column;
        lambda_.derivatives(p.row, p.column, value, by_row, by_column);
        Surroundings at;
        Matrix inverse;
        if constexpr (Planes == Eigen::Dynamic) {
            const Eigen::PartialPivLU<Matrix> lu(value);
            inverse = lu.inverse();
            at.determinant = lu.determinant();
        } else {
            inverse = value.inverse();
            at.determinant = value.determinant();
        }
        at.inverse_norm = inverse.norm();
        at.by_row = (inverse * by_row).norm();
        at.by_column = (inverse * by_column).norm();
        return at;
    }
    [[nodiscard]] Complex determinant(Point p) const { return lambda_.at(p.row, p.column).determinant(); }

    /// κ; not a number or infinite where Λ is singular.
    [[nodiscard]] double change(double half, const SpectralPoints& at, int n) const {
        return half * (at.by_row(n) + at.by_column(n)) + 0.5 * half * half * at.inverse_norm(n) * curvature_;
    }
    /// Change of arg det Λ along a segment that is parallel to an axis; nothing when a zero lies on it or so
    /// close to it that `steps` run out.
    [[nodiscard]] std::optional<double> phase_change(Point a, Complex at_a, Point b, Complex at_b,
                                                     int& steps) const {
        const Point middle{0.5 * (a.row + b.row), 0.5 * (a.column + b.column)};
        const bool along_row = a.column == b.column;
        const double half = 0.5 * (along_row ? std::abs(b.row - a.row) : std::abs(b.column - a.column));
        const Surroundings at = around(middle);
        // Eigenvalues μ of Λ⁻¹(middle) Λ(ω) − I: Σ |arg(1 + μ)| <= π/2 Σ |μ| <= π/2 √d ‖·‖_F, which stays
        // below π.
        const double bound =
            half * (along_row ? at.by_row : at.by_column) +
            0.5 * half * half * at.inverse_norm * (along_row ? row_curvature_ : column_curvature_);
        if (bound < step_) return std::arg(at.determinant / at_a) + std::arg(at_b / at.determinant);
        if (--steps < 0) return std::nullopt;
        const auto first = phase_change(a, at_a, middle, at.determinant, steps);
        if (!first) return std::nullopt;
        const auto second = phase_change(middle, at.determinant, b, at_b, steps);
        if (!second) return std::nullopt;
        return *first + *second;
    }
    /// Zeros inside, by the turns of det Λ around the cell; none when the argument cannot be followed.
    [[nodiscard]] int zeros_inside(const Cell& cell) const {
        const auto [row, column] = cell.centre;
        const double h = cell.half;
        const std::array<Point, 5> corners = {Point{row - h, column - h}, Point{row - h, column + h},
                                              Point{row + h, column + h}, Point{row + h, column - h},
                                              Point{row - h, column - h}};
        std::array<Complex, 5> values;
        for (size_t k = 0; k < 4; ++k) values[k] = determinant(corners[k]);
        values[4] = values[0];
        double turn = 0.0;
        int steps = most_steps;
        for (size_t k = 0; k < 4; ++k) {
            const auto part = phase_change(corners[k], values[k], corners[k + 1], values[k + 1], steps);
            if (!part) return 0;
            turn += *part;
        }
        return static_cast<int>(std::abs(std::lround(turn / (2.0 * pi))));
    }

  private:
    LocalLambda<Planes> lambda_;
    double slope_ = 0.0, curvature_ = 0.0, row_curvature_ = 0.0, column_curvature_ = 0.0, step_ = 0.0;
};

/// A_s = A_{−s} for every offset, to rounding: Λ is real.
bool is_real(const LinearField& field) {
    const auto block = static_cast<size_t>(field.planes) * static_cast<size_t>(field.planes);
    double largest = 0.0;
    for (const double a : field.coefficients) largest = std::max(largest, std::abs(a));
    for (size_t s = 0; s < field.offsets.size(); ++s) {
        const auto found = std::find(field.offsets.begin(), field.offsets.end(), -field.offsets[s]);
        const auto other = static_cast<size_t>(found - field.offsets.begin());
        for (size_t e = 0; e < block; ++e) {
            const double opposite =
                found == field.offsets.end() ? 0.0 : field.coefficients[other * block + e];
            if (!(std::abs(field.coefficients[s * block + e] - opposite) <= 1e-9 * largest)) return false;
        }
    }
    return true;
}

/// Squares of the grid, all corners on nodes, in which the real det Λ changes sign.
int sign_changes(const NodeValues& nodes) {
    int count = 0;
    for (int m = 0; m < nodes.side / 2; ++m) {
        for (int n = 0; n < nodes.side; ++n) {
            const int next = (n + 1) % nodes.side;
            int positive = 0;
            for (const auto& [row, column] : {std::pair{m, n}, {m, next}, {m + 1, n}, {m + 1, next}}) {
                if (nodes
                        .determinant[static_cast<size_t>(row) * static_cast<size_t>(nodes.side) +
                                     static_cast<size_t>(column)]
                        .real() > 0.0)
                    ++positive;
            }
            if (positive != 0 && positive != 4) count += 2;
        }
    }
    return count;
}

/// Nodes whose squares the bound of the whole torus, ‖Λ⁻¹‖ h Σ_s ‖A_s‖ (|s1| + |s2|) < 1, does not exclude.
std::vector<Cell> open_nodes(const NodeValues& nodes, double slope) {
    std::vector<Cell> cells;
    const double half = pi / nodes.side;
    for (int m = 0; m <= nodes.side / 2; ++m) {
        for (int n = 0; n < nodes.side; ++n) {
            const int base = m * nodes.side + n;
            const double norm = nodes.inverse_norm[static_cast<size_t>(base)];
            if (norm * slope * half < 1.0) continue;
            cells.push_back({{2.0 * half * m, 2.0 * half * n}, half, row_weight(m, nodes.side), base});
        }
    }
    return cells;
}

std::array<Cell, 9> divide(const Cell& cell) {
    std::array<Cell, 9> parts;
    const double half = cell.half / 3.0;
    for (int k = 0; k < 9; ++k) {
        const int down = k / 3 - 1, right = k % 3 - 1;
        const Point centre{cell.centre.row + 2.0 * half * down, cell.centre.column + 2.0 * half * right};
        parts[static_cast<size_t>(k)] = {centre, half, cell.weight, cell.base};
    }
    return parts;
}

template <int Planes>
class Search {
  public:
    Search(const SpectralForm& form, const NodeValues& nodes)
        : form_(form), bounds_(form), nodes_(nodes), real_(form.is_markov() || is_real(form.lambda)) {
        result_.covariance.setZero(form.planes(), form.planes());
        // Evaluations cost about d³.
        const double planes = form.planes();
        budget_ = static_cast<size_t>(150000.0 / std::max(1.0, planes * planes * planes / 64.0));
    }

    TorusSearch run() {
        if (real_) result_.zeros = sign_changes(nodes_);
        if (result_.zeros > 0) return result_;
        std::vector<Cell> cells = open_nodes(nodes_, bounds_.slope());
        size_t before = 0, visited = 0;
        for (int division = 0; !cells.empty(); ++division) {
            visited += cells.size();
            const bool last = division == finest_division || visited > proof_share * budget_;
            const std::vector<Judgement> judged =
                judge_all(cells, division, visited > budget_ ? excluded : resolved, last);
            const std::vector<Cell> suspects = suspects_among(cells, judged);
            if (real_ ? result_.zeros > 0 : count_zeros(suspects, division, before)) return result_;
            if (last) {
                result_.decided = suspects.empty();
                return result_;
            }
            before = suspects.size();
            std::vector<Cell> parts;
            for (size_t k = 0; k < cells.size(); ++k) {
                if (!judged[k].divide) continue;
                const std::array<Cell, 9> nine = divide(cells[k]);
                parts.insert(parts.end(), nine.begin(), nine.end());
            }
            cells = std::move(parts);
        }
        return result_;
    }

  private:
    struct Judgement {
        bool singular_centre = false, suspect = false, divide = false, positive = false;
    };

    /// Densities and logarithms of determinants, as far as they count.
    struct Sums {
        Eigen::MatrixXd densities;
        double logarithms = 0.0;
    };

    /// Tests all cells and adds the densities of those that are not divided.
    /// \param largest κ of a square that is not divided
    std::vector<Judgement> judge_all(const std::vector<Cell>& cells, int division, double largest,
                                     bool last) {
        std::vector<Judgement> judged(cells.size());
        constexpr size_t lanes = 64, chunk = 4 * lanes;
        const auto chunks = static_cast<int>((cells.size() + chunk - 1) / chunk);
        const auto d = result_.covariance.rows();
        std::vector<Sums> sums(static_cast<size_t>(chunks), Sums{Eigen::MatrixXd::Zero(d, d)});
        const double share = 1.0 / (static_cast<double>(nodes_.side) * nodes_.side) / std::pow(9.0, division);
        const auto judge = [&](const Cell& cell, const SpectralPoints& at, int lane) {
            const double change = bounds_.change(cell.half, at, lane);
            Judgement judgement;
            judgement.singular_centre = !(at.inverse_norm(lane) < singular);
            judgement.suspect = !(change < excluded);
            judgement.divide = !(change < largest) && !last;
            judgement.positive = at.determinant(lane).real() > 0.0;
            return judgement;
        };
        for_each_block(chunks, [&](int block) {
            const auto place = static_cast<size_t>(block);
            const size_t end = std::min((place + 1) * chunk, cells.size());
            SpectralPoints at(form_, static_cast<int>(std::min(lanes, end - place * chunk)));
            const auto own = static_cast<size_t>(at.lanes());
            std::vector<double> scales(own);
            for (size_t first = place * chunk; first < end; first += own) {
                const std::span<const Cell> group(cells.data() + first, std::min(own, end - first));
                evaluate(group, at);
                for (size_t n = 0; n < group.size(); ++n) {
                    const Judgement judgement = judge(group[n], at, static_cast<int>(n));
                    judged[first + n] = judgement;
                    // The node itself already counts in the means: it leaves them when its square is divided.
                    const double sign =
                        division == 0 ? (judgement.divide ? -1.0 : 0.0) : (judgement.divide ? 0.0 : 1.0);
                    scales[n] = judgement.singular_centre ? 0.0 : sign * group[n].weight * share;
                }
                add({scales.data(), group.size()}, at, sums[place]);
            }
        });
        for (const Sums& own : sums) {
            result_.covariance += own.densities;
            result_.log_determinant += own.logarithms;
        }
        return judged;
    }

    static void evaluate(std::span<const Cell> cells, SpectralPoints& at) {
        const auto lanes = static_cast<size_t>(at.lanes());
        std::vector<double> rows(lanes), columns(lanes);
        for (size_t n = 0; n < lanes; ++n) {  // what is left over repeats the last
            const Point centre = cells[std::min(n, cells.size() - 1)].centre;
            rows[n] = centre.row;
            columns[n] = centre.column;
        }
        at.evaluate(rows, columns);
    }

    /// Adds values of the points in these shares.
    static void add(std::span<const double> scales, SpectralPoints& at, Sums& sums) {
        bool dense = false;
        for (size_t n = 0; n < scales.size(); ++n) {
            if (scales[n] == 0.0) continue;
            dense = true;
            sums.logarithms += 0.5 * scales[n] * std::log(std::norm(at.determinant(static_cast<int>(n))));
        }
        if (!dense) return;
        at.evaluate_density();
        for (int i = 0; i < at.planes(); ++i) {
            for (int j = i; j < at.planes(); ++j) {
                const double* const density = at.density(i, j);
                double sum = 0.0;
                for (size_t n = 0; n < scales.size(); ++n) {
                    if (scales[n] != 0.0) sum += scales[n] * density[n];
                }
                sums.densities(i, j) += sum;
                if (i != j) sums.densities(j, i) += sum;
            }
        }
    }

    /// Cells that may hold a zero. Zeros that are plain to see are counted on the way: singular centres, and
    /// changes of sign of a real determinant, once per node.
    std::vector<Cell> suspects_among(const std::vector<Cell>& cells, const std::vector<Judgement>& judged) {
        std::vector<Cell> suspects;
        const bool positive = nodes_.determinant.front().real() > 0.0;
        int last_base = -1;
        for (size_t k = 0; k < cells.size(); ++k) {
            if (real_ && (judged[k].singular_centre || judged[k].positive != positive) &&
                cells[k].base != last_base) {
                result_.zeros += cells[k].weight;
                last_base = cells[k].base;
            }
            if (judged[k].suspect) suspects.push_back(cells[k]);
        }
        return suspects;
    }

    /// Counts turns once that is worth it: around single zeros the number of suspects stays what it is from
    /// division to division, along curves of near singularity it triples until they are excluded.
    bool count_zeros(const std::vector<Cell>& suspects, int division, size_t before) {
        const bool worth =
            division == first_count || suspects.size() <= few || 2 * suspects.size() <= 3 * before;
        if (suspects.empty() || division < first_count || !worth) return false;
        std::vector<int> counts(suspects.size());
        constexpr size_t chunk = 8;
        for_each_block(static_cast<int>((suspects.size() + chunk - 1) / chunk), [&](int block) {
            const size_t first = static_cast<size_t>(block) * chunk;
            for (size_t k = first; k < std::min(first + chunk, suspects.size()); ++k) {
                counts[k] = suspects[k].weight * bounds_.zeros_inside(suspects[k]);
            }
        });
        for (const int count : counts) result_.zeros += count;
        return result_.zeros > 0;
    }

    const SpectralForm& form_;
    Bounds<Planes> bounds_;
    const NodeValues& nodes_;
    bool real_;
    size_t budget_;
    TorusSearch result_;
};

}  // namespace

TorusSearch search_torus(const SpectralForm& form, const NodeValues& nodes) {
    switch (form.planes()) {
        case 1:
            return Search<1>(form, nodes).run();
        case 2:
            return Search<2>(form, nodes).run();
        case 3:
            return Search<3>(form, nodes).run();
        case 4:
            return Search<4>(form, nodes).run();
        default:
            return Search<Eigen::Dynamic>(form, nodes).run();
    }
}

}  // namespace btfield::detail

#include "host/spectrum/spectral_density.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>

#include "btfield/error.hpp"
#include "host/base/dense.hpp"
#include "host/base/eigen.hpp"
#include "host/base/lane_inverse.hpp"
#include "host/base/parallel.hpp"
#include "host/base/text.hpp"
#include "host/spectrum/half_grid.hpp"
#include "host/spectrum/lag_transform.hpp"
#include "host/spectrum/small_torus.hpp"

namespace btfield::detail {
namespace {

using std::size_t;
using Complex = std::complex<double>;

}  // namespace

SpectralLanes::SpectralLanes(const SpectralForm& form, int lanes)
    : kind_(form.kind),
      planes_(form.planes()),
      lanes_(lanes),
      left_(form.left),
      right_(form.right),
      lambda_(planes_ * planes_, lanes),
      determinant_(1, lanes),
      inverse_(planes_ * planes_, lanes),
      squares_(static_cast<size_t>(lanes)),
      inverse_squares_(static_cast<size_t>(lanes)) {
    const Eigen::MatrixXd noise = noise_matrix(form.lambda);
    switch (kind_) {
        case SpectralForm::Kind::autoregressive:
            noise_ = noise.llt().matrixL();
            break;
        case SpectralForm::Kind::moving_average:
            noise_ = symmetric_root(noise);
            break;
        case SpectralForm::Kind::mmrf:
        case SpectralForm::Kind::pmrf:
            noise_ = noise;
            break;
    }
}

void SpectralLanes::invert() {
    const auto lanes = static_cast<size_t>(lanes_);
    invert_lanes(planes_, lanes, lambda_.at(0), inverse_.at(0), determinant_.at(0));
    std::fill(squares_.begin(), squares_.end(), 0.0);
    add_squared_moduli(determinant_.at(0), squares_.data(), lanes);
    std::fill(inverse_squares_.begin(), inverse_squares_.end(), 0.0);
    for (int e = 0; e < planes_ * planes_; ++e)
        add_squared_moduli(inverse_.at(e), inverse_squares_.data(), lanes);
}

void SpectralLanes::times_real(const Values& a, const Eigen::MatrixXd& m, Values& out) const {
    const int d = planes_;
    out.clear();
    for (int i = 0; i < d; ++i) {
        for (int k = 0; k < d; ++k) {
            for (int j = 0; j < d; ++j) {
                if (m(j, k) == 0.0) continue;
                add_scaled(m(j, k), a.at(i * d + j), out.at(i * d + k), 2 * static_cast<size_t>(lanes_));
            }
        }
    }
}

void SpectralLanes::set_density(const Values& y) {
    const int d = planes_;
    density_.clear();
    for (int i = 0; i < d; ++i) {
        for (int j = i; j < d; ++j) {
            for (int k = 0; k < d; ++k) {
                add_lane_conjugate_product(coloured_.at(i * d + k), y.at(j * d + k), density_.at(i * d + j),
                                           static_cast<size_t>(lanes_));
            }
        }
    }
}

void SpectralLanes::evaluate_density() {
    const int d = planes_;
    if (density_.empty()) {
        coloured_ = Values(d * d, lanes_);
        density_ = Values(d * d, lanes_);
        if (kind_ == SpectralForm::Kind::pmrf) second_ = Values(d * d, lanes_);
    }
    switch (kind_) {
        case SpectralForm::Kind::autoregressive:
            times_real(inverse_, noise_, coloured_);
            set_density(coloured_);
            break;
        case SpectralForm::Kind::moving_average:
            times_real(lambda_, noise_, coloured_);
            set_density(coloured_);
            break;
        case SpectralForm::Kind::mmrf:
            times_real(inverse_, noise_, density_);
            break;
        case SpectralForm::Kind::pmrf:
            // (Λ⁻¹ left) Λ, then times right, then times Λ⁻ᴴ.
            times_real(inverse_, left_, coloured_);
            second_.clear();
            for (int i = 0; i < d; ++i) {
                for (int j = 0; j < d; ++j) {
                    for (int k = 0; k < d; ++k) {
                        add_lane_product(coloured_.at(i * d + k), lambda_.at(k * d + j),
                                         second_.at(i * d + j), static_cast<size_t>(lanes_));
                    }
                }
            }
            times_real(second_, right_, coloured_);
            set_density(inverse_);
            break;
    }
}

std::complex<double> SpectralLanes::determinant(int n) const {
    return {determinant_.at(0)[n], determinant_.at(0)[lanes_ + n]};
}

double SpectralLanes::sum_of_log_determinants() const {
    return 0.5 * sum_of_logarithms(squares_.data(), squares_.size());
}

double SpectralLanes::inverse_norm(int n) const {
    return std::sqrt(inverse_squares_[static_cast<size_t>(n)]);
}

SpectralRow::SpectralRow(const SpectralForm& form, int columns) : SpectralLanes(form, columns) {
    const RootsOfUnity root(columns);
    fill_waves(form, [&](int s, int n) { return root(static_cast<long long>(s) * n); });
}

SpectralRow::SpectralRow(const SpectralForm& form, const std::vector<double>& columns)
    : SpectralLanes(form, static_cast<int>(columns.size())) {
    fill_waves(form, [&](int s, int n) { return std::polar(1.0, s * columns[static_cast<size_t>(n)]); });
}

void SpectralRow::fill_waves(const SpectralForm& form,
                             const std::function<Complex(int column, int n)>& turn) {
    offsets_ = form.lambda.offsets;
    coefficients_ = form.lambda.coefficients;
    for (const Offset s : offsets_) column_offsets_.push_back(s.column);
    std::sort(column_offsets_.begin(), column_offsets_.end());
    column_offsets_.erase(std::unique(column_offsets_.begin(), column_offsets_.end()), column_offsets_.end());
    const auto distinct = static_cast<Eigen::Index>(column_offsets_.size());
    waves_.resize(2 * distinct, lanes());
    for (Eigen::Index c = 0; c < distinct; ++c) {
        for (int n = 0; n < lanes(); ++n) {
            const Complex wave = turn(column_offsets_[static_cast<size_t>(c)], n);
            waves_(c, n) = wave.real();
            waves_(distinct + c, n) = wave.imag();
        }
    }
}

void SpectralRow::evaluate(double row_frequency) {
    const auto entries = static_cast<Eigen::Index>(planes()) * planes();
    const auto distinct = static_cast<Eigen::Index>(column_offsets_.size());
    // −Σ over offsets with the same s2 of A_s e^{iω1 s1}: what is left is a sum over few distinct s2.
    RowMajorMatrix sums = RowMajorMatrix::Zero(2 * entries, 2 * distinct);
    for (size_t s = 0; s < offsets_.size(); ++s) {
        const auto found =
            std::lower_bound(column_offsets_.begin(), column_offsets_.end(), offsets_[s].column);
        const auto c = static_cast<Eigen::Index>(found - column_offsets_.begin());
        const Complex turn = std::polar(1.0, row_frequency * offsets_[s].row);
        for (Eigen::Index e = 0; e < entries; ++e) {
            const Complex b = turn * coefficients_[s * static_cast<size_t>(entries) + static_cast<size_t>(e)];
            sums(2 * e, c) -= b.real();
            sums(2 * e, c + distinct) += b.imag();
            sums(2 * e + 1, c) -= b.imag();
            sums(2 * e + 1, c + distinct) -= b.real();
        }
    }
    Eigen::Map<RowMajorMatrix> values(lambda_values().at(0), 2 * entries, lanes());
    values.setZero();
    for (Eigen::Index i = 0; i < planes(); ++i) values.row(2 * i * (planes() + 1)).setOnes();
    add_product(sums, waves_, values);
    invert();
}

SpectralMeans spectral_means(const SpectralForm& form, Size grid,
                             const std::function<void(int m, const SpectralRow& row)>& visit) {
    const int d = form.planes();
    const RowBlocks blocks(half_rows(grid.height));
    std::vector<SpectralMeans> partial(static_cast<size_t>(blocks.count));
    for_each_block(blocks.count, [&](int block) {
        SpectralRow row(form, grid.width);
        SpectralMeans& sums = partial[static_cast<size_t>(block)];
        sums.covariance.setZero(d, d);
        for (int m = blocks.first(block); m < blocks.last(block); ++m) {
            row.evaluate(2.0 * std::numbers::pi * m / grid.height);
            row.evaluate_density();
            if (visit) visit(m, row);
            const double weight = row_weight(m, grid.height);
            sums.log_determinant += weight * row.sum_of_log_determinants();
            for (int i = 0; i < d; ++i) {
                for (int j = i; j < d; ++j) {
                    const double* density = row.density(i, j);
                    double sum = 0.0;
                    for (int n = 0; n < grid.width; ++n) sum += density[n];
                    sums.covariance(i, j) += weight * sum;
                }
            }
        }
    });
    SpectralMeans means;
    means.covariance.setZero(d, d);
    for (const SpectralMeans& sums : partial) {
        means.covariance += sums.covariance;
        means.log_determinant += sums.log_determinant;
    }
    const double count = static_cast<double>(area(grid));
    means.covariance = Eigen::MatrixXd(means.covariance.selfadjointView<Eigen::Upper>()) / count;
    means.log_determinant /= count;
    return means;
}

namespace {

/// Rows 2p and 2p + 1 are the real and imaginary parts of conj S_ij for pair p of i <= j.
void conjugate_pairs(const SpectralRow& row, RowMajorMatrix& values) {
    const int d = row.planes();
    const auto densities = row.densities();
    values.resize(Eigen::Index{d} * (d + 1), densities.cols());
    Eigen::Index pair = 0;
    for (int i = 0; i < d; ++i) {
        for (int j = i; j < d; ++j, ++pair) {
            const Eigen::Index entry = Eigen::Index{2} * (i * d + j);
            values.row(2 * pair) = densities.row(entry);
            values.row(2 * pair + 1) = -densities.row(entry + 1);
        }
    }
}

}  // namespace

LagCovariance model_covariance(const SpectralForm& form, Size torus, Offset box) {
    if (torus.height < 1 || torus.width < 1) {
        throw InputError("covariances of a model on a torus", text_of(torus) + " has no pixel",
                         "use positive sides");
    }
    const int d = form.planes();
    LagCovariance result(d, torus, box);
    const LagTransform transform(torus, box);
    const RowBlocks blocks(half_rows(torus.height));
    std::vector<LagSums> parts(static_cast<size_t>(blocks.count),
                               LagSums(transform, Eigen::Index{d} * (d + 1) / 2, blocks.per_block));
    for_each_block(blocks.count, [&](int block) {
        SpectralRow row(form, torus.width);
        RowMajorMatrix values;
        for (int m = blocks.first(block); m < blocks.last(block); ++m) {
            row.evaluate(2.0 * std::numbers::pi * m / torus.height);
            row.evaluate_density();
            conjugate_pairs(row, values);
            parts[static_cast<size_t>(block)].add(static_cast<size_t>(m), values);
        }
    });
    const LagMeans means = means_of(parts);
    for (int s1 = -box.row; s1 <= box.row; ++s1) {
        for (int s2 = -box.column; s2 <= box.column; ++s2) {
            const double* value = means.at({s1, s2});
            for (int i = 0; i < d; ++i) {
                for (int j = i; j < d; ++j) result.set(i, j, {s1, s2}, *value++);
            }
        }
    }
    return result;
}

namespace {

/// model_covariance() of what grows on a torus.
LagCovariance grown_covariance(const SpectralForm& form, Size torus, Offset box, int factor, int depth) {
    LagCovariance sampled = model_covariance(form, torus, box);
    const auto mean = mean_density(form, torus, factor, depth);
    if (!mean) return sampled;
    LagCovariance covariance = sampled;
    const Eigen::MatrixXd more = (*mean - density_at_zero(form)) / static_cast<double>(area(torus));
    for (int row = -box.row; row <= box.row; ++row)
        for (int column = -box.column; column <= box.column; ++column)
            for (int i = 0; i < form.planes(); ++i)
                for (int j = i; j < form.planes(); ++j)
                    covariance.set(i, j, {row, column}, sampled(i, j, {row, column}) + more(i, j));
    return covariance;
}

}  // namespace

LagCovariance level_covariance(const LevelModel& level, Size torus, Offset box, int factor, int depth) {
    const auto own_covariance = [&](const Model& model) {
        return level.certificate.valid ? grown_covariance(model, torus, box, factor, depth)
                                       : model_covariance(model, torus, box);
    };
    if (level.models.size() == 1) return own_covariance(level.models.front());
    LagCovariance result(static_cast<int>(level.models.size()), torus, box);
    for (int p = 0; p < result.planes(); ++p) {
        const LagCovariance own = own_covariance(level.models[static_cast<size_t>(p)]);
        for (int row = -box.row; row <= box.row; ++row) {
            for (int column = -box.column; column <= box.column; ++column)
                result.set(p, p, {row, column}, own(0, 0, {row, column}));
        }
    }
    return result;
}

}  // namespace btfield::detail

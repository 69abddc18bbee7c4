#include "tests/reference/mrf_least_squares.hpp"

#include <cstddef>

#include "tests/reference/algebra.hpp"
#include "tests/reference/fields.hpp"
#include "tests/reference/lag_covariance.hpp"

namespace btfield::reference {

namespace {

/// Y_{r ⊕ s} without its mean.
class Centred {
  public:
    explicit Centred(const Image& image) : size_(image.size()) {
        Eigen::VectorXd mu(image.planes());
        for (int i = 0; i < image.planes(); ++i) mu[i] = mean(image, i);
        for (int row = 0; row < image.height(); ++row)
            for (int column = 0; column < image.width(); ++column) {
                values_.push_back(-mu);
                for (int i = 0; i < image.planes(); ++i)
                    values_.back()[i] += static_cast<double>(image.at(i, row, column));
            }
    }
    [[nodiscard]] const Eigen::VectorXd& operator()(int row, int column) const {
        return values_[static_cast<std::size_t>(wrapped(row, size_.height)) *
                           static_cast<std::size_t>(size_.width) +
                       static_cast<std::size_t>(wrapped(column, size_.width))];
    }

  private:
    Size size_;
    std::vector<Eigen::VectorXd> values_;
};

template <class F>
void for_each_pixel(const Image& image, F&& f) {
    for (int row = 0; row < image.height(); ++row)
        for (int column = 0; column < image.width(); ++column)
            f(row, column, static_cast<Eigen::Index>(row) * image.width() + column);
}

Eigen::MatrixXd residuals(const Image& image, const std::vector<Offset>& offsets,
                          const std::vector<Eigen::MatrixXd>& a) {
    const Centred centred(image);
    Eigen::MatrixXd sum = Eigen::MatrixXd::Zero(image.planes(), image.planes());
    for_each_pixel(image, [&](int row, int column, Eigen::Index) {
        Eigen::VectorXd e = centred(row, column);
        for (std::size_t s = 0; s < offsets.size(); ++s)
            e -= a[s] * centred(row + offsets[s].row, column + offsets[s].column);
        sum += e * e.transpose();
    });
    return sum / static_cast<double>(area(image.size()));
}

Eigen::MatrixXd& matrix_of(std::vector<Eigen::MatrixXd>& a, const std::vector<Offset>& offsets, Offset s) {
    std::size_t place = 0;
    while (offsets[place] != s) ++place;
    return a[place];
}

}  // namespace

MrfIterate mmrf_diagonal(const Image& image, const std::vector<Offset>& offsets, int iterations) {
    const int d = image.planes();
    const Centred centred(image);
    struct Unknown {
        int i, j;
        Offset s;
    };
    std::vector<Unknown> unknowns;
    for (int i = 0; i < d; ++i)
        for (int j = i; j < d; ++j)
            for (const Offset s : offsets)
                if (i != j || s > Offset{}) unknowns.push_back({i, j, s});
    const auto pixels = static_cast<Eigen::Index>(area(image.size()));
    Eigen::VectorXd sigma = Eigen::VectorXd::Ones(d);
    MrfIterate result;
    for (int t = 0; t < iterations; ++t) {
        Eigen::MatrixXd q = Eigen::MatrixXd::Zero(pixels * d, static_cast<Eigen::Index>(unknowns.size()));
        Eigen::VectorXd y(pixels * d);
        for_each_pixel(image, [&](int row, int column, Eigen::Index r) {
            y.segment(r * d, d) = centred(row, column);
            for (std::size_t k = 0; k < unknowns.size(); ++k) {
                const auto& [i, j, s] = unknowns[k];
                const auto at = static_cast<Eigen::Index>(k);
                q(r * d + i, at) += centred(row + s.row, column + s.column)[j];
                q(r * d + j, at) += sigma[j] / sigma[i] * centred(row - s.row, column - s.column)[i];
            }
        });
        const Eigen::VectorXd gamma = least_squares(q, y);
        result.a.assign(offsets.size(), Eigen::MatrixXd::Zero(d, d));
        for (std::size_t k = 0; k < unknowns.size(); ++k) {
            const auto& [i, j, s] = unknowns[k];
            const double value = gamma[static_cast<Eigen::Index>(k)];
            matrix_of(result.a, offsets, s)(i, j) = value;
            matrix_of(result.a, offsets, -s)(j, i) = sigma[j] / sigma[i] * value;
        }
        result.sigma = residuals(image, offsets, result.a);
        sigma = result.sigma.diagonal();
    }
    return result;
}

MrfIterate mmrf_full(const Image& image, const std::vector<Offset>& offsets, int iterations) {
    const int d = image.planes();
    const Centred centred(image);
    std::vector<Offset> half;
    for (const Offset s : offsets)
        if (s > Offset{}) half.push_back(s);
    const auto pixels = static_cast<Eigen::Index>(area(image.size()));
    const auto count = static_cast<Eigen::Index>(half.size()) * d * d;
    MrfIterate result;
    result.sigma = residuals(image, {}, {});
    for (int t = 0; t < iterations; ++t) {
        const Eigen::MatrixXd lower = lower_root(result.sigma);
        Eigen::MatrixXd q = Eigen::MatrixXd::Zero(pixels * d, count);
        Eigen::VectorXd y(pixels * d);
        for_each_pixel(image, [&](int row, int column, Eigen::Index r) {
            y.segment(r * d, d) = lower.triangularView<Eigen::Lower>().solve(centred(row, column));
            for (std::size_t s = 0; s < half.size(); ++s) {
                const Eigen::VectorXd after = centred(row + half[s].row, column + half[s].column);
                const Eigen::VectorXd before = centred(row - half[s].row, column - half[s].column);
                for (int k = 0; k < d; ++k)
                    for (int l = 0; l < d; ++l) {
                        // L⁻¹ Σ (E_kl Y(r ⊕ s) + E_lk Y(r ⊖ s)), Σ = L Lᵀ
                        const Eigen::Index at = (static_cast<Eigen::Index>(s) * d + k) * d + l;
                        q.col(at).segment(r * d, d) +=
                            lower.transpose().col(k) * after[l] + lower.transpose().col(l) * before[k];
                    }
            }
        });
        const Eigen::VectorXd unknowns = least_squares(q, y);
        result.a.assign(offsets.size(), Eigen::MatrixXd::Zero(d, d));
        for (std::size_t s = 0; s < half.size(); ++s) {
            Eigen::MatrixXd precision(d, d);
            for (int k = 0; k < d; ++k)
                for (int l = 0; l < d; ++l)
                    precision(k, l) = unknowns[(static_cast<Eigen::Index>(s) * d + k) * d + l];
            matrix_of(result.a, offsets, half[s]) = result.sigma * precision;
            matrix_of(result.a, offsets, -half[s]) = result.sigma * precision.transpose();
        }
        result.sigma = residuals(image, offsets, result.a);
    }
    return result;
}

}  // namespace btfield::reference

#include "bench/peers/spectral_factors.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>

#include "bench/peers/fftw.hpp"

namespace btfield::peer {
namespace {

constexpr int block = 512;  // frequencies solved at a time: noise and factors stay in the first-level cache

}  // namespace

int SpectralFactors::blocks() const {
    return (static_cast<int>(spectrum_size(size_)) + block - 1) / block;
}

SpectralFactors::SpectralFactors(const LinearField& field, Size size, double gain)
    : size_(size), planes_(field.planes) {
    using Matrix = Eigen::MatrixXcd;
    const int d = planes_, half = size.width / 2 + 1;
    const auto entries = static_cast<std::size_t>(2 * d * d);
    values_.resize(static_cast<std::size_t>(blocks()) * entries * block);
    const Eigen::MatrixXd noise =
        Eigen::Map<const Eigen::Matrix<double, -1, -1, Eigen::RowMajor>>(field.noise_covariance.data(), d, d);
    const Matrix root = noise.llt().matrixL().toDenseMatrix().cast<std::complex<double>>();
    for (int t = 0; t < size.height * half; ++t) {
        const int m = t / half, n = t % half;
        Matrix lambda = Matrix::Identity(d, d);
        for (std::size_t s = 0; s < field.offsets.size(); ++s) {
            const double angle = 2.0 * std::numbers::pi *
                                 (static_cast<double>(m) * field.offsets[s].row / size.height +
                                  static_cast<double>(n) * field.offsets[s].column / size.width);
            const double* a = field.coefficients.data() + s * static_cast<std::size_t>(d * d);
            for (int i = 0; i < d; ++i)
                for (int j = 0; j < d; ++j) lambda(i, j) -= a[i * d + j] * std::polar(1.0, angle);
        }
        // Columns 0 and width/2 are their own mirror image. The transform uses the Hermitian part of what it
        // is given there, which halves the variance of independent draws: √2 restores it.
        const bool mirrored = n == 0 || 2 * n == size.width;
        const double scale = gain * std::sqrt((mirrored ? 1.0 : 0.5) / static_cast<double>(area(size)));
        const Matrix factor = scale * lambda.partialPivLu().solve(root);
        float* place = values_.data() + static_cast<std::size_t>(t / block) * entries * block + t % block;
        for (int i = 0; i < d; ++i)
            for (int j = 0; j < d; ++j) {
                place[static_cast<std::ptrdiff_t>((i * d + j) * 2 * block)] =
                    static_cast<float>(factor(i, j).real());
                place[static_cast<std::ptrdiff_t>(((i * d + j) * 2 + 1) * block)] =
                    static_cast<float>(factor(i, j).imag());
            }
    }
}

void SpectralFactors::draw(NoiseSource& source, int begin, int end, fftwf_complex* spectrum) const {
    const int d = planes_;
    const auto frequencies = static_cast<int>(spectrum_size(size_));
    const std::ptrdiff_t step = 2 * block;
    std::vector<float> noise(static_cast<std::size_t>(2 * d * block));
    std::vector<float> sum(2 * block);
    for (int b = begin; b < end; ++b) {
        source.fill(noise);
        const float* factor = values_.data() + static_cast<std::ptrdiff_t>(b) * d * d * step;
        const int used = std::min(block, frequencies - b * block);
        for (int i = 0; i < d; ++i) {
            float* __restrict re = sum.data();
            float* __restrict im = sum.data() + block;
            std::fill(sum.begin(), sum.end(), 0.0F);
            for (int j = 0; j < d; ++j) {
                const float* __restrict a = factor + (i * d + j) * step;
                const float* __restrict x = noise.data() + j * step;
                for (int f = 0; f < block; ++f) {
                    re[f] += a[f] * x[f] - a[block + f] * x[block + f];
                    im[f] += a[f] * x[block + f] + a[block + f] * x[f];
                }
            }
            fftwf_complex* out =
                spectrum + static_cast<std::ptrdiff_t>(i) * frequencies + b * std::ptrdiff_t{block};
            for (int f = 0; f < used; ++f) {
                out[f][0] = re[f];
                out[f][1] = im[f];
            }
        }
    }
}

}  // namespace btfield::peer

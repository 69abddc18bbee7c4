#include "host/analysis/picture_spectra.hpp"

#include <algorithm>
#include <cstddef>
#include <span>
#include <unsupported/Eigen/FFT>

#include "host/base/parallel.hpp"

namespace btfield::detail {
namespace {

using std::size_t;
using Complex = std::complex<double>;

/// In place along one axis, lines in parallel.
void transform(std::vector<Complex>& values, int lines, int length, size_t line_step, size_t step) {
    if (length == 1) return;  // its own transform
    constexpr int chunk = 16;
    for_each_block((lines + chunk - 1) / chunk, [&](int block) {
        Eigen::FFT<double> fft;
        std::vector<Complex> in(static_cast<size_t>(length)), out;
        for (int line = block * chunk; line < std::min(lines, (block + 1) * chunk); ++line) {
            Complex* const first = values.data() + static_cast<size_t>(line) * line_step;
            for (size_t k = 0; k < in.size(); ++k) in[k] = first[k * step];
            fft.fwd(out, in);
            for (size_t k = 0; k < in.size(); ++k) first[k * step] = out[k];
        }
    });
}

}  // namespace

PictureSpectrum spectrum_of(const Image& image, int plane) {
    const std::span<const float> from = image.plane(plane);
    double mean = 0.0;
    for (const float v : from) mean += v;
    mean /= static_cast<double>(from.size());
    PictureSpectrum values(from.size());
    std::transform(from.begin(), from.end(), values.begin(), [&](float v) { return v - mean; });
    const auto width = static_cast<size_t>(image.width());
    transform(values, image.height(), image.width(), width, 1);
    transform(values, image.width(), image.height(), 1, width);
    return values;
}

std::vector<PictureSpectrum> spectra_of(const Image& image) {
    std::vector<PictureSpectrum> spectra;
    spectra.reserve(static_cast<size_t>(image.planes()));
    for (int p = 0; p < image.planes(); ++p) spectra.push_back(spectrum_of(image, p));
    return spectra;
}

}  // namespace btfield::detail

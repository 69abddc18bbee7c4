#include "host/synthesis/spectral_factors.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <set>
#include <utility>

#include "btfield/error.hpp"
#include "host/base/eigen.hpp"

namespace btfield::detail {

namespace {

using Matrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

/// Index of each value among the distinct ones, which are returned in ascending order.
std::vector<int> distinct(const std::vector<Offset>& offsets, int Offset::*part) {
    std::vector<int> values;
    values.reserve(offsets.size());
    for (const Offset& s : offsets) values.push_back(s.*part);
    std::sort(values.begin(), values.end());
    values.erase(std::unique(values.begin(), values.end()), values.end());
    return values;
}

int index_of(const std::vector<int>& values, int value) {
    return static_cast<int>(std::lower_bound(values.begin(), values.end(), value) - values.begin());
}

/// π·s·k/n with s·k reduced modulo 2n first, so that large lattices lose no digits.
double half_angle(int s, int k, int n) {
    const long long turns = static_cast<long long>(s) * k % (2LL * n);
    return std::numbers::pi * static_cast<double>(turns) / n;
}

/// Of each step, cosines, then sines, of the first `count` frequencies ky.
std::vector<float> row_waves(const std::vector<int>& steps, int count, int height) {
    std::vector<float> waves;
    for (const int s : steps) {
        for (int k = 0; k < count; ++k)
            waves.push_back(static_cast<float>(std::cos(half_angle(s, k, height))));
        for (int k = 0; k < count; ++k)
            waves.push_back(static_cast<float>(std::sin(half_angle(s, k, height))));
    }
    return waves;
}

/// The root of Σ that the family's kernel takes.
Eigen::MatrixXd root_for_kernel(const SpectralForm& form) {
    const Eigen::MatrixXd covariance = noise_matrix(form.lambda);
    if (form.kind == SpectralForm::Kind::moving_average) return symmetric_root(covariance);
    const Eigen::LLT<Eigen::MatrixXd> llt(covariance);
    if (llt.info() != Eigen::Success)
        throw InputError("take the root of the noise covariance", "it is not positive definite",
                         "fit the model again");
    if (form.is_markov()) return symmetric_root(covariance);
    return llt.matrixL();
}

/// Λ as the family's kernel takes it: of an MMRF in the basis in which it is Hermitian.
LinearField lambda_for_kernel(const SpectralForm& form) {
    if (form.kind != SpectralForm::Kind::mmrf) return form.lambda;
    const Eigen::MatrixXd covariance = noise_matrix(form.lambda);
    return change_basis(form.lambda, inverse_symmetric_root(covariance), symmetric_root(covariance));
}

/// A_s at the places of `offsets`, then I − Σ A_s, then the scaled root of Σ.
void pack_coefficients(const SpectralForm& form, const std::vector<Offset>& offsets, double scale,
                       std::vector<float>& packed) {
    const LinearField field = lambda_for_kernel(form);
    const int d = field.planes;
    const auto entries = static_cast<std::size_t>(d) * static_cast<std::size_t>(d);
    const std::size_t start = packed.size();
    packed.resize(start + (offsets.size() + 2) * entries);
    Matrix at_zero = Matrix::Identity(d, d);
    for (std::size_t s = 0; s < field.offsets.size(); ++s) {
        const auto found = std::lower_bound(offsets.begin(), offsets.end(), field.offsets[s]);
        const std::size_t place = start + static_cast<std::size_t>(found - offsets.begin()) * entries;
        for (std::size_t e = 0; e < entries; ++e) {
            const double a = field.coefficients[s * entries + e];
            packed[place + e] = static_cast<float>(a);
            at_zero.data()[e] -= a;
        }
    }
    const Matrix root = root_for_kernel(form);
    const std::size_t tail = start + offsets.size() * entries;
    for (std::size_t e = 0; e < entries; ++e) {
        packed[tail + e] = static_cast<float>(at_zero.data()[e]);
        packed[tail + entries + e] = static_cast<float>(scale * root.data()[e]);
    }
}

/// Every offset of any part, once, in raster order.
std::vector<Offset> all_offsets(const std::vector<SpectralForm>& parts) {
    std::set<Offset> offsets;
    for (const SpectralForm& part : parts)
        offsets.insert(part.lambda.offsets.begin(), part.lambda.offsets.end());
    return {offsets.begin(), offsets.end()};
}

/// Of the draw of a normal: 80 operations of Philox make four, 78 of Box-Muller two.
constexpr double operations_of_normal = 80.0 / 4.0 + 78.0 / 2.0;

/// Draws that lie together: they feed twice as many frequencies.
constexpr std::size_t block_of_noise = 16;

/// Vectors of draws for all frequencies ky.
std::size_t block_vectors(const DeviceImpl& device, int height) {
    const auto blocks = static_cast<std::size_t>(height / 2 / 32 + 1) * block_of_noise;
    return blocks / static_cast<std::size_t>(device.vector_width());
}

}  // namespace

SpectralFactors::SpectralFactors(DeviceImpl& device, const std::vector<SpectralForm>& parts, Size lattice,
                                 double scale, const std::vector<double>& mean, double budget,
                                 bool indefinite)
    : kind_(parts.front().kind),
      planes_(parts.front().planes()),
      parts_(static_cast<int>(parts.size())),
      lattice_(lattice),
      scale_(scale),
      indefinite_(indefinite) {
    const int pitch = spectrum_pitch(lattice.height);
    const std::vector<Offset> offsets = all_offsets(parts);
    offsets_count_ = static_cast<int>(offsets.size());
    row_steps_ = distinct(offsets, &Offset::row);
    const std::vector<int> column_steps = distinct(offsets, &Offset::column);

    std::vector<std::array<int, 2>> indices;
    indices.reserve(offsets.size());
    for (const Offset& s : offsets)
        indices.push_back({index_of(row_steps_, s.row), index_of(column_steps, s.column)});
    std::vector<std::array<float, 2>> columns;
    for (const int s : column_steps)
        for (int k = 0; k < lattice.width; ++k) {
            const double angle = half_angle(s, k, lattice.width);
            columns.push_back({static_cast<float>(std::cos(angle)), static_cast<float>(std::sin(angle))});
        }
    column_steps_ = column_steps.size();
    std::vector<float> means(mean.begin(), mean.end());
    std::vector<float> coefficients;
    for (const SpectralForm& part : parts) pack_coefficients(part, offsets, scale, coefficients);

    coefficients_ = device.upload(coefficients);
    offsets_ = device.upload(indices);
    rows_ = device.upload(row_waves(row_steps_, pitch, lattice.height));
    columns_ = device.upload(columns);
    mean_ = device.upload(means);

    const std::size_t bytes = factor_bytes();
    storable_ = 2.0 * static_cast<double>(bytes) <= budget && bytes <= device.largest_allocation();
}

void SpectralFactors::store(DeviceImpl& device) {
    if (!storable_ || stored_) return;
    const std::size_t bytes = factor_bytes();
    Buffer re = device.buffer(bytes), im = device.buffer(bytes);
    const int pitch = spectrum_pitch(lattice_.height);
    const auto lanes = static_cast<std::size_t>(device.vector_width());
    device.launch(kernel(device, "spectral_factors", false),
                  range(static_cast<std::size_t>(pitch) / lanes, lattice_.width), grain(),
                  LaunchWork{.bytes = 2.0 * static_cast<double>(bytes)}, coefficients_, offsets_, rows_,
                  columns_, offsets_count_, re, im, lattice_.width, pitch);
    put_means(device, re, im, spectrum_floats(lattice_, 1));
    factor_re_ = std::move(re);
    factor_im_ = std::move(im);
    stored_ = true;
}

void SpectralFactors::set_means(DeviceImpl& device,
                                const std::vector<std::optional<Eigen::MatrixXd>>& densities) {
    const auto d = static_cast<std::size_t>(planes_);
    roots_.clear();
    for (const std::optional<Eigen::MatrixXd>& density : densities) {
        std::vector<float>& root = roots_.emplace_back();
        if (!density) continue;
        const Matrix values = scale_ * symmetric_root(*density);
        root.assign(values.data(), values.data() + d * d);
    }
    // Of one block of noise at frequency 0: little memory however long the torus is.
    const int rows = rows_at_zero();
    const auto lanes = static_cast<std::size_t>(device.vector_width());
    const std::size_t bytes =
        sizeof(float) * static_cast<std::size_t>(parts_) * d * d * static_cast<std::size_t>(rows);
    zero_re_ = device.buffer(bytes);
    zero_im_ = device.buffer(bytes);
    // Of every column step, cos 0 and sin 0.
    const std::vector<std::array<float, 2>> columns(column_steps_, {1.0F, 0.0F});
    device.launch(kernel(device, "spectral_factors", false), range(static_cast<std::size_t>(rows) / lanes, 1),
                  grain(), LaunchWork{.bytes = 2.0 * static_cast<double>(bytes)}, coefficients_, offsets_,
                  device.upload(row_waves(row_steps_, rows, lattice_.height)), device.upload(columns),
                  offsets_count_, zero_re_, zero_im_, 1, rows);
    put_means(device, zero_re_, zero_im_, static_cast<std::size_t>(rows));
}

int SpectralFactors::rows_at_zero() const {
    return std::min(spectrum_pitch(lattice_.height), 2 * static_cast<int>(block_of_noise));
}

void SpectralFactors::put_means(DeviceImpl& device, const Buffer& factor_re, const Buffer& factor_im,
                                std::size_t frequencies) const {
    const auto d = static_cast<std::size_t>(planes_), lanes = static_cast<std::size_t>(device.vector_width());
    for (std::size_t part = 0; part < roots_.size(); ++part) {
        for (std::size_t e = 0; e < roots_[part].size(); ++e) {
            const std::size_t place = sizeof(float) * (part * d * d * frequencies + e * lanes);
            const float re = roots_[part][e], im = 0.0F;
            device.write(factor_re, &re, sizeof re, place);
            device.write(factor_im, &im, sizeof im, place);
        }
    }
}

std::size_t SpectralFactors::factor_bytes() const {
    return sizeof(float) * spectrum_floats(lattice_, parts_ * planes_ * planes_);
}

Range SpectralFactors::range(std::size_t vectors, int columns) const {
    return {vectors, static_cast<std::size_t>(columns), static_cast<std::size_t>(parts_)};
}

Kernel SpectralFactors::kernel(DeviceImpl& device, const char* name, bool stored) const {
    BuildParameters parameters = device.lanes();
    parameters.set("BTFIELD_PLANES", planes_).set("BTFIELD_STORED_FACTORS", stored ? 1 : 0);
    parameters.set("BTFIELD_FACTOR", static_cast<int>(kind_));
    if (indefinite_) parameters.set("BTFIELD_INDEFINITE", 1);
    return device.kernel("spectral_factors", name, parameters);
}

Grain SpectralFactors::grain() const {
    return planes_ <= 4 ? Grain::fine : Grain::coarse;
}

LaunchWork SpectralFactors::solve_work(int batch, double operations, double passes) const {
    const double values = static_cast<double>(spectrum_floats(lattice_, parts_ * planes_)) * batch;
    return {.bytes = stored_bytes() + 2.0 * passes * sizeof(float) * values,
            .operations = values * (operations + 8.0 * planes_)};
}

double SpectralFactors::stored_bytes() const {
    return stored_ ? 2.0 * static_cast<double>(factor_bytes()) : 0.0;
}
double SpectralFactors::storable_bytes() const {
    return storable_ ? 2.0 * static_cast<double>(factor_bytes()) : 0.0;
}

void SpectralFactors::draw(DeviceImpl& device, Spectrum& spectrum, const Buffer& keys, int batch, int level,
                           int first_key) const {
    draw(device, Target{spectrum.re, spectrum.im, spectrum_floats(lattice_, 1), 0}, keys, batch, level,
         first_key);
}

void SpectralFactors::draw(DeviceImpl& device, const Buffer& packed, const Buffer& keys, int batch, int level,
                           int first_key) const {
    const PackedSpectrum places{lattice_};
    draw(device, Target{packed, packed, places.stride(), places.imaginary()}, keys, batch, level, first_key);
}

void SpectralFactors::draw(DeviceImpl& device, const Target& target, const Buffer& keys, int batch, int level,
                           int first_key) const {
    const LaunchWork work = solve_work(batch, 2.0 * operations_of_normal, 1.0);
    const int pitch = spectrum_pitch(lattice_.height);
    const auto word = static_cast<std::uint32_t>(level);
    const std::uint64_t stride = target.stride, imaginary = target.imaginary;
    const std::size_t vectors = block_vectors(device, lattice_.height);
    if (stored_) {
        device.launch(kernel(device, "synthesise_spectrum", true), range(vectors, lattice_.width), grain(),
                      work, factor_re_, factor_im_, mean_, keys, target.re, target.im, lattice_.height,
                      lattice_.width, pitch, batch, parts_, word, stride, imaginary, first_key);
        return;
    }
    device.launch(kernel(device, "synthesise_spectrum", false), range(vectors, lattice_.width), grain(), work,
                  coefficients_, offsets_, rows_, columns_, offsets_count_, mean_, keys, target.re, target.im,
                  lattice_.height, lattice_.width, pitch, batch, parts_, word, stride, imaginary, first_key);
    if (roots_.empty()) return;
    // Sides and pitch tell where these factors lie and where they end; values of kx = 0 have no mirror and
    // begin the spectrum. An odd side has no row of its own at its end.
    const int rows = rows_at_zero(), height = std::min(lattice_.height, 2 * rows - 1);
    const double share = static_cast<double>(rows) / static_cast<double>(spectrum_floats(lattice_, 1));
    device.launch(kernel(device, "synthesise_spectrum", true), range(block_vectors(device, height), 1),
                  grain(), LaunchWork{.bytes = share * work.bytes, .operations = share * work.operations},
                  zero_re_, zero_im_, mean_, keys, target.re, target.im, height, 1, rows, batch, parts_, word,
                  stride, imaginary, first_key);
}

void SpectralFactors::filter(DeviceImpl& device, Spectrum& spectrum, int batch) const {
    const int pitch = spectrum_pitch(lattice_.height);
    const Range items = range(static_cast<std::size_t>(pitch / device.vector_width()), lattice_.width);
    const Kernel filter = kernel(device, "filter_spectrum", stored_);
    const LaunchWork work = solve_work(batch, 0.0, 2.0);
    if (stored_)
        device.launch(filter, items, grain(), work, factor_re_, factor_im_, mean_, spectrum.re, spectrum.im,
                      lattice_.height, lattice_.width, pitch, batch, parts_);
    else
        device.launch(filter, items, grain(), work, coefficients_, offsets_, rows_, columns_, offsets_count_,
                      mean_, spectrum.re, spectrum.im, lattice_.height, lattice_.width, pitch, batch, parts_);
}

void draw_normal_field(DeviceImpl& device, const Buffer& images, const Buffer& keys, Size lattice, int planes,
                       int batch, int level) {
    // Chunks of 64 columns take 16 blocks.
    const auto blocks = static_cast<std::size_t>((lattice.width + 63) / 64) * 16;
    device.launch(
        device.kernel("noise", "normal_field", device.lanes()),
        {blocks / static_cast<std::size_t>(device.vector_width()), static_cast<std::size_t>(lattice.height),
         static_cast<std::size_t>(batch) * static_cast<std::size_t>(planes)},
        Grain::fine,
        LaunchWork{.bytes = sizeof(float) * static_cast<double>(area(lattice)) * planes * batch,
                   .operations = operations_of_normal * static_cast<double>(area(lattice)) * planes * batch},
        images, keys, lattice.height, lattice.width, planes, static_cast<std::uint32_t>(level));
}

}  // namespace btfield::detail

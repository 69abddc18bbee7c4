#pragma once

/// \file
/// Real 2D transforms on a device. Alone owns layout, scaling and batching of spectra.
///
/// Spectra are split complex and half over the row frequency: value (kx, ky) of plane p, 0 <= kx < W,
/// 0 <= ky <= H/2, is at [(p·W + kx)·pitch + ky] of a plane of real and one of imaginary parts; images are
/// [plane][row][column]. Neither direction scales:
///     inverse: y(r) = Σ_t Y_t exp(+√−1 ω_t·r) over the whole Hermitian spectrum
///     forward: Y_t = Σ_r y(r) exp(−√−1 ω_t·r)

#include <map>
#include <memory>
#include <mutex>
#include <tuple>

#include "btfield/device.hpp"
#include "btfield/image.hpp"
#include "host/cl/buffer_pool.hpp"

namespace btfield::detail {

/// Largest prime factor that both back ends transform.
inline constexpr int fft_largest_prime = 13;

/// Longest side that both back ends transform on every device: beyond it the rows of one work group are more
/// than a CPU driver's stacks hold.
inline constexpr int fft_longest_side = 16384;

/// Bytes that lie between the passes of a packed transform, where one plane does not take more.
inline constexpr std::size_t fft_packed_room = std::size_t{16} << 20;

/// Smallest n' >= n whose prime factors are all <= 13; n itself when it is one. This is the way around for
/// other sizes: synthesise on the larger lattice and crop.
[[nodiscard]] int next_fft_size(int n);

/// ky rows are padded to a multiple of every vector width.
[[nodiscard]] constexpr int spectrum_pitch(int height) {
    return (height / 2 + 1 + 15) / 16 * 16;
}

/// Floats in one of the two parts of a spectrum of `planes` planes.
[[nodiscard]] constexpr std::size_t spectrum_floats(Size size, int planes) {
    return static_cast<std::size_t>(planes) * static_cast<std::size_t>(size.width) *
           static_cast<std::size_t>(spectrum_pitch(size.height));
}

/// Split complex spectrum in device memory.
struct Spectrum {
    Buffer re, im;
};

/// Spectra of several planes in one buffer, both parts of a plane together: the real part of plane p begins
/// at p·stride(), the imaginary one imaginary() later.
struct PackedSpectrum {
    Size size;
    [[nodiscard]] std::size_t imaginary() const { return spectrum_floats(size, 1); }
    [[nodiscard]] std::size_t stride() const { return 2 * imaginary(); }
    /// An image takes no more than its spectrum.
    [[nodiscard]] std::size_t bytes(int planes) const {
        return sizeof(float) * static_cast<std::size_t>(planes) * stride();
    }
};

/// One size, any number of planes up to the plan's batch, from any number of threads.
class Fft {
  public:
    virtual ~Fft() = default;
    /// Spectrum → images. The spectrum's content is lost.
    virtual void inverse(DeviceImpl& device, Spectrum& spectrum, Buffer& images, int planes) = 0;
    /// Whether inverse_packed() does it.
    [[nodiscard]] virtual bool takes_packed() const { return false; }
    /// The same of PackedSpectrum's planes from `first` on: the image of plane first + i begins at i·H·W of
    /// `images`, which may be the spectra's own memory where `first` is 0.
    virtual void inverse_packed(DeviceImpl& /*device*/, const Buffer& /*spectra*/, int /*first*/,
                                const Buffer& /*images*/, int /*count*/) {}
    /// Images → spectrum; padding rows of ky are left undefined.
    virtual void forward(DeviceImpl& device, const Buffer& images, Spectrum& spectrum, int planes) = 0;
    /// Cross-correlation of `count` patches with a sample of `planes` planes on the torus, not scaled:
    ///     scores_b(p) = N Σ_planes Σ_r patch_b(r) sample(p + r), N the number of pixels
    /// \param patches [patch][plane][row][column], no larger than the sample
    /// \param sample its spectrum, kept
    /// \param inside scores beyond so many rows and columns are not needed: there may be anything
    /// \param scores [patch][row][column]
    virtual void correlate(DeviceImpl& device, const Buffer& patches, Size patch, int count, int planes,
                           const Spectrum& sample, Size inside, Buffer& scores) = 0;
    /// Bytes of device memory that inverse() or forward() of this many planes takes beside its arguments.
    [[nodiscard]] virtual std::size_t scratch_bytes(int planes) const = 0;
    /// The same of inverse_packed().
    [[nodiscard]] virtual std::size_t packed_scratch_bytes(int planes) const { return scratch_bytes(planes); }
};

/// Plans of one device, made when first asked for.
class FftPlans {
  public:
    FftPlans();
    ~FftPlans();
    /// \throws DeviceError when a side has a prime factor over 13 (use next_fft_size first).
    Fft& plan(DeviceImpl& device, Size size, FftBackend backend);
    /// The back end that `automatic` means for this device and size.
    [[nodiscard]] static FftBackend resolve(const DeviceImpl& device, Size size, FftBackend backend);

  private:
    std::mutex mutex_;
    std::map<std::tuple<int, int, FftBackend>, std::unique_ptr<Fft>> plans_;
};

}  // namespace btfield::detail

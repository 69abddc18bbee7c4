#pragma once

/// \file
/// Per-frequency factors F_t of one level, S_t = F_t F_tᴴ, and what is done with them on the device.

#include <optional>
#include <vector>

#include "host/base/eigen.hpp"
#include "host/cl/device_impl.hpp"
#include "host/spectrum/spectral_form.hpp"

namespace btfield::detail {

class SpectralFactors {
  public:
    /// \param parts    one model of all planes, or single-plane models of one family; they are independent of
    ///                 each other
    /// \param lattice  of the level's transform
    /// \param scale    of F: level gain and the transform's normalisation
    /// \param mean     added to every pixel, one per plane of all parts
    /// \param budget   bytes that store() may take; beyond, and before, factors are computed where they are
    ///                 used
    /// \param indefinite of Markov models: directions in which S_t is negative are left out instead of NaN
    SpectralFactors(DeviceImpl& device, const std::vector<SpectralForm>& parts, Size lattice, double scale,
                    const std::vector<double>& mean, double budget, bool indefinite = false);

    /// Spectra of `batch` textures from noise drawn in frequency. keys: two seed words per texture, those of
    /// the first at first_key.
    void draw(DeviceImpl& device, Spectrum& spectrum, const Buffer& keys, int batch, int level,
              int first_key = 0) const;
    /// The same as a PackedSpectrum.
    void draw(DeviceImpl& device, const Buffer& packed, const Buffer& keys, int batch, int level,
              int first_key = 0) const;
    /// Spectra of noise that was drawn on the lattice → spectra of textures, in place.
    void filter(DeviceImpl& device, Spectrum& spectrum, int batch) const;
    /// 0 when they are not stored.
    [[nodiscard]] double stored_bytes() const;
    /// What they take once stored; 0 when the budget does not allow that.
    [[nodiscard]] double storable_bytes() const;

    /// Computes the factors and keeps them, where the budget allows that: worth it from the second draw on.
    void store(DeviceImpl& device);

    /// Takes roots of these densities in place of F at frequency 0 (mean_density()) when it draws.
    /// \param densities of each part; those that are empty change nothing
    void set_means(DeviceImpl& device, const std::vector<std::optional<Eigen::MatrixXd>>& densities);

  private:
    /// Where spectra of a batch go: planes `stride` floats apart, imaginary parts so far behind im
    struct Target {
        const Buffer &re, &im;
        std::size_t stride, imaginary;
    };
    void draw(DeviceImpl& device, const Target& target, const Buffer& keys, int batch, int level,
              int first_key) const;
    /// Puts roots_ at frequency 0 of factors that are stored for so many frequencies.
    void put_means(DeviceImpl& device, const Buffer& factor_re, const Buffer& factor_im,
                   std::size_t frequencies) const;
    /// Values of ky whose noise is drawn together with that of frequency 0.
    [[nodiscard]] int rows_at_zero() const;
    [[nodiscard]] Kernel kernel(DeviceImpl& device, const char* name, bool stored) const;
    [[nodiscard]] Grain grain() const;

    [[nodiscard]] Range range(std::size_t vectors, int columns) const;
    /// Of one of their two parts.
    [[nodiscard]] std::size_t factor_bytes() const;
    /// Of F z where factors are stored, and so many operations for each z; spectra go by so many times.
    [[nodiscard]] LaunchWork solve_work(int batch, double operations, double passes) const;

    SpectralForm::Kind kind_;
    int planes_;  ///< of one part
    int parts_;
    Size lattice_;
    double scale_;
    int offsets_count_;
    std::vector<int> row_steps_;    ///< distinct rows of the offsets
    std::size_t column_steps_ = 0;  ///< distinct columns
    bool storable_ = false, stored_ = false;
    bool indefinite_;
    Buffer coefficients_, offsets_, rows_, columns_, mean_;
    Buffer factor_re_, factor_im_;
    /// Of each part, what F is at frequency 0; empty: what it is anyway.
    std::vector<std::vector<float>> roots_;
    Buffer zero_re_, zero_im_;  ///< where there are any: factors of kx = 0, the first rows_at_zero()
};

/// White noise on the lattice: [texture · planes + plane][row][column], textures in the order of the keys.
void draw_normal_field(DeviceImpl& device, const Buffer& images, const Buffer& keys, Size lattice, int planes,
                       int batch, int level);

}  // namespace btfield::detail

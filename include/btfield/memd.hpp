#pragma once

/// \file
/// Mean exhaustive minimum distance of the colours of two pictures (theory 15.2; P4 eq. 50).

#include <array>
#include <cstddef>
#include <functional>
#include <memory>
#include <span>
#include <string_view>
#include <vector>

#include "btfield/api.hpp"
#include "btfield/device.hpp"
#include "btfield/image.hpp"

namespace btfield {

/// ρ of P4 eq. 50, over planes.
enum class Metric {
    max,  ///< largest difference: the one whose largest value is P4's MEMD_max = 255
    l1,   ///< sum of differences
    l2,   ///< Euclidean
};

/// "max", "l1", "l2".
[[nodiscard]] BTFIELD_API std::string_view name(Metric metric);
/// Inverse of name().
/// \throws InputError for any other text
[[nodiscard]] BTFIELD_API Metric metric(std::string_view name);

/// Largest distance of two colours in units 0…255: 255 for max, 255 d for l1, 255 √d for l2.
[[nodiscard]] BTFIELD_API double memd_max(Metric metric, int planes);

/// How nearest pixels are found. Results are equal to the bit, times are not.
enum class MemdSearch {
    /// On a CPU the host's tree: the device's cores are the host's. On other devices exhaustive where A has
    /// thousands of pixels and B few colours, else the host's tree.
    automatic,
    host_tree,   ///< a tree of B's colours, searched on one core for one pixel after the other
    exhaustive,  ///< candidates from comparing with every colour of B on the device: the baseline
};

struct MemdOptions {
    Metric metric = Metric::max;
    /// Value of each picture, A and B, that is 255 units: 1 for pictures in [0, 1], the white level for HDR.
    std::array<double, 2> white{1.0, 1.0};
    bool local_errors = false;  ///< fill Memd::local_errors
    MemdSearch search = MemdSearch::automatic;
    /// Called now and then with the share of the pixels that are found, in the caller's thread; what it
    /// throws ends the search.
    std::function<void(double)> progress{};
};

struct Memd {
    double memd = 0.0;                    ///< units 0…255
    double memd_star = 0.0;               ///< 100 memd / memd_max, percent
    std::array<std::size_t, 2> pixels{};  ///< of A and of B
    /// Error of every pixel of A in raster order, units 0…255; −1 where B had no pixel left. On request only.
    std::vector<float> local_errors;
    double search_seconds = 0.0;  ///< without the preparation of A
};

/// MEMD(A, B): pixels of A in raster order; each takes the nearest pixel of B that is not yet taken, the one
/// of lowest raster index among equals; mean over min(|A|, |B|) local errors. Sizes may differ, planes may
/// not.
///
/// The value is defined to the bit, and every device gives it: colours are y = v · (255 / white) in float32
/// (the quotient rounded to float32 first), |y| < 2⁻³⁹ counts as 0; |y_A − y_B|, its square and the sum in
/// plane order are float32, each rounded once; l2 is compared squared, and its local error is the float64
/// root; the mean is summed in float64 in raster order.
/// \throws InputError when planes differ, a picture is empty, a value is NaN, infinite or beyond 10¹⁵ units,
///     or the white level is not a positive number
[[nodiscard]] BTFIELD_API Memd memd(Device& device, const Image& a, const Image& b,
                                    const MemdOptions& options);
[[nodiscard]] BTFIELD_API Memd memd(Device& device, const Image& a, const Image& b,
                                    Metric metric = Metric::max);

/// One reference A held against many candidates: A's colours are prepared once, and stay on a device that
/// searches. The device is to outlive it. Any number of threads may ask at a time.
class BTFIELD_API MemdReference {
  public:
    MemdReference(Device& device, const Image& a, const MemdOptions& options = {});
    ~MemdReference();
    MemdReference(MemdReference&&) noexcept;
    MemdReference& operator=(MemdReference&&) noexcept;
    /// MEMD(A, candidate); the same value as memd().
    /// \throws InputError as memd() does
    [[nodiscard]] Memd operator()(const Image& candidate);

  private:
    class Impl;
    std::unique_ptr<Impl> impl_;
};

}  // namespace btfield

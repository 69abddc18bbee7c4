#include "host/cl/tuning.hpp"

#include <limits>

namespace btfield::detail {

namespace {

constexpr std::size_t mebibyte = std::size_t{1} << 20;

constexpr Tuning cpu{
    .widest_vector = 16,
    .fine_group = 8,
    .coarse_group = 1,
    .serial_group = 1,
    .local_tiles = false,
    .fft = FftBackend::lanes,
    .memory_share = 0.7,
    .batch_bytes = 16 * mebibyte,
    .largest_batch = 64,
    .factor_bytes = 256 * mebibyte,
    .whole_fields = 2,
    .row_parts = 2,
    .row_part_steps = 0,
    .stack_values = std::size_t{1} << 21,
    .memd_pixels = std::numeric_limits<std::size_t>::max(),
    .memd_colours = 0,
    .memd = {},
};

/// Not measured on a GPU. Work-groups are two of NVIDIA's or one of AMD's waves; the limit of MEMD's colours
/// is low because only then the search is a matter of microseconds on any GPU.
constexpr Tuning gpu{
    .widest_vector = 1,
    .fine_group = 64,
    .coarse_group = 1,
    .serial_group = 64,
    .local_tiles = true,
    .fft = FftBackend::clfft,
    .memory_share = 0.9,
    .batch_bytes = 1024 * mebibyte,
    .largest_batch = 64,
    .factor_bytes = std::size_t{1} << 40,
    .whole_fields = 0,
    .row_parts = 0,
    .row_part_steps = 16,
    .stack_values = std::size_t{1} << 23,
    .memd_pixels = 8192,
    .memd_colours = 4096,
    .memd = {.tile = 16},
};

}  // namespace

const Tuning& tuning(DeviceType type) {
    return type == DeviceType::cpu ? cpu : gpu;
}

}  // namespace btfield::detail

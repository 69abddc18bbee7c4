#pragma once

/// \file
/// Thresholds that were measured, or that stand for a measurement, by kind of device. None changes a result
/// beyond the order in which transforms add.
///
/// Those of a CPU suit 2 cores with AVX-512 under PoCL 3.1; where a comment gives figures, they come from the
/// command beside them, which shows the others' effect. Those of other devices are estimates: none has been
/// measured on a GPU.

#include <cstddef>

#include "btfield/device.hpp"

namespace btfield::detail {

/// How much one work-item does.
enum class Grain {
    fine,    ///< a few vectors: many work-items share a work-group
    coarse,  ///< a whole row with private arrays: one work-item to a work-group
    serial,  ///< steps that wait for each other, in few registers: alone on a core, beside others on a GPU
};

/// How the search of MEMD on a device is cut up (`./dev bench '^memd'`).
struct MemdBlocks {
    int candidates = 2;          ///< for each pixel of A: with more, the host searches for fewer itself
    std::size_t smallest = 512;  ///< pixels of a block: a launch must be worth its while
    std::size_t largest = 8192;
    std::size_t parts = 48;  ///< a block takes at most this part of B's pixels that are left
    /// Share of pixels whose candidates were all gone from which the host goes on alone.
    double hopeless = 0.5;
    /// Blocks of 16 colours that a work-group holds in local memory, where they fit; 0: read where they lie.
    int tile = 0;
};

struct Tuning {
    /// BTFIELD_VECTOR_WIDTH at most; below, the device's native width. Scalar kernels draw 0.08 G normals a
    /// second where float16 ones draw 1.0 (`./dev bench '^noise, 3 planes'`).
    int widest_vector;
    /// Work-items of a work-group. On a CPU a group is what a thread takes at once: noise in groups of 1
    /// takes 1.06 times as long as in groups of 8, in groups of 64, which 512 columns do not fill, 1.35 times
    /// (`./dev bench '^(noise|pyramid|planes)'` with DeviceOptions::work_group_size).
    std::size_t fine_group, coarse_group, serial_group;
    /// Whether work-groups bring what they share into local memory. On a CPU that is the cache which held it
    /// already: pairs of MEMD take 1.2 times as long (`./dev bench '^(convolution|memd pairs)'`).
    bool local_tiles;
    /// Back end of transforms unless one is asked for: 3 planes of 512² take 1.0 ms by lanes, 12 to 20 ms by
    /// clFFT (`./dev bench '^fft'`).
    FftBackend fft;

    /// Part of the memory that synthesis may plan with; a CPU shares it with everything else. A policy, not a
    /// measurement.
    double memory_share;
    /// Textures of a batch share launches while what they touch together stays within this much memory: the
    /// last-level cache of a CPU, and on a GPU enough to fill it (`./dev bench '^synthesis 512'`).
    std::size_t batch_bytes;
    int largest_batch;
    /// Bytes of factors that a synthesiser keeps at most: on a CPU no more than lets a large texture grow in
    /// three times its own memory.
    std::size_t factor_bytes;
    /// Fields of a recursion to a compute unit from which a work-item makes a whole field; 0: never, as one
    /// work-item leaves a GPU's compute unit idle (`./dev bench '^noise and raster'`).
    int whole_fields;
    /// A row of a recursion is cut into this many parts to a compute unit, one launch each, or, where 0, into
    /// parts of so many steps: short ones keep more rows at work, long ones take fewer launches
    /// (`./dev bench '^noise and raster'`).
    int row_parts, row_part_steps;

    /// Values of pictures under lights that are fitted in one launch: on a CPU they stay in its cache from
    /// being brought there to being fitted (`./dev bench '^relief ls'`).
    std::size_t stack_values;

    /// Pixels from which MEMD searches on the device, and colours of B up to which it does: comparing with
    /// every colour has no branches that diverge, but the host's tree looks at few. On a CPU, whose cores are
    /// the host's, the tree takes a tenth of the time (`./dev bench '^memd'`), so it never does.
    std::size_t memd_pixels, memd_colours;
    MemdBlocks memd;
};

[[nodiscard]] const Tuning& tuning(DeviceType type);

/// Products that a convolution adds up for one value, up to which it is expected to be faster than a
/// transform there and back. Its cost grows with this number; that of the transforms hardly depends on the
/// support. 512 x 512 RGB, whole textures: 15 products 0.6 to 0.8 of the transforms' time, 39 0.85 to 0.95,
/// 75 1.0, 135 1.3 to 1.6 (`./dev bench '^(convolution|synthesis 512)'`). One number for all devices: the
/// lattice follows from it, and with it the picture.
inline constexpr std::size_t largest_convolution = 64;

}  // namespace btfield::detail

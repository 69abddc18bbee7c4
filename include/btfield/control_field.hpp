#pragma once

/// \file
/// Control fields (theory 18.1, 18.2; P1 2.1): which region of a material each pixel belongs to, found by
/// clustering, and as pictures that people read and paint.

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "btfield/api.hpp"
#include "btfield/image.hpp"

namespace btfield {

/// More regions than any material needs; kernels keep sets of regions in 32 bits.
inline constexpr int most_regions = 32;

/// X: labels 0 … K − 1 on the torus.
struct ControlField {
    Size size;
    int regions = 0;                   ///< K, 1 to most_regions
    std::vector<std::uint8_t> labels;  ///< [row][column], each below K
};

/// \throws InputError naming the first defect: an empty size, K out of range, another number of labels than
///     pixels, a label that is not below K
BTFIELD_API void check(const ControlField& field);

/// Share of pixels of each region, sum 1.
[[nodiscard]] BTFIELD_API std::vector<double> shares(const ControlField& field);

/// The field on a lattice of another size: begun again where it ends, or cut off.
/// Precondition: check() accepts the field.
[[nodiscard]] BTFIELD_API ControlField on_lattice(const ControlField& field, Size lattice);

/// In which planes pixels are compared when they are clustered.
enum class ClusterSpace {
    automatic,  ///< lab for colour pictures of three planes, planes otherwise
    lab,        ///< L*a*b* of the slightly smoothed picture, its planes taken as R, G, B
    rgb,        ///< the values as they are, unsmoothed, as in P1 2.1
    planes,     ///< any planes, slightly smoothed, each in units of its standard deviation
};
/// "auto", "lab", "rgb", "planes".
[[nodiscard]] BTFIELD_API std::string_view name(ClusterSpace space);

struct ClusterOptions {
    /// K; without one, the largest of at most `most` regions such that any two regional distributions of
    /// values are `divergence` apart and every region has `pixels` pixels (theory 18.2; P1 2.1).
    std::optional<int> regions;
    int most = 12;
    /// Symmetric Kullback-Leibler divergence, in nats.
    double divergence = 0.25;
    std::size_t pixels = 500;
    ClusterSpace space = ClusterSpace::automatic;
    std::uint64_t seed = 0;
};

struct Clustering {
    ControlField field;  ///< regions in the order of their mean over all planes, darkest first
    std::string reason;  ///< why there are as many regions; empty where K was given
};

/// k-means, the best of several starts.
/// \throws InputError when the picture is empty, holds a NaN or infinity, K is out of range, or there are
///     fewer distinct colours than regions
[[nodiscard]] BTFIELD_API Clustering cluster(const Image& image, const ClusterOptions& options = {});

/// A region's colour in a label picture.
using PaletteColour = std::array<std::uint8_t, 3>;

/// Writes an 8-bit PNG with a palette: pixel value = label. The file appears complete or not at all.
/// \throws InputError when check() refuses the field, there are fewer colours than regions, the name does not
///     end in .png, or the file cannot be written
BTFIELD_API void write_labels(const std::filesystem::path& path, const ControlField& field,
                              std::span<const PaletteColour> palette);

/// Reads labels of a field with K = palette.size() regions. A PNG with a palette and a grey picture of 8 bits
/// are read by value: the value is the label. Any other picture of 8 bits is read by colour: each must be one
/// of the palette's.
/// \throws InputError when the file cannot be read, a value is not below K (the message names the value and
///     where it is), or a colour is not in the palette (the message names it, where it is, and the nearest)
[[nodiscard]] BTFIELD_API ControlField read_labels(const std::filesystem::path& path,
                                                   std::span<const PaletteColour> palette);

}  // namespace btfield

#pragma once

/// \file
/// Height, slopes and normals of a surface over a lattice (theory 19). x points right, y up, z to the
/// viewer; heights are in pixels, so a slope is a rise in pixels for each pixel. Slopes are two planes, ∂h/∂x
/// along columns and −∂h/∂y, the one down the rows; normals are three planes x, y, z of unit vectors. All
/// three are tied by one operator, the central difference.

#include <cstdint>
#include <optional>

#include "btfield/api.hpp"
#include "btfield/device.hpp"
#include "btfield/image.hpp"
#include "btfield/image_io.hpp"

namespace btfield {

/// How a surface goes on beyond its picture.
enum class SurfaceEdges {
    mirror,    ///< reflected: the pixel beyond an edge is that at the edge
    periodic,  ///< on the torus
};

/// What is taken out of a height that measurements are known to get wrong.
enum class Flattening {
    none,
    plane,  ///< the plane that fits best: a sample that lay askew. A torus has none
    low,    ///< and waves longer than the shorter side: a bowl that light from near leaves
};

/// Which way the second colour of a normal map points.
enum class NormalConvention {
    opengl,   ///< up
    directx,  ///< down
};

struct SlopeField {
    Image slopes;
    /// Pixels whose slope was cut to that of 86 degrees: their normals lie in the plane or point away.
    std::uintmax_t cut = 0;
};

/// (n_x, −n_y) / −n_z, so that a surface rises to the right where its normal leans left. Normals need not be
/// of unit length; those of length 0 are level.
/// \throws InputError unless there are three planes
[[nodiscard]] BTFIELD_API SlopeField slopes_of_normals(const Image& normals);

/// Half the difference of the neighbours right and left, below and above.
/// \throws InputError unless there is one plane
[[nodiscard]] BTFIELD_API Image slopes_of_height(const Image& height, SurfaceEdges edges);

/// Unit vectors.
/// \throws InputError unless there are two planes
[[nodiscard]] BTFIELD_API Image normals_of_slopes(const Image& slopes);

struct CoarseHeight {
    Image height;
    /// Waves longer than this many pixels are the coarse height's, shorter ones the slopes'. At least 4.
    double wavelength = 64.0;
};

struct IntegrationOptions {
    SurfaceEdges edges = SurfaceEdges::mirror;
    Flattening flattening = Flattening::none;
    /// A height that is right where slopes are not: in the large.
    std::optional<CoarseHeight> coarse;
    /// Whether normals were measured: what nearly alternates from pixel to pixel, of which central
    /// differences see little and which then is noise, is left out.
    bool measured = false;
};

/// The height h whose slopes come closest, in least squares, in closed form; with a coarse height h₀, that
/// for which |∇h − slopes|² + μ |h − h₀|² is least. Inverts slopes_of_height(), but for the mean, which is
/// 0, and on the torus for what alternates from pixel to pixel and has no slopes. Any size: a side with a
/// prime factor over 13 takes time in proportion to its third power.
/// \throws InputError unless there are two planes, all finite, and the coarse height has one of their size
[[nodiscard]] BTFIELD_API Image integrate(Device& device, const Image& slopes,
                                          const IntegrationOptions& options = {});

/// Factor on the height for which its slopes come closest to these: how far apart black and white of a height
/// map are, in pixels. 0 where they tell nothing.
/// \throws InputError unless sizes agree
[[nodiscard]] BTFIELD_API double height_scale(const Image& slopes, const Image& height, SurfaceEdges edges);

/// Unit vectors of a picture of a normal map. Whole numbers stand for [−1, 1]; floats for themselves, unless
/// their lengths say that they are coded like whole numbers. Vectors of length 0 become (0, 0, 1).
/// \throws InputError unless there are three planes, or when no vector points to the viewer
[[nodiscard]] BTFIELD_API Image decode_normals(const Picture& picture,
                                               NormalConvention convention = NormalConvention::opengl);

/// As values from 0 to 1, for PNG and its like.
[[nodiscard]] BTFIELD_API Image encode_normals(const Image& normals,
                                               NormalConvention convention = NormalConvention::opengl);

/// Of heights in 16 bits: the mean plane, 0, is 32768.
inline constexpr double mid_grey = 32768.0 / 65535.0;

/// Least distance, in pixels, between black and white that holds all heights about 0. Above 0.
[[nodiscard]] BTFIELD_API double encoded_height_scale(const Image& height);

/// mid_grey + h / scale.
[[nodiscard]] BTFIELD_API Image encode_height(const Image& height, double scale);

}  // namespace btfield

// From Gaussian eigenplanes of the residual and the conditional mean to the picture's planes (theory 18.5): of a pixel in
// region k
//
//     y = c_k + a_k (b_k (M − c_k) + μ_k + T_kᵀ q_k(W_k x)),
//
// c the region's colour, a its contrast, b its structure, and P1's treatment of borders.

#include "base/lanes.clh"

#ifndef BTFIELD_PLANES
#error "BTFIELD_PLANES (number of planes d) is not defined"
#endif
#ifndef BTFIELD_RANK
#error "BTFIELD_RANK (number of eigenplanes r) is not defined"
#endif

#define D BTFIELD_PLANES
#define RANK BTFIELD_RANK

#ifdef BTFIELD_KERNEL_restore_regions
// numbers: of each region a, b, knots (0: q(x) = x), c [d], μ [d], W [r][r], T [r][d]
// tables: [region][eigenplane][knot_stride][2], q_k and q_{k+1} − q_k by turns
// x: [eigenplane][row][pitch]; labels, mean and out: [row][width], out over mean.
// Work-item (vector of columns, row).
__kernel void restore_regions(__global const float* x, __global float* mean, __global const uchar* labels,
                              __global const float* numbers, __global const float* tables, int knot_stride, float reach,
                              int height, int width, int lattice_height, int pitch) {
    const int column = (int)get_global_id(0) * VW;
    const int row = (int)get_global_id(1);
    if (column >= width) return;
    const int count = min(VW, width - column);
    const size_t plane_size = (size_t)height * width, at = (size_t)row * width + column;
    const size_t lattice_size = (size_t)lattice_height * pitch;
    const int stride = 3 + 2 * D + RANK * RANK + RANK * D;
    for (int l = 0; l < count; ++l) {
        const int k = labels[at + l];
        __global const float* own = numbers + k * stride;
        const float contrast = own[0], structure = own[1];
        const int knots = (int)own[2];
        __global const float *colour = own + 3, *centre = colour + D, *w = centre + D, *t = w + RANK * RANK;
        float m[RANK];
        for (int i = 0; i < RANK; ++i) {
            float sum = 0.0f;
            for (int j = 0; j < RANK; ++j)
                sum = fma(w[i * RANK + j], x[j * lattice_size + (size_t)row * pitch + column + l], sum);
            if (knots > 0) {
                const float last = (float)(knots - 1);
                const float u = fma(sum, last / (2.0f * reach), 0.5f * last);
                const float inside = u < 0.0f ? 0.0f : u > last ? last : u;  // a NaN stays one
                const int n = clamp((int)inside, 0, knots - 2);
                __global const float* q = tables + 2 * ((size_t)(k * RANK + i) * knot_stride + n);
                sum = fma(inside - (float)n, q[1], q[0]);
            }
            m[i] = sum;
        }
        for (int p = 0; p < D; ++p) {
            float y = centre[p];
            for (int i = 0; i < RANK; ++i) y = fma(t[i * D + p], m[i], y);
            const size_t to = p * plane_size + at + l;
            mean[to] = fma(contrast, fma(structure, mean[to] - colour[p], y), colour[p]);
        }
    }
}
#endif

// A random word of a pixel: MurmurHash3's finalisation.
inline uint pixel_word(uint2 seed, uint pixel, uint turn) {
    uint h = pixel * 0x9e3779b9u ^ seed.x ^ (turn * 0x85ebca6bu);
    h ^= h >> 16;
    h *= 0x85ebca6bu;
    h ^= h >> 13;
    h = (h ^ seed.y) * 0xc2b2ae35u;
    return h ^ (h >> 16);
}

#ifdef BTFIELD_KERNEL_swap_pixels
// Pixels whose neighbour, below or to the right, is of another region change places with it, every other time.
//   across: 1 with the right neighbour, 0 with the one below; parity: of the column or row that pairs begin at
// Work-item (pair along the row or column, the other index).
__kernel void swap_pixels(__global float* planes, __global const uchar* labels, uint2 seed, uint turn, int across,
                          int parity, int height, int width) {
    const int first = 2 * (int)get_global_id(0) + parity, other = (int)get_global_id(1);
    const int side = across ? width : height;
    if (first >= side || (side % 2 == 1 && first == side - 1)) return;
    const int next = first + 1 < side ? first + 1 : 0;
    const size_t a = across ? (size_t)other * width + first : (size_t)first * width + other;
    const size_t b = across ? (size_t)other * width + next : (size_t)next * width + other;
    if (labels[a] == labels[b] || (pixel_word(seed, (uint)a, turn) & 1u) == 0) return;
    const size_t plane_size = (size_t)height * width;
    for (int p = 0; p < D; ++p) {
        const float value = planes[p * plane_size + a];
        planes[p * plane_size + a] = planes[p * plane_size + b];
        planes[p * plane_size + b] = value;
    }
}
#endif

#ifdef BTFIELD_KERNEL_smooth_borders
// [1 2 1]/4 along both axes at pixels that have another region among their eight neighbours; others as they are.
// Work-item (column, row).
__kernel void smooth_borders(__global const float* in, __global float* out, __global const uchar* labels, int height,
                             int width) {
    const int column = (int)get_global_id(0), row = (int)get_global_id(1);
    if (column >= width) return;
    const int columns[3] = {column > 0 ? column - 1 : width - 1, column, column + 1 < width ? column + 1 : 0};
    const int rows[3] = {row > 0 ? row - 1 : height - 1, row, row + 1 < height ? row + 1 : 0};
    const size_t plane_size = (size_t)height * width, at = (size_t)row * width + column;
    int border = 0;
    for (int r = 0; r < 3; ++r)
        for (int c = 0; c < 3; ++c) border |= labels[(size_t)rows[r] * width + columns[c]] != labels[at];
    for (int p = 0; p < D; ++p) {
        __global const float* plane = in + p * plane_size;
        float sum = plane[at];
        if (border) {
            sum = 0.0f;
            for (int r = 0; r < 3; ++r)
                for (int c = 0; c < 3; ++c)
                    sum += (r == 1 ? 0.5f : 0.25f) * (c == 1 ? 0.5f : 0.25f) * plane[(size_t)rows[r] * width + columns[c]];
        }
        out[p * plane_size + at] = sum;
    }
}
#endif

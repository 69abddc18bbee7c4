// The conditional mean of a picture given the labels around each pixel (theory 18.3): labels are mapped to numbers first
// and smoothed afterwards, so that the number of regions does not count. By Horner's rule over the scales,
//
//     M = μ + U_0 + h_0 (U_1 + h_1 (U_2 + h_2 (U_3 + h_3 U_4))),
//
// U_0 the numbers of the pixel itself and its eight neighbours, U_s those of scale s with their derivatives, h_s what
// smooths scale s to the next.

#include "base/lanes.clh"

#ifndef BTFIELD_PLANES
#error "BTFIELD_PLANES (number of planes d) is not defined"
#endif
#define D BTFIELD_PLANES
// Planes by fours: one look-up brings those of a label.
#define QUADS ((D + 3) / 4)

inline int around(int i, int n) {
    i %= n;
    return i < 0 ? i + n : i;
}

#ifdef BTFIELD_KERNEL_smooth_down
// Five taps along columns of the lattice, `step` rows apart: [plane][row][column]. taps: at 0, ±1, ±2.
// Work-item (vector of columns, row, plane).
__kernel void smooth_down(__global const float* in, __global float* out, float t0, float t1, float t2, int step,
                          int height, int width) {
    const int column = (int)get_global_id(0) * VW;
    const int row = (int)get_global_id(1);
    if (column >= width) return;
    const int count = min(VW, width - column);
    __global const float* plane = in + get_global_id(2) * (size_t)height * width + column;
    const REALN a = load_up_to(plane + (size_t)around(row - 2 * step, height) * width, count);
    const REALN b = load_up_to(plane + (size_t)around(row - step, height) * width, count);
    const REALN c = load_up_to(plane + (size_t)row * width, count);
    const REALN d = load_up_to(plane + (size_t)around(row + step, height) * width, count);
    const REALN e = load_up_to(plane + (size_t)around(row + 2 * step, height) * width, count);
    const REALN sum = fma((REALN)(t0), c, fma((REALN)(t1), b + d, (REALN)(t2) * (a + e)));
    store_up_to(sum, out + (get_global_id(2) * height + row) * (size_t)width + column, count);
}
#endif

#ifdef BTFIELD_KERNEL_smooth_across
// The same along rows. Work-item (vector of columns, row, plane).
__kernel void smooth_across(__global const float* in, __global float* out, float t0, float t1, float t2, int step,
                            int height, int width) {
    const int column = (int)get_global_id(0) * VW;
    if (column >= width) return;
    const size_t line = (get_global_id(2) * height + get_global_id(1)) * width;
    __global const float* from = in + line;
    __global float* to = out + line + column;
    if (column >= 2 * step && column + VW + 2 * step <= width) {
        __global const float* at = from + column;
        const REALN ends = LOADN(at - 2 * step) + LOADN(at + 2 * step);
        const REALN beside = LOADN(at - step) + LOADN(at + step);
        STOREN(fma((REALN)(t0), LOADN(at), fma((REALN)(t1), beside, (REALN)(t2) * ends)), to);
        return;
    }
    for (int l = 0; l < min(VW, width - column); ++l) {
        const int x = column + l;
        const float ends = from[around(x - 2 * step, width)] + from[around(x + 2 * step, width)];
        const float beside = from[around(x - step, width)] + from[around(x + step, width)];
        to[l] = fma(t0, from[x], fma(t1, beside, t2 * ends));
    }
}
#endif

#ifdef BTFIELD_KERNEL_add_context
// planes [plane][row][column] ← (what was there) + U_s.
//   labels: [row][column]; weights: [region][filter][plane] by fours, `filter` the first of the scale: value, and where
//   step > 0 the derivatives down and across
//   step: how far derivatives look; 0: of the pixel itself, to which the mean is added
//   pairs: where step is 0, the first filter of those that take half the sum of two neighbours opposite each other: above
//   and below, left and right, on the falling diagonal and on the rising one; 0: none
//   accumulate: 0 at the coarsest scale, where nothing is there yet
// Work-item (vector of columns, row).
__kernel void add_context(__global float* planes, __global const uchar* labels, __global const float4* weights,
                          int filters, int filter, int pairs, __global const float* mean, int step, int accumulate,
                          int height, int width) {
    const int column = (int)get_global_id(0) * VW;
    const int row = (int)get_global_id(1);
    if (column >= width) return;
    const int count = min(VW, width - column);
    const size_t plane_size = (size_t)height * width;
    __global const uchar* line = labels + (size_t)row * width;
    const int reach = step > 0 ? step : 1;
    __global const uchar* above = labels + (size_t)around(row - reach, height) * width;
    __global const uchar* below = labels + (size_t)around(row + reach, height) * width;
    float sums[4 * QUADS * VW];
    const int stride = filters * QUADS;
    __global const float4* w = weights + filter * QUADS;
    for (int l = 0; l < VW; ++l) {
        const int x = min(column + l, width - 1);
        __global const float4* value = w + line[x] * stride;
        const int before = x >= reach ? x - reach : around(x - reach, width);
        const int after = x + reach < width ? x + reach : around(x + reach, width);
        __global const float4 *down = w + below[x] * stride + QUADS, *up = w + above[x] * stride + QUADS;
        __global const float4 *right = w + line[after] * stride + 2 * QUADS, *left = w + line[before] * stride + 2 * QUADS;
        __global const float4* ring = weights + pairs * QUADS;
        for (int q = 0; q < QUADS; ++q) {
            float4 sum = value[q];
            if (step > 0) sum += 0.5f * ((down[q] - up[q]) + (right[q] - left[q]));
            if (pairs > 0) {
                const float4 column_pair = ring[above[x] * stride + q] + ring[below[x] * stride + q];
                const float4 row_pair = ring[line[before] * stride + QUADS + q] + ring[line[after] * stride + QUADS + q];
                const float4 falling = ring[above[before] * stride + 2 * QUADS + q] + ring[below[after] * stride + 2 * QUADS + q];
                const float4 rising = ring[above[after] * stride + 3 * QUADS + q] + ring[below[before] * stride + 3 * QUADS + q];
                sum += 0.5f * ((column_pair + row_pair) + (falling + rising));
            }
            sums[(4 * q) * VW + l] = sum.x;
            sums[(4 * q + 1) * VW + l] = sum.y;
            sums[(4 * q + 2) * VW + l] = sum.z;
            sums[(4 * q + 3) * VW + l] = sum.w;
        }
    }
    for (int p = 0; p < D; ++p) {
        __global float* to = planes + p * plane_size + (size_t)row * width + column;
        REALN sum = LOADN(sums + p * VW);
        if (step == 0) sum += mean[p];
        if (accumulate) sum += load_up_to(to, count);
        store_up_to(sum, to, count);
    }
}
#endif

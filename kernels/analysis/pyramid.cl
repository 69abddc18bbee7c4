// Gaussian-Laplacian pyramid on the torus, separable (theory 2).
//
// Rows may be pitched (a level synthesised on a larger lattice than it needs); indices wrap at the level's own size.
// Weights: 2·RADIUS + 1 taps of w for reduce; for expand the same times the factor n.

#include "base/lanes.clh"

#ifndef BTFIELD_FACTOR
#error "BTFIELD_FACTOR (reduction factor n) is not defined"
#endif
#ifndef BTFIELD_RADIUS
#error "BTFIELD_RADIUS (taps on each side) is not defined"
#endif

#define F BTFIELD_FACTOR
#define R BTFIELD_RADIUS

inline int wrap(int i, int n) {
    i %= n;
    return i < 0 ? i + n : i;
}

#ifdef BTFIELD_KERNEL_reduce_rows
// fine [plane][fine_height][width] → out [plane][height][width], height = ceil(fine_height/n).
// Work-item (vector of columns, row, plane).
__kernel void reduce_rows(__global const float* fine, __global float* out, __constant float* weights, int fine_height,
                          int height, int width) {
    const int x = (int)get_global_id(0) * VW;
    const int row = (int)get_global_id(1);
    const size_t plane = get_global_id(2);
    if (x >= width) return;
    const int n = min(VW, width - x);
    __global const float* in = fine + plane * fine_height * width + x;
    __global float* target = out + (plane * height + row) * width + x;
    if (n == VW) {
        REALN sum = 0.0f;
        for (int t = -R; t <= R; ++t)
            sum = fma((REALN)(weights[t + R]), LOADN(in + (size_t)wrap(row * F + t, fine_height) * width), sum);
        STOREN(sum, target);
    } else {
        for (int l = 0; l < n; ++l) {
            float sum = 0.0f;
            for (int t = -R; t <= R; ++t)
                sum = fma(weights[t + R], in[(size_t)wrap(row * F + t, fine_height) * width + l], sum);
            target[l] = sum;
        }
    }
}
#endif

#ifdef BTFIELD_KERNEL_reduce_columns
// in [plane][height][fine_width] → out [plane][height][width], width = ceil(fine_width/n).
// Work-item (vector of columns, row, plane).
__kernel void reduce_columns(__global const float* in, __global float* out, __constant float* weights, int fine_width,
                             int height, int width) {
    const int x = (int)get_global_id(0) * VW;
    const int row = (int)get_global_id(1);
    const size_t plane = get_global_id(2);
    if (x >= width) return;
    const int n = min(VW, width - x);
    __global const float* line = in + (plane * height + row) * fine_width;
    __global float* target = out + (plane * height + row) * width + x;
    const int inside = x * F >= R && (x + VW - 1) * F + R < fine_width;
    float sums[VW];
    for (int l = 0; l < n; ++l) {
        float sum = 0.0f;
        const int centre = (x + l) * F;
        if (inside)
            for (int t = -R; t <= R; ++t) sum = fma(weights[t + R], line[centre + t], sum);
        else
            for (int t = -R; t <= R; ++t) sum = fma(weights[t + R], line[wrap(centre + t, fine_width)], sum);
        sums[l] = sum;
    }
    for (int l = 0; l < n; ++l) target[l] = sums[l];
}
#endif

#ifdef BTFIELD_KERNEL_expand_rows
// coarse [plane][coarse_lattice_height][coarse_pitch], of which coarse_height rows wrap, → out [plane][height][width].
// Work-item (vector of columns, fine row, plane).
__kernel void expand_rows(__global const float* coarse, __global float* out, __constant float* weights,
                          int coarse_height, int coarse_lattice_height, int coarse_pitch, int height, int width) {
    const int x = (int)get_global_id(0) * VW;
    const int row = (int)get_global_id(1);
    const size_t plane = get_global_id(2);
    if (x >= width) return;
    const int n = min(VW, width - x);
    __global const float* in = coarse + plane * coarse_lattice_height * coarse_pitch + x;
    __global float* target = out + (plane * height + row) * width + x;
    // Coarse rows m with |row − n·m| <= R.
    const int first = row >= R ? (row - R + F - 1) / F : -((R - row) / F);
    const int last = (row + R) / F;
    if (n == VW) {
        REALN sum = 0.0f;
        for (int m = first; m <= last; ++m)
            sum = fma((REALN)(weights[row - m * F + R]), LOADN(in + (size_t)wrap(m, coarse_height) * coarse_pitch), sum);
        STOREN(sum, target);
    } else {
        for (int l = 0; l < n; ++l) {
            float sum = 0.0f;
            for (int m = first; m <= last; ++m)
                sum = fma(weights[row - m * F + R], in[(size_t)wrap(m, coarse_height) * coarse_pitch + l], sum);
            target[l] = sum;
        }
    }
}
#endif

#ifdef BTFIELD_KERNEL_expand_columns
// fine ← base + scale · expanded line of coarse: coarse [plane][height][coarse_width], base [plane][base_lattice_height]
// [base_pitch]. Work-item (vector of coarse columns, fine row, plane).
__kernel void expand_columns(__global const float* coarse, __global const float* base, __global float* fine,
                             __constant float* weights, int coarse_width, int base_lattice_height, int base_pitch,
                             int height, int width, float scale) {
    const int m0 = (int)get_global_id(0) * VW;
    const int row = (int)get_global_id(1);
    const size_t plane = get_global_id(2);
    if (m0 >= coarse_width) return;
    __global const float* in = coarse + (plane * height + row) * coarse_width;
    __global const float* add = base + (plane * base_lattice_height + row) * base_pitch;
    __global float* target = fine + (plane * height + row) * width;
    // Taps reach from −⌊R/n⌋ to ⌈(n − 1 + R)/n⌉ coarse columns.
    const int below = R / F, above = (F - 1 + R) / F;
    if (m0 >= below && m0 + VW + above <= coarse_width && (m0 + VW) * F <= width) {
        float lanes[F * VW];
        for (int p = 0; p < F; ++p) {
            REALN sum = 0.0f;
            for (int k = -below; k <= above; ++k) {
                const int t = p - k * F;
                if (t >= -R && t <= R) sum = fma((REALN)(weights[t + R]), LOADN(in + m0 + k), sum);
            }
            float phase[VW];
            STOREN(sum, phase);
            for (int l = 0; l < VW; ++l) lanes[l * F + p] = phase[l];
        }
        for (int p = 0; p < F; ++p) {
            const int x = m0 * F + p * VW;
            STOREN(fma((REALN)(scale), LOADN(lanes + p * VW), LOADN(add + x)), target + x);
        }
        return;
    }
    for (int x = m0 * F; x < min((m0 + VW) * F, width); ++x) {
        const int first = x >= R ? (x - R + F - 1) / F : -((R - x) / F);
        const int last = (x + R) / F;
        float sum = 0.0f;
        for (int m = first; m <= last; ++m) sum = fma(weights[x - m * F + R], in[wrap(m, coarse_width)], sum);
        target[x] = fma(scale, sum, add[x]);
    }
}
#endif

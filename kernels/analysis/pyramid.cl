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

#define UNROLL _Pragma("unroll")

inline int wrap(int i, int n) {
    i %= n;
    return i < 0 ? i + n : i;
}

#ifdef BTFIELD_KERNEL_reduce_rows
// fine [plane][fine_height][width] → out [plane][height][width], height = ceil(fine_height/n).
// Work-item (vector of columns, row, plane).
__kernel void reduce_rows(__global const float* fine, __global float* out, __constant float* weights,
                          int fine_height, int height, int width) {
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
            sum =
                fma((REALN)(weights[t + R]), LOADN(in + (size_t)wrap(row * F + t, fine_height) * width), sum);
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
__kernel void reduce_columns(__global const float* in, __global float* out, __constant float* weights,
                             int fine_width, int height, int width) {
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

#ifdef BTFIELD_KERNEL_add_expanded
// Coarse columns that taps of a coarse column's n fine ones reach, to the left and to the right.
#define BELOW (R / F)
#define ABOVE ((F - 1 + R) / F)

// Into the lattice's columns 0 to n − 1; i is at most a few lines away.
inline int wrap_near(int i, int n) {
    while (i < 0) i += n;
    while (i >= n) i -= n;
    return i;
}

// fine ← base + scale · ↑n(coarse): first each coarse column's sum over coarse rows, then over columns.
//   coarse [first_coarse + plane][coarse_lattice_height][coarse_pitch]: of it coarse_height rows, coarse_width columns wrap
//   base [plane][base_lattice_height][base_pitch]; may be fine's memory where its lattice has no margins
// Work-item (vector of coarse columns, fine row, plane).
__kernel void add_expanded(__global const float* coarse, __global const float* base, __global float* fine,
                           __constant float* weights, int coarse_height, int coarse_width,
                           int coarse_lattice_height, int coarse_pitch, int base_lattice_height,
                           int base_pitch, int height, int width, float scale, int first_coarse) {
    const int m0 = (int)get_global_id(0) * VW;
    const int row = (int)get_global_id(1);
    const size_t plane = get_global_id(2);
    if (m0 >= coarse_width) return;
    __global const float* in = coarse + (first_coarse + plane) * coarse_lattice_height * coarse_pitch;
    __global const float* add = base + (plane * base_lattice_height + row) * base_pitch;
    __global float* target = fine + (plane * height + row) * width;
    // Coarse rows m with |row − n·m| <= R.
    const int first = row >= R ? (row - R + F - 1) / F : -((R - row) / F);
    const int last = (row + R) / F;
    // Sums of the columns m0 + k + lane, at [k + BELOW].
    REALN column[BELOW + 1 + ABOVE];
    if (m0 >= BELOW && m0 + VW + ABOVE <= coarse_width) {
        UNROLL
        for (int k = 0; k <= BELOW + ABOVE; ++k) column[k] = 0.0f;
        for (int m = first; m <= last; ++m) {
            __global const float* line = in + (size_t)wrap(m, coarse_height) * coarse_pitch + m0 - BELOW;
            const REALN weight = weights[row - m * F + R];
            UNROLL
            for (int k = 0; k <= BELOW + ABOVE; ++k) column[k] = fma(weight, LOADN(line + k), column[k]);
        }
    } else {
        float sums[BELOW + VW + ABOVE];
        for (int l = 0; l < BELOW + VW + ABOVE; ++l) sums[l] = 0.0f;
        const int needed = BELOW + min(VW, coarse_width - m0) + ABOVE;
        for (int m = first; m <= last; ++m) {
            __global const float* line = in + (size_t)wrap(m, coarse_height) * coarse_pitch;
            const float weight = weights[row - m * F + R];
            for (int l = 0; l < needed; ++l)
                sums[l] = fma(weight, line[wrap_near(m0 - BELOW + l, coarse_width)], sums[l]);
        }
        UNROLL
        for (int k = 0; k <= BELOW + ABOVE; ++k) column[k] = LOADN(sums + k);
    }
    // Phase p of the lanes' columns lies at fine columns n·(m0 + lane) + p.
    REALN phase[F];
    UNROLL
    for (int p = 0; p < F; ++p) {
        REALN sum = 0.0f;
        UNROLL
        for (int k = -BELOW; k <= ABOVE; ++k) {
            const int t = p - k * F;
            if (t >= -R && t <= R) sum = fma((REALN)(weights[t + R]), column[k + BELOW], sum);
        }
        phase[p] = sum;
    }
    const int x = m0 * F;
#if F == 2 && VW > 1
    const REALN left = INTERLEAVED_LOW(phase[0], phase[1]), right = INTERLEAVED_HIGH(phase[0], phase[1]);
    store_up_to(fma((REALN)(scale), left, load_up_to(add + x, width - x)), target + x, width - x);
    if (width - x > VW)
        store_up_to(fma((REALN)(scale), right, load_up_to(add + x + VW, width - x - VW)), target + x + VW,
                    width - x - VW);
#else
    float lanes[F * VW], one[VW];
    for (int p = 0; p < F; ++p) {
        STOREN(phase[p], one);
        for (int l = 0; l < VW; ++l) lanes[l * F + p] = one[l];
    }
    for (int p = 0; p < F && x + p * VW < width; ++p) {
        const int at = x + p * VW;
        store_up_to(fma((REALN)(scale), LOADN(lanes + p * VW), load_up_to(add + at, width - at)), target + at,
                    width - at);
    }
#endif
}
#endif

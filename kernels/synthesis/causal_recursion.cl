// Raster recursion: y_i(r) = Σ_s Σ_j A_{s,ij} y_j(r + s) + Σ_j L_ij n_j(r), 0 beyond the domain (theory 6.3; P4 eq. 10).
//
// Lanes are BTFIELD_VECTOR_WIDTH rows on top of each other, each BTFIELD_LAG columns behind the row above it, so that a step
// finds all that it needs done: at step t lane l makes column t − l·LAG of its row. What lies back at most BTFIELD_BACK
// steps is kept in a window of [step][plane][REACH rows above, then the lanes]: there an offset is one displacement.
// Planes come in blocks of BTFIELD_PLANES that share nothing with each other.

#include "base/lanes.clh"

#ifndef BTFIELD_PLANES
#error "BTFIELD_PLANES (number of planes of a block) is not defined"
#endif
#ifndef BTFIELD_LAG
#error "BTFIELD_LAG (columns that a row is behind the one above) is not defined"
#endif
#ifndef BTFIELD_REACH
#error "BTFIELD_REACH (rows that offsets reach up) is not defined"
#endif
#ifndef BTFIELD_BACK
#error "BTFIELD_BACK (steps that offsets reach back) is not defined"
#endif
#ifndef BTFIELD_CHUNK
#error "BTFIELD_CHUNK (steps between two moves of the window) is not defined"
#endif

#define D BTFIELD_PLANES
#define LAG BTFIELD_LAG
#define REACH BTFIELD_REACH
#define BACK BTFIELD_BACK
#define CHUNK BTFIELD_CHUNK
#define COLUMN (REACH + VW)
#define STEP (D * COLUMN)

// d up to 4 unrolls wholly, so that sums stay in registers; beyond, loops stay loops.
#if D <= 4
#define UNROLL _Pragma("unroll")
#else
#define UNROLL _Pragma("nounroll")
#endif

#ifdef BTFIELD_KERNEL_causal_recursion
// Rows `row`… of the window, steps first … first + count − 1, from the field; 0 beyond the domain.
inline void fetch(__global const float* y, float* window, int row, int first, int count, int lowest, int highest,
                  int height, int width) {
    for (int q = lowest; q < highest; ++q) {
        const int r = row + q - REACH;
        const int shift = first - (q - REACH) * LAG;
        // Steps whose column is inside.
        const int begin = r < 0 || r >= height ? count : clamp(-shift, 0, count);
        const int end = r < 0 || r >= height ? count : clamp(width - shift, begin, count);
        for (int j = 0; j < D; ++j) {
            float* to = window + j * COLUMN + q;
            for (int t = 0; t < begin; ++t) to[t * STEP] = 0.0f;
            if (begin < end) {
                __global const float* from = y + ((size_t)j * height + r) * width;
                for (int t = begin; t < end; ++t) to[t * STEP] = from[t + shift];
            }
            for (int t = end; t < count; ++t) to[t * STEP] = 0.0f;
        }
    }
}

// Rows that begin at `row`, steps begin … end − 1.
inline void advance(__global float* y, __global const float* coefficients, __global const int* displacements, int count,
                    int row, int begin, int end, int height, int width) {
    float window[(BACK + CHUNK) * STEP];
    fetch(y, window, row, begin - BACK, BACK, 0, COLUMN, height, width);
    __global const float* root = coefficients + count * D * D;
    for (int first = begin; first < end; first += CHUNK) {
        const int steps = min(CHUNK, end - first);
        // The noise lies where the field will.
        fetch(y, window + BACK * STEP, row, first, steps, 0, COLUMN, height, width);
        for (int t = 0; t < steps; ++t) {
            float* here = window + (BACK + t) * STEP;
            REALN sum[D], n[D];
            UNROLL
            for (int i = 0; i < D; ++i) {
                sum[i] = 0.0f;
                n[i] = LOADN(here + i * COLUMN + REACH);
            }
            UNROLL
            for (int i = 0; i < D; ++i)
                UNROLL
                for (int j = 0; j <= i; ++j) sum[i] = fma((REALN)(root[i * D + j]), n[j], sum[i]);
            __global const float* a = coefficients;
            for (int s = 0; s < count; ++s, a += D * D) {
                const float* at = here + displacements[s];
                UNROLL
                for (int j = 0; j < D; ++j) {
                    const REALN x = LOADN(at + j * COLUMN);
                    UNROLL
                    for (int i = 0; i < D; ++i) sum[i] = fma((REALN)(a[i * D + j]), x, sum[i]);
                }
            }
            const INTN column = (first + t) - AS_INTN(LANE_INDEX) * LAG;
            const INTN inside = MASK(column >= 0) & MASK(column < width);
            UNROLL
            for (int i = 0; i < D; ++i) STOREN(choose(inside, sum[i], (REALN)(0.0f)), here + i * COLUMN + REACH);
        }
        for (int l = 0; l < VW && row + l < height; ++l) {
            const int shift = first - l * LAG;
            const int from = clamp(-shift, 0, steps), to = clamp(width - shift, from, steps);
            for (int j = 0; j < D; ++j) {
                __global float* target = y + ((size_t)j * height + row + l) * width;
                const float* source = window + BACK * STEP + j * COLUMN + REACH + l;
                for (int t = from; t < to; ++t) target[t + shift] = source[t * STEP];
            }
        }
        for (int k = 0; k < BACK * STEP; ++k) window[k] = window[k + steps * STEP];
    }
}

// y: noise on the way in, field on the way out, [texture · planes + plane][row][column]; coefficients: per block [s][i][j],
// then L [i][j]; displacements: of each s in the window.
// wave < 0: work-item (texture · blocks + block) makes the whole field. Otherwise groups of lanes and parts of `part` steps
// are made wave by wave, group g and part b in wave 2g + b: work-item (texture · blocks + block, g − lowest group).
__kernel void causal_recursion(__global float* y, __global const float* coefficients, __global const int* displacements,
                               int count, int height, int width, int blocks, int items, int wave, int lowest, int part) {
    const int item = (int)get_global_id(0);
    if (item >= items) return;
    __global float* field = y + (size_t)item * D * height * width;
    __global const float* own = coefficients + (size_t)(item % blocks) * (count + 1) * D * D;
    const int steps = width + (VW - 1) * LAG;
    if (wave < 0) {
        for (int row = 0; row < height; row += VW)
            advance(field, own, displacements, count, row, 0, steps, height, width);
    } else {
        const int group = lowest + (int)get_global_id(1);
        const int begin = (wave - 2 * group) * part;
        if (group * VW < height && begin >= 0 && begin < steps)
            advance(field, own, displacements, count, group * VW, begin, min(begin + part, steps), height, width);
    }
}
#endif

#ifdef BTFIELD_KERNEL_crop_field
// out: [plane][row][column] of the part of the domain that begins at (top, left), plus the mean of the plane.
// Work-item (vector of columns, row, plane of all textures).
__kernel void crop_field(__global const float* y, __global float* out, __global const float* mean, int planes,
                         int height, int width, int top, int left, int out_height, int out_width) {
    const int column = (int)get_global_id(0) * VW;
    const int row = (int)get_global_id(1);
    const size_t plane = get_global_id(2);
    if (column >= out_width) return;
    const float level = mean[plane % planes];
    __global const float* from = y + (plane * height + top + row) * width + left + column;
    __global float* to = out + (plane * out_height + row) * out_width + column;
    const int count = min(VW, out_width - column);
    if (count == VW)
        STOREN(LOADN(from) + level, to);
    else
        for (int l = 0; l < count; ++l) to[l] = from[l] + level;
}
#endif

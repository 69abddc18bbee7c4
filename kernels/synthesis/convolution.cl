// Moving averages: y_i(r) = μ_i + Σ_s Σ_j M_{s,ij} n_j(r ⊖ s) on the torus, M_s = scale · A_s Σ_e^{1/2}
// (theory 14.4; P4 eq. 14, 16).
//
// Planes come in blocks of BTFIELD_PLANES that share nothing with each other (one block, or as many as a 2D model has
// planes). Pictures and noise are [texture · planes + plane][row][column].

#include "base/lanes.clh"

#ifndef BTFIELD_PLANES
#error "BTFIELD_PLANES (number of planes of a block) is not defined"
#endif
// Rows that a work-item makes at once: coefficients are read once for all of them.
#ifndef BTFIELD_ROWS
#error "BTFIELD_ROWS is not defined"
#endif
// 0: noise is read where it lies, which suits caches and wide lanes; 1: a work-group brings its part into local memory first.
#ifndef BTFIELD_LOCAL_TILE
#error "BTFIELD_LOCAL_TILE (0 or 1) is not defined"
#endif

#define D BTFIELD_PLANES
#define ROWS BTFIELD_ROWS

// d up to 4 unrolls wholly, so that sums stay in registers; beyond, loops stay loops.
#if D <= 4
#define UNROLL _Pragma("unroll")
#else
#define UNROLL _Pragma("nounroll")
#endif

inline int into(int value, int side) {
    const int rest = value % side;
    return rest < 0 ? rest + side : rest;
}

inline REALN load_wrapped(__global const float* row, int column, int width) {
    float lanes[VW];
    int at = into(column, width);
    for (int l = 0; l < VW; ++l) {
        lanes[l] = row[at];
        at = at + 1 < width ? at + 1 : 0;
    }
    return LOADN(lanes);
}

#ifdef BTFIELD_KERNEL_convolve
// coefficients: [block][s][i][j]; offsets: s with |row| <= H/2 and |column| <= W/2; reach: the largest -row, row, -column and
// column among them, not below 0. Work-item (vector of columns, BTFIELD_ROWS rows, texture · blocks + block).
__kernel void convolve(__global const float* noise, __global float* out, __global const float* coefficients,
                       __global const int2* offsets, int count, __global const float* mean, int height, int width,
                       int blocks, int4 reach, __local float* tile) {
    const int column = (int)get_global_id(0) * VW;
    const int row = (int)get_global_id(1) * ROWS;
    const size_t item = get_global_id(2);
    const int block = (int)item % blocks;
    const size_t plane_size = (size_t)height * width;
    __global const float* source = noise + item * D * plane_size;
#if BTFIELD_LOCAL_TILE
    // Rows row - reach.y … row + ROWS - 1 + reach.x, columns likewise around those of the work-group.
    const int lanes = (int)get_local_size(0), lane = (int)get_local_id(0);
    const int tile_width = lanes * VW + reach.z + reach.w;
    const int tile_height = ROWS + reach.x + reach.y;
    const int first_column = (int)get_group_id(0) * lanes * VW - reach.w;
    for (int j = 0; j < D; ++j) {
        for (int y = 0; y < tile_height; ++y) {
            __global const float* from = source + j * plane_size + (size_t)into(row - reach.y + y, height) * width;
            for (int x = lane; x < tile_width; x += lanes)
                tile[(j * tile_height + y) * tile_width + x] = from[into(first_column + x, width)];
        }
    }
    barrier(CLK_LOCAL_MEM_FENCE);
    if (column >= width) return;
#else
    if (column >= width) return;
    const int inside = column - reach.w >= 0 && column + VW + reach.z <= width;
#endif
    REALN sum[ROWS * D];
    UNROLL
    for (int i = 0; i < D; ++i)
        UNROLL
        for (int k = 0; k < ROWS; ++k) sum[k * D + i] = mean[block * D + i];
    __global const float* m = coefficients + (size_t)block * count * D * D;
    for (int s = 0; s < count; ++s, m += D * D) {
        const int2 o = offsets[s];
#if BTFIELD_LOCAL_TILE
        __local const float* at = tile + (reach.y - o.x) * tile_width + lane * VW + reach.w - o.y;
        UNROLL
        for (int j = 0; j < D; ++j) {
            UNROLL
            for (int k = 0; k < ROWS; ++k) {
                const REALN x = LOADN(at + (j * tile_height + k) * tile_width);
                UNROLL
                for (int i = 0; i < D; ++i) sum[k * D + i] = fma((REALN)(m[i * D + j]), x, sum[k * D + i]);
            }
        }
#else
        size_t rows[ROWS];
        UNROLL
        for (int k = 0; k < ROWS; ++k) {
            int r = min(row + k, height - 1) - o.x;
            r = r < 0 ? r + height : r;
            rows[k] = (size_t)(r >= height ? r - height : r) * width;
        }
        UNROLL
        for (int j = 0; j < D; ++j) {
            __global const float* plane = source + j * plane_size;
            REALN x[ROWS];
            if (inside) {
                UNROLL
                for (int k = 0; k < ROWS; ++k) x[k] = LOADN(plane + rows[k] + (column - o.y));
            } else {
                UNROLL
                for (int k = 0; k < ROWS; ++k) x[k] = load_wrapped(plane + rows[k], column - o.y, width);
            }
            UNROLL
            for (int i = 0; i < D; ++i) {
                const REALN a = m[i * D + j];
                UNROLL
                for (int k = 0; k < ROWS; ++k) sum[k * D + i] = fma(a, x[k], sum[k * D + i]);
            }
        }
#endif
    }
    const int left = width - column;
    UNROLL
    for (int i = 0; i < D; ++i)
        UNROLL
        for (int k = 0; k < ROWS; ++k)
            if (row + k < height)
                store_up_to(sum[k * D + i], out + (item * D + i) * plane_size + (size_t)(row + k) * width + column, left);
}
#endif

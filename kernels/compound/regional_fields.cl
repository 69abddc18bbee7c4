// Fields of several regions on one lattice (theory 18.5). Labels lie on the finest lattice; that of a coarser level's pixel is
// the label of the pixel that it was reduced to, `step` rows and columns apart.

#include "base/lanes.clh"

#ifndef BTFIELD_PLANES
#error "BTFIELD_PLANES (number of planes) is not defined"
#endif

#define D BTFIELD_PLANES

#if D <= 4
#define UNROLL _Pragma("unroll")
#else
#define UNROLL _Pragma("nounroll")
#endif

// Labels of the lanes from `column` on. Pixels beyond the labels, which nobody reads, take the last one.
inline UINTN labels_at(__global const uchar* labels, int row, int column, int label_height, int label_width, int step) {
    __global const uchar* line = labels + (size_t)min(row * step, label_height - 1) * label_width;
    uint lanes[VW];
    for (int l = 0; l < VW; ++l) lanes[l] = line[min((column + l) * step, label_width - 1)];
    return LOADN_UINT(lanes);
}

#ifdef BTFIELD_KERNEL_convolve_regions
inline int into(int value, int side) {
    const int rest = value % side;
    return rest < 0 ? rest + side : rest;
}

// Moving averages: y_i(r) = Σ_s Σ_j M^X_{s,ij} n_j(r ⊖ s), X the region of r: every region has the same noise. Each is
// computed only where the lanes hold it.
//   coefficients: [region][s][i][j]; offsets: |row| <= H/2, |column| <= W/2; reach: the largest |column|
// Work-item (vector of columns, row).
__kernel void convolve_regions(__global const float* noise, __global float* out, __global const uchar* labels,
                               __global const float* coefficients, __global const int2* offsets, int count, int height,
                               int width, int label_height, int label_width, int step, int reach) {
    const int column = (int)get_global_id(0) * VW;
    const int row = (int)get_global_id(1);
    if (column >= width) return;
    const size_t plane_size = (size_t)height * width;
    const UINTN label = labels_at(labels, row, column, label_height, label_width, step);
    uint lanes[VW];
    STOREN_UINT(label, lanes);
    uint present = 0;
    for (int l = 0; l < VW; ++l) present |= 1u << lanes[l];
    const int inside = column >= reach && column + VW + reach <= width;
    REALN result[D];
    UNROLL
    for (int i = 0; i < D; ++i) result[i] = 0.0f;
    while (present != 0) {
        const uint k = 31 - clz(present);
        present &= ~(1u << k);
        __global const float* m = coefficients + (size_t)k * count * D * D;
        REALN sum[D];
        UNROLL
        for (int i = 0; i < D; ++i) sum[i] = 0.0f;
        for (int s = 0; s < count; ++s, m += D * D) {
            const int2 o = offsets[s];
            int r = row - o.x;
            r = r < 0 ? r + height : r >= height ? r - height : r;
            UNROLL
            for (int j = 0; j < D; ++j) {
                __global const float* line = noise + j * plane_size + (size_t)r * width;
                REALN x;
                if (inside) {
                    x = LOADN(line + (column - o.y));
                } else {
                    float wrapped[VW];
                    for (int l = 0; l < VW; ++l) wrapped[l] = line[into(column + l - o.y, width)];
                    x = LOADN(wrapped);
                }
                UNROLL
                for (int i = 0; i < D; ++i) sum[i] = fma((REALN)(m[i * D + j]), x, sum[i]);
            }
        }
        const INTN here = MASK(label == (UINTN)(k));
        UNROLL
        for (int i = 0; i < D; ++i) result[i] = choose(here, sum[i], result[i]);
    }
    for (int i = 0; i < D; ++i)
        store_up_to(result[i], out + i * plane_size + (size_t)row * width + column, width - column);
}
#endif

#ifdef BTFIELD_KERNEL_take_region
// out ← in where the label is `region`: planes `planes` of BTFIELD_PLANES, the others become 0 there.
// Work-item (vector of columns, row).
__kernel void take_region(__global const float* in, __global float* out, __global const uchar* labels, int region,
                          int planes, int height, int width, int label_height, int label_width, int step) {
    const int column = (int)get_global_id(0) * VW;
    const int row = (int)get_global_id(1);
    if (column >= width) return;
    const int count = min(VW, width - column);
    const UINTN label = labels_at(labels, row, column, label_height, label_width, step);
    const INTN here = MASK(label == (UINTN)((uint)region));
    for (int i = 0; i < D; ++i) {
        const size_t at = ((size_t)i * height + row) * width + column;
        const REALN mine = i < planes ? load_up_to(in + at, count) : (REALN)(0.0f);
        store_up_to(choose(here, mine, load_up_to(out + at, count)), out + at, count);
    }
}
#endif

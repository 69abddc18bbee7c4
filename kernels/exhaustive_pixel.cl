// Candidates for the nearest pixel that is left, by comparing with every colour: the search of MEMD without a tree. Lanes
// lie across pixels of A; a tile of BTFIELD_ROWS vectors of them stays in registers while the colours of B go by, each
// read once for the tile.
//
// BTFIELD_PLANES d, BTFIELD_METRIC 0 max, 1 l1, 2 l2 squared, BTFIELD_CANDIDATES per pixel, BTFIELD_ROWS.

#include "lanes.clh"
#include "colour_distance.clh"

#ifndef BTFIELD_PLANES
#error "BTFIELD_PLANES is not defined"
#endif
#ifndef BTFIELD_CANDIDATES
#error "BTFIELD_CANDIDATES is not defined"
#endif
#ifndef BTFIELD_ROWS
#error "BTFIELD_ROWS is not defined"
#endif

#define D BTFIELD_PLANES
#define K BTFIELD_CANDIDATES
#define ROWS BTFIELD_ROWS
#define BRANCHES 16
#define NONE 0xffffffffu

inline UINTN choose_uint(INTN mask, UINTN a, UINTN b) { return (a & AS_UINTN(mask)) | (b & AS_UINTN(~mask)); }

// For pixel begin + n of `colours` ([pixel][plane]): the K nearest of the colours in `points` ([block][plane][16 lanes], +∞
// where none is left), ordered by (distance, raster index in `first`), [n][K]; raster NONE where there are fewer. Work-item:
// ROWS * BTFIELD_VECTOR_WIDTH pixels.
__kernel void exhaustive_candidates(__global const float* colours, uint begin, uint count, __global const float* points,
                                    __global const uint* first, uint blocks, __global float* distances,
                                    __global uint* rasters, __global uint* slots) {
    const uint start = (uint)get_global_id(0) * (ROWS * VW);
    if (start >= count) return;
    REALN colour[ROWS][D], best[ROWS][K];
    UINTN raster[ROWS][K], slot[ROWS][K];
    float lanes[VW];
    for (int r = 0; r < ROWS; ++r) {
        for (int i = 0; i < D; ++i) {
            for (int l = 0; l < VW; ++l)
                lanes[l] = colours[(size_t)(begin + min(start + r * VW + l, count - 1)) * D + i];
            colour[r][i] = LOADN(lanes);
        }
        for (int k = 0; k < K; ++k) {
            best[r][k] = (REALN)(FLT_MAX);
            raster[r][k] = slot[r][k] = (UINTN)(NONE);
        }
    }
    for (uint block = 0; block < blocks; ++block) {
        __global const float* here = points + (size_t)block * BRANCHES * D;
        for (uint lane = 0; lane < BRANCHES; ++lane) {
            REALN sum[ROWS];
            INTN near = (INTN)(0);
            for (int r = 0; r < ROWS; ++r) {
                sum[r] = (REALN)(0.0f);
                for (int i = 0; i < D; ++i)
                    sum[r] = accumulate(sum[r], fabs(colour[r][i] - here[BRANCHES * i + lane]), i);
                near |= MASK(sum[r] <= best[r][K - 1]);
            }
            if (!any(near)) continue;
            for (int r = 0; r < ROWS; ++r) {
                REALN d = sum[r];
                UINTN n = (UINTN)(first[block * BRANCHES + lane]), s = (UINTN)(block * BRANCHES + lane);
                for (int k = 0; k < K; ++k) {
                    const INTN precedes =
                        MASK(d < best[r][k]) | (MASK(d == best[r][k]) & MASK(n < raster[r][k]));
                    const REALN other = best[r][k];
                    const UINTN on = raster[r][k], os = slot[r][k];
                    best[r][k] = choose(precedes, d, other);
                    raster[r][k] = choose_uint(precedes, n, on);
                    slot[r][k] = choose_uint(precedes, s, os);
                    d = choose(precedes, other, d);
                    n = choose_uint(precedes, on, n);
                    s = choose_uint(precedes, os, s);
                }
            }
        }
    }
    uint numbers[VW];
    for (int r = 0; r < ROWS; ++r)
        for (int k = 0; k < K; ++k) {
            const uint at = start + r * VW;
            STOREN(best[r][k], lanes);
            for (int l = 0; l < VW && at + l < count; ++l) distances[(size_t)(at + l) * K + k] = lanes[l];
            STOREN_UINT(raster[r][k], numbers);
            for (int l = 0; l < VW && at + l < count; ++l) rasters[(size_t)(at + l) * K + k] = numbers[l];
            STOREN_UINT(slot[r][k], numbers);
            for (int l = 0; l < VW && at + l < count; ++l) slots[(size_t)(at + l) * K + k] = numbers[l];
        }
}

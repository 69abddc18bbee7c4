// Candidates for the nearest pixel that is left, by comparing with every colour (theory 15.2). Lanes lie across pixels of A,
// which stay in registers while the colours of B go by in blocks of 16.

#include "base/lanes.clh"

#ifndef BTFIELD_PLANES
#error "BTFIELD_PLANES is not defined"
#endif
#ifndef BTFIELD_METRIC
#error "BTFIELD_METRIC (0 max, 1 l1, 2 l2 squared) is not defined"
#endif
#ifndef BTFIELD_CANDIDATES
#error "BTFIELD_CANDIDATES (per pixel) is not defined"
#endif
// 0: colours are read where they lie, which suits caches; else blocks that a work-group brings into local memory at a time.
#ifndef BTFIELD_TILE
#error "BTFIELD_TILE (blocks of 16 colours in local memory, or 0) is not defined"
#endif

#define D BTFIELD_PLANES
#define K BTFIELD_CANDIDATES
// Colours of a block, the lanes of its planes.
#define BRANCHES 16
#define BLOCK (BRANCHES * D)
// Every how many blocks the first bound looks at.
#define SAMPLE 8
// Raster index where there is no colour.
#define NONE 0xffffffffu

#ifdef BTFIELD_KERNEL_nearest_candidates

// do(i) for every plane: written out as far as colours stay in registers. PoCL unrolls no loop over an array of vectors
// before it decides that the array lies in memory.
#if D == 1
#define EACH_PLANE(do) do(0)
#elif D == 2
#define EACH_PLANE(do) do(0) do(1)
#elif D == 3
#define EACH_PLANE(do) do(0) do(1) do(2)
#elif D == 4
#define EACH_PLANE(do) do(0) do(1) do(2) do(3)
#elif D == 5
#define EACH_PLANE(do) do(0) do(1) do(2) do(3) do(4)
#elif D == 6
#define EACH_PLANE(do) do(0) do(1) do(2) do(3) do(4) do(5)
#elif D == 7
#define EACH_PLANE(do) do(0) do(1) do(2) do(3) do(4) do(5) do(6)
#elif D == 8
#define EACH_PLANE(do) do(0) do(1) do(2) do(3) do(4) do(5) do(6) do(7)
#else
#define EACH_PLANE(do) for (int i = 0; i < D; ++i) { do(i) }
#endif

#if BTFIELD_TILE > 0
#define COLOURS __local const float*
#else
#define COLOURS __global const float*
#endif

// Adds plane i's difference: the plain loop's float32 operations in its order.
inline REALN accumulate(REALN sum, REALN difference, int i) {
#if BTFIELD_METRIC == 0
    return i == 0 ? difference : (difference > sum ? difference : sum);
#elif BTFIELD_METRIC == 1
    return i == 0 ? difference : sum + difference;
#else
    const REALN square = difference * difference;
    return i == 0 ? square : sum + square;
#endif
}

// From the pixels in the lanes to a colour of a block.
inline REALN distance_to(const REALN* colour, COLOURS point) {
    REALN sum = (REALN)(0.0f);
#define ADD_PLANE(i) sum = accumulate(sum, fabs(colour[i] - point[BRANCHES * (i)]), i);
    EACH_PLANE(ADD_PLANE)
    return sum;
}

inline REALN lesser(REALN a, REALN b) { return b < a ? b : a; }

// The least distance to four neighbours in a block: four chains, so that no operation waits for the one before.
inline REALN distance_to_four(const REALN* colour, COLOURS point) {
    REALN a = (REALN)(0.0f), b = a, c = a, d = a;
#define ADD_PLANE_TO_FOUR(i)                                            \
    a = accumulate(a, fabs(colour[i] - point[BRANCHES * (i)]), i);      \
    b = accumulate(b, fabs(colour[i] - point[BRANCHES * (i) + 1]), i);  \
    c = accumulate(c, fabs(colour[i] - point[BRANCHES * (i) + 2]), i);  \
    d = accumulate(d, fabs(colour[i] - point[BRANCHES * (i) + 3]), i);
    EACH_PLANE(ADD_PLANE_TO_FOUR)
    return lesser(lesser(a, b), lesser(c, d));
}

// The least distance to the colours of a block.
inline REALN distance_to_block(const REALN* colour, COLOURS block) {
    return lesser(lesser(distance_to_four(colour, block), distance_to_four(colour, block + 4)),
                  lesser(distance_to_four(colour, block + 8), distance_to_four(colour, block + 12)));
}

inline UINTN choose_uint(INTN mask, UINTN a, UINTN b) { return (a & AS_UINTN(mask)) | (b & AS_UINTN(~mask)); }

// For pixel begin + n of `colours` ([pixel][plane]): the K nearest of the colours in `points` ([block][plane][16 lanes], +∞
// where none is left), ordered by (distance, raster index in `first`), [n][K]; raster NONE where there are fewer. tile: of
// BTFIELD_TILE blocks. Work-item: BTFIELD_VECTOR_WIDTH pixels.
__kernel void nearest_candidates(__global const float* colours, uint begin, uint count, __global const float* points,
                                 __global const uint* first, uint blocks, __global float* distances, __global uint* rasters,
                                 __global uint* slots, __local float* tile) {
    const uint start = (uint)get_global_id(0) * VW;
#if BTFIELD_TILE == 0
    if (start >= count) return;
#endif
    REALN colour[D], best[K], bound[K];
    UINTN raster[K], slot[K];
    float lanes[VW];
#define LOAD_PLANE(i)                                                                                     \
    for (int l = 0; l < VW; ++l) lanes[l] = colours[(size_t)(begin + min(start + l, count - 1)) * D + i]; \
    colour[i] = LOADN(lanes);
    EACH_PLANE(LOAD_PLANE)
    for (int k = 0; k < K; ++k) {
        best[k] = bound[k] = (REALN)(FLT_MAX);
        raster[k] = slot[k] = (UINTN)(NONE);
    }
    // No candidate is farther than the K-th least of the nearest colours of K blocks. A sample of blocks makes a bound that
    // spares most others the search for candidates, which takes the more time the farther the first are.
    REALN limit = (REALN)(FLT_MAX);
    for (int pass = 0; pass < 2; ++pass) {
        const uint stride = pass == 0 ? SAMPLE : 1;
        const uint members = (blocks + stride - 1) / stride;
#if BTFIELD_TILE > 0
        for (uint first_member = 0; first_member < members; first_member += BTFIELD_TILE) {
            const uint last_member = min(first_member + BTFIELD_TILE, members);
            barrier(CLK_LOCAL_MEM_FENCE);
            for (uint at = (uint)get_local_id(0); at < (last_member - first_member) * BLOCK; at += (uint)get_local_size(0))
                tile[at] = points[(size_t)(first_member + at / BLOCK) * stride * BLOCK + at % BLOCK];
            barrier(CLK_LOCAL_MEM_FENCE);
            COLOURS here = tile;
            const uint step = BLOCK;
#else
        {
            const uint first_member = 0, last_member = members;
            COLOURS here = points;
            const uint step = stride * BLOCK;
#endif
            for (uint member = first_member; member < last_member; ++member, here += step) {
                REALN least = distance_to_block(colour, here);
                if (pass == 0) {
                    for (int k = 0; k < K; ++k) {
                        const REALN other = bound[k];
                        bound[k] = lesser(other, least);
                        least = least < other ? other : least;
                    }
                    continue;
                }
                if (!any_lane(MASK(least <= limit))) continue;
                for (uint lane = 0; lane < BRANCHES; ++lane) {
                    REALN d = distance_to(colour, here + lane);
                    if (!any_lane(MASK(d <= limit))) continue;
                    UINTN n = (UINTN)(first[member * BRANCHES + lane]), s = (UINTN)(member * BRANCHES + lane);
                    for (int k = 0; k < K; ++k) {
                        const INTN precedes = MASK(d < best[k]) | (MASK(d == best[k]) & MASK(n < raster[k]));
                        const REALN other = best[k];
                        const UINTN on = raster[k], os = slot[k];
                        best[k] = choose(precedes, d, other);
                        raster[k] = choose_uint(precedes, n, on);
                        slot[k] = choose_uint(precedes, s, os);
                        d = choose(precedes, other, d);
                        n = choose_uint(precedes, on, n);
                        s = choose_uint(precedes, os, s);
                    }
                    limit = lesser(limit, best[K - 1]);
                }
            }
        }
        if (pass == 0) limit = bound[K - 1];
    }
    uint numbers[VW], places[VW];
    for (int k = 0; k < K; ++k) {
        STOREN(best[k], lanes);
        STOREN_UINT(raster[k], numbers);
        STOREN_UINT(slot[k], places);
        for (int l = 0; l < VW && start + l < count; ++l) {
            const size_t at = (size_t)(start + l) * K + k;
            distances[at] = lanes[l];
            rasters[at] = numbers[l];
            slots[at] = places[l];
        }
    }
}
#endif

#ifdef BTFIELD_KERNEL_update_colours
// points: [block][plane][16 lanes], first: [block][16 lanes]; slots, values [slot][plane], rasters: what changed. Work-item
// (change).
__kernel void update_colours(__global float* points, __global uint* first, __global const uint* slots,
                             __global const float* values, __global const uint* rasters, uint count) {
    const uint n = (uint)get_global_id(0);
    if (n >= count) return;
    const uint slot = slots[n];
    for (int i = 0; i < D; ++i)
        points[((size_t)(slot / BRANCHES) * D + i) * BRANCHES + slot % BRANCHES] = values[(size_t)n * D + i];
    first[slot] = rasters[n];
}
#endif

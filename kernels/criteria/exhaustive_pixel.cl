// Candidates for the nearest pixel that is left, by comparing with every colour: the search of MEMD without a tree. Lanes
// lie across pixels of A, which stay in registers while the colours of B go by in blocks of 16.

#include "base/colour_candidates.clh"

inline UINTN choose_uint(INTN mask, UINTN a, UINTN b) { return (a & AS_UINTN(mask)) | (b & AS_UINTN(~mask)); }

// From the pixels in the lanes to a colour of a block.
inline REALN distance_to(const REALN* colour, __global const float* point) {
    REALN sum = (REALN)(0.0f);
    for (int i = 0; i < D; ++i) sum = accumulate(sum, fabs(colour[i] - point[BRANCHES * i]), i);
    return sum;
}

// For pixel begin + n of `colours` ([pixel][plane]): the K nearest of the colours in `points` ([block][plane][16 lanes], +∞
// where none is left), ordered by (distance, raster index in `first`), [n][K]; raster NONE where there are fewer. Work-item:
// BTFIELD_VECTOR_WIDTH pixels.
__kernel void exhaustive_candidates(__global const float* colours, uint begin, uint count, __global const float* points,
                                    __global const uint* first, uint blocks, __global float* distances,
                                    __global uint* rasters, __global uint* slots) {
    const uint start = (uint)get_global_id(0) * VW;
    if (start >= count) return;
    REALN colour[D], best[K];
    UINTN raster[K], slot[K];
    float lanes[VW];
    for (int i = 0; i < D; ++i) {
        for (int l = 0; l < VW; ++l) lanes[l] = colours[(size_t)(begin + min(start + l, count - 1)) * D + i];
        colour[i] = LOADN(lanes);
    }
    for (int k = 0; k < K; ++k) {
        best[k] = (REALN)(FLT_MAX);
        raster[k] = slot[k] = (UINTN)(NONE);
    }
    for (uint block = 0; block < blocks; ++block) {
        __global const float* here = points + (size_t)block * BRANCHES * D;
        // Most blocks hold no candidate for any of the pixels.
        INTN near = (INTN)(0);
        for (uint lane = 0; lane < BRANCHES; ++lane) near |= MASK(distance_to(colour, here + lane) <= best[K - 1]);
        if (!any(near)) continue;
        for (uint lane = 0; lane < BRANCHES; ++lane) {
            REALN d = distance_to(colour, here + lane);
            if (!any(MASK(d <= best[K - 1]))) continue;
            UINTN n = (UINTN)(first[block * BRANCHES + lane]), s = (UINTN)(block * BRANCHES + lane);
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
        }
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

// Candidates for the nearest pixel that is left, from the tree of a picture's colours (host/colour_tree.hpp has its
// layout): the search of MEMD. Lanes lie across the 16 branches of a block.

#include "base/colour_candidates.clh"

#define MOST_LEVELS 8

#ifdef BTFIELD_KERNEL_nearest_candidates
// Bit l set where lane l of the mask is.
inline uint bits_of(INTN mask) {
    const UINTN bits = AS_UINTN(mask) & ((UINTN)(1u) << LANE_INDEX);
#if VW == 1
    return bits;
#else
    uint all[VW];
    STOREN_UINT(bits, all);
    uint result = 0;
    for (int l = 0; l < VW; ++l) result |= all[l];
    return result;
#endif
}

// Distances to 16 colours. Returns which are at most `limit`.
inline uint point_distances(__global const float* points, const float* colour, float limit, float* out) {
    uint bits = 0;
    for (int h = 0; h < BRANCHES; h += VW) {
        REALN sum = (REALN)(0.0f);
        for (int i = 0; i < D; ++i)
            sum = accumulate(sum, fabs(LOADN(points + BRANCHES * i + h) - colour[i]), i);
        STOREN(sum, out + h);
        bits |= bits_of(MASK(sum <= limit)) << h;
    }
    return bits;
}

// Distances to 16 boxes: by the monotony of rounding, no more than that of any colour inside.
inline uint box_distances(__global const float* boxes, const float* colour, float limit, float* out) {
    uint bits = 0;
    for (int h = 0; h < BRANCHES; h += VW) {
        REALN sum = (REALN)(0.0f);
        for (int i = 0; i < D; ++i) {
            const REALN below = LOADN(boxes + BRANCHES * i + h) - colour[i];
            const REALN above = colour[i] - LOADN(boxes + BRANCHES * (D + i) + h);
            sum = accumulate(sum, fmax(fmax(below, above), (REALN)(0.0f)), i);
        }
        STOREN(sum, out + h);
        bits |= bits_of(MASK(sum <= limit)) << h;
    }
    return bits;
}

inline int precedes(float distance, uint raster, float other_distance, uint other_raster) {
    return distance < other_distance || (distance == other_distance && raster < other_raster);
}

// For pixel begin + n of `colours` ([pixel][plane]): the K nearest colours of the tree, ordered by (distance, raster
// index), [n][K]; raster NONE where the tree has fewer. level_begin: first block of each level above the colours, then
// the end. Work-item n.
__kernel void nearest_candidates(__global const float* colours, uint begin, uint count, __global const float* points,
                                 __global const uint* first, __global const float* boxes, __global const uint* lowest,
                                 __global const uint* level_begin, int levels, __global float* distances,
                                 __global uint* rasters, __global uint* slots) {
    const uint n = (uint)get_global_id(0);
    if (n >= count) return;
    float colour[D];
    for (int i = 0; i < D; ++i) colour[i] = colours[(size_t)(begin + n) * D + i];
    float best[K];
    uint raster[K], slot[K];
    for (int k = 0; k < K; ++k) best[k] = FLT_MAX, raster[k] = NONE, slot[k] = NONE;

    float bound[MOST_LEVELS][BRANCHES];
    uint left[MOST_LEVELS], blocks[MOST_LEVELS];
    // Level 0 is a colours' block: without levels above there is only that one.
    int level = levels;
    uint block = 0;
    int descending = 1;
    while (level <= levels) {
        if (descending) {
            descending = 0;
            if (level == 0) {
                float distance[BRANCHES];
                uint bits = point_distances(points + (size_t)block * BRANCHES * D, colour, best[K - 1], distance);
                for (uint lane = 0; bits != 0; ++lane, bits >>= 1) {
                    if (!(bits & 1u)) continue;
                    float d = distance[lane];
                    uint s = block * BRANCHES + lane, r = first[s];
                    if (r == NONE) continue;
                    for (int k = 0; k < K; ++k) {
                        if (!precedes(d, r, best[k], raster[k])) continue;
                        const float od = best[k];
                        const uint other = raster[k], os = slot[k];
                        best[k] = d, raster[k] = r, slot[k] = s;
                        d = od, r = other, s = os;
                    }
                }
                ++level;
                continue;
            }
            blocks[level] = level_begin[level - 1] + block;
            left[level] = box_distances(boxes + (size_t)blocks[level] * 2 * BRANCHES * D, colour, best[K - 1],
                                        bound[level]);
        }
        __global const uint* low = lowest + (size_t)blocks[level] * BRANCHES;
        float least = best[K - 1];
        uint least_raster = raster[K - 1];
        int nearest = -1;
        uint bits = left[level];
        for (int lane = 0; bits != 0; ++lane, bits >>= 1) {
            if (!(bits & 1u)) continue;
            if (precedes(bound[level][lane], low[lane], least, least_raster)) {
                least = bound[level][lane];
                least_raster = low[lane];
                nearest = lane;
            } else if (!precedes(bound[level][lane], low[lane], best[K - 1], raster[K - 1])) {
                left[level] &= ~(1u << lane);
            }
        }
        if (nearest < 0) {
            ++level;
            continue;
        }
        left[level] &= ~(1u << nearest);
        block = (blocks[level] - level_begin[level - 1]) * BRANCHES + (uint)nearest;
        --level;
        descending = 1;
    }
    for (int k = 0; k < K; ++k) {
        distances[(size_t)n * K + k] = best[k];
        rasters[(size_t)n * K + k] = raster[k];
        slots[(size_t)n * K + k] = slot[k];
    }
}
#endif

#ifdef BTFIELD_KERNEL_update_slots
// fields: [block][field][16 lanes], rasters: [block][16 lanes]; slots, values [slot][field], new_rasters: what changed.
// Work-item (change).
__kernel void update_slots(__global float* fields, __global uint* rasters, __global const uint* slots,
                           __global const float* values, __global const uint* new_rasters, uint count,
                           int fields_per_slot) {
    const uint n = (uint)get_global_id(0);
    if (n >= count) return;
    const uint slot = slots[n];
    for (int f = 0; f < fields_per_slot; ++f)
        fields[((size_t)(slot / BRANCHES) * fields_per_slot + f) * BRANCHES + slot % BRANCHES] =
            values[(size_t)n * fields_per_slot + f];
    rasters[slot] = new_rasters[n];
}
#endif

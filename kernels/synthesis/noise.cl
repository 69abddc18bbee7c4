// White Gaussian noise on the lattice, a function of (seed, level, plane, row, column) alone (theory 14.2).
//
// Columns come in chunks of 64: block b of a row yields four normals, of columns 64·(b/16) + b%16 + {0, 16, 32, 48}.
// So vectors of up to 16 lanes store whole, and the numbers do not depend on the number of lanes.

#include "base/philox.clh"

#ifdef BTFIELD_KERNEL_normal_field
// out: [plane][row][column], plane = batch index · planes + plane. Work-item (vector of blocks, row, plane).
__kernel void normal_field(__global float* out, __global const uint2* seeds, int height, int width, int planes,
                           uint level) {
    const int item = (int)get_global_id(0);
    const int row = (int)get_global_id(1);
    const int plane = (int)get_global_id(2);
    const int block = item * VW;
    const int column = (block / 16) * 64 + block % 16;
    if (column >= width) return;
    const uint2 seed = seeds[plane / planes];
    philox_words counter;
    counter.x = (UINTN)((uint)block) + LANE_INDEX;
    counter.y = (UINTN)((uint)row);
    counter.z = (UINTN)((uint)(plane % planes));
    counter.w = (UINTN)(noise_level(level, BTFIELD_DOMAIN_SPATIAL));
    const philox_words words = philox4x32_10(counter, seed.x, seed.y);
    REALN first[2], second[2];
    const UINTN radius_words[2] = {words.x, words.z}, angle_words[2] = {words.y, words.w};
    box_muller(radius_words, angle_words, first, second);
    __global float* target = out + ((size_t)plane * height + row) * width + column;
    const int left = width - column;
    if (left >= 48 + VW) {
        STOREN_GLOBAL(first[0], target);
        STOREN_GLOBAL(second[0], target + 16);
        STOREN_GLOBAL(first[1], target + 32);
        STOREN_GLOBAL(second[1], target + 48);
        return;
    }
    store_up_to(first[0], target, left);
    store_up_to(second[0], target + 16, left - 16);
    store_up_to(first[1], target + 32, left - 32);
    store_up_to(second[1], target + 48, left - 48);
}
#endif

#ifdef BTFIELD_KERNEL_philox_block
// The generator's own words, for its published vectors. counters and words: [4][count], keys: [2].
__kernel void philox_block(__global uint* words, __global const uint* counters, uint key0, uint key1, int count) {
    const int at = (int)get_global_id(0) * VW;
    if (at + VW > count) return;
    philox_words c;
    c.x = LOADN_UINT(counters + at);
    c.y = LOADN_UINT(counters + count + at);
    c.z = LOADN_UINT(counters + 2 * count + at);
    c.w = LOADN_UINT(counters + 3 * count + at);
    const philox_words w = philox4x32_10(c, key0, key1);
    STOREN_UINT(w.x, words + at);
    STOREN_UINT(w.y, words + count + at);
    STOREN_UINT(w.z, words + 2 * count + at);
    STOREN_UINT(w.w, words + 3 * count + at);
}
#endif

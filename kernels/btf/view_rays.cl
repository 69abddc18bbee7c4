// Places on a relief that the pixels of a view show (theory 21.1).

#include "btf/relief_ray.clh"

#ifdef BTFIELD_KERNEL_meet_relief
// relief: [row][column], within [lowest, highest]. x right, y down, of each pixel, beyond the edges where the ray goes
// there. Work-item (column, row / step).
__kernel void meet_relief(__global const float* relief, float dx, float dy, float dz, float lowest, float highest,
                          __global float* x, __global float* y, int width, int height,
                          int step) {
    const int column = (int)get_global_id(0), line = (int)get_global_id(1), row = line * step;
    if (column >= width) return;
    const float t = distance_met(relief, column, row, dx, dy, dz, lowest, highest, width, height);
    const size_t at = (size_t)line * width + column;
    x[at] = column + dx * t;
    y[at] = row - dy * t;
}
#endif

#ifdef BTFIELD_KERNEL_weigh_planes
#ifndef BTFIELD_PLANES
#error "BTFIELD_PLANES (planes of the surface, with zeros up to a multiple of 4) is not defined"
#endif
#ifndef BTFIELD_COLOURS
#error "BTFIELD_COLOURS is not defined"
#endif

// Σ_k U_k T_k. planes: [pixel][BTFIELD_PLANES]. table: U, [colour][BTFIELD_PLANES]. weighted: [pixel][colour]. Work-item
// pixel.
__kernel void weigh_planes(__global const float* planes, __global const float* table, __global float* weighted, int pixels) {
    const int pixel = (int)get_global_id(0);
    if (pixel >= pixels) return;
    float4 sums[BTFIELD_COLOURS];
    for (int i = 0; i < BTFIELD_COLOURS; ++i) sums[i] = (float4)(0.0f);
    for (int k = 0; k < BTFIELD_PLANES; k += 4) {
        const float4 value = vload4(0, planes + (size_t)pixel * BTFIELD_PLANES + k);
        for (int i = 0; i < BTFIELD_COLOURS; ++i) sums[i] += value * vload4(0, table + i * BTFIELD_PLANES + k);
    }
    for (int i = 0; i < BTFIELD_COLOURS; ++i)
        weighted[(size_t)pixel * BTFIELD_COLOURS + i] = sums[i].x + sums[i].y + sums[i].z + sums[i].w;
}
#endif

#ifdef BTFIELD_KERNEL_show_weighted
#ifndef BTFIELD_COLOURS
#error "BTFIELD_COLOURS is not defined"
#endif

// What the places x, y of the surface have, between pixels. weighted: [pixel of the surface][colour]. picture:
// [colour][pixel]. Work-item (column, row).
__kernel void show_weighted(__global const float* weighted, __global const float* x, __global const float* y,
                            __global float* picture, int width, int height) {
    const int column = (int)get_global_id(0), row = (int)get_global_id(1);
    if (column >= width) return;
    const size_t pixel = (size_t)row * width + column;
    const float place = wrapped(x[pixel], width), under = wrapped(y[pixel], height);
    const int left = min((int)place, width - 1), top = min((int)under, height - 1);
    const int right = left + 1 == width ? 0 : left + 1, bottom = top + 1 == height ? 0 : top + 1;
    const float across = place - (float)left, down = under - (float)top;
    __global const float* a = weighted + ((size_t)top * width + left) * BTFIELD_COLOURS;
    __global const float* b = weighted + ((size_t)top * width + right) * BTFIELD_COLOURS;
    __global const float* c = weighted + ((size_t)bottom * width + left) * BTFIELD_COLOURS;
    __global const float* d = weighted + ((size_t)bottom * width + right) * BTFIELD_COLOURS;
    for (int i = 0; i < BTFIELD_COLOURS; ++i)
        picture[i * (size_t)width * height + pixel] =
            mix(mix(a[i], b[i], across), mix(c[i], d[i], across), down);
}
#endif

// Places on a relief that the pixels of a view show (theory 21.1).

#include "btf/relief_ray.clh"

#ifdef BTFIELD_KERNEL_meet_relief
// relief: [row][column], within [lowest, highest]. x right, y down, of each pixel, beyond the edges where the ray goes
// there. Work-item (column, row).
__kernel void meet_relief(__global const float* relief, float dx, float dy, float dz, float lowest,
                          float highest, __global float* x, __global float* y, int width, int height) {
    const int column = (int)get_global_id(0), row = (int)get_global_id(1);
    if (column >= width) return;
    const float t = distance_met(relief, column, row, dx, dy, dz, lowest, highest, width, height);
    const size_t at = (size_t)row * width + column;
    x[at] = column + dx * t;
    y[at] = row - dy * t;
}
#endif

#ifdef BTFIELD_KERNEL_show_planes
#include "btf/surface_planes.clh"

#ifndef BTFIELD_COLOURS
#error "BTFIELD_COLOURS is not defined"
#endif

// I = mean (offset + Σ_k U_k T_k)² at the places x, y. planes: [pixel of the surface][BTFIELD_PLANES]. table: of each
// colour mean, offset, two zeros and U. picture: [colour][pixel]. Work-item (column, row).
__kernel void show_planes(__global const float* planes, __global const float* x, __global const float* y,
                          __global const float* table, __global float* picture, int width, int height) {
    const int column = (int)get_global_id(0), row = (int)get_global_id(1);
    if (column >= width) return;
    const size_t pixel = (size_t)row * width + column;
    const Corners at = corners_of(wrapped(x[pixel], width), wrapped(y[pixel], height), width, height);
    float4 sums[BTFIELD_COLOURS];
    for (int i = 0; i < BTFIELD_COLOURS; ++i) sums[i] = (float4)(0.0f);
    for (int k = 0; k < BTFIELD_PLANES; k += 4) {
        const float4 value = blend(planes, &at, k);
        for (int i = 0; i < BTFIELD_COLOURS; ++i)
            sums[i] += value * vload4(0, table + i * (BTFIELD_PLANES + 4) + 4 + k);
    }
    for (int i = 0; i < BTFIELD_COLOURS; ++i) {
        __global const float* own = table + i * (BTFIELD_PLANES + 4);
        const float z = own[1] + sums[i].x + sums[i].y + sums[i].z + sums[i].w;
        picture[i * (size_t)width * height + pixel] = own[0] * z * z;
    }
}
#endif

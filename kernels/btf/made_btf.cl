// Pictures of a material that maps tell, from any view under any light (docs/btf.md): what a viewer's ray hits, how much of
// a light reaches each pixel of the surface, and what it looks like there. Maps are tori of width x height pixels, heights
// in pixels; x is right, y up, so that rows descend along y.

#include "base/lanes.clh"
#include "btf/relief_ray.clh"

// Pixels from one look along a ray to the next.
#define LIGHT_STEP 0.7f
// Width of a shadow's edge over the distance to what throws it.
#define SOFTNESS 0.15f

#ifdef BTFIELD_KERNEL_trace_view
// Where the ray to the viewer through each pixel of the mean plane first meets the surface, coming from the viewer, and
// what is there. relief: [row][column], mean 0, within [lowest, highest]. maps, seen: [plane][row][column], the last four
// planes normals and roughness, normals of length 1. hits: x, then y, of each pixel. Work-item (column, row).
__kernel void trace_view(__global const float* relief, __global const float* maps, int planes, float dx, float dy, float dz,
                         float lowest, float highest, __global float* hits, __global float* seen, int width, int height) {
    const int column = (int)get_global_id(0), row = (int)get_global_id(1);
    if (column >= width) return;
    const float t = distance_met(relief, column, row, dx, dy, dz, lowest, highest, width, height);
    const float x = wrapped(column + dx * t, width), y = wrapped(row - dy * t, height);
    const size_t pixels = (size_t)width * height, pixel = (size_t)row * width + column;
    hits[pixel] = x;
    hits[pixels + pixel] = y;
    for (int p = 0; p < planes - 4; ++p) seen[p * pixels + pixel] = between(maps + p * pixels, x, y, width, height);
    __global const float* normals = maps + (planes - 4) * pixels;
    __global float* normal = seen + (planes - 4) * pixels + pixel;
    float n[3], square = 0.0f;
    for (int i = 0; i < 3; ++i) {
        n[i] = between(normals + i * pixels, x, y, width, height);
        square += n[i] * n[i];
    }
    const float scale = square > 0.0f ? 1.0f / sqrt(square) : 0.0f;
    for (int i = 0; i < 3; ++i) normal[i * pixels] = n[i] * scale;
    normal[3 * pixels] = between(normals + 3 * pixels, x, y, width, height);
}
#endif

#ifdef BTFIELD_KERNEL_cast_light
// Share of a light that reaches each pixel of the surface: 1 where the ray to it clears all that is in the way by half a
// shadow's edge. Work-item (column, row).
__kernel void cast_light(__global const float* relief, float dx, float dy, float dz, float highest, float farthest,
                         __global float* light, int width, int height) {
    const int column = (int)get_global_id(0), row = (int)get_global_id(1);
    if (column >= width) return;
    const size_t pixel = (size_t)row * width + column;
    const float from = relief[pixel];
    float clearance = 0.5f;
    for (int i = 0;; ++i) {
        const float t = 1.0f + LIGHT_STEP * (float)i, ray = from + dz * t;
        if (t > farthest || ray > highest + 0.5f * SOFTNESS * t || clearance <= -0.5f) break;
        clearance = fmin(clearance, (ray - height_at(relief, column + dx * t, row - dy * t, width, height)) / (SOFTNESS * t));
    }
    light[pixel] = fmax(clearance + 0.5f, 0.0f);
}
#endif

#ifdef BTFIELD_KERNEL_shade
// Lambert's reflection of albedo 1 facing the light is 1; GGX's lobe with Smith's masking as Schlick has it and a constant
// reflectance beside it. hits, seen: of the view; light: of each pixel of the surface. picture: [plane][pixel], the albedo's
// planes. Work-item: vector of pixels.
__kernel void shade(__global const float* hits, __global const float* seen, __global const float* light, int planes, float vx,
                    float vy, float vz, float lx, float ly, float lz, float reflectance, __global float* picture, int width,
                    int height) {
    const int pixels = width * height, pixel = (int)get_global_id(0) * VW;
    if (pixel >= pixels) return;
    const int count = min(VW, pixels - pixel);
    const size_t stride = (size_t)pixels;
    float lit[VW];
    for (int l = 0; l < VW; ++l) {
        const int at = min(pixel + l, pixels - 1);
        lit[l] = between(light, hits[at], hits[stride + at], width, height);
    }
    __global const float* normal = seen + (planes - 4) * stride + pixel;
    const REALN nx = load_up_to(normal, count), ny = load_up_to(normal + stride, count),
                nz = load_up_to(normal + 2 * stride, count), roughness = load_up_to(normal + 3 * stride, count);
    const float hx = lx + vx, hy = ly + vy, hz = lz + vz, half_length = 1.0f / sqrt(hx * hx + hy * hy + hz * hz);
    const REALN nl = fmax(nx * lx + ny * ly + nz * lz, (REALN)(0.0f)), nv = fmax(nx * vx + ny * vy + nz * vz, (REALN)(0.05f));
    const REALN nh = fmin(fmax((nx * hx + ny * hy + nz * hz) * half_length, (REALN)(0.0f)), (REALN)(1.0f));
    const REALN alpha = roughness * roughness, square = alpha * alpha, k = 0.5f * alpha;
    const REALN lobe = nh * nh * (square - 1.0f) + 1.0f;
    const REALN gloss = reflectance * square /
                        (lobe * lobe * 4.0f * (nv * (1.0f - k) + k) * (fmax(nl, (REALN)(0.02f)) * (1.0f - k) + k));
    const REALN arriving = nl * LOADN(lit);
    for (int p = 0; p < planes - 4; ++p)
        store_up_to((load_up_to(seen + p * stride + pixel, count) + gloss) * arriving, picture + p * stride + pixel, count);
}
#endif

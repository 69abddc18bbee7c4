// A material on a plane or a sphere under directional light, as an orthographic camera sees it (theory 22.1).

#include "btf/relief_ray.clh"
#include "rendering/surface_planes.clh"

#ifndef BTFIELD_COLOURS
#error "BTFIELD_COLOURS is not defined"
#endif

// Numbers of a table's entry: of each colour log(mean / l_z), offset, background, zero and U.
#define ROW (BTFIELD_PLANES + 4)
#define ENTRY (BTFIELD_COLOURS * ROW)
// Samples of a pixel along each axis at most.
#define MOST_SAMPLES 4
// As far as the rim of a sphere is looked at, in radii.
#define RIM 0.9999f

// The material: a torus of width x height texels, heights in texels within [lowest, highest].
typedef struct {
    __global const float* relief;
    __global const float* planes;
    int width, height;
    float lowest, highest;
} Surface;

// Adds (offset + Σ U T)² of each colour, where a ray to (dx, dy, dz) through a place of the mean plane meets the relief.
inline void add_sample(const Surface* surface, float x, float y, float dx, float dy, float dz,
                       const float* entry, float* squares) {
    const int width = surface->width, height = surface->height;
    const float u = wrapped(x, width), v = wrapped(y, height);
    const float t =
        distance_met(surface->relief, u, v, dx, dy, dz, surface->lowest, surface->highest, width, height);
    const Corners at = corners_of(wrapped(u + dx * t, width), wrapped(v - dy * t, height), width, height);
    float4 sums[BTFIELD_COLOURS];
    for (int i = 0; i < BTFIELD_COLOURS; ++i) sums[i] = (float4)(0.0f);
    for (int k = 0; k < BTFIELD_PLANES; k += 4) {
        const float4 value = blend(surface->planes, &at, k);
        for (int i = 0; i < BTFIELD_COLOURS; ++i) sums[i] += value * vload4(0, entry + i * ROW + 4 + k);
    }
    for (int i = 0; i < BTFIELD_COLOURS; ++i) {
        const float z = entry[i * ROW + 1] + sums[i].x + sums[i].y + sums[i].z + sums[i].w;
        squares[i] += z * z;
    }
}

inline int samples_of(float texels) {
    return clamp((int)ceil(texels - 0.01f), 1, MOST_SAMPLES);
}

#ifdef BTFIELD_KERNEL_show_plane
// table: one entry. (to_x, to_y, to_z): unit vector to the viewer for rays. Texels (x, y) of a pixel (right, up) of the
// picture's centre: (origin_x + xx right + xy up, origin_y − xy right − yy up). lit: l_z. picture: [colour][pixel].
// Work-item (column, row).
__kernel void show_plane(__global const float* relief, __global const float* planes,
                         __global const float* table, int width, int height, float lowest, float highest,
                         float to_x, float to_y, float to_z, float lit, float origin_x, float origin_y,
                         float xx, float xy, float yy, __global float* picture, int columns, int rows) {
    const int column = (int)get_global_id(0), row = (int)get_global_id(1);
    if (column >= columns) return;
    const Surface surface = {relief, planes, width, height, lowest, highest};
    float entry[ENTRY], squares[BTFIELD_COLOURS];
    for (int i = 0; i < ENTRY; ++i) entry[i] = table[i];
    for (int i = 0; i < BTFIELD_COLOURS; ++i) squares[i] = 0.0f;
    const float right = (float)column - 0.5f * (float)(columns - 1),
                up = 0.5f * (float)(rows - 1) - (float)row;
    const int across = samples_of(sqrt(xx * xx + xy * xy)), down = samples_of(sqrt(xy * xy + yy * yy));
    for (int j = 0; j < down; ++j)
        for (int i = 0; i < across; ++i) {
            const float x = right + ((float)i + 0.5f) / (float)across - 0.5f,
                        y = up + ((float)j + 0.5f) / (float)down - 0.5f;
            add_sample(&surface, origin_x + xx * x + xy * y, origin_y - xy * x - yy * y, to_x, to_y, to_z,
                       entry, squares);
        }
    for (int i = 0; i < BTFIELD_COLOURS; ++i)
        picture[((size_t)i * rows + row) * columns + column] =
            exp(entry[i * ROW]) * lit * squares[i] / (float)(across * down);
}
#endif

#ifdef BTFIELD_KERNEL_show_sphere
// Normal of the sphere, and what the camera has of it.
typedef struct {
    float x, y, z;              ///< in the sphere's frame, poles at ±y
    float right, up, to;        ///< in the camera's
    float longitude, latitude;  ///< from z towards x, and towards y
} Place;

// (right, up) in radii.
inline Place place_of(float right, float up, float4 camera_right, float4 camera_up, float4 camera_to) {
    const float out = sqrt(right * right + up * up), within = out > RIM ? RIM / out : 1.0f;
    Place at;
    at.right = right * within;
    at.up = up * within;
    at.to = sqrt(1.0f - at.right * at.right - at.up * at.up);
    const float4 n = camera_right * at.right + camera_up * at.up + camera_to * at.to;
    at.x = n.x;
    at.y = n.y;
    at.z = n.z;
    at.longitude = atan2(n.x, n.z);
    at.latitude = asin(clamp(n.y, -1.0f, 1.0f));
    return at;
}

// table: [latitude from −90 to 90 degrees][longitude from 0 on] entries. camera_…, light: unit vectors in the sphere's
// frame. radius: pixels. texels: of a radian. steepest: cosine and sine of the steepest ray. picture: [colour][pixel].
// Work-item (column, row).
__kernel void show_sphere(__global const float* relief, __global const float* planes,
                          __global const float* table, int longitudes, int latitudes, int width, int height,
                          float lowest, float highest, float4 camera_right, float4 camera_up,
                          float4 camera_to, float4 light, float radius, float texels, float steepest_cosine,
                          float steepest_sine, __global float* picture, int columns,
                          int rows) {
    const int column = (int)get_global_id(0), row = (int)get_global_id(1);
    if (column >= columns) return;
    const float right = (float)column - 0.5f * (float)(columns - 1),
                up = 0.5f * (float)(rows - 1) - (float)row;
    const float coverage = clamp(radius + 0.5f - sqrt(right * right + up * up), 0.0f, 1.0f);
    const size_t pixels = (size_t)columns * rows, pixel = (size_t)row * columns + column;
    const Place at = place_of(right / radius, up / radius, camera_right, camera_up, camera_to);
    const float lit = at.x * light.x + at.y * light.y + at.z * light.z;
    if (coverage <= 0.0f || lit <= 0.0f) {
        for (int i = 0; i < BTFIELD_COLOURS; ++i)
            picture[i * pixels + pixel] = (1.0f - coverage) * table[i * ROW + 2];
        return;
    }
    const Surface surface = {relief, planes, width, height, lowest, highest};

    // The table, between its four entries.
    const float turn = 0.5f * M_1_PI_F * at.longitude,
                over = (at.latitude * M_1_PI_F + 0.5f) * (float)(latitudes - 1);
    const float around = (turn < 0.0f ? turn + 1.0f : turn) * (float)longitudes;
    const int west = min((int)around, longitudes - 1), south = min((int)over, latitudes - 2);
    const int east = west + 1 == longitudes ? 0 : west + 1;
    const float a = around - (float)west, b = over - (float)south;
    __global const float* low = table + (size_t)south * longitudes * ENTRY;
    __global const float* high = low + (size_t)longitudes * ENTRY;
    float entry[ENTRY], squares[BTFIELD_COLOURS];
    for (int i = 0; i < ENTRY; ++i)
        entry[i] = mix(mix(low[west * ENTRY + i], low[east * ENTRY + i], a),
                       mix(high[west * ENTRY + i], high[east * ENTRY + i], a), b);
    for (int i = 0; i < BTFIELD_COLOURS; ++i) squares[i] = 0.0f;

    // The viewer in the frame of the place, no lower than the steepest ray.
    const float level = fmax(sqrt(1.0f - at.y * at.y), 1e-6f), sine = at.x / level, cosine = at.z / level;
    float dx = camera_to.x * cosine - camera_to.z * sine;
    float dy = camera_to.y * level - (camera_to.x * sine + camera_to.z * cosine) * at.y;
    float dz = at.to;
    if (dz < steepest_cosine) {
        const float scale = steepest_sine / sqrt(dx * dx + dy * dy);
        dx *= scale;
        dy *= scale;
        dz = steepest_cosine;
    }

    // Texels of a pixel along its sides.
    const float density = texels / (radius * fmax(level, 0.25f)), slope_x = at.right / at.to,
                slope_y = at.up / at.to;
    const int across = samples_of(density * sqrt(1.0f + slope_x * slope_x));
    const int down = samples_of(density * sqrt(1.0f + slope_y * slope_y));
    for (int j = 0; j < down; ++j)
        for (int i = 0; i < across; ++i) {
            const float x = right + ((float)i + 0.5f) / (float)across - 0.5f,
                        y = up + ((float)j + 0.5f) / (float)down - 0.5f;
            const Place near = place_of(x / radius, y / radius, camera_right, camera_up, camera_to);
            add_sample(&surface, 0.5f * (float)(width - 1) + texels * near.longitude,
                       0.5f * (float)(height - 1) - texels * near.latitude, dx, dy, dz, entry, squares);
        }
    for (int i = 0; i < BTFIELD_COLOURS; ++i)
        picture[i * pixels + pixel] = (1.0f - coverage) * table[i * ROW + 2] + coverage * exp(entry[i * ROW]) * lit *
                                                                           squares[i] /
                                                                           (float)(across * down);
}
#endif

// A material on a plane or a sphere under directional light, as an orthographic camera sees it (theory 23.1). Three steps,
// for a band of the picture's rows at a time: where samples of pixels are on the mean plane, and from where they are seen;
// where their rays meet the relief; what the planes are there. The second alone is simple enough for drivers that lay
// work-items out in vectors, and takes most of the time.
//
// places: x, then y, in texels, each [sample][row of the band][column]; x below 0: there is no such sample. rays: x, y, z of
// the unit vector to the viewer in the frame of the place, each [row of the band][column].

#include "btf/relief_ray.clh"

// Samples of a pixel along each axis at most: they are [down][across] of these.
#define MOST_SAMPLES 4
// As far as the rim of a sphere is looked at, in radii.
#define RIM 0.9999f

inline int samples_of(float texels) {
    return clamp((int)ceil(texels - 0.01f), 1, MOST_SAMPLES);
}

// (right, up) of a pixel from the middle of the picture.
inline float2 pixel_at(int column, int row, int columns, int rows) {
    return (float2)((float)column - 0.5f * (float)(columns - 1), 0.5f * (float)(rows - 1) - (float)row);
}

// From the middle of a pixel to one of its samples.
inline float2 to_sample(int index, int across, int down) {
    return (float2)(((float)(index % across) + 0.5f) / (float)across - 0.5f,
                    ((float)(index / across) + 0.5f) / (float)down - 0.5f);
}

inline void put_ray(__global float* rays, size_t stride, size_t at, float x, float y, float z) {
    rays[at] = x;
    rays[stride + at] = y;
    rays[2 * stride + at] = z;
}

#ifdef BTFIELD_KERNEL_place_plane
// Texels (x, y) of a pixel (right, up) of the picture's middle: (origin_x + xx right + xy up, origin_y − xy right − yy up).
// Work-item (column, row of the band, sample).
__kernel void place_plane(float to_x, float to_y, float to_z, float origin_x, float origin_y, float xx, float xy, float yy,
                          int across, int down, __global float* places, __global float* rays, int width, int height,
                          int columns, int rows, int first, int band) {
    const int column = (int)get_global_id(0), row = (int)get_global_id(1), sample = (int)get_global_id(2);
    if (column >= columns) return;
    const float2 at = pixel_at(column, first + row, columns, rows) + to_sample(sample, across, down);
    const size_t stride = (size_t)columns * band, pixel = (size_t)row * columns + column;
    const size_t index = (size_t)sample * stride + pixel;
    places[index] = wrapped(origin_x + xx * at.x + xy * at.y, width);
    places[(size_t)(across * down) * stride + index] = wrapped(origin_y - xy * at.x - yy * at.y, height);
    if (sample == 0) put_ray(rays, stride, pixel, to_x, to_y, to_z);
}
#endif

#if defined(BTFIELD_KERNEL_place_sphere) || defined(BTFIELD_KERNEL_show_sphere)
// Normal of the sphere, and what the camera has of it.
typedef struct {
    float x, y, z;        // in the sphere's frame, poles at ±y
    float right, up, to;  // in the camera's
} Normal;

// (right, up) in radii.
inline Normal normal_at(float2 place, float4 camera_right, float4 camera_up, float4 camera_to) {
    const float out = sqrt(place.x * place.x + place.y * place.y), within = out > RIM ? RIM / out : 1.0f;
    Normal normal;
    normal.right = place.x * within;
    normal.up = place.y * within;
    normal.to = sqrt(1.0f - normal.right * normal.right - normal.up * normal.up);
    const float4 n = camera_right * normal.right + camera_up * normal.up + camera_to * normal.to;
    normal.x = n.x;
    normal.y = n.y;
    normal.z = n.z;
    return normal;
}

// Longitude, from z towards x, and latitude, towards y.
inline float2 angles_of(const Normal* n) {
    return (float2)(atan2(n->x, n->z), asin(clamp(n->y, -1.0f, 1.0f)));
}

inline float coverage_of(float2 pixel, float radius) {
    return clamp(radius + 0.5f - sqrt(pixel.x * pixel.x + pixel.y * pixel.y), 0.0f, 1.0f);
}

inline float lit_of(const Normal* n, float4 light) {
    return n->x * light.x + n->y * light.y + n->z * light.z;
}
#endif

#ifdef BTFIELD_KERNEL_place_sphere
// camera_…, light: unit vectors in the sphere's frame. radius: pixels. texels: of a radian. steepest: cosine and sine of
// the lowest ray. Work-item (column, row of the band).
__kernel void place_sphere(float4 camera_right, float4 camera_up, float4 camera_to, float4 light, float radius, float texels,
                           float steepest_cosine, float steepest_sine, __global float* places, __global float* rays,
                           int width, int height, int columns, int rows, int first, int band) {
    const int column = (int)get_global_id(0), row = (int)get_global_id(1);
    if (column >= columns) return;
    const size_t stride = (size_t)columns * band, pixel = (size_t)row * columns + column;
    const float2 middle = pixel_at(column, first + row, columns, rows);
    const Normal n = normal_at(middle / radius, camera_right, camera_up, camera_to);
    const float level = fmax(sqrt(fmax(1.0f - n.y * n.y, 0.0f)), 1e-6f);
    const float density = texels / (radius * fmax(level, 0.25f)), slope_x = n.right / n.to, slope_y = n.up / n.to;
    const int across = samples_of(density * sqrt(1.0f + slope_x * slope_x));
    const int down = samples_of(density * sqrt(1.0f + slope_y * slope_y));
    const int most = MOST_SAMPLES * MOST_SAMPLES;
    const int count = coverage_of(middle, radius) > 0.0f && lit_of(&n, light) > 0.0f ? across * down : 0;
    for (int sample = 0; sample < count; ++sample) {
        const Normal own =
            normal_at((middle + to_sample(sample, across, down)) / radius, camera_right, camera_up, camera_to);
        const float2 angles = angles_of(&own);
        const size_t index = (size_t)sample * stride + pixel;
        places[index] = wrapped(0.5f * (float)(width - 1) + texels * angles.x, width);
        places[most * stride + index] = wrapped(0.5f * (float)(height - 1) - texels * angles.y, height);
    }
    for (int sample = count; sample < most; ++sample) places[(size_t)sample * stride + pixel] = -1.0f;

    // The viewer in the frame of the place.
    const float sine = n.x / level, cosine = n.z / level;
    const float x = camera_to.x * cosine - camera_to.z * sine;
    const float y = camera_to.y * level - (camera_to.x * sine + camera_to.z * cosine) * n.y;
    const float scale = n.to < steepest_cosine ? steepest_sine / sqrt(x * x + y * y) : 1.0f;
    put_ray(rays, stride, pixel, scale * x, scale * y, fmax(n.to, steepest_cosine));
}
#endif

#ifdef BTFIELD_KERNEL_meet_places
// Places of samples become those of the relief that are seen there. relief: [row][column], within [lowest, highest].
// Work-item (pixel of the band, sample).
__kernel void meet_places(__global const float* relief, __global const float* rays, float lowest, float highest,
                          __global float* places, int samples, int width, int height, int pixels) {
    const int pixel = (int)get_global_id(0), sample = (int)get_global_id(1);
    if (pixel >= pixels) return;
    const size_t stride = (size_t)pixels, at = (size_t)sample * stride + pixel, under = at + (size_t)samples * stride;
    const float x = places[at], y = places[under];
    if (x < 0.0f) return;
    const float dx = rays[pixel], dy = rays[stride + pixel], dz = rays[2 * stride + pixel];
    const float t = distance_met(relief, x, y, dx, dy, dz, lowest, highest, width, height);
    places[at] = wrapped(x + dx * t, width);
    places[under] = wrapped(y - dy * t, height);
}
#endif

#if defined(BTFIELD_KERNEL_show_plane) || defined(BTFIELD_KERNEL_show_sphere)
#include "rendering/surface_planes.clh"

#ifndef BTFIELD_COLOURS
#error "BTFIELD_COLOURS is not defined"
#endif

// Numbers of a table's entry: of each colour log(mean / l_z), offset, background, zero and U.
#define ROW (BTFIELD_PLANES + 4)
#define ENTRY (BTFIELD_COLOURS * ROW)

// Mean over samples of (offset + Σ U T)² of each colour.
inline void mean_squares(__global const float* planes, __global const float* places, size_t pixel, size_t stride,
                         int samples, int width, int height, const float* entry, float* squares) {
    for (int i = 0; i < BTFIELD_COLOURS; ++i) squares[i] = 0.0f;
    int count = 0;
    for (; count < samples; ++count) {
        const float x = places[(size_t)count * stride + pixel], y = places[(size_t)(samples + count) * stride + pixel];
        if (x < 0.0f) break;
        const Corners at = corners_of(x, y, width, height);
        float4 sums[BTFIELD_COLOURS];
        for (int i = 0; i < BTFIELD_COLOURS; ++i) sums[i] = (float4)(0.0f);
        for (int k = 0; k < BTFIELD_PLANES; k += 4) {
            const float4 value = blend(planes, &at, k);
            for (int i = 0; i < BTFIELD_COLOURS; ++i) sums[i] += value * vload4(0, entry + i * ROW + 4 + k);
        }
        for (int i = 0; i < BTFIELD_COLOURS; ++i) {
            const float z = entry[i * ROW + 1] + sums[i].x + sums[i].y + sums[i].z + sums[i].w;
            squares[i] += z > 0.0f ? z * z : 0.0f;
        }
    }
    for (int i = 0; i < BTFIELD_COLOURS; ++i) squares[i] /= (float)count;
}
#endif

#ifdef BTFIELD_KERNEL_show_plane
// table: one entry. lit: l_z. picture: [colour][pixel]. Work-item (column, row of the band).
__kernel void show_plane(__global const float* planes, __global const float* table, __global const float* places,
                         int samples, float lit, __global float* picture, int width, int height, int columns, int rows,
                         int first, int band) {
    const int column = (int)get_global_id(0), row = (int)get_global_id(1);
    if (column >= columns) return;
    float entry[ENTRY], squares[BTFIELD_COLOURS];
    for (int i = 0; i < ENTRY; ++i) entry[i] = table[i];
    mean_squares(planes, places, (size_t)row * columns + column, (size_t)columns * band, samples, width, height, entry,
                 squares);
    for (int i = 0; i < BTFIELD_COLOURS; ++i)
        picture[((size_t)i * rows + first + row) * columns + column] = exp(entry[i * ROW]) * lit * squares[i];
}
#endif

#ifdef BTFIELD_KERNEL_show_sphere
// table: [latitude from −90 to 90 degrees][longitude from 0 on] entries. picture: [colour][pixel]. Work-item (column, row of
// the band).
__kernel void show_sphere(__global const float* planes, __global const float* table, __global const float* places,
                          int longitudes, int latitudes, float4 camera_right, float4 camera_up, float4 camera_to,
                          float4 light, float radius, __global float* picture, int width, int height, int columns, int rows,
                          int first, int band) {
    const int column = (int)get_global_id(0), row = (int)get_global_id(1);
    if (column >= columns) return;
    const float2 middle = pixel_at(column, first + row, columns, rows);
    const float coverage = coverage_of(middle, radius);
    const Normal n = normal_at(middle / radius, camera_right, camera_up, camera_to);
    const float lit = lit_of(&n, light);
    const size_t pixels = (size_t)columns * rows, pixel = (size_t)(first + row) * columns + column;
    if (coverage <= 0.0f || lit <= 0.0f) {
        for (int i = 0; i < BTFIELD_COLOURS; ++i) picture[i * pixels + pixel] = (1.0f - coverage) * table[i * ROW + 2];
        return;
    }
    // The table, between its four entries.
    const float2 angles = angles_of(&n);
    const float turn = 0.5f * M_1_PI_F * angles.x, over = (angles.y * M_1_PI_F + 0.5f) * (float)(latitudes - 1);
    const float around = (turn < 0.0f ? turn + 1.0f : turn) * (float)longitudes;
    const int west = min((int)around, longitudes - 1), south = clamp((int)over, 0, latitudes - 2);
    const int east = west + 1 == longitudes ? 0 : west + 1;
    const float a = around - (float)west, b = over - (float)south;
    __global const float* low = table + (size_t)south * longitudes * ENTRY;
    __global const float* high = low + (size_t)longitudes * ENTRY;
    float entry[ENTRY], squares[BTFIELD_COLOURS];
    for (int i = 0; i < ENTRY; ++i)
        entry[i] = mix(mix(low[west * ENTRY + i], low[east * ENTRY + i], a),
                       mix(high[west * ENTRY + i], high[east * ENTRY + i], a), b);
    mean_squares(planes, places, (size_t)row * columns + column, (size_t)columns * band, MOST_SAMPLES * MOST_SAMPLES, width,
                 height, entry, squares);
    for (int i = 0; i < BTFIELD_COLOURS; ++i)
        picture[i * pixels + pixel] =
            (1.0f - coverage) * table[i * ROW + 2] + coverage * exp(entry[i * ROW]) * lit * squares[i];
}
#endif

// One pixel of a material on a plane or a sphere: what kernels/rendering/lit_shape.cl computes. COLOURS and LAYERS are
// defined by the page.

precision highp float;
precision highp int;
precision highp sampler2D;
precision highp sampler2DArray;

uniform sampler2D heights;      // texels
uniform sampler2DArray planes;  // four to a layer, from 0 to 1
uniform sampler2DArray table;   // of each colour (log(mean / l_z), offset), then U of planes less 1/2
uniform vec2 tile, grid, picture, origin;
uniform float lowest, highest;
uniform bool sphere;
uniform vec3 camera_right, camera_up, camera_to, light;
uniform vec3 stretch;  // plane: texels of a pixel, xx, xy, yy
uniform float radius, texels, background, exposure;
uniform vec2 steepest;  // cosine and sine
uniform mat3 to_rgb;

out vec4 colour;

const float PI = 3.14159265358979;
const float STEP = 0.5;
const int MOST_SAMPLES = 4;
const float RIM = 0.9999;

float height_at(vec2 place) {
    return textureLod(heights, (place + 0.5) / tile, 0.0).r;
}

// How far along the ray (right, up, out) from a place the view meets the relief; y of places goes down.
float distance_met(vec2 place, vec3 ray) {
    vec2 along = vec2(ray.x, -ray.y);
    float first = highest / ray.z, last = lowest / ray.z;
    int steps = int(ceil((first - last) / STEP));
    for (int i = 1; i <= steps; ++i) {
        float at = first - STEP * float(i);
        if (ray.z * at > height_at(place + along * at)) continue;
        float below = at, above = at + STEP;
        for (int k = 0; k < 6; ++k) {
            float middle = 0.5 * (below + above);
            if (ray.z * middle > height_at(place + along * middle)) above = middle;
            else below = middle;
        }
        return 0.5 * (below + above);
    }
    return last;
}

void add_sample(vec2 place, vec3 ray, vec4 entry[COLOURS * (LAYERS + 1)], inout float squares[COLOURS]) {
    float t = distance_met(place, ray);
    vec2 at = (place + vec2(ray.x, -ray.y) * t + 0.5) / tile;
    vec4 value[LAYERS];
    for (int k = 0; k < LAYERS; ++k) value[k] = textureLod(planes, vec3(at, float(k)), 0.0) - 0.5;
    for (int c = 0; c < COLOURS; ++c) {
        float z = entry[c * (LAYERS + 1)].y;
        for (int k = 0; k < LAYERS; ++k) z += dot(entry[c * (LAYERS + 1) + 1 + k], value[k]);
        squares[c] += z > 0.0 ? z * z : 0.0;
    }
}

int samples_of(float count) {
    return clamp(int(ceil(count - 0.01)), 1, MOST_SAMPLES);
}

// (right, up, to) of a normal of the sphere, from (right, up) in radii.
vec3 normal_of(vec2 place) {
    float out_ = length(place);
    vec2 within = out_ > RIM ? place * (RIM / out_) : place;
    return vec3(within, sqrt(1.0 - dot(within, within)));
}

vec3 in_sphere(vec3 normal) {
    return camera_right * normal.x + camera_up * normal.y + camera_to * normal.z;
}

vec2 longitude_latitude(vec3 n) {
    return vec2(atan(n.x, n.z), asin(clamp(n.y, -1.0, 1.0)));
}

float encoded(float linear) {
    float x = clamp(linear, 0.0, 1.0);
    return x <= 0.0031308 ? 12.92 * x : 1.055 * pow(x, 1.0 / 2.4) - 0.055;
}

void show(vec3 linear) {
    vec3 rgb = to_rgb * linear * exposure;
    colour = vec4(encoded(rgb.r), encoded(rgb.g), encoded(rgb.b), 1.0);
}

void main() {
    vec2 pixel = gl_FragCoord.xy - 0.5 * picture;
    vec2 where = vec2(0.5);
    float coverage = 1.0, lit = light.z;
    vec3 ray = camera_to;
    ivec2 samples;
    vec3 behind = inverse(to_rgb) * vec3(background);
    if (sphere) {
        coverage = clamp(radius + 0.5 - length(pixel), 0.0, 1.0);
        vec3 normal = normal_of(pixel / radius), n = in_sphere(normal);
        lit = dot(n, light);
        if (coverage <= 0.0 || lit <= 0.0) {
            show((1.0 - coverage) * behind);
            return;
        }
        vec2 place = longitude_latitude(n);
        where = vec2(place.x / (2.0 * PI) + 0.5 / grid.x, ((place.y / PI + 0.5) * (grid.y - 1.0) + 0.5) / grid.y);
        float level = max(sqrt(max(1.0 - n.y * n.y, 0.0)), 1e-6), sine = n.x / level, cosine = n.z / level;
        ray = vec3(camera_to.x * cosine - camera_to.z * sine,
                   camera_to.y * level - (camera_to.x * sine + camera_to.z * cosine) * n.y, normal.z);
        if (ray.z < steepest.x) ray = vec3(ray.xy * (steepest.y / length(ray.xy)), steepest.x);
        vec2 slope = normal.xy / normal.z;
        vec2 footprint = texels / (radius * max(level, 0.25)) * sqrt(1.0 + slope * slope);
        samples = ivec2(samples_of(footprint.x), samples_of(footprint.y));
    } else {
        samples = ivec2(samples_of(length(stretch.xy)), samples_of(length(stretch.yz)));
    }
    vec4 entry[COLOURS * (LAYERS + 1)];
    for (int i = 0; i < COLOURS * (LAYERS + 1); ++i) entry[i] = textureLod(table, vec3(where, float(i)), 0.0);
    float squares[COLOURS];
    for (int c = 0; c < COLOURS; ++c) squares[c] = 0.0;
    for (int j = 0; j < samples.y; ++j) {
        for (int i = 0; i < samples.x; ++i) {
            vec2 at = pixel + (vec2(i, j) + 0.5) / vec2(samples) - 0.5, place;
            if (sphere) {
                vec2 angles = longitude_latitude(in_sphere(normal_of(at / radius)));
                place = 0.5 * (tile - 1.0) + texels * vec2(angles.x, -angles.y);
            } else {
                place = origin + vec2(dot(stretch.xy, at), -dot(stretch.yz, at));
            }
            add_sample(place, ray, entry, squares);
        }
    }
    vec3 linear;
    for (int c = 0; c < COLOURS; ++c)
        linear[c] = exp(entry[c * (LAYERS + 1)].x) * lit * squares[c] / float(samples.x * samples.y);
    if (COLOURS == 1) linear = vec3(linear.x);
    show((1.0 - coverage) * behind + coverage * linear);
}

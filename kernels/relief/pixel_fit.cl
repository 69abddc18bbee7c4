// Photometric stereo, pixel by pixel (theory 19.3): b = ρ n of each pixel from its values under many lights, each vector
// lane a pixel of its own.

#include "base/lanes.clh"

#ifndef BTFIELD_LIGHTS
#error "BTFIELD_LIGHTS (room for this many lights) is not defined"
#endif
#ifndef BTFIELD_RULE
#error "BTFIELD_RULE (0: least squares, 1: ranks, 2: Huber, 3: ambient, 4: lobe) is not defined"
#endif

#define RANKS 1
#define HUBER 2
#define AMBIENT 3
#define LOBE 4
// Unknowns: b, ambient, strength of the lobe.
#define UNKNOWNS 5
#define FAR_AWAY 3e38f
#define LOWEST 1e-30f

typedef struct {
    REALN x[UNKNOWNS];
} fit;

// What a pixel and the rule have in common for all steps.
typedef struct {
    int lights;
    __global const float4 *direction, *half_way;  // unit vectors; half_way.w is not used
    float roughness;
    REALN gate, floor_;
} given;

inline REALN size_of(REALN v) {
    return fabs(v);
}

// Truncates the value of this rank, from 0, among `count` values of 0 or more to its first `steps` bits behind the sign: 12
// bits keep 1/16 of it, 31 all. By bisection on bits, in which such numbers are ordered as whole numbers are.
inline REALN order_statistic(const REALN* values, int count, INTN rank, int steps) {
    UINTN low = (UINTN)(0);
    for (int bit = 30; bit > 30 - steps; --bit) {
        const UINTN trial = low | (UINTN)(1u << bit);
        INTN below = (INTN)(0);
        for (int k = 0; k < count; ++k) below -= MASK(AS_UINTN(values[k]) < trial);
        const INTN taken = MASK(below <= rank);
        low = AS_UINTN(choose(taken, AS_REALN(trial), AS_REALN(low)));
    }
    return AS_REALN(low);
}

// Solves a x = y, a symmetric and positive, lower triangle [i][j <= i] by rows; both are lost.
#define AT(i, j) ((i) * ((i) + 1) / 2 + (j))
#define SOLVE(name, N)                                                       \
    inline void name(REALN* a, REALN* y) {                                   \
        for (int i = 0; i < N; ++i) {                                        \
            for (int j = 0; j <= i; ++j) {                                   \
                REALN sum = a[AT(i, j)];                                     \
                for (int k = 0; k < j; ++k) sum -= a[AT(i, k)] * a[AT(j, k)]; \
                a[AT(i, j)] = i == j ? sqrt(fmax(sum, LOWEST)) : sum / a[AT(j, j)]; \
            }                                                                \
            REALN sum = y[i];                                                \
            for (int k = 0; k < i; ++k) sum -= a[AT(i, k)] * y[k];           \
            y[i] = sum / a[AT(i, i)];                                        \
        }                                                                    \
        for (int i = N - 1; i >= 0; --i) {                                   \
            REALN sum = y[i];                                                \
            for (int k = i + 1; k < N; ++k) sum -= a[AT(k, i)] * y[k];       \
            y[i] = sum / a[AT(i, i)];                                        \
        }                                                                    \
    }
SOLVE(solve3, 3)
SOLVE(solve4, 4)
SOLVE(solve5, 5)

inline REALN shading(const REALN* b, float4 l) {
    return fma(b[0], (REALN)(l.x), fma(b[1], (REALN)(l.y), b[2] * l.z));
}

// 1 / d to 3e-4 for d > 0, some times faster than a division: weights need no more.
inline REALN roughly_inverse(REALN d) {
    REALN r = AS_REALN((UINTN)(0x7ef311c3u) - AS_UINTN(d));
    r *= fma(-d, r, (REALN)(2.0f));
    return r * fma(-d, r, (REALN)(2.0f));
}

// Median of residuals under lights that count, as a deviation; not below the floor. Truncated to steps of 1/8 of what lies
// up to 8 octaves above the floor's own.
inline REALN scale_of(const REALN* sizes, const given* with, INTN counted) {
    UINTN low = AS_UINTN(with->floor_ * 0.5f) & 0x7f800000u;
    const INTN rank = counted >> 1;
    for (int bit = 25; bit > 19; --bit) {
        const UINTN trial = low + (UINTN)(1u << bit);
        INTN below = (INTN)(0);
        for (int k = 0; k < with->lights; ++k) below -= MASK(AS_UINTN(sizes[k]) < trial);
        low = AS_UINTN(choose(MASK(below <= rank), AS_REALN(trial), AS_REALN(low)));
    }
    // 1.4826 for a normal distribution, and 1/16 for what was cut off on average.
    return fmax(1.4826f * 1.0625f * AS_REALN(low), with->floor_);
}

// inverse: 1 / scale
inline REALN weight_of(REALN size, REALN inverse) {
    const REALN u = size * inverse;
#if BTFIELD_RULE == HUBER
    return fmin((REALN)(1.0f), 1.345f * roughly_inverse(fmax(u, (REALN)(LOWEST))));
#else
    const REALN r = roughly_inverse(fma(u, u, (REALN)(1.0f)));
    return r * r;
#endif
}

// Reweighted least squares from b = x[0 … 2] on: I = max(0, b·l), and the ambient x[3] >= 0 with it where the rule has it.
// values: below 0 where saturated; sizes: room.
inline void reweight(const REALN* values, REALN* sizes, const given* with, fit* of, int steps) {
    for (int t = 0; t < steps; ++t) {
        INTN counted = (INTN)(0);
        for (int k = 0; k < with->lights; ++k) {
            const REALN s = shading(of->x, with->direction[k]);
            const INTN counts = MASK(values[k] >= with->gate);
            counted -= counts;
            sizes[k] = choose(counts, size_of(values[k] - fmax(s, (REALN)(0.0f)) - of->x[3]), (REALN)(FAR_AWAY));
        }
        const REALN inverse = 1.0f / scale_of(sizes, with, counted);
        REALN a[10], y[4];
        for (int i = 0; i < 10; ++i) a[i] = (REALN)(0.0f);
        for (int i = 0; i < 4; ++i) y[i] = (REALN)(0.0f);
        for (int k = 0; k < with->lights; ++k) {
            const float4 l = with->direction[k];
            const REALN s = shading(of->x, l);
            REALN w = weight_of(sizes[k], inverse);
            w = choose(MASK(s > 0.0f) & MASK(values[k] >= with->gate), w, (REALN)(0.0f));
            const REALN v = w * values[k];
            a[0] += w * (l.x * l.x);
            a[1] += w * (l.x * l.y);
            a[2] += w * (l.y * l.y);
            a[3] += w * (l.x * l.z);
            a[4] += w * (l.y * l.z);
            a[5] += w * (l.z * l.z);
            a[6] += w * l.x;
            a[7] += w * l.y;
            a[8] += w * l.z;
            a[9] += w;
            y[0] += v * l.x;
            y[1] += v * l.y;
            y[2] += v * l.z;
            y[3] += v;
        }
        const REALN total = a[9];
        const INTN usable = MASK(total > 0.0f);
        for (int i = 0; i < 3; ++i) a[AT(i, i)] += 1e-6f * total;
        REALN plain[6], b[3];
        for (int i = 0; i < 6; ++i) plain[i] = a[i];
        for (int i = 0; i < 3; ++i) b[i] = y[i];
        solve3(plain, b);
        REALN ambient = (REALN)(0.0f);
#if BTFIELD_RULE >= AMBIENT
        a[9] += 0.01f * total;
        solve4(a, y);
        const INTN above = MASK(y[3] >= 0.0f);
        for (int i = 0; i < 3; ++i) b[i] = choose(above, y[i], b[i]);
        ambient = choose(above, y[3], ambient);
#endif
        for (int i = 0; i < 3; ++i) of->x[i] = choose(usable, b[i], of->x[i]);
        of->x[3] = choose(usable, ambient, of->x[3]);
    }
}

// Value of the model under a light, and what its derivatives need.
typedef struct {
    REALN shade, value, lobe, slope;  // b·l; model; D f; dD f / d(n·h), times strength / |b|
    REALN cosine;                     // n·h
} modelled;

inline modelled model(const fit* of, const REALN* n, REALN inverse, const given* with, int k) {
    modelled m;
    m.shade = shading(of->x, with->direction[k]);
    m.value = fmax(m.shade, (REALN)(0.0f)) + of->x[3];
#if BTFIELD_RULE == LOBE
    m.cosine = shading(n, with->half_way[k]);
    const float alpha = with->roughness * with->roughness;
    // Not below alpha: cosines are at most 1, but for rounding.
    const REALN q = fmax(fma(m.cosine * m.cosine, (REALN)(alpha - 1.0f), (REALN)(1.0f)), (REALN)(alpha));
    REALN root = roughly_inverse(q);
    root *= alpha * fma(-q, root, (REALN)(2.0f));
    const REALN faded = fmin(fmax(m.shade * inverse * 10.0f, (REALN)(0.0f)), (REALN)(1.0f));
    m.lobe = choose(MASK(m.cosine > 0.0f), root * root * faded, (REALN)(0.0f));
    m.slope = (4.0f * (1.0f - alpha) / alpha) * m.cosine * root * m.lobe * of->x[4] * inverse;
    m.value += of->x[4] * m.lobe;
#endif
    return m;
}

inline REALN unit(const fit* of, REALN* n) {
    const REALN inverse =
        1.0f / fmax(sqrt(of->x[0] * of->x[0] + of->x[1] * of->x[1] + of->x[2] * of->x[2]), (REALN)(LOWEST));
    for (int i = 0; i < 3; ++i) n[i] = of->x[i] * inverse;
    return inverse;
}

#if BTFIELD_RULE == LOBE
// Sizes of residuals; what they cost at a scale.
inline REALN residuals(const REALN* values, REALN* sizes, const given* with, const fit* of, REALN scale, INTN* counted) {
    const REALN steps = 1.0f / scale;
    REALN n[3], cost = (REALN)(0.0f);
    const REALN inverse = unit(of, n);
    *counted = (INTN)(0);
    for (int k = 0; k < with->lights; ++k) {
        const modelled m = model(of, n, inverse, with, k);
        const INTN counts = MASK(values[k] >= with->gate);
        const REALN size = size_of(values[k] - m.value);
        const REALN u = size * steps;
        *counted -= counts;
        sizes[k] = choose(counts, size, (REALN)(FAR_AWAY));
        cost += choose(counts, 1.0f - roughly_inverse(fma(u, u, (REALN)(1.0f))), (REALN)(0.0f));
    }
    return cost;
}

// Normal equations of a step, and the cost of where it starts.
inline REALN equations(const REALN* values, const given* with, const fit* of, REALN scale, REALN* a, REALN* y) {
    const REALN steps = 1.0f / scale;
    REALN n[3], cost = (REALN)(0.0f), total = (REALN)(0.0f);
    const REALN inverse = unit(of, n);
    for (int i = 0; i < 15; ++i) a[i] = (REALN)(0.0f);
    for (int i = 0; i < UNKNOWNS; ++i) y[i] = (REALN)(0.0f);
    for (int k = 0; k < with->lights; ++k) {
        const modelled m = model(of, n, inverse, with, k);
        const float4 l = with->direction[k], h = with->half_way[k];
        const INTN counts = MASK(values[k] >= with->gate), lit = counts & MASK(m.shade > 0.0f);
        const REALN r = values[k] - m.value;
        const REALN u = r * steps, kept = roughly_inverse(fma(u, u, (REALN)(1.0f)));
        cost += choose(counts, 1.0f - kept, (REALN)(0.0f));
        const REALN w = choose(lit, kept * kept, (REALN)(0.0f));
        REALN j[UNKNOWNS];
        j[0] = fma(m.slope, h.x - m.cosine * n[0], (REALN)(l.x));
        j[1] = fma(m.slope, h.y - m.cosine * n[1], (REALN)(l.y));
        j[2] = fma(m.slope, h.z - m.cosine * n[2], (REALN)(l.z));
        j[4] = m.lobe;
        total += w;
        for (int i = 0; i < UNKNOWNS; ++i) {
            const REALN wj = i == 3 ? w : w * j[i];
            for (int e = 0; e <= i; ++e) a[AT(i, e)] += e == 3 ? wj : (i == 3 ? w * j[e] : wj * j[e]);
            y[i] += wj * r;
        }
    }
    a[AT(3, 3)] += 0.01f * total;
    y[3] -= 0.01f * total * of->x[3];
    a[AT(4, 4)] += 0.001f * total;
    y[4] -= 0.001f * total * of->x[4];
    for (int i = 0; i < UNKNOWNS; ++i) a[AT(i, i)] += 1e-7f * total + LOWEST;
    return cost;
}

// Levenberg-Marquardt, the scale graduated.
inline void descend(const REALN* values, REALN* sizes, const given* with, fit* of) {
    REALN damping = (REALN)(1e-3f);
    INTN counted;
    for (int stage = 0; stage < 2; ++stage) {
        const float widened = stage == 0 ? 1.5f : 1.0f;
        (void)residuals(values, sizes, with, of, (REALN)(1.0f), &counted);
        REALN scale = widened * scale_of(sizes, with, counted);
        for (int t = 0; t < 6; ++t) {
            REALN a[15], y[UNKNOWNS];
            const REALN before = equations(values, with, of, scale, a, y);
            for (int i = 0; i < UNKNOWNS; ++i) a[AT(i, i)] *= 1.0f + damping;
            solve5(a, y);
            fit next;
            for (int i = 0; i < UNKNOWNS; ++i) next.x[i] = of->x[i] + y[i];
            for (int i = 3; i < UNKNOWNS; ++i) next.x[i] = fmax(next.x[i], (REALN)(0.0f));
            const REALN after = residuals(values, sizes, with, &next, scale, &counted);
            const INTN better = MASK(after <= before);
            for (int i = 0; i < UNKNOWNS; ++i) of->x[i] = choose(better, next.x[i], of->x[i]);
            scale = choose(better, widened * scale_of(sizes, with, counted), scale);
            damping = choose(better, fmax(0.3f * damping, (REALN)(1e-6f)), fmin(8.0f * damping, (REALN)(1e3f)));
        }
    }
}

// The sum of residuals, each cut at a part of what is bright.
inline REALN misfit(const REALN* values, const given* with, const fit* of) {
    REALN n[3], sum = (REALN)(0.0f);
    const REALN inverse = unit(of, n);
    for (int k = 0; k < with->lights; ++k)
        sum += choose(MASK(values[k] >= with->gate),
                      fmin(size_of(values[k] - model(of, n, inverse, with, k).value), 9.0f * with->floor_), (REALN)(0.0f));
    return sum;
}
#endif

// Weights that the last step of the rule gives, for albedo.
inline REALN final_weight(REALN value, REALN size, REALN scale, const given* with, REALN lowest, REALN highest) {
#if BTFIELD_RULE == RANKS
    return choose(MASK(size_of(value) >= lowest) & MASK(size_of(value) <= highest), (REALN)(1.0f), (REALN)(0.0f));
#elif BTFIELD_RULE >= HUBER
    return choose(MASK(value >= with->gate), weight_of(size, 1.0f / scale), (REALN)(0.0f));
#else
    return (REALN)(1.0f);
#endif
}

#ifdef BTFIELD_KERNEL_fit_pixels
// Work-item (vector of pixels).
//   stack: [light][plane][pixel], values below 0 where saturated; a row of pixels has `pitch` floats
//   direction, half_way: unit vectors to the light, and half way to the viewer at (0, 0, 1)
//   inverse: row k of the pseudo-inverse of all directions: b = Σ_k inverse[k] I_k
//   low, high: ranks that count, as parts of the largest
//   fits: [b_x, b_y, b_z, ambient, strength][pixel]; albedo: [plane][pixel]; residual: [pixel], Σ|I − model| / Σ I
__kernel void fit_pixels(__global const float* stack, __global const float4* direction, __global const float4* half_way,
                         __global const float4* inverse, int lights, int planes, int pixels, int pitch, float low, float high,
                         float roughness, __global float* fits, __global float* albedo, __global float* residual) {
    const int first = (int)get_global_id(0) * VW;
    if (first >= pixels) return;
    const int count = min(VW, pixels - first);
    REALN values[BTFIELD_LIGHTS], sizes[BTFIELD_LIGHTS];
    fit of;
    for (int i = 0; i < UNKNOWNS; ++i) of.x[i] = (REALN)(0.0f);
    for (int k = 0; k < lights; ++k) {
        REALN sum = (REALN)(0.0f);
        INTN saturated = (INTN)(0);
        for (int p = 0; p < planes; ++p) {
            const REALN value = load_up_to(stack + ((size_t)k * planes + p) * pitch + first, count);
            saturated |= MASK(value < 0.0f);
            sum += size_of(value);
        }
        const REALN grey = sum / (float)planes;
        values[k] = choose(saturated, -grey, grey);
        sizes[k] = grey;
        const float4 row = inverse[k];
        of.x[0] += grey * row.x;
        of.x[1] += grey * row.y;
        of.x[2] += grey * row.z;
    }
    given with;
    with.lights = lights;
    with.direction = direction;
    with.half_way = half_way;
    with.roughness = roughness;
    with.gate = with.floor_ = (REALN)(0.0f);
    REALN lowest = (REALN)(0.0f), highest = (REALN)(FAR_AWAY), scale = (REALN)(1.0f);
#if BTFIELD_RULE == RANKS
    lowest = order_statistic(sizes, lights, (INTN)((int)ceil(low * (lights - 1))), 31);
    highest = order_statistic(sizes, lights, (INTN)((int)floor(high * (lights - 1))), 31);
    REALN a[6], y[3], total = (REALN)(0.0f);
    for (int i = 0; i < 6; ++i) a[i] = (REALN)(0.0f);
    for (int i = 0; i < 3; ++i) y[i] = (REALN)(0.0f);
    for (int k = 0; k < lights; ++k) {
        const float4 l = direction[k];
        const REALN w = final_weight(values[k], sizes[k], scale, &with, lowest, highest), v = w * sizes[k];
        a[0] += w * (l.x * l.x);
        a[1] += w * (l.x * l.y);
        a[2] += w * (l.y * l.y);
        a[3] += w * (l.x * l.z);
        a[4] += w * (l.y * l.z);
        a[5] += w * (l.z * l.z);
        y[0] += v * l.x;
        y[1] += v * l.y;
        y[2] += v * l.z;
        total += w;
    }
    for (int i = 0; i < 3; ++i) a[AT(i, i)] += 1e-6f * total;
    solve3(a, y);
    for (int i = 0; i < 3; ++i) of.x[i] = y[i];
#elif BTFIELD_RULE >= HUBER
    const int last = lights - 1;
    with.gate = 0.15f * order_statistic(sizes, lights, (INTN)((8 * last) / 10), 12);
    const REALN bright = order_statistic(sizes, lights, (INTN)((9 * last) / 10), 12);
    with.floor_ = fmax(0.01f * bright, (REALN)(LOWEST));
#if BTFIELD_RULE == LOBE
    // From two starts: reweighted with ambient light, and least squares, which is kept unless the other is clearly better, as
    // what is thrown out to fit the rest may have been right.
    fit other = of;
    descend(values, sizes, &with, &of);
    reweight(values, sizes, &with, &other, 8);
    descend(values, sizes, &with, &other);
    const INTN better = MASK(1.1f * misfit(values, &with, &other) < misfit(values, &with, &of));
    for (int i = 0; i < UNKNOWNS; ++i) of.x[i] = choose(better, other.x[i], of.x[i]);
#else
    reweight(values, sizes, &with, &of, 12);
#endif
#endif
    REALN n[3], sum = (REALN)(0.0f), all = (REALN)(0.0f);
    const REALN length = unit(&of, n);
    INTN counted = (INTN)(0);
    for (int k = 0; k < lights; ++k) {
        const REALN size = size_of(size_of(values[k]) - model(&of, n, length, &with, k).value);
        const INTN counts = MASK(values[k] >= with.gate);
        const INTN sound = MASK(values[k] >= 0.0f);
        sum += choose(sound, size, (REALN)(0.0f));
        all += choose(sound, values[k], (REALN)(0.0f));
        counted -= counts;
        sizes[k] = choose(counts, size, (REALN)(FAR_AWAY));
    }
#if BTFIELD_RULE >= HUBER
    scale = scale_of(sizes, &with, counted);
#endif
    store_up_to(sum / fmax(all, (REALN)(LOWEST)), residual + first, count);
    for (int i = 0; i < UNKNOWNS; ++i) store_up_to(of.x[i], fits + (size_t)i * pixels + first, count);
    for (int p = 0; p < planes; ++p) {
        REALN product = (REALN)(0.0f), square = (REALN)(0.0f);
        for (int k = 0; k < lights; ++k) {
            const REALN s = fmax(shading(n, direction[k]), (REALN)(0.0f));
            const REALN w = final_weight(values[k], sizes[k], scale, &with, lowest, highest) * s;
            product += w * size_of(load_up_to(stack + ((size_t)k * planes + p) * pitch + first, count));
            square += w * s;
        }
        store_up_to(product / fmax(square, (REALN)(LOWEST)), albedo + (size_t)p * pixels + first, count);
    }
}
#endif

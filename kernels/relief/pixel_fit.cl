// Photometric stereo, pixel by pixel (theory 19.3): b = ρ n of each pixel from its values under many lights, each vector
// lane a pixel of its own.

#include "base/lanes.clh"

#ifndef BTFIELD_LIGHTS
#error "BTFIELD_LIGHTS (room for this many lights) is not defined"
#endif
#ifndef BTFIELD_RULE
#error "BTFIELD_RULE (0: least squares, 1: ranks, 2: Huber, 3: ambient, 4: lobe) is not defined"
#endif
#ifndef BTFIELD_FEW
#error "BTFIELD_FEW (whether lights are few, and their weights fall slowly) is not defined"
#endif
#ifndef BTFIELD_STACK
#error "BTFIELD_STACK (0: light, below 0 where saturated, 1: floats, 2: uchar, 3: ushort) is not defined"
#endif
#ifndef BTFIELD_FOLLOW
#error "BTFIELD_FOLLOW (whether a neighbour's fit is where to begin) is not defined"
#endif
#ifndef BTFIELD_TABLE
#error "BTFIELD_TABLE (whether whole numbers are looked up) is not defined"
#endif

#define RANKS 1
#define HUBER 2
#define AMBIENT 3
#define LOBE 4
// Unknowns: b, ambient, strength of the lobe.
#define UNKNOWNS 5
#define FAR_AWAY 3e38f
#define LOWEST 1e-30f
// Values below this part of a pixel's brightest are in shadow.
#define DARK 0.02f

#if BTFIELD_STACK == 2
typedef uchar STORED;
#define LARGEST 255u
#elif BTFIELD_STACK == 3
typedef ushort STORED;
#define LARGEST 65535u
#else
typedef float STORED;
#endif
#if VW == 1
#define TO_UINTN convert_uint
#else
#define TO_UINTN BTFIELD_PASTE(convert_uint, VW)
#endif

typedef struct {
    REALN x[UNKNOWNS];
} fit;

// What a pixel and the rule have in common for all steps.
typedef struct {
    int lights;
    __global const float4 *direction, *half_way;  // unit vectors
    float roughness;
    REALN gate, floor_;
} given;

inline REALN size_of(REALN v) {
    return fabs(v);
}

// Light of what is stored, below 0 where saturated.
inline REALN light_of(__global const STORED* at, float gain, __global const float* table) {
#if BTFIELD_STACK == 0
    return LOADN(at);
#elif BTFIELD_STACK == 1
    return gain * fmax(LOADN(at), (REALN)(0.0f));
#else
    const UINTN number = TO_UINTN(LOADN(at));
#if BTFIELD_TABLE
    uint places[VW];
    float found[VW];
    STOREN_UINT(number, places);
    for (int l = 0; l < VW; ++l) found[l] = table[places[l]];
    const REALN value = gain * LOADN(found);
#else
    const REALN value = gain * TO_REALN(number);
#endif
    return choose(MASK(number == LARGEST), -value, value);
#endif
}

// Fills room behind the last of `count` values so that they can be counted by fours.
inline void pad(REALN* values, int count) {
    for (; count % 4 != 0; ++count) values[count] = (REALN)(FAR_AWAY);
}

// Truncates the value of this rank, from 0, among `count` padded values of 0 or more to its first `steps` bits from `bit`
// on, those above being `low`. By bisection on bits, in which such numbers are ordered as whole numbers are.
inline REALN order_statistic(const REALN* values, int count, INTN rank, UINTN low, int bit, int steps) {
    for (const int last = bit - steps; bit > last; --bit) {
        const UINTN trial = low + (UINTN)(1u << bit);
        INTN below = (INTN)(0), others = (INTN)(0);
        for (int k = 0; k < count; k += 4) {
            below -= MASK(AS_UINTN(values[k]) < trial);
            others -= MASK(AS_UINTN(values[k + 1]) < trial);
            below -= MASK(AS_UINTN(values[k + 2]) < trial);
            others -= MASK(AS_UINTN(values[k + 3]) < trial);
        }
        low = AS_UINTN(choose(MASK(below + others <= rank), AS_REALN(trial), AS_REALN(low)));
    }
    return AS_REALN(low);
}

// Solves a x = y, a symmetric and positive, lower triangle [i][j <= i] by rows; both are lost. By L D Lᵀ: a root or a
// division takes as long as a dozen products.
#define AT(i, j) ((i) * ((i) + 1) / 2 + (j))
#define SOLVE(name, N)                                                                                  \
    inline void name(REALN* a, REALN* y) {                                                              \
        REALN inverse[N];                                                                               \
        for (int i = 0; i < N; ++i) {                                                                   \
            for (int j = 0; j < i; ++j)                                                                 \
                for (int k = 0; k < j; ++k)                                                             \
                    a[AT(i, j)] = fma(-a[AT(i, k)], inverse[k] * a[AT(j, k)], a[AT(i, j)]);             \
            for (int k = 0; k < i; ++k) {                                                               \
                const REALN l = inverse[k] * a[AT(i, k)];                                               \
                a[AT(i, i)] = fma(-l, a[AT(i, k)], a[AT(i, i)]);                                        \
                y[i] = fma(-l, y[k], y[i]);                                                             \
            }                                                                                           \
            inverse[i] = 1.0f / fmax(a[AT(i, i)], (REALN)(LOWEST));                                     \
        }                                                                                               \
        for (int i = N - 1; i >= 0; --i) {                                                              \
            for (int k = i + 1; k < N; ++k) y[i] = fma(-a[AT(k, i)], y[k], y[i]);                       \
            y[i] *= inverse[i];                                                                         \
        }                                                                                               \
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
    const UINTN low = AS_UINTN(with->floor_ * 0.5f) & 0x7f800000u;
    const REALN median = order_statistic(sizes, with->lights, counted >> 1, low, 25, 6);
    // 1.4826 for a normal distribution, and 1/16 for what was cut off on average.
    return fmax(1.4826f * 1.0625f * median, with->floor_);
}

// inverse: 1 / scale
inline REALN weight_of(REALN size, REALN inverse) {
    const REALN u = size * inverse;
#if BTFIELD_RULE == HUBER
    return fmin((REALN)(1.0f), 1.345f * roughly_inverse(fmax(u, (REALN)(LOWEST))));
#else
    const REALN r = roughly_inverse(fma(u, u, (REALN)(1.0f)));
#if BTFIELD_FEW
    return r;
#else
    return r * r;
#endif
#endif
}

// Normal equations of b, and of the ambient where a rule has it: lower triangle by rows, right side.
typedef struct {
    REALN a[10], y[4];
} linear;

inline linear nothing() {
    linear e;
    for (int i = 0; i < 10; ++i) e.a[i] = (REALN)(0.0f);
    for (int i = 0; i < 4; ++i) e.y[i] = (REALN)(0.0f);
    return e;
}

// Adds a light of direction l, value v and weight w.
inline void add_light(linear* e, float4 l, REALN w, REALN v) {
    const REALN x = w * l.x, u = w * l.y, z = w * l.z;
    e->a[0] = fma(x, (REALN)(l.x), e->a[0]);
    e->a[1] = fma(x, (REALN)(l.y), e->a[1]);
    e->a[2] = fma(u, (REALN)(l.y), e->a[2]);
    e->a[3] = fma(x, (REALN)(l.z), e->a[3]);
    e->a[4] = fma(u, (REALN)(l.z), e->a[4]);
    e->a[5] = fma(z, (REALN)(l.z), e->a[5]);
    e->y[0] = fma(x, v, e->y[0]);
    e->y[1] = fma(u, v, e->y[1]);
    e->y[2] = fma(z, v, e->y[2]);
#if BTFIELD_RULE >= AMBIENT
    e->a[6] += x;
    e->a[7] += u;
    e->a[8] += z;
    e->y[3] = fma(w, v, e->y[3]);
#endif
    e->a[9] += w;
}

// Reweighted least squares from b = x[0 … 2] on: I = max(0, b·l), and the ambient x[3] >= 0 with it where the rule has it.
// values: below 0 where saturated; sizes: room.
inline void reweight(const REALN* values, REALN* sizes, const given* with, fit* of, int steps) {
    const REALN gate = with->gate;
    const int lights = with->lights;
    __global const float4* direction = with->direction;
    for (int t = 0; t < steps; ++t) {
        const fit here = *of;
        INTN counted = (INTN)(0);
        for (int k = 0; k < lights; ++k) {
            const REALN s = shading(here.x, direction[k]);
            const INTN counts = MASK(values[k] >= gate);
            counted -= counts;
            sizes[k] = choose(counts, size_of(values[k] - fmax(s, (REALN)(0.0f)) - here.x[3]), (REALN)(FAR_AWAY));
        }
        const REALN inverse = 1.0f / scale_of(sizes, with, counted);
        linear e = nothing();
        for (int k = 0; k < lights; ++k) {
            const float4 l = direction[k];
            const INTN counts = MASK(shading(here.x, l) > 0.0f) & MASK(values[k] >= gate);
            add_light(&e, l, choose(counts, weight_of(sizes[k], inverse), (REALN)(0.0f)), values[k]);
        }
        REALN *a = e.a, *y = e.y;
        const REALN total = a[9];
        const INTN usable = MASK(total > 0.0f);
        for (int i = 0; i < 3; ++i) a[AT(i, i)] = fma((REALN)(1e-6f), total, a[AT(i, i)]);
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

// A fit with what all lights need of it.
typedef struct {
    REALN x[UNKNOWNS], n[3], inverse;  // inverse: 1 / |b|
    float alpha, steep;                // of the lobe: roughness squared, 4 (1 − alpha) / alpha
} surface;

inline surface surface_of(const fit* of, const given* with) {
    surface s;
    for (int i = 0; i < UNKNOWNS; ++i) s.x[i] = of->x[i];
    s.inverse = 1.0f / fmax(sqrt(of->x[0] * of->x[0] + of->x[1] * of->x[1] + of->x[2] * of->x[2]), (REALN)(LOWEST));
    for (int i = 0; i < 3; ++i) s.n[i] = of->x[i] * s.inverse;
    s.alpha = with->roughness * with->roughness;
    s.steep = 4.0f * (1.0f - s.alpha) / s.alpha;
    return s;
}

inline modelled model(const surface* s, float4 l, float4 h) {
    modelled m;
    m.shade = shading(s->x, l);
    m.value = fmax(m.shade, (REALN)(0.0f)) + s->x[3];
#if BTFIELD_RULE == LOBE
    m.cosine = shading(s->n, h);
    // Not below alpha: cosines are at most 1, but for rounding.
    const REALN alpha = (REALN)(s->alpha), q = fma(m.cosine * m.cosine, alpha - 1.0f, (REALN)(1.0f));
    const REALN bounded = q > alpha ? q : alpha;
    REALN root = roughly_inverse(bounded);
    root *= alpha * fma(-bounded, root, (REALN)(2.0f));
    const REALN faded = fmin(fmax(m.shade * (s->inverse * 10.0f), (REALN)(0.0f)), (REALN)(1.0f));
    m.lobe = choose(MASK(m.cosine > 0.0f), root * root * faded, (REALN)(0.0f));
    m.slope = m.cosine * root * m.lobe * (s->steep * s->x[4] * s->inverse);
    m.value = fma(s->x[4], m.lobe, m.value);
#endif
    return m;
}

#if BTFIELD_RULE == LOBE
// Sizes of residuals, and how good they are at a scale: Σ 1 / (1 + u²). steps: 1 / scale
inline REALN residuals(const REALN* values, REALN* sizes, const given* with, const fit* of, REALN steps, INTN* counted) {
    const surface s = surface_of(of, with);
    const REALN gate = with->gate;
    const int lights = with->lights;
    __global const float4 *direction = with->direction, *half_way = with->half_way;
    REALN score = (REALN)(0.0f);
    INTN sum = (INTN)(0);
    for (int k = 0; k < lights; ++k) {
        const INTN counts = MASK(values[k] >= gate);
        const REALN size = size_of(values[k] - model(&s, direction[k], half_way[k]).value);
        const REALN u = size * steps;
        sum -= counts;
        sizes[k] = choose(counts, size, (REALN)(FAR_AWAY));
        score += choose(counts, roughly_inverse(fma(u, u, (REALN)(1.0f))), (REALN)(0.0f));
    }
    *counted = sum;
    return score;
}

// Normal equations of a step, and how good it is where it starts: Σ 1 / (1 + u²).
typedef struct {
    REALN a[15], y[UNKNOWNS], score;
} equations;

// steps: 1 / scale
inline void set_up(equations* e, const REALN* values, const given* with, const fit* of, REALN steps) {
    const surface s = surface_of(of, with);
    const REALN gate = with->gate;
    const int lights = with->lights;
    __global const float4 *direction = with->direction, *half_way = with->half_way;
    // Named one by one so that they stay in registers.
    const REALN zero = (REALN)(0.0f);
    REALN a0 = zero, a1 = zero, a2 = zero, a3 = zero, a4 = zero, a5 = zero, a6 = zero, a7 = zero, a8 = zero, a9 = zero,
          a10 = zero, a11 = zero, a12 = zero, a13 = zero, a14 = zero, y0 = zero, y1 = zero, y2 = zero, y3 = zero, y4 = zero,
          score = zero;
    for (int k = 0; k < lights; ++k) {
        const float4 l = direction[k], h = half_way[k];
        const modelled m = model(&s, l, h);
        const REALN r = values[k] - m.value, u = r * steps;
        const REALN kept = choose(MASK(values[k] >= gate), roughly_inverse(fma(u, u, (REALN)(1.0f))), zero);
        score += kept;
        const REALN w = choose(MASK(m.shade > 0.0f), kept * kept, zero);
        const REALN turn = -m.slope * m.cosine;
        const REALN x = fma(m.slope, (REALN)(h.x), fma(turn, s.n[0], (REALN)(l.x)));
        const REALN v = fma(m.slope, (REALN)(h.y), fma(turn, s.n[1], (REALN)(l.y)));
        const REALN z = fma(m.slope, (REALN)(h.z), fma(turn, s.n[2], (REALN)(l.z)));
        const REALN wx = w * x, wv = w * v, wz = w * z, ws = w * m.lobe;
        a0 = fma(wx, x, a0);
        a1 = fma(wv, x, a1);
        a2 = fma(wv, v, a2);
        a3 = fma(wz, x, a3);
        a4 = fma(wz, v, a4);
        a5 = fma(wz, z, a5);
        a6 += wx;
        a7 += wv;
        a8 += wz;
        a9 += w;
        a10 = fma(ws, x, a10);
        a11 = fma(ws, v, a11);
        a12 = fma(ws, z, a12);
        a13 += ws;
        a14 = fma(ws, m.lobe, a14);
        y0 = fma(wx, r, y0);
        y1 = fma(wv, r, y1);
        y2 = fma(wz, r, y2);
        y3 = fma(w, r, y3);
        y4 = fma(ws, r, y4);
    }
    const REALN ridge = fma((REALN)(1e-7f), a9, (REALN)(LOWEST));
    e->a[0] = a0 + ridge;
    e->a[1] = a1;
    e->a[2] = a2 + ridge;
    e->a[3] = a3;
    e->a[4] = a4;
    e->a[5] = a5 + ridge;
    e->a[6] = a6;
    e->a[7] = a7;
    e->a[8] = a8;
    e->a[9] = a9 + 0.01f * a9 + ridge;
    e->a[10] = a10;
    e->a[11] = a11;
    e->a[12] = a12;
    e->a[13] = a13;
    e->a[14] = a14 + 0.001f * a9 + ridge;
    e->y[0] = y0;
    e->y[1] = y1;
    e->y[2] = y2;
    e->y[3] = y3 - 0.01f * a9 * s.x[3];
    e->y[4] = y4 - 0.001f * a9 * s.x[4];
    e->score = score;
}

// Levenberg-Marquardt at `widened` times the scale of what it reaches, from a scale on.
inline void descend(const REALN* values, REALN* sizes, const given* with, fit* of, REALN scale, float widened, int steps) {
    REALN damping = (REALN)(1e-3f);
    for (int t = 0; t < steps; ++t) {
        const REALN inverse = 1.0f / scale;
        equations e;
        set_up(&e, values, with, of, inverse);
        for (int i = 0; i < UNKNOWNS; ++i) e.a[AT(i, i)] = fma(damping, e.a[AT(i, i)], e.a[AT(i, i)]);
        solve5(e.a, e.y);
        fit next;
        for (int i = 0; i < UNKNOWNS; ++i) next.x[i] = of->x[i] + e.y[i];
        for (int i = 3; i < UNKNOWNS; ++i) next.x[i] = fmax(next.x[i], (REALN)(0.0f));
        INTN counted;
        const INTN better = MASK(residuals(values, sizes, with, &next, inverse, &counted) >= e.score);
        for (int i = 0; i < UNKNOWNS; ++i) of->x[i] = choose(better, next.x[i], of->x[i]);
        if (t + 1 < steps) scale = choose(better, widened * scale_of(sizes, with, counted), scale);
        damping = choose(better, fmax(0.3f * damping, (REALN)(1e-6f)), fmin(8.0f * damping, (REALN)(1e3f)));
    }
}

inline REALN scale_at(const REALN* values, REALN* sizes, const given* with, const fit* of) {
    INTN counted;
    (void)residuals(values, sizes, with, of, (REALN)(1.0f), &counted);
    return scale_of(sizes, with, counted);
}

// Six steps at 1.5 times the scale, six at it.
inline void descend_twice(const REALN* values, REALN* sizes, const given* with, fit* of) {
    for (int stage = 0; stage < 2; ++stage) {
        const float widened = stage == 0 ? 1.5f : 1.0f;
        descend(values, sizes, with, of, widened * scale_at(values, sizes, with, of), widened, 6);
    }
}

// The sum of residuals, each cut at a part of what is bright.
inline REALN misfit(const REALN* values, const given* with, const fit* of) {
    const surface s = surface_of(of, with);
    const REALN gate = with->gate, most = 9.0f * with->floor_;
    REALN sum = (REALN)(0.0f);
    for (int k = 0; k < with->lights; ++k) {
        const REALN size = size_of(values[k] - model(&s, with->direction[k], with->half_way[k]).value);
        sum += choose(MASK(values[k] >= gate), fmin(size, most), (REALN)(0.0f));
    }
    return sum;
}

// From two starts: reweighted with ambient light, and least squares, which is kept unless the other is clearly better, as
// what is thrown out to fit the rest may have been right.
inline void fit_lobe(const REALN* values, REALN* sizes, const given* with, fit* of) {
    fit other = *of;
    descend_twice(values, sizes, with, of);
    reweight(values, sizes, with, &other, 8);
    descend_twice(values, sizes, with, &other);
    const INTN better = MASK(1.1f * misfit(values, with, &other) < misfit(values, with, of));
    for (int i = 0; i < UNKNOWNS; ++i) of->x[i] = choose(better, other.x[i], of->x[i]);
}

// From the fit of a neighbour, made as bright as this pixel is.
inline void follow(const REALN* values, REALN* sizes, const given* with, fit* of) {
    const surface s = surface_of(of, with);
    const REALN gate = with->gate;
    REALN product = (REALN)(0.0f), square = (REALN)(0.0f);
    for (int k = 0; k < with->lights; ++k) {
        const REALN value = model(&s, with->direction[k], with->half_way[k]).value;
        const REALN w = choose(MASK(values[k] >= gate), value, (REALN)(0.0f));
        product = fma(w, values[k], product);
        square = fma(w, value, square);
        sizes[k] = value;
    }
    const REALN ratio = product / fmax(square, (REALN)(LOWEST));
    for (int i = 0; i < UNKNOWNS; ++i) of->x[i] *= ratio;
    INTN counted = (INTN)(0);
    for (int k = 0; k < with->lights; ++k) {
        const INTN counts = MASK(values[k] >= gate);
        counted -= counts;
        sizes[k] = choose(counts, size_of(fma(-ratio, sizes[k], values[k])), (REALN)(FAR_AWAY));
    }
    descend(values, sizes, with, of, scale_of(sizes, with, counted), 1.0f, 7);
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
// Work-item (vector of columns, row). Rows lie in groups of `period`, of which the second leads: where BTFIELD_FOLLOW is 0,
// leading rows are fitted, else the others, which begin where the leading row of their group ended.
//   stack: [light][plane][row][column]; a plane has `pitch` values, some behind its last pixel
//   gains: [light][plane], what stored values are multiplied by; table: light of whole numbers before that
//   direction, half_way: unit vectors to the light, and half way to the viewer at (0, 0, 1)
//   inverse: row k of the pseudo-inverse of all directions: b = Σ_k inverse[k] I_k
//   low, high: ranks that count, as parts of the largest
//   fits: [b_x, b_y, b_z, ambient, strength][pixel]; albedo: [plane][pixel]; residual: [pixel], Σ|I − model| / Σ I
//   counts: [dark, saturated][pixel], values of all planes
__kernel void fit_pixels(__global const STORED* stack, __global const float* gains, __global const float* table,
                         __global const float4* direction, __global const float4* half_way, __global const float4* inverse,
                         int lights, int planes, int height, int width, int pitch, int period, float low, float high,
                         float roughness, __global float* fits, __global float* albedo, __global float* residual,
                         __global float* counts) {
    const int column = (int)get_global_id(0) * VW, id = (int)get_global_id(1), pixels = height * width;
    if (column >= width) return;
#if BTFIELD_FOLLOW
    const int group = id / (period - 1) * period, place = id % (period - 1);
    const int row = group + place + (place > 0 ? 1 : 0), leader = min(group + 1, height - 1);
    if (row >= height || row == leader) return;
#else
    const int row = period > 1 ? min(id * period + 1, height - 1) : id;
#endif
    const int first = row * width + column, count = min(VW, width - column);
    const float share = 1.0f / (float)planes;
    REALN values[BTFIELD_LIGHTS], sizes[BTFIELD_LIGHTS];
    REALN most = (REALN)(0.0f), brightest = (REALN)(0.0f);
    fit of;
    for (int i = 0; i < UNKNOWNS; ++i) of.x[i] = (REALN)(0.0f);
    for (int k = 0; k < lights; ++k) {
        REALN sum = (REALN)(0.0f);
        INTN saturated = (INTN)(0);
        for (int p = 0; p < planes; ++p) {
            const int plane = k * planes + p;
            const REALN value = light_of(stack + (size_t)plane * pitch + first, gains[plane], table);
            saturated |= MASK(value < 0.0f);
            sum += size_of(value);
            most = fmax(most, size_of(value));
        }
        const REALN grey = sum * share;
        values[k] = choose(saturated, -grey, grey);
        sizes[k] = grey;
        brightest = fmax(brightest, grey);
        const float4 row = inverse[k];
        of.x[0] = fma(grey, (REALN)(row.x), of.x[0]);
        of.x[1] = fma(grey, (REALN)(row.y), of.x[1]);
        of.x[2] = fma(grey, (REALN)(row.z), of.x[2]);
    }
    pad(sizes, lights);
    given with;
    with.lights = lights;
    with.direction = direction;
    with.half_way = half_way;
    with.roughness = roughness;
    with.gate = with.floor_ = (REALN)(0.0f);
    REALN lowest = (REALN)(0.0f), highest = (REALN)(FAR_AWAY), scale = (REALN)(1.0f);
#if BTFIELD_RULE == RANKS
    lowest = order_statistic(sizes, lights, (INTN)((int)ceil(low * (lights - 1))), (UINTN)(0), 30, 31);
    highest = order_statistic(sizes, lights, (INTN)((int)floor(high * (lights - 1))), (UINTN)(0), 30, 31);
    linear e = nothing();
    for (int k = 0; k < lights; ++k)
        add_light(&e, direction[k], final_weight(values[k], sizes[k], scale, &with, lowest, highest), sizes[k]);
    for (int i = 0; i < 3; ++i) e.a[AT(i, i)] += 1e-6f * e.a[9];
    solve3(e.a, e.y);
    for (int i = 0; i < 3; ++i) of.x[i] = e.y[i];
#elif BTFIELD_RULE >= HUBER
    // Both are looked for in 16 octaves below the brightest; what is darker counts as dark.
    const int last = lights - 1;
    const INTN octave = (AS_INTN(brightest) & 0x7f800000) - (15 << 23);
    const REALN darkest = choose(MASK(octave > 0), AS_REALN(octave), (REALN)(0.0f));
    REALN bright = order_statistic(sizes, lights, (INTN)((8 * last) / 10), AS_UINTN(darkest), 26, 8);
    with.gate = choose(MASK(bright > darkest), 0.15f * bright, (REALN)(0.0f));
    bright = order_statistic(sizes, lights, (INTN)((9 * last) / 10), AS_UINTN(darkest), 26, 8);
    bright = choose(MASK(bright > darkest), bright, (REALN)(0.0f));
    // Where most lights leave the pixel dark, squares of residuals over the floor stay finite.
    with.floor_ = fmax(fmax(0.01f * bright, 1e-7f * brightest), (REALN)(LOWEST));
#if BTFIELD_RULE == LOBE
#if BTFIELD_FOLLOW
    for (int i = 0; i < UNKNOWNS; ++i) of.x[i] = load_up_to(fits + (size_t)i * pixels + leader * width + column, count);
    follow(values, sizes, &with, &of);
#else
    fit_lobe(values, sizes, &with, &of);
#endif
#else
    reweight(values, sizes, &with, &of, 12);
#endif
#endif
    const surface s = surface_of(&of, &with);
    REALN sum = (REALN)(0.0f), all = (REALN)(0.0f);
    INTN counted = (INTN)(0);
    for (int k = 0; k < lights; ++k) {
        const REALN size = size_of(size_of(values[k]) - model(&s, direction[k], half_way[k]).value);
        const INTN taken = MASK(values[k] >= with.gate);
        const INTN sound = MASK(values[k] >= 0.0f);
        sum += choose(sound, size, (REALN)(0.0f));
        all += choose(sound, values[k], (REALN)(0.0f));
        counted -= taken;
        sizes[k] = choose(taken, size, (REALN)(FAR_AWAY));
    }
#if BTFIELD_RULE >= HUBER
    scale = scale_of(sizes, &with, counted);
#endif
    store_up_to(sum / fmax(all, (REALN)(LOWEST)), residual + first, count);
    for (int i = 0; i < UNKNOWNS; ++i) store_up_to(of.x[i], fits + (size_t)i * pixels + first, count);
    INTN dark = (INTN)(0), saturated = (INTN)(0);
    most *= DARK;
    for (int p = 0; p < planes; ++p) {
        REALN product = (REALN)(0.0f), square = (REALN)(0.0f);
        for (int k = 0; k < lights; ++k) {
            const int plane = k * planes + p;
            REALN value = values[k];
            if (planes > 1) value = light_of(stack + (size_t)plane * pitch + first, gains[plane], table);
            dark -= MASK(size_of(value) < most);
            saturated -= MASK(value < 0.0f);
            const REALN shade = fmax(shading(s.n, direction[k]), (REALN)(0.0f));
            const REALN w = final_weight(values[k], sizes[k], scale, &with, lowest, highest) * shade;
            product = fma(w, size_of(value), product);
            square = fma(w, shade, square);
        }
        store_up_to(product / fmax(square, (REALN)(LOWEST)), albedo + (size_t)p * pixels + first, count);
    }
    store_up_to(TO_REALN(dark), counts + first, count);
    store_up_to(TO_REALN(saturated), counts + pixels + first, count);
}
#endif

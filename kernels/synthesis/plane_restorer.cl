// From Gaussian eigenplanes to the planes of a picture: m = q(M x) (theory 13), then y = Tᵀ m + μ (theory 3), in one
// pass. Without marginals m = x.
//
// q_j is piecewise linear over equal steps of the normal axis, constant beyond the ends; u is the place among the knots.

#include "base/lanes.clh"

#ifndef BTFIELD_PLANES
#error "BTFIELD_PLANES (number of planes d) is not defined"
#endif
#ifndef BTFIELD_RANK
#error "BTFIELD_RANK (number of eigenplanes r <= d) is not defined"
#endif
// 0: the eigenplanes are taken as they are.
#ifndef BTFIELD_KNOTS
#error "BTFIELD_KNOTS (knots of a marginal, or 0) is not defined"
#endif

#define D BTFIELD_PLANES
#define RANK BTFIELD_RANK
#define KNOTS BTFIELD_KNOTS

#if D <= 4
#define UNROLL _Pragma("unroll")
#else
#define UNROLL _Pragma("nounroll")
#endif

#if KNOTS
// q(x); table: q_k and q_{k+1} − q_k by turns. A NaN stays one.
inline REALN mapped(REALN x, __global const float* table, float scale) {
    const REALN u = fma(x, (REALN)(scale), (REALN)(0.5f * (KNOTS - 1)));
#if VW == 16
    // Sixteen look-ups cost more than all steps in full (measured, AVX-512): the part of each step that lies below u.
    REALN sum = table[0];
    _Pragma("unroll")
    for (int k = 0; k + 1 < KNOTS; ++k) {
        REALN part = u - (float)k;
        part = part < 0.0f ? (REALN)(0.0f) : part;
        part = part > 1.0f ? (REALN)(1.0f) : part;
        sum = fma((REALN)(table[2 * k + 1]), part, sum);
    }
    return sum;
#else
    const REALN low = 0.0f, high = (float)(KNOTS - 1);
    const REALN inside = choose(MASK(u < low), low, choose(MASK(u > high), high, u));
#if VW == 1
    const int k = clamp((int)inside, 0, KNOTS - 2);
    return fma(inside - (float)k, table[2 * k + 1], table[2 * k]);
#else
    const INTN k = clamp(TO_INTN(inside), (INTN)(0), (INTN)(KNOTS - 2));
    int index[VW];
    float value[VW], step[VW];
    STOREN_INT(k, index);
    for (int l = 0; l < VW; ++l) {
        value[l] = table[2 * index[l]];
        step[l] = table[2 * index[l] + 1];
    }
    return fma(inside - TO_REALN(k), LOADN(step), LOADN(value));
#endif
#endif
}
#endif

#ifdef BTFIELD_KERNEL_restore_planes
// in [first + texture][eigenplane][pixel] → out [texture][plane][pixel]; may be the same memory where r = d and first = 0.
//   tables: [eigenplane][knot][2] as above; scale: knots per unit of the normal axis
//   basis: T, [eigenplane][plane], then μ, then M
// Work-item (vector of pixels, texture).
__kernel void restore_planes(__global const float* in, __global float* out, __global const float* tables, float scale,
                             __global const float* basis, int pixels, int first) {
    const int at = (int)get_global_id(0) * VW;
    const size_t texture = get_global_id(1);
    if (at >= pixels) return;
    const int count = min(VW, pixels - at);
    __global const float* source = in + (first + texture) * RANK * (size_t)pixels + at;
    __global float* target = out + texture * D * (size_t)pixels + at;
    REALN m[RANK];
#if KNOTS
    REALN x[RANK];
    UNROLL
    for (int j = 0; j < RANK; ++j) x[j] = load_up_to(source + (size_t)j * pixels, count);
    __global const float* whitening = basis + RANK * D + D;
    UNROLL
    for (int i = 0; i < RANK; ++i) {
        REALN sum = 0.0f;
        UNROLL
        for (int j = 0; j < RANK; ++j) sum = fma((REALN)(whitening[i * RANK + j]), x[j], sum);
        m[i] = mapped(sum, tables + 2 * KNOTS * i, scale);
    }
#else
    UNROLL
    for (int j = 0; j < RANK; ++j) m[j] = load_up_to(source + (size_t)j * pixels, count);
#endif
    UNROLL
    for (int i = 0; i < D; ++i) {
        REALN y = basis[RANK * D + i];
        UNROLL
        for (int j = 0; j < RANK; ++j) y = fma((REALN)(basis[j * D + i]), m[j], y);
        store_up_to(y, target + (size_t)i * pixels, count);
    }
}
#endif

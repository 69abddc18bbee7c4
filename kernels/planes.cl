// From Gaussian eigenplanes to the planes of a picture: m_j = q_j(x_j) (MODELS section 11, "Marginals"), then y = Tᵀ m + μ
// (MODELS section 3), in one pass.
//
// q_j is piecewise linear over equal steps of the normal axis, constant beyond the ends; u is the place among the knots.

#include "lanes.clh"

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
#ifdef HINGES
inline REALN mapped(REALN x, __global const float* table, float scale) {
    const REALN u = fma(x, (REALN)(scale), (REALN)(0.5f * (KNOTS - 1)));
    REALN sum = table[0];
    _Pragma("unroll")
    for (int k = 0; k + 1 < KNOTS; ++k)
        sum = fma((REALN)(table[2 * k + 1]), fmin(fmax(u - (float)k, (REALN)(0.0f)), (REALN)(1.0f)), sum);
    return sum;
}
#else
// table: q_k and q_{k+1} − q_k by turns. A NaN stays one.
inline REALN mapped(REALN x, __global const float* table, float scale) {
    REALN u = fma(x, (REALN)(scale), (REALN)(0.5f * (KNOTS - 1)));
    u = choose(MASK(u < 0.0f), (REALN)(0.0f), u);
    u = choose(MASK(u > (float)(KNOTS - 1)), (REALN)((float)(KNOTS - 1)), u);
#if VW == 1
    const int k = clamp((int)u, 0, KNOTS - 2);
    return fma(u - (float)k, table[2 * k + 1], table[2 * k]);
#else
    const INTN k = clamp(TO_INTN(u), 0, KNOTS - 2);
    int index[VW];
    float low[VW], step[VW];
    STOREN_INT(k, index);
    for (int l = 0; l < VW; ++l) {
        low[l] = table[2 * index[l]];
        step[l] = table[2 * index[l] + 1];
    }
    return fma(u - TO_REALN(k), LOADN(step), LOADN(low));
#endif
}
#endif
#endif

#ifdef BTFIELD_KERNEL_restore_planes
// in [texture][eigenplane][pixel] → out [texture][plane][pixel]; the same memory where r = d.
//   tables: [eigenplane][knot][2] as above; scale: knots per unit of the normal axis
//   basis: T, [eigenplane][plane], then μ
// Work-item (vector of pixels, texture).
__kernel void restore_planes(__global const float* in, __global float* out, __global const float* tables, float scale,
                             __global const float* basis, int pixels) {
    const int at = (int)get_global_id(0) * VW;
    const size_t texture = get_global_id(1);
    if (at >= pixels) return;
    const int count = min(VW, pixels - at);
    __global const float* source = in + texture * RANK * (size_t)pixels + at;
    __global float* target = out + texture * D * (size_t)pixels + at;
    REALN m[RANK];
    UNROLL
    for (int j = 0; j < RANK; ++j) {
        REALN x = load_up_to(source + (size_t)j * pixels, count);
#if KNOTS
        x = mapped(x, tables + 2 * KNOTS * j, scale);
#endif
        m[j] = x;
    }
    UNROLL
    for (int i = 0; i < D; ++i) {
        REALN y = basis[RANK * D + i];
        UNROLL
        for (int j = 0; j < RANK; ++j) y = fma((REALN)(basis[j * D + i]), m[j], y);
        store_up_to(y, target + (size_t)i * pixels, count);
    }
}
#endif

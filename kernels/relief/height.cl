// Height from slopes by least squares in frequency (theory 19.2): Gᵀ(p, q), whose transform is divided by that of GᵀG.
// G halves the difference of the neighbours on both sides. Where edges mirror, rows and columns change places first, even
// ones ascending and then odd ones descending: on that cycle of N, whose neighbours are 2 pixels apart in the picture or
// reflected, GᵀG is circulant.

#include "base/lanes.clh"

#ifndef BTFIELD_MIRROR
#error "BTFIELD_MIRROR (0: the surface is a torus, 1: it is mirrored at its edges) is not defined"
#endif

inline int place(int i, int n) {
#if BTFIELD_MIRROR
    return (i & 1) ? n - 1 - i / 2 : i / 2;
#else
    return i;
#endif
}

// A slope beyond the edge has the index of this one …
inline int around(int i, int n) {
#if BTFIELD_MIRROR
    return i < 0 ? 0 : (i >= n ? n - 1 : i);
#else
    return i < 0 ? i + n : (i >= n ? i - n : i);
#endif
}

// … and this sign: what rises to the right falls when mirrored.
inline float sign_of(int i, int n) {
#if BTFIELD_MIRROR
    return i < 0 || i >= n ? -1.0f : 1.0f;
#else
    return 1.0f;
#endif
}

#ifdef BTFIELD_KERNEL_adjoint_slopes
// Gᵀ(p, q) + weight·coarse, placed. slopes: [2][row][column]; coarse: [row][column], not read where weight is 0.
// Work-item (vector of columns, row).
__kernel void adjoint_slopes(__global const float* slopes, __global const float* coarse, float weight,
                             __global float* result, int height, int width) {
    const int column = (int)get_global_id(0) * VW, row = (int)get_global_id(1);
    if (column >= width) return;
    const int count = min(VW, width - column);
    __global const float* p = slopes + (size_t)row * width;
    __global const float* q = slopes + (size_t)height * width + column;
    REALN left, right;
    if (column > 0 && column + VW < width) {
        left = LOADN(p + column - 1);
        right = LOADN(p + column + 1);
    } else {
        float before[VW], after[VW];
        for (int l = 0; l < VW; ++l) {
            const int x = min(column + l, width - 1);
            before[l] = sign_of(x - 1, width) * p[around(x - 1, width)];
            after[l] = sign_of(x + 1, width) * p[around(x + 1, width)];
        }
        left = LOADN(before);
        right = LOADN(after);
    }
    const REALN above = sign_of(row - 1, height) * load_up_to(q + (size_t)around(row - 1, height) * width, count);
    const REALN below = sign_of(row + 1, height) * load_up_to(q + (size_t)around(row + 1, height) * width, count);
    REALN value = -0.5f * ((right - left) + (below - above));
    if (weight > 0.0f) value += weight * load_up_to(coarse + (size_t)row * width + column, count);
    __global float* to = result + (size_t)place(row, height) * width;
#if BTFIELD_MIRROR
    float lanes[VW];
    STOREN(value, lanes);
    for (int l = 0; l < count; ++l) to[place(column + l, width)] = lanes[l];
#else
    store_up_to(value, to + column, count);
#endif
}
#endif

#ifdef BTFIELD_KERNEL_divide_spectrum
// Y_t ← Y_t w / (λ + weight), λ = across[kx] + down[ky] the transform of GᵀG, 0 where that is 0; w = λ²/(λ² + low²) takes
// out long waves. Spectra as host/cl/fft.hpp has them, scaled by 1 / N. down: padded to the pitch.
// Work-item (vector of ky, kx).
__kernel void divide_spectrum(__global float* re, __global float* im, __global const float* across,
                              __global const float* down, float weight, float low, float scale, int pitch) {
    const int ky = (int)get_global_id(0) * VW;
    if (ky >= pitch) return;
    const size_t at = get_global_id(1) * (size_t)pitch + ky;
    const REALN lambda = across[get_global_id(1)] + LOADN(down + ky);
    const REALN divisor = lambda + weight;
    const INTN there = MASK(divisor > 0.0f);
    const REALN squared = lambda * lambda;
    const REALN kept = low > 0.0f ? squared / (squared + low * low) : (REALN)(1.0f);
    const REALN factor = scale * kept / choose(there, divisor, (REALN)(1.0f));
    const REALN zero = (REALN)(0.0f);
    STOREN(choose(there, factor * LOADN(re + at), zero), re + at);
    STOREN(choose(there, factor * LOADN(im + at), zero), im + at);
}
#endif

#ifdef BTFIELD_KERNEL_take_back
// What was placed, in the picture's order. Work-item (vector of columns, row).
__kernel void take_back(__global const float* placed, __global float* result, int height, int width) {
    const int column = (int)get_global_id(0) * VW, row = (int)get_global_id(1);
    if (column >= width) return;
    __global const float* from = placed + (size_t)place(row, height) * width;
    __global float* to = result + (size_t)row * width;
    for (int l = 0; l < min(VW, width - column); ++l) to[column + l] = from[place(column + l, width)];
}
#endif

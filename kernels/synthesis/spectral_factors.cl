// Synthesis in the frequency domain: Ỹ_t = F_t z_t (theory 14.2, 14.3; P4 eq. 33).
//
// A texture has `parts` models of d planes each: one of all planes (3D models), or one per plane with d = 1 (2D models). The
// part is work-item dimension 2. BTFIELD_FACTOR says what F_t is:
//   0 autoregressive   scale · Λ_t⁻¹ Σ^{1/2}
//   1 MMRF, 2 PMRF     as hermitian_factor.clh says
//   3 moving average   scale · Λ_t Σ^{1/2}, Λ_t the transfer function
// Λ_t is evaluated as transfer_matrix.clh says. Spectra lie as host/cl/fft.hpp says; lanes run over ky. Factors, re and im:
// [part][kx][vector of ky][i][j][lane], one after the other as they are read.

#include "base/lanes.clh"

#ifndef BTFIELD_PLANES
#error "BTFIELD_PLANES (number of planes d of a part) is not defined"
#endif

// Planes whose noise is drawn together.
#if BTFIELD_PLANES <= 4
#define TOGETHER BTFIELD_PLANES
#else
#define TOGETHER 1
#endif
#define BTFIELD_PAIRS (2 * TOGETHER)
#include "base/philox.clh"

#ifndef BTFIELD_FACTOR
#error "BTFIELD_FACTOR (0 to 3, what F is) is not defined"
#endif
// 0: factors are computed where they are used; 1: they are read from memory.
#ifndef BTFIELD_STORED_FACTORS
#error "BTFIELD_STORED_FACTORS (0 or 1) is not defined"
#endif

#define D BTFIELD_PLANES

// d up to 4 unrolls wholly; beyond, loops stay loops and the arrays live in memory.
#if D <= 4
#define UNROLL _Pragma("unroll")
#else
#define UNROLL _Pragma("nounroll")
#endif

#if !BTFIELD_STORED_FACTORS
// Includes are put in place once: what both branches need comes before them.
#include "base/float_pairs.clh"
#include "base/transfer_matrix.clh"
#if BTFIELD_FACTOR == 1 || BTFIELD_FACTOR == 2
#include "base/hermitian_factor.clh"
#elif BTFIELD_FACTOR == 0
#include "base/general_solve.clh"
#endif
#define COEFFICIENTS_OF(part) (coefficients + (size_t)(part) * (count + 2) * D * D)

// F_t at (kx, ky…).
INLINED void factor(FACTOR_ARGUMENTS, int kx, int ky, int width, int pitch, REALN* fr, REALN* fi) {
#if BTFIELD_FACTOR == 1 || BTFIELD_FACTOR == 2
    hermitian_factor(coefficients, offsets, rows, columns, count, kx, ky, width, pitch, fr, fi);
#else
    REALN lr[D * D], li[D * D];
    transfer_matrix(coefficients, offsets, rows, columns, count, kx, ky, width, pitch, lr, li);
    __global const float* noise = coefficients + (size_t)(count + 1) * D * D;
#if BTFIELD_FACTOR == 0
    general_solve(lr, li, noise, fr, fi);
#else
    UNROLL
    for (int i = 0; i < D; ++i) {
        UNROLL
        for (int k = 0; k < D; ++k) {
            REALN re = 0.0f, im = 0.0f;
            UNROLL
            for (int j = 0; j < D; ++j) {
                re = fma(lr[i * D + j], (REALN)(noise[j * D + k]), re);
                im = fma(li[i * D + j], (REALN)(noise[j * D + k]), im);
            }
            fr[i * D + k] = re;
            fi[i * D + k] = im;
        }
    }
#endif
#endif
}
#endif

// Where the factors of a vector of ky begin.
inline size_t factor_place(int part, int kx, int ky, int width, int pitch) {
    return (((size_t)part * width + kx) * pitch + ky) * (D * D);
}

#if BTFIELD_STORED_FACTORS
#define FACTOR_SOURCE __global const float *factor_re, __global const float *factor_im

INLINED void fetch_factor(FACTOR_SOURCE, int part, int kx, int ky, int width, int pitch, REALN* fr,
                         REALN* fi) {
    const size_t first = factor_place(part, kx, ky, width, pitch);
    UNROLL
    for (int e = 0; e < D * D; ++e) {
        fr[e] = LOADN(factor_re + first + e * VW);
        fi[e] = LOADN(factor_im + first + e * VW);
    }
}

#define FETCH_FACTOR(part, kx, ky, fr, fi) \
    fetch_factor(factor_re, factor_im, part, kx, ky, width, pitch, fr, fi)
#else
#define FACTOR_SOURCE FACTOR_ARGUMENTS
#define FETCH_FACTOR(part, kx, ky, fr, fi) \
    factor(COEFFICIENTS_OF(part), offsets, rows, columns, count, kx, ky, width, pitch, fr, fi)
#endif

#ifdef BTFIELD_KERNEL_spectral_factors
// Factors of every frequency of the half spectrum. Work-item (vector of ky, kx, part).
__kernel void spectral_factors(FACTOR_ARGUMENTS, __global float* factor_re, __global float* factor_im,
                               int width, int pitch) {
    const int ky = (int)get_global_id(0) * VW;
    const int kx = (int)get_global_id(1);
    const int part = (int)get_global_id(2);
    if (ky >= pitch) return;
    REALN fr[D * D], fi[D * D];
    factor(COEFFICIENTS_OF(part), offsets, rows, columns, count, kx, ky, width, pitch, fr, fi);
    const size_t first = factor_place(part, kx, ky, width, pitch);
    UNROLL
    for (int e = 0; e < D * D; ++e) {
        STOREN(fr[e], factor_re + first + e * VW);
        STOREN(fi[e], factor_im + first + e * VW);
    }
}
#endif

// y = F z; the mean of plane i is added at frequency 0, where one unit is one unit of every pixel.
INLINED void apply_and_store(const REALN* fr, const REALN* fi, const REALN* zr, const REALN* zi,
                            __global const float* mean, __global float* re, __global float* im, size_t base,
                            size_t plane_size, int zero_frequency) {
    UNROLL
    for (int i = 0; i < D; ++i) {
        REALN yr = 0.0f, yi = 0.0f;
        UNROLL
        for (int j = 0; j < D; ++j) {
            const REALN a = fr[i * D + j], b = fi[i * D + j];
            yr = fma(a, zr[j], fma(-b, zi[j], yr));
            yi = fma(a, zi[j], fma(b, zr[j], yi));
        }
        if (zero_frequency) yr = choose(MASK(LANE_INDEX == 0u), yr + mean[i], yr);
        STOREN_GLOBAL(yr, re + base + (size_t)i * plane_size);
        STOREN_GLOBAL(yi, im + base + (size_t)i * plane_size);
    }
}

#ifdef BTFIELD_KERNEL_synthesise_spectrum
INLINED philox_words spectral_words(UINTN block, int kx, UINTN plane, uint level, uint2 seed) {
    philox_words counter;
    counter.x = block;
    counter.y = (UINTN)((uint)kx);
    counter.z = plane;
    counter.w = (UINTN)(noise_level(level, BTFIELD_DOMAIN_SPECTRAL));
    return philox4x32_10(counter, seed.x, seed.y);
}

// Both pairs of the blocks of row kx, of the D planes of a part.
INLINED void draw_planes(UINTN block, int kx, int part, uint level, uint2 seed, REALN (*zr)[D], REALN (*zi)[D]) {
    UNROLL
    for (int j = 0; j < D; j += TOGETHER) {
        UINTN radius_words[PAIRS], angle_words[PAIRS];
        REALN first[PAIRS], second[PAIRS];
        UNROLLED
        for (int k = 0; k < TOGETHER; ++k) {
            const philox_words words = spectral_words(block, kx, (UINTN)((uint)(part * D + j + k)), level, seed);
            radius_words[k] = words.x, angle_words[k] = words.y;
            radius_words[TOGETHER + k] = words.z, angle_words[TOGETHER + k] = words.w;
        }
        box_muller(radius_words, angle_words, first, second);
        UNROLLED
        for (int k = 0; k < TOGETHER; ++k) {
            zr[0][j + k] = first[k], zi[0][j + k] = second[k];
            zr[1][j + k] = first[TOGETHER + k], zi[1][j + k] = second[TOGETHER + k];
        }
    }
}

// Pair `pair` of one block of row kx, of all planes of a part, which are the lanes.
INLINED void draw_bin(int block, int pair, int kx, int part, uint level, uint2 seed, float* re, float* im) {
    for (int j = 0; j < D; j += VW) {
        const UINTN plane = (UINTN)((uint)(part * D + j)) + LANE_INDEX;
        const philox_words words = spectral_words((UINTN)((uint)block), kx, plane, level, seed);
        UINTN radius_words[PAIRS], angle_words[PAIRS];
        REALN first[PAIRS], second[PAIRS];
        UNROLLED
        for (int i = 0; i < PAIRS; ++i) {
            radius_words[i] = pair ? words.z : words.x;
            angle_words[i] = pair ? words.w : words.y;
        }
        box_muller(radius_words, angle_words, first, second);
        STOREN(first[0], re + j);
        STOREN(second[0], im + j);
    }
}

// Hermitian white noise, drawn in frequency, times the factors: the spectra of `batch` textures, seeds from first_seed on.
// Bin ky of a row kx is pair ky/16 % 2 of block 16·(ky/32) + ky%16; on ky = 0 and H/2 the upper half of kx mirrors the lower
// and self-conjugate bins are real. Spectra of planes begin `stride` floats apart, imaginary parts im_at floats after im.
// Work-item (vector of blocks, kx, part).
__kernel void synthesise_spectrum(FACTOR_SOURCE, __global const float* mean, __global const uint2* seeds,
                                  __global float* re, __global float* im, int height, int width, int pitch,
                                  int batch, int parts, uint level, ulong stride, ulong im_at,
                                  int first_seed) {
    const int item = (int)get_global_id(0);
    const int kx = (int)get_global_id(1);
    const int part = (int)get_global_id(2);
    const int block = item * VW;
    const int ky0 = (block / 16) * 32 + block % 16;
    const int last = height / 2;
    if (ky0 > last) return;
    const int pairs = ky0 + 16 <= last ? 2 : 1;
    const int mirror = kx == 0 ? 0 : width - kx;

    // The first and the last bin of a row are drawn apart, all planes at once, where they mirror another bin, and where the
    // last one stands alone in its vector.
    const int alone = ky0 == last;
    int apart[2], lane[2], pair[2], mirrors[2];
    UNROLLED
    for (int end = 0; end < 2; ++end) {
        const int ky = end == 0 ? 0 : last;
        lane[end] = ky / 32 * 16 + ky % 16 - block;
        pair[end] = ky / 16 % 2;
        mirrors[end] = kx >= mirror && (end == 0 || height % 2 == 0);
        const int here = lane[end] >= 0 && lane[end] < VW && (end == 0 || last > 0);
        apart[end] = here && (mirrors[end] || alone);
    }
#if !BTFIELD_STORED_FACTORS
    REALN fr[2][D * D], fi[2][D * D];
    for (int h = 0; h < pairs; ++h) FETCH_FACTOR(part, kx, ky0 + 16 * h, fr[h], fi[h]);
#endif
    for (int b = 0; b < batch; ++b) {
        const uint2 seed = seeds[first_seed + b];
        REALN zr[2][D], zi[2][D];
        if (alone) {
            UNROLL
            for (int j = 0; j < D; ++j) zr[0][j] = zi[0][j] = zr[1][j] = zi[1][j] = 0.0f;
        } else {
            draw_planes((UINTN)((uint)block) + LANE_INDEX, kx, part, level, seed, zr, zi);
        }
        for (int end = 0; end < 2; ++end) {
            if (!apart[end]) continue;
            float bin_re[D + VW - 1], bin_im[D + VW - 1];
            draw_bin(block + lane[end], pair[end], mirrors[end] ? mirror : kx, part, level, seed, bin_re, bin_im);
            const int real = mirrors[end] && kx == mirror;
            const float scale = real ? 1.41421356237f : 1.0f, sign = mirrors[end] ? -1.0f : 1.0f;
            UNROLLED
            for (int h = 0; h < 2; ++h) {
                if (h != pair[end]) continue;
                const INTN here = MASK(LANE_INDEX == (uint)lane[end]);
                UNROLL
                for (int j = 0; j < D; ++j) {
                    zr[h][j] = choose(here, bin_re[j] * scale, zr[h][j]);
                    zi[h][j] = choose(here, real ? 0.0f : bin_im[j] * sign, zi[h][j]);
                }
            }
        }
        UNROLLED
        for (int h = 0; h < 2; ++h) {
            if (h == pairs) break;
            const int ky = ky0 + 16 * h;
#if BTFIELD_STORED_FACTORS
            REALN fr[2][D * D], fi[2][D * D];
            FETCH_FACTOR(part, kx, ky, fr[h], fi[h]);
#endif
            const size_t base = (size_t)(b * parts + part) * D * stride + (size_t)kx * pitch + ky;
            apply_and_store(fr[h], fi[h], zr[h], zi[h], mean + part * D, re, im + im_at, base, stride,
                            kx == 0 && ky == 0);
        }
    }
}
#endif

#ifdef BTFIELD_KERNEL_filter_spectrum
// The same for noise that was drawn on the lattice and transformed: in place. Work-item (vector of ky, kx, part).
__kernel void filter_spectrum(FACTOR_SOURCE, __global const float* mean, __global float* re,
                              __global float* im, int height, int width, int pitch, int batch, int parts) {
    const int ky = (int)get_global_id(0) * VW;
    const int kx = (int)get_global_id(1);
    const int part = (int)get_global_id(2);
    if (ky > height / 2) return;
    const size_t plane_size = (size_t)width * pitch;
    REALN fr[D * D], fi[D * D];
    FETCH_FACTOR(part, kx, ky, fr, fi);
    for (int b = 0; b < batch; ++b) {
        const size_t base = (size_t)(b * parts + part) * D * plane_size + (size_t)kx * pitch + ky;
        REALN zr[D], zi[D];
        for (int j = 0; j < D; ++j) {
            zr[j] = LOADN(re + base + (size_t)j * plane_size);
            zi[j] = LOADN(im + base + (size_t)j * plane_size);
        }
        apply_and_store(fr, fi, zr, zi, mean + part * D, re, im, base, plane_size, kx == 0 && ky == 0);
    }
}
#endif

// Real 2D transforms with one transform per vector lane (Stockham, radix 8, 4, 2 and any odd radix up to 13).
//
// Pass 1 runs along x or kx with lanes over ky, pass 2 along rows or ky with lanes over x. Two real columns share one
// complex transform, so odd heights need nothing special. Layouts: see host/cl/fft.hpp; between the passes
// [plane][x / BLOCK][ky][x % BLOCK], where both find what they need close together.

#include "cl/transform.clh"

#define BLOCK 32  // columns, two vectors or more; pitch_of() of the host rounds up to it

// Where (ky, x) of a plane lies between the passes, `rows` of ky and `pitch_x` floats of x to a plane.
INLINED size_t mid_at(size_t plane, int rows, int pitch_x, int ky, int x) {
    return plane * rows * pitch_x + ((size_t)(x / BLOCK) * rows + ky) * BLOCK + x % BLOCK;
}

// Lanes of ky to the layout between the passes, as many as there are.
inline void store_rows(const REALN* re, const REALN* im, __global float* mid_re, __global float* mid_im,
                       size_t plane, int rows, int ky, int length, int pitch_x) {
    int done = 0;
#if VW > 1
    for (; done + VW <= length; done += VW) {
        REALN r[VW], i[VW];
        UNROLL
        for (int l = 0; l < VW; ++l) r[l] = re[done + l], i[l] = im[done + l];
        transpose_lanes(r);
        transpose_lanes(i);
        UNROLL
        for (int l = 0; l < VW; ++l) {
            if (ky + l >= rows) continue;
            const size_t out = mid_at(plane, rows, pitch_x, ky + l, done);
            STOREN(r[l], mid_re + out);
            STOREN(i[l], mid_im + out);
        }
    }
#endif
    const float* sr = (const float*)re;
    const float* si = (const float*)im;
    for (int l = 0; l < VW && ky + l < rows; ++l) {
        for (int k = done; k < length; ++k) {
            const size_t out = mid_at(plane, rows, pitch_x, ky + l, k);
            mid_re[out] = sr[k * VW + l];
            mid_im[out] = si[k * VW + l];
        }
    }
}

// The way back: from ky on, the last one again and again, times `sign` in the imaginary part.
inline void load_rows(__global const float* mid_re, __global const float* mid_im, size_t plane, int rows, int ky, int length,
                      int pitch_x, float sign, REALN* re, REALN* im) {
    int done = 0;
#if VW > 1
    for (; done + VW <= length; done += VW) {
        REALN r[VW], i[VW];
        UNROLL
        for (int l = 0; l < VW; ++l) {
            const size_t in = mid_at(plane, rows, pitch_x, min(ky + l, rows - 1), done);
            r[l] = LOADN(mid_re + in);
            i[l] = LOADN(mid_im + in) * sign;
        }
        transpose_lanes(r);
        transpose_lanes(i);
        UNROLL
        for (int l = 0; l < VW; ++l) re[done + l] = r[l], im[done + l] = i[l];
    }
#endif
    float* xr = (float*)re;
    float* xi = (float*)im;
    for (int l = 0; l < VW; ++l) {
        for (int k = done; k < length; ++k) {
            const size_t in = mid_at(plane, rows, pitch_x, min(ky + l, rows - 1), k);
            xr[k * VW + l] = mid_re[in];
            xi[k * VW + l] = mid_im[in] * sign;
        }
    }
}

#ifdef BTFIELD_KERNEL_fft_columns_inverse
// Inverse pass 1, length W: spectrum (re, im) → (mid_re, mid_im), planes from `first` on. Their spectra begin `stride`
// floats apart, imaginary parts im_at floats after im. Work-item (vector of ky, plane).
__kernel void fft_columns_inverse(__global const float* re, __global const float* im, __global float* mid_re,
                                  __global float* mid_im, __global const float2* tw, int length, int height,
                                  int pitch_ky, int pitch_x, int first, ulong stride, ulong im_at) {
    const int ky = (int)get_global_id(0) * VW;
    const int plane = (int)get_global_id(1);
    const int rows = height / 2 + 1;
    if (ky >= rows) return;
    REALN room[4 * APART];
    REALN *ar = room, *ai = room + APART, *br = room + 2 * APART, *bi = room + 3 * APART;
    const size_t base = (size_t)(first + plane) * stride + ky;
    im += im_at;
    for (int k = 0; k < length; ++k) {
        ar[k] = LOADN(re + base + (size_t)k * pitch_ky);
        ai[k] = LOADN(im + base + (size_t)k * pitch_ky);
    }
    const int swapped = transform(length, length, ar, ai, br, bi, tw);
    store_rows(swapped ? br : ar, swapped ? bi : ai, mid_re, mid_im, plane, rows, ky, length, pitch_x);
}
#endif

#ifdef BTFIELD_KERNEL_fft_rows_inverse
// Inverse pass 2, length H: (mid_re, mid_im) → the first rows_out rows and `columns` columns of images from number `first` on,
// of rows of `width` floats. Work-item (two vectors of x, plane).
__kernel void fft_rows_inverse(__global const float* mid_re, __global const float* mid_im,
                               __global float* images, __global const float2* tw, int length, int width,
                               int rows_out, int columns, int pitch_x, int first) {
    const int x = (int)get_global_id(0) * 2 * VW;
    const int plane = (int)get_global_id(1);
    if (x >= columns) return;
    REALN room[4 * APART];
    REALN *ar = room, *ai = room + APART, *br = room + 2 * APART, *bi = room + 3 * APART;
    const int rows = length / 2 + 1;
    const int left = columns - x;
    const size_t base = mid_at(plane, rows, pitch_x, 0, x);
    for (int k = 0; k < rows; ++k) {
        const size_t i = base + (size_t)k * BLOCK;
        // c = a + √−1·b for the two columns a and b, and the same of the mirrored, conjugated bins.
        const REALN a_re = LOADN(mid_re + i), a_im = LOADN(mid_im + i);
        // Past the last column there is anything, NaN included: it must not reach a.
        const REALN b_re = load_up_to(mid_re + i + VW, left - VW),
                    b_im = load_up_to(mid_im + i + VW, left - VW);
        const int mirror = length - k;
        if (mirror < length && mirror != k) {
            ar[mirror] = a_re + b_im;
            ai[mirror] = b_re - a_im;
            ar[k] = a_re - b_im;
            ai[k] = a_im + b_re;
        } else {
            // Self-conjugate bins are real: what rounding left in the imaginary part is dropped.
            ar[k] = a_re;
            ai[k] = b_re;
        }
    }
    const int swapped = transform(length, length, ar, ai, br, bi, tw);
    const REALN* sr = swapped ? br : ar;
    const REALN* si = swapped ? bi : ai;
    __global float* out = images + (size_t)(first + plane) * length * width + x;
    for (int r = 0; r < rows_out; ++r) {
        store_up_to(sr[r], out + (size_t)r * width, left);
        store_up_to(si[r], out + (size_t)r * width + VW, left - VW);
    }
}
#endif

#ifdef BTFIELD_KERNEL_fft_rows_forward
// Forward pass 1, length H: images → (mid_re, mid_im). Images of `rows_in` rows stand for those that go on with zeros.
// Work-item (two vectors of x, plane).
__kernel void fft_rows_forward(__global const float* images, __global float* mid_re, __global float* mid_im,
                               __global const float2* tw, int length, int rows_in, int width, int pitch_x) {
    const int x = (int)get_global_id(0) * 2 * VW;
    const int plane = (int)get_global_id(1);
    if (x >= width) return;
    REALN room[4 * APART];
    REALN *ar = room, *ai = room + APART, *br = room + 2 * APART, *bi = room + 3 * APART;
    const int left = width - x;
    __global const float* in = images + (size_t)plane * rows_in * width + x;
    for (int r = 0; r < rows_in; ++r) {
        ar[r] = load_up_to(in + (size_t)r * width, left);
        ai[r] = load_up_to(in + (size_t)r * width + VW, left - VW);
    }
    const int swapped = transform(length, rows_in, ar, ai, br, bi, tw);
    const REALN* sr = swapped ? br : ar;
    const REALN* si = swapped ? bi : ai;
    const int rows = length / 2 + 1;
    const size_t base = mid_at(plane, rows, pitch_x, 0, x);
    for (int k = 0; k < rows; ++k) {
        const int mirror = k == 0 ? 0 : length - k;
        const size_t o = base + (size_t)k * BLOCK;
        STOREN((sr[k] + sr[mirror]) * 0.5f, mid_re + o);
        STOREN((si[k] - si[mirror]) * 0.5f, mid_im + o);
        STOREN((si[k] + si[mirror]) * 0.5f, mid_re + o + VW);
        STOREN((sr[mirror] - sr[k]) * 0.5f, mid_im + o + VW);
    }
}
#endif

#ifdef BTFIELD_KERNEL_fft_columns_forward
// Forward pass 2, length W: (mid_re, mid_im) → spectrum. Work-item (vector of ky, plane).
__kernel void fft_columns_forward(__global const float* mid_re, __global const float* mid_im,
                                  __global float* re, __global float* im, __global const float2* tw,
                                  int length, int height, int pitch_ky, int pitch_x) {
    const int ky = (int)get_global_id(0) * VW;
    const int plane = (int)get_global_id(1);
    const int rows = height / 2 + 1;
    if (ky >= rows) return;
    REALN room[4 * APART];
    REALN *ar = room, *ai = room + APART, *br = room + 2 * APART, *bi = room + 3 * APART;
    load_rows(mid_re, mid_im, plane, rows, ky, length, pitch_x, 1.0f, ar, ai);
    const int swapped = transform(length, length, ar, ai, br, bi, tw);
    const REALN* sr = swapped ? br : ar;
    const REALN* si = swapped ? bi : ai;
    const size_t base = (size_t)plane * length * pitch_ky + ky;
    for (int k = 0; k < length; ++k) {
        STOREN(sr[k], re + base + (size_t)k * pitch_ky);
        STOREN(si[k], im + base + (size_t)k * pitch_ky);
    }
}
#endif

#ifdef BTFIELD_KERNEL_fft_columns_correlate
// Between forward pass 1 of patches and inverse pass 2 of scores, length W: patches (mid_re, mid_im), [patch][plane] of
// `columns_in` columns and pitch_in floats, and the sample's spectrum (re, im) → Σ_planes sample · conj(patch), inverse
// pass 1 done, (out_re, out_im), [patch], columns_out columns of it. For the +1 transform: it makes the conjugate of a forward
// one from conjugates. Work-item (patch, vector of ky): patches one after the other find the sample's spectrum in the cache.
__kernel void fft_columns_correlate(__global const float* mid_re, __global const float* mid_im,
                                    __global const float* re, __global const float* im,
                                    __global float* out_re, __global float* out_im, __global const float2* tw,
                                    int length, int height, int patches, int planes, int columns_in,
                                    int columns_out, int pitch_in, int pitch_ky, int pitch_x) {
    const int patch = (int)get_global_id(0);
    const int ky = (int)get_global_id(1) * VW;
    const int rows = height / 2 + 1;
    if (patch >= patches) return;
    REALN room[6 * APART];
    REALN *ar = room, *ai = room + APART, *br = room + 2 * APART, *bi = room + 3 * APART;
    REALN *sum_re = room + 4 * APART, *sum_im = room + 5 * APART;
    for (int plane = 0; plane < planes; ++plane) {
        load_rows(mid_re, mid_im, (size_t)patch * planes + plane, rows, ky, columns_in, pitch_in, -1.0f, ar, ai);
        const int swapped = transform(length, columns_in, ar, ai, br, bi, tw);
        const REALN* pr = swapped ? br : ar;
        const REALN* pi = swapped ? bi : ai;
        const size_t base = (size_t)plane * length * pitch_ky + ky;
        for (int k = 0; k < length; ++k) {
            const REALN fr = LOADN(re + base + (size_t)k * pitch_ky),
                        fi = LOADN(im + base + (size_t)k * pitch_ky);
            complexn sum;
            sum.re = sum.im = (REALN)(0.0f);
            if (plane > 0) sum = at(sum_re, sum_im, k);
            sum.re = fma(fr, pr[k], fma(-fi, pi[k], sum.re));
            sum.im = fma(fr, pi[k], fma(fi, pr[k], sum.im));
            put(sum_re, sum_im, k, sum);
        }
    }
    const int swapped = transform(length, length, sum_re, sum_im, br, bi, tw);
    store_rows(swapped ? br : sum_re, swapped ? bi : sum_im, out_re, out_im, patch, rows, ky, columns_out, pitch_x);
}
#endif

#ifdef BTFIELD_KERNEL_spread_patches
// images[plane][height][width] ← patches[plane][rows][columns], zero elsewhere. Work-item (column, row, plane).
__kernel void spread_patches(__global const float* patches, __global float* images, int height, int width,
                             int rows, int columns) {
    const int x = (int)get_global_id(0), y = (int)get_global_id(1);
    if (x >= width) return;
    const size_t plane = get_global_id(2);
    images[(plane * height + y) * width + x] =
        x < columns && y < rows ? patches[(plane * rows + y) * columns + x] : 0.0f;
}
#endif

#ifdef BTFIELD_KERNEL_correlate_spectra
// out[patch] ← Σ_planes sample[plane] · conj(patches[patch][plane]) value by value. Work-item (vector of values, patch).
__kernel void correlate_spectra(__global const float* re, __global const float* im,
                                __global const float* patches_re, __global const float* patches_im,
                                __global float* out_re, __global float* out_im, uint values, int planes) {
    const size_t at = get_global_id(0) * VW, patch = get_global_id(1);
    if (at >= values) return;
    REALN sum_re = (REALN)(0.0f), sum_im = sum_re;
    for (int plane = 0; plane < planes; ++plane) {
        const size_t f = (size_t)plane * values + at, p = (patch * planes + plane) * values + at;
        const REALN fr = LOADN(re + f), fi = LOADN(im + f), pr = LOADN(patches_re + p),
                    pi = LOADN(patches_im + p);
        sum_re = fma(fr, pr, fma(fi, pi, sum_re));
        sum_im = fma(fi, pr, fma(-fr, pi, sum_im));
    }
    STOREN(sum_re, out_re + patch * values + at);
    STOREN(sum_im, out_im + patch * values + at);
}
#endif

#ifdef BTFIELD_KERNEL_transpose_planes
// images[plane][row][column] ← columns[plane][column][row] (clFFT's order), in 16 × 16 tiles on private memory.
__kernel void transpose_planes(__global const float* columns, __global float* images, int height, int width) {
    const int x0 = (int)get_global_id(0) * 16;
    const int y0 = (int)get_global_id(1) * 16;
    const size_t plane = (size_t)get_global_id(2) * height * width;
    if (x0 >= width) return;
    const int x1 = min(x0 + 16, width), y1 = min(y0 + 16, height);
    for (int y = y0; y < y1; ++y)
        for (int x = x0; x < x1; ++x)
            images[plane + (size_t)y * width + x] = columns[plane + (size_t)x * height + y];
}
#endif

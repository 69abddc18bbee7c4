// Real 2D transforms with one transform per vector lane (Stockham, radix 8, 4, 2 and any odd radix up to 13).
//
// Pass 1 runs along x or kx with lanes over ky, pass 2 along rows or ky with lanes over x. Two real columns share one
// complex transform, so odd heights need nothing special. Layouts: see host/cl/fft.hpp; between the passes
// [plane][x / BLOCK][ky][x % BLOCK], where both find what they need close together.

#include "base/lanes.clh"

// Lengths are arguments; what is compiled is the room for them, so that few programs serve all sizes.
#ifndef BTFIELD_FFT_ROOM
#error "BTFIELD_FFT_ROOM (largest transform length) is not defined"
#endif
#ifndef BTFIELD_FFT_SIGN
#error "BTFIELD_FFT_SIGN (+1 inverse, -1 forward) is not defined"
#endif
#ifndef BTFIELD_FFT_ODD
#error "BTFIELD_FFT_ODD (1 for lengths with an odd prime factor) is not defined"
#endif

#define UNROLL _Pragma("unroll")
#define ROOM BTFIELD_FFT_ROOM
// Whether transforms may find zeros after their first values: others need not be compiled for them.
#if defined(BTFIELD_KERNEL_fft_rows_forward) || defined(BTFIELD_KERNEL_fft_columns_correlate)
#define FEW(filled, n) ((filled) <= (n) / 4)
#else
#define FEW(filled, n) 0
#endif

// From one array of a transform to the next: a power of 2 apart, all that a butterfly reads would meet in one set of the cache.
#define APART (ROOM + 8)
#define SIGN ((float)BTFIELD_FFT_SIGN)
#define SQRT_HALF 0.70710678118654752f
#define BLOCK 32  // columns, two vectors or more; pitch_of() of the host rounds up to it

typedef struct {
    REALN re, im;
} complexn;

INLINED complexn add(complexn a, complexn b) {
    a.re += b.re;
    a.im += b.im;
    return a;
}

INLINED complexn sub(complexn a, complexn b) {
    a.re -= b.re;
    a.im -= b.im;
    return a;
}

// a·√−1·SIGN
INLINED complexn turn(complexn a) {
    complexn r;
    r.re = -SIGN * a.im;
    r.im = SIGN * a.re;
    return r;
}

// a·(w.x + √−1·SIGN·w.y): tables hold cosines and sines of positive angles.
INLINED complexn twiddle(complexn a, float2 w) {
    const float wy = SIGN * w.y;
    complexn r;
    r.re = fma(a.re, (REALN)(w.x), -a.im * wy);
    r.im = fma(a.re, (REALN)(wy), a.im * w.x);
    return r;
}

INLINED complexn at(const REALN* re, const REALN* im, int i) {
    complexn r;
    r.re = re[i];
    r.im = im[i];
    return r;
}

INLINED void put(REALN* re, REALN* im, int i, complexn v) {
    re[i] = v.re;
    im[i] = v.im;
}

INLINED void dft4(complexn a, complexn b, complexn c, complexn d, complexn* y) {
    const complexn s = add(a, c), t = sub(a, c), u = add(b, d), v = turn(sub(b, d));
    y[0] = add(s, u);
    y[1] = add(t, v);
    y[2] = sub(s, u);
    y[3] = sub(t, v);
}

// One Stockham stage: sub-transforms of length n = radix·m, `s` of them interleaved; table: w_N^k at tw[k].
inline void stage2(int n, int s, const REALN* xr, const REALN* xi, REALN* yr, REALN* yi,
                   __global const float2* tw) {
    const int m = n / 2;
    for (int p = 0; p < m; ++p) {
        const float2 w = tw[p * s];
        for (int q = 0; q < s; ++q) {
            const complexn a = at(xr, xi, q + s * p), b = at(xr, xi, q + s * (p + m));
            put(yr, yi, q + s * 2 * p, add(a, b));
            put(yr, yi, q + s * (2 * p + 1), twiddle(sub(a, b), w));
        }
    }
}

inline void stage4(int n, int s, const REALN* xr, const REALN* xi, REALN* yr, REALN* yi,
                   __global const float2* tw) {
    const int m = n / 4;
    for (int p = 0; p < m; ++p) {
        const float2 w1 = tw[p * s], w2 = tw[2 * p * s], w3 = tw[3 * p * s];
        for (int q = 0; q < s; ++q) {
            complexn y[4];
            dft4(at(xr, xi, q + s * p), at(xr, xi, q + s * (p + m)), at(xr, xi, q + s * (p + 2 * m)),
                 at(xr, xi, q + s * (p + 3 * m)), y);
            const int o = q + s * 4 * p;
            put(yr, yi, o, y[0]);
            put(yr, yi, o + s, twiddle(y[1], w1));
            put(yr, yi, o + 2 * s, twiddle(y[2], w2));
            put(yr, yi, o + 3 * s, twiddle(y[3], w3));
        }
    }
}

// Transforms 8 values that lie `step` apart.
INLINED void dft8(const REALN* xr, const REALN* xi, int step, complexn* y) {
    complexn even[4], odd[4];
    dft4(at(xr, xi, 0), at(xr, xi, 2 * step), at(xr, xi, 4 * step), at(xr, xi, 6 * step), even);
    dft4(at(xr, xi, step), at(xr, xi, 3 * step), at(xr, xi, 5 * step), at(xr, xi, 7 * step), odd);
    // odd[k]·exp(√−1·SIGN·πk/4)
    complexn t1 = turn(odd[1]), t3 = turn(odd[3]);
    t1.re = (odd[1].re + t1.re) * SQRT_HALF;
    t1.im = (odd[1].im + t1.im) * SQRT_HALF;
    t3.re = (t3.re - odd[3].re) * SQRT_HALF;
    t3.im = (t3.im - odd[3].im) * SQRT_HALF;
    const complexn t2 = turn(odd[2]);
    y[0] = add(even[0], odd[0]);
    y[1] = add(even[1], t1);
    y[2] = add(even[2], t2);
    y[3] = add(even[3], t3);
    y[4] = sub(even[0], odd[0]);
    y[5] = sub(even[1], t1);
    y[6] = sub(even[2], t2);
    y[7] = sub(even[3], t3);
}

// The same where only the first two may be other than 0, `count` of them.
INLINED void dft8_few(const REALN* xr, const REALN* xi, int step, int count, complexn* y) {
    complexn a, b;
    a.re = a.im = b.re = b.im = (REALN)(0.0f);
    if (count > 0) a = at(xr, xi, 0);
    if (count > 1) b = at(xr, xi, step);
    const complexn t = turn(b);
    complexn t1 = add(b, t), t3 = sub(t, b);
    t1.re *= SQRT_HALF;
    t1.im *= SQRT_HALF;
    t3.re *= SQRT_HALF;
    t3.im *= SQRT_HALF;
    y[0] = add(a, b);
    y[1] = add(a, t1);
    y[2] = add(a, t);
    y[3] = add(a, t3);
    y[4] = sub(a, b);
    y[5] = sub(a, t1);
    y[6] = sub(a, t);
    y[7] = sub(a, t3);
}

// Values `step` apart from 8 of a transform, each times its power of the root at tw[at], w^k at tw[k·at].
INLINED void put8(const complexn* y, int at, __global const float2* tw, REALN* yr, REALN* yi, int step) {
    put(yr, yi, 0, y[0]);
    UNROLL
    for (int k = 1; k < 8; ++k) put(yr, yi, k * step, twiddle(y[k], tw[k * at]));
}

inline void stage8(int n, int s, const REALN* xr, const REALN* xi, REALN* yr, REALN* yi,
                   __global const float2* tw) {
    const int m = n / 8;
    for (int p = 0; p < m; ++p)
        for (int q = 0; q < s; ++q) {
            complexn y[8];
            dft8(xr + q + s * p, xi + q + s * p, s * m, y);
            put8(y, p * s, tw, yr + q + s * 8 * p, yi + q + s * 8 * p, s);
        }
}

// Two stages of 8 at once: what lies between them stays in the first-level cache. Values from `filled` on stand for 0, where
// that is no more than n/4 and s = 1.
inline void stage64(int n, int s, int filled, const REALN* xr, const REALN* xi, REALN* yr, REALN* yi,
                    __global const float2* tw) {
    const int m = n / 64;
    for (int p = 0; p < m; ++p)
        for (int q = 0; q < s; ++q) {
            REALN tr[64], ti[64];
            for (int j = 0; j < 8; ++j) {
                const int a = p + m * j;
                complexn y[8];
                if (FEW(filled, n))
                    dft8_few(xr + a, xi + a, 8 * m, (filled - a + 8 * m - 1) / (8 * m), y);
                else
                    dft8(xr + q + s * a, xi + q + s * a, 8 * s * m, y);
                put8(y, a * s, tw, tr + j, ti + j, 8);
            }
            for (int k = 0; k < 8; ++k) {
                const int o = q + s * (k + 64 * p);
                complexn y[8];
                dft8(tr + 8 * k, ti + 8 * k, 1, y);
                put8(y, 8 * p * s, tw, yr + o, yi + o, 8 * s);
            }
        }
}

// Odd radix by sums and differences of conjugate pairs.
inline void stage_odd(int length, int radix, int n, int s, const REALN* xr, const REALN* xi, REALN* yr,
                      REALN* yi, __global const float2* tw) {
    const int m = n / radix, pairs = radix / 2, root = length / radix;
    for (int p = 0; p < m; ++p)
        for (int q = 0; q < s; ++q) {
            const complexn x0 = at(xr, xi, q + s * p);
            complexn sum[6], diff[6];
            complexn total = x0;
            for (int j = 0; j < pairs; ++j) {
                const complexn a = at(xr, xi, q + s * (p + m * (j + 1)));
                const complexn b = at(xr, xi, q + s * (p + m * (radix - 1 - j)));
                sum[j] = add(a, b);
                diff[j] = sub(a, b);
                total = add(total, sum[j]);
            }
            const int o = q + s * radix * p;
            put(yr, yi, o, total);
            for (int k = 1; k <= pairs; ++k) {
                complexn c = x0, d;
                d.re = (REALN)(0.0f);
                d.im = (REALN)(0.0f);
                for (int j = 0; j < pairs; ++j) {
                    const float2 w = tw[((j + 1) * k % radix) * root];
                    c.re = fma(sum[j].re, (REALN)(w.x), c.re);
                    c.im = fma(sum[j].im, (REALN)(w.x), c.im);
                    d.re = fma(diff[j].re, (REALN)(w.y), d.re);
                    d.im = fma(diff[j].im, (REALN)(w.y), d.im);
                }
                d = turn(d);
                put(yr, yi, o + s * k, twiddle(add(c, d), tw[k * p * s]));
                put(yr, yi, o + s * (radix - k), twiddle(sub(c, d), tw[(radix - k) * p * s]));
            }
        }
}

// The first stage of 8 where values from `filled` on stand for 0, no more than n/4.
inline void stage8_few(int n, int filled, const REALN* xr, const REALN* xi, REALN* yr, REALN* yi,
                       __global const float2* tw) {
    const int m = n / 8;
    for (int p = 0; p < m; ++p) {
        complexn y[8];
        dft8_few(xr + p, xi + p, m, (filled - p + m - 1) / m, y);
        put8(y, p, tw, yr + 8 * p, yi + 8 * p, 1);
    }
}

// Transforms (ar, ai) using (br, bi) as room; true when the result is in (br, bi). Values from `filled` on stand for 0.
inline int transform(int length, int filled, REALN* ar, REALN* ai, REALN* br, REALN* bi, __global const float2* tw) {
    int n = length, s = 1, swapped = 0;
    if (n % 8 == 0 && FEW(filled, n)) {
        if (n % 64 == 0)
            stage64(n, 1, filled, ar, ai, br, bi, tw);
        else
            stage8_few(n, filled, ar, ai, br, bi, tw);
        s = n % 64 == 0 ? 64 : 8;
        n /= s;
        swapped = 1;
    } else {
        for (int i = filled; i < n; ++i) ar[i] = ai[i] = (REALN)(0.0f);
    }
    while (n > 1) {
        const REALN* xr = swapped ? br : ar;
        const REALN* xi = swapped ? bi : ai;
        REALN* yr = swapped ? ar : br;
        REALN* yi = swapped ? ai : bi;
        int radix;
        if (n % 64 == 0) {
            radix = 64;
            stage64(n, s, length, xr, xi, yr, yi, tw);
        } else if (n % 8 == 0) {
            radix = 8;
            stage8(n, s, xr, xi, yr, yi, tw);
        } else if (n % 4 == 0) {
            radix = 4;
            stage4(n, s, xr, xi, yr, yi, tw);
        } else if (n % 2 == 0) {
            radix = 2;
            stage2(n, s, xr, xi, yr, yi, tw);
        } else {
#if BTFIELD_FFT_ODD
            radix = n % 3 == 0 ? 3 : n % 5 == 0 ? 5 : n % 7 == 0 ? 7 : n % 11 == 0 ? 11 : 13;
            stage_odd(length, radix, n, s, xr, xi, yr, yi, tw);
#else
            radix = n;  // not reached: the length was a power of 2
#endif
        }
        n /= radix;
        s *= radix;
        swapped ^= 1;
    }
    return swapped;
}

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

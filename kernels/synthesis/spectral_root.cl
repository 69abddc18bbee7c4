// Roots and solves of one small complex matrix a lane, alone; hermitian_factor.clh and general_solve.clh hold what
// spectral_factors.cl uses.
//
// Matrices lie as factors do: [i][j][matrix], real and imaginary parts apart, rows of `pitch` matrices, a multiple of
// BTFIELD_VECTOR_WIDTH. Work-item (vector of matrices).

#ifndef BTFIELD_FACTOR
#define BTFIELD_FACTOR 1
#endif

#include "base/general_solve.clh"
#include "base/hermitian_factor.clh"

inline void load_matrix(__global const float* re, __global const float* im, size_t pitch, size_t n, REALN* mr, REALN* mi) {
    UNROLL
    for (int e = 0; e < D * D; ++e) mr[e] = LOADN(re + e * pitch + n), mi[e] = LOADN(im + e * pitch + n);
}

inline void store_matrix(const REALN* mr, const REALN* mi, __global float* re, __global float* im, size_t pitch, size_t n) {
    UNROLL
    for (int e = 0; e < D * D; ++e) {
        STOREN(mr[e], re + e * pitch + n);
        STOREN(mi[e], im + e * pitch + n);
    }
}

#ifdef BTFIELD_KERNEL_hermitian_roots
// A^{1/2} and A^{-1/2} of Hermitian positive definite A, whose lower triangle is read; NaN where A is not.
__kernel void hermitian_roots(__global const float* re, __global const float* im, __global float* root_re,
                              __global float* root_im, __global float* inverse_re, __global float* inverse_im, int pitch) {
    const int n = (int)get_global_id(0) * VW;
    if (n >= pitch) return;
    REALN ar[D * D], ai[D * D], fr[D * D], fi[D * D];
    load_matrix(re, im, pitch, n, ar, ai);
#if D == 1
    fr[0] = sqrt(ar[0]), fi[0] = 0.0f;
    store_matrix(fr, fi, root_re, root_im, pitch, n);
    fr[0] = 1.0f / fr[0];
    store_matrix(fr, fi, inverse_re, inverse_im, pitch, n);
#elif D == 2
    const REALN root = sqrt(hermitian_det2(ar[0], ar[3], ar[2], ai[2]));
    const REALN as = ar[0] + root, cs = ar[3] + root;
    const REALN f = rsqrt(as + cs), g = f / root;
    fr[0] = as * f, fr[1] = ar[2] * f, fr[2] = fr[1], fr[3] = cs * f;
    fi[0] = 0.0f, fi[1] = -ai[2] * f, fi[2] = ai[2] * f, fi[3] = 0.0f;
    store_matrix(fr, fi, root_re, root_im, pitch, n);
    fr[0] = cs * g, fr[1] = -ar[2] * g, fr[2] = fr[1], fr[3] = as * g;
    fi[0] = 0.0f, fi[1] = ai[2] * g, fi[2] = -ai[2] * g, fi[3] = 0.0f;
    store_matrix(fr, fi, inverse_re, inverse_im, pitch, n);
#else
    REALN xr[D * D], xi[D * D], values[D], weights[D];
    hermitian_eigen(ar, ai, xr, xi, values);
    UNROLL
    for (int j = 0; j < D; ++j) weights[j] = rsqrt(values[j]);
    hermitian_sum(xr, xi, weights, fr, fi);
    store_matrix(fr, fi, root_re, root_im, pitch, n);
    UNROLL
    for (int j = 0; j < D; ++j) weights[j] /= values[j];
    hermitian_sum(xr, xi, weights, fr, fi);
    store_matrix(fr, fi, inverse_re, inverse_im, pitch, n);
#endif
}
#endif

#ifdef BTFIELD_KERNEL_hermitian_root_factors
// F of given Λ (PMRF) or W (MMRF) and one root of Σ at [i][j]: hermitian_factor.clh.
__kernel void hermitian_root_factors(__global const float* re, __global const float* im, __global const float* noise,
                                     __global float* factor_re, __global float* factor_im, int pitch) {
    const int n = (int)get_global_id(0) * VW;
    if (n >= pitch) return;
    REALN ar[D * D], ai[D * D], fr[D * D], fi[D * D];
    load_matrix(re, im, pitch, n, ar, ai);
    hermitian_root_factor(ar, ai, noise, fr, fi);
    store_matrix(fr, fi, factor_re, factor_im, pitch, n);
}
#endif

#ifdef BTFIELD_KERNEL_general_solves
// A⁻¹ B of given A and one real B at [i][j]: general_solve.clh.
__kernel void general_solves(__global const float* re, __global const float* im, __global const float* right,
                             __global float* out_re, __global float* out_im, int pitch) {
    const int n = (int)get_global_id(0) * VW;
    if (n >= pitch) return;
    REALN ar[D * D], ai[D * D], fr[D * D], fi[D * D];
    load_matrix(re, im, pitch, n, ar, ai);
    general_solve(ar, ai, right, fr, fi);
    store_matrix(fr, fi, out_re, out_im, pitch, n);
}
#endif

#ifdef BTFIELD_KERNEL_hermitian_factors
// F_t of every frequency of the half spectrum: [i][j][kx][ky]. Work-item (vector of ky, kx).
__kernel void hermitian_factors(FACTOR_ARGUMENTS, __global float* factor_re, __global float* factor_im, int width,
                                int pitch) {
    const int ky = (int)get_global_id(0) * VW;
    const int kx = (int)get_global_id(1);
    if (ky >= pitch) return;
    REALN fr[D * D], fi[D * D];
    hermitian_factor(coefficients, offsets, rows, columns, count, kx, ky, width, pitch, fr, fi);
    store_matrix(fr, fi, factor_re, factor_im, (size_t)width * pitch, (size_t)kx * pitch + ky);
}
#endif

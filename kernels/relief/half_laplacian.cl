// Powers of the Laplacian in frequency (theory 20.3).

#include "base/lanes.clh"

#ifdef BTFIELD_KERNEL_scale_spectrum
// Y_t ← scale · μ^{±1/2} Y_t, μ = across[kx] + down[ky] the transform of −Δ of forward differences; 0 where μ is. Spectra as
// host/cl/fft.hpp has them. down: padded to the pitch. Work-item (vector of ky, kx).
__kernel void scale_spectrum(__global float* re, __global float* im, __global const float* across,
                             __global const float* down, int inverse, float scale, int pitch) {
    const int ky = (int)get_global_id(0) * VW;
    if (ky >= pitch) return;
    const size_t at = get_global_id(1) * (size_t)pitch + ky;
    const REALN mu = across[get_global_id(1)] + LOADN(down + ky);
    const INTN there = MASK(mu > 0.0f);
    const REALN root = sqrt(choose(there, mu, (REALN)(1.0f)));
    const REALN factor = choose(there, scale * (inverse ? 1.0f / root : root), (REALN)(0.0f));
    STOREN(factor * LOADN(re + at), re + at);
    STOREN(factor * LOADN(im + at), im + at);
}
#endif

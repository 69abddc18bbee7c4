// What a device reaches at most: copies, multiply-adds in registers, launches that do nothing.

#include "base/lanes.clh"

#ifdef BTFIELD_KERNEL_copy_values
// Work-item (vector).
__kernel void copy_values(__global const float* in, __global float* out, uint count) {
    const size_t at = get_global_id(0) * VW;
    if (at + VW > count) return;
    STOREN(LOADN(in + at), out + at);
}
#endif

#ifdef BTFIELD_KERNEL_multiply_add
// Twelve chains, so that no operation waits for the one before: 24 operations a lane and step. Work-item: one vector.
__kernel void multiply_add(__global float* out, float factor, float term, int steps) {
    const REALN start = TO_REALN(AS_INTN(LANE_INDEX)) + (REALN)((float)get_global_id(0));
    REALN a0 = start, a1 = start + 1.0f, a2 = start + 2.0f, a3 = start + 3.0f, a4 = start + 4.0f,
          a5 = start + 5.0f;
    REALN b0 = start + 6.0f, b1 = start + 7.0f, b2 = start + 8.0f, b3 = start + 9.0f, b4 = start + 10.0f,
          b5 = start + 11.0f;
    for (int step = 0; step < steps; ++step) {
        a0 = fma(a0, (REALN)(factor), (REALN)(term));
        a1 = fma(a1, (REALN)(factor), (REALN)(term));
        a2 = fma(a2, (REALN)(factor), (REALN)(term));
        a3 = fma(a3, (REALN)(factor), (REALN)(term));
        a4 = fma(a4, (REALN)(factor), (REALN)(term));
        a5 = fma(a5, (REALN)(factor), (REALN)(term));
        b0 = fma(b0, (REALN)(factor), (REALN)(term));
        b1 = fma(b1, (REALN)(factor), (REALN)(term));
        b2 = fma(b2, (REALN)(factor), (REALN)(term));
        b3 = fma(b3, (REALN)(factor), (REALN)(term));
        b4 = fma(b4, (REALN)(factor), (REALN)(term));
        b5 = fma(b5, (REALN)(factor), (REALN)(term));
    }
    STOREN(((a0 + a1) + (a2 + a3)) + ((a4 + a5) + (b0 + b1)) + ((b2 + b3) + (b4 + b5)),
           out + get_global_id(0) * VW);
}
#endif

#ifdef BTFIELD_KERNEL_launch_only
__kernel void launch_only(__global float* out) {
    if (get_global_id(0) == 0) out[0] = 0.0f;
}
#endif

#pragma once

/// \file
/// The benchmarks by station, and what several of them share.

#include "btfield/device.hpp"
#include "btfield/fit.hpp"
#include "btfield/image.hpp"
#include "btfield/models.hpp"

namespace btfield::bench {

void add_ceiling();
void add_noise();
void add_fft();
void add_spectral_factors();
void add_spectral_root();
void add_pyramid();
void add_plane_restorer();
void add_lag_covariance();
void add_fit();
void add_models();
void add_convolution();
void add_causal_recursion();
void add_synthesis();
void add_experiment();
void add_memd();
void add_roller();
void add_compound();
void add_relief();
void add_btf();
void add_png();
void add_all();

/// The device of $BTFIELD_DEVICE, else the best; opened once.
Device& device();
void close_device();
/// The committed cork picture, continued on its torus to this size.
Image picture(Size size);
/// 3D CAR of the 512² cork picture, causal.
TextureModel model(int order, int levels);

/// \throws std::runtime_error unless |a − b| <= tolerance: a peer that computes something else is no peer.
void must_agree(double a, double b, double tolerance, const char* what);

}  // namespace btfield::bench

#pragma once

#include <vector>

#include "btfield/image.hpp"
#include "btfield/neighbourhood.hpp"

namespace btfield::peer {

/// Least squares of a causal autoregressive model of all planes on the torus: a_{s,i,j} at [(s·d + i)·d + j].
std::vector<double> fit_car(const Image& image, const std::vector<Offset>& offsets);

}  // namespace btfield::peer

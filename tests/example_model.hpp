#pragma once

#include <cstddef>
#include <vector>

#include "btfield/models.hpp"

namespace btfield::test {

/// Coefficients small enough for any family, and of Markov models the same for s and −s.
LinearField example_field(ModelKind kind, int planes, NoiseForm noise, bool per_pair, std::size_t variant);

/// A valid model with numbers of many digits everywhere, so that a lost bit shows. Stable: its coefficients
/// are small. 2D models have a basis that turns neighbouring planes into each other; `marginals` brings one
/// too.
TextureModel example_model(ModelKind kind = ModelKind::car3d, int planes = 2, int levels = 2,
                           NoiseForm noise = NoiseForm::full, bool per_pair = false, bool marginals = false);

/// The linear part, to be spoilt.
LinearField& field_of(TextureModel& model, std::size_t level);

}  // namespace btfield::test

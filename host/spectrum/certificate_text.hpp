#pragma once

/// \file
/// What a certificate that fails says.

#include <string>

#include "btfield/models.hpp"

namespace btfield::detail {

/// Why it is not valid, the first of: "4 zeros of det Λ", "Λ is not positive definite", "the variance of
/// plane 3 is 14.2 times the picture's", "det Λ comes too close to zero to prove that it has none".
[[nodiscard]] std::string failure_text(const Certificate& certificate);

}  // namespace btfield::detail

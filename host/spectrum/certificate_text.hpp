#pragma once

/// \file
/// What a certificate that fails says. Here, not in a source: the command needs it without the rest of the
/// room.

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdio>
#include <string>

#include "btfield/models.hpp"
#include "host/base/text.hpp"

namespace btfield::detail {

/// Of a certified model, variance over the data's: one of ten times the data's is no model of the data,
/// though its field may exist. Such variance sits in a ring of near-singular frequencies (theory 7.3).
inline constexpr double largest_variance_ratio = 10.0;

/// Why it is not valid, the first of: "4 zeros of det Λ", "Λ is not positive definite", "the variance of
/// plane 3 is 14.2 times the picture's", "det Λ comes too close to zero to prove that it has none".
[[nodiscard]] inline std::string failure_text(const Certificate& certificate) {
    if (certificate.zeros > 0) return counted(certificate.zeros, "zero") + " of det Λ";
    if (certificate.min_singular < 0.0) return "Λ is not positive definite";
    for (std::size_t i = 0; i < certificate.variance_ratio.size(); ++i) {
        const double ratio = certificate.variance_ratio[i];
        if (ratio > 0.0 && ratio <= largest_variance_ratio) continue;
        const std::string plane = "the variance of plane " + std::to_string(i + 1) + " is ";
        if (!std::isfinite(ratio)) return plane + "not finite";
        std::array<char, 32> text{};
        std::snprintf(text.data(), text.size(), "%.4g", ratio);
        return plane + text.data() + " times the picture's";
    }
    return "det Λ comes too close to zero to prove that it has none";
}

}  // namespace btfield::detail

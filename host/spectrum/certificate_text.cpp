#include "host/spectrum/certificate_text.hpp"

#include <array>
#include <cmath>
#include <cstdio>

#include "host/spectrum/examination.hpp"

namespace btfield::detail {

std::string failure_text(const Certificate& certificate) {
    if (certificate.zeros > 0)
        return std::to_string(certificate.zeros) + (certificate.zeros == 1 ? " zero" : " zeros") +
               " of det Λ";
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

#pragma once

// Contrasts as tables of models have them (theory 22.2).

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "btfield/btf_textures.hpp"

namespace btfield::detail {

[[nodiscard]] inline std::uint8_t contrast_code(double mean, double deviation) {
    if (!(mean > 0.0) || !(deviation > 0.5 * smallest_btf_contrast * mean)) return 0;
    const double steps = std::log(deviation / (mean * smallest_btf_contrast)) / std::log(btf_contrast_step);
    return static_cast<std::uint8_t>(1.0 + std::clamp(std::round(steps), 0.0, 254.0));
}

[[nodiscard]] inline double contrast_of_code(std::uint8_t code) {
    return code == 0 ? 0.0 : smallest_btf_contrast * std::pow(btf_contrast_step, code - 1);
}

}  // namespace btfield::detail

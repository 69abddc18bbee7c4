#pragma once

#include "btfield/synthesis.hpp"
#include "host/base/names.hpp"

namespace btfield::detail {

template <>
struct Names<SynthesisMethod> {
    static constexpr std::string_view what = "synthesis method";
    static constexpr auto words = std::to_array<Word<SynthesisMethod>>(
        {{SynthesisMethod::torus, "torus"}, {SynthesisMethod::raster, "raster"}});
};

template <>
struct Names<NoiseDomain> {
    static constexpr std::string_view what = "noise domain";
    static constexpr auto words = std::to_array<Word<NoiseDomain>>(
        {{NoiseDomain::frequency, "frequency"}, {NoiseDomain::spatial, "spatial"}});
};

}  // namespace btfield::detail

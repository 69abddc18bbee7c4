#pragma once

#include "btfield/btf_renderer.hpp"
#include "host/base/names.hpp"

namespace btfield::detail {

template <>
struct Names<BtfShape> {
    static constexpr std::string_view what = "shape";
    static constexpr auto words =
        std::to_array<Word<BtfShape>>({{BtfShape::plane, "plane"}, {BtfShape::sphere, "sphere"}});
};

}  // namespace btfield::detail

#pragma once

#include "btfield/memd.hpp"
#include "host/base/names.hpp"

namespace btfield::detail {

template <>
struct Names<Metric> {
    static constexpr std::string_view what = "metric";
    static constexpr auto words =
        std::to_array<Word<Metric>>({{Metric::max, "max"}, {Metric::l1, "l1"}, {Metric::l2, "l2"}});
};

}  // namespace btfield::detail

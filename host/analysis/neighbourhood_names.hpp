#pragma once

#include "btfield/neighbourhood.hpp"
#include "host/base/names.hpp"

namespace btfield::detail {

template <>
struct Names<NeighbourhoodKind> {
    static constexpr std::string_view what = "neighbourhood";
    static constexpr auto words =
        std::to_array<Word<NeighbourhoodKind>>({{NeighbourhoodKind::symmetric, "symmetric"},
                                                {NeighbourhoodKind::half, "half"},
                                                {NeighbourhoodKind::causal, "causal"},
                                                {NeighbourhoodKind::unilateral, "unilateral"},
                                                {NeighbourhoodKind::custom, "custom"}});
};

}  // namespace btfield::detail

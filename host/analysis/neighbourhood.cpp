#include "btfield/neighbourhood.hpp"

#include <algorithm>
#include <array>
#include <string>

#include "btfield/error.hpp"
#include "host/analysis/neighbourhood_names.hpp"

namespace btfield {
namespace {

constexpr std::array<int, max_order> squared_radius = {1, 2, 4, 5, 8, 9, 10, 13};

bool belongs(NeighbourhoodKind kind, Offset s) {
    switch (kind) {
        case NeighbourhoodKind::symmetric:
            return true;
        case NeighbourhoodKind::half:
            return s > Offset{};
        case NeighbourhoodKind::causal:
            return s < Offset{};
        case NeighbourhoodKind::unilateral:
            return s.row <= 0 && s.column <= 0;
        case NeighbourhoodKind::custom:
            break;
    }
    return false;
}

}  // namespace

std::string_view name(NeighbourhoodKind kind) {
    return detail::word_of(kind);
}

NeighbourhoodKind neighbourhood_kind(std::string_view name) {
    return detail::value_of<NeighbourhoodKind>(name);
}

std::vector<Offset> neighbourhood(int order, NeighbourhoodKind kind) {
    const std::string asked = "neighbourhood of order " + std::to_string(order);
    if (order < 1 || order > max_order) {
        throw InputError(asked, "orders run from 1 to " + std::to_string(max_order),
                         "choose an order in that range");
    }
    if (kind == NeighbourhoodKind::custom) {
        throw InputError(asked, "a custom neighbourhood has no order", "give its offsets as a list");
    }
    const int limit = squared_radius[static_cast<std::size_t>(order - 1)];
    std::vector<Offset> offsets;
    for (int row = -3; row <= 3; ++row) {
        for (int column = -3; column <= 3; ++column) {
            const Offset s{row, column};
            const int distance = row * row + column * column;
            if (distance > 0 && distance <= limit && belongs(kind, s)) offsets.push_back(s);
        }
    }
    return offsets;
}

Offset difference_box(const std::vector<Offset>& offsets) {
    Offset low, high;
    for (const Offset s : offsets) {
        low = {std::min(low.row, s.row), std::min(low.column, s.column)};
        high = {std::max(high.row, s.row), std::max(high.column, s.column)};
    }
    return high - low;
}

}  // namespace btfield

#pragma once

/// \file
/// Contextual neighbourhoods I_r (theory 4).

#include <cstddef>
#include <cstdint>
#include <string_view>
#include <vector>

#include "btfield/api.hpp"

namespace btfield {

/// Offset s = (row, column), stored as it is applied: y(r ⊕ s).
struct Offset {
    int row = 0;
    int column = 0;
    friend auto operator<=>(const Offset&, const Offset&) = default;
    friend Offset operator-(Offset a, Offset b) { return {a.row - b.row, a.column - b.column}; }
    friend Offset operator-(Offset a) { return {-a.row, -a.column}; }
};

enum class NeighbourhoodKind {
    symmetric,   ///< all offsets of the order
    half,        ///< one of each ±s pair, the lexicographically positive one
    causal,      ///< non-symmetric half-plane: those that precede r in raster order
    unilateral,  ///< quarter-plane: s1 <= 0, s2 <= 0
    custom,      ///< any list
};

/// "symmetric", "half", "causal", "unilateral", "custom".
[[nodiscard]] BTFIELD_API std::string_view name(NeighbourhoodKind kind);
/// Inverse of name().
/// \throws InputError for any other text
[[nodiscard]] BTFIELD_API NeighbourhoodKind neighbourhood_kind(std::string_view name);

inline constexpr int max_order = 8;

/// Offsets s != 0 with s1² + s2² <= q(order), q = 1, 2, 4, 5, 8, 9, 10, 13 (theory 4.1), in raster order.
/// \throws InputError when order is outside 1..8 or kind is custom
[[nodiscard]] BTFIELD_API std::vector<Offset> neighbourhood(int order, NeighbourhoodKind kind);

/// The neighbours in a model's equations.
struct Support {
    NeighbourhoodKind kind = NeighbourhoodKind::custom;
    std::vector<Offset> offsets;
    /// Per-pair sets I_r^{ij} (theory 4.3): 1 where plane j at offset s is in the equation of plane i, at
    /// [(s·d + i)·d + j]; empty = every pair has every offset.
    std::vector<std::uint8_t> active{};

    /// Whether plane j at offset s is in the equation of plane i.
    [[nodiscard]] bool has(std::size_t s, std::size_t i, std::size_t j, std::size_t planes) const {
        return active.empty() || active[(s * planes + i) * planes + j] != 0;
    }
    /// Whether every pair of planes has every offset.
    [[nodiscard]] bool has_all() const {
        for (const std::uint8_t present : active) {
            if (present == 0) return false;
        }
        return true;
    }
};

/// Largest |row| and |column| among differences of two offsets of the set, the centre included: the box of
/// lags that a fit on this support reads (theory 5.2).
[[nodiscard]] BTFIELD_API Offset difference_box(const std::vector<Offset>& offsets);

}  // namespace btfield

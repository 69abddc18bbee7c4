#pragma once

// The pixels of a picture that MEMD has not yet taken, as a tree of their colours.

#include <cstddef>
#include <cstdint>
#include <limits>
#include <new>
#include <span>
#include <vector>

#include "btfield/memd.hpp"

namespace btfield::detail {

/// Colours in units 0…255, [pixel][plane], pixels in raster order.
struct Colours {
    int planes = 0;
    std::vector<float> values;
    [[nodiscard]] std::size_t pixels() const { return values.size() / static_cast<std::size_t>(planes); }
    [[nodiscard]] const float* at(std::size_t pixel) const {
        return values.data() + pixel * static_cast<std::size_t>(planes);
    }
};

/// (distance, raster index) as one number that orders as the pair does: distances are never negative.
using ColourKey = std::uint64_t;
inline constexpr ColourKey no_colour = std::numeric_limits<ColourKey>::max();

/// Memory that begins on a cache line, so that 16 lanes are one.
template <class T>
struct LineAllocator {
    using value_type = T;
    static constexpr std::align_val_t line{64};
    LineAllocator() = default;
    template <class U>
    explicit LineAllocator(const LineAllocator<U>&) {}
    [[nodiscard]] T* allocate(std::size_t count) {
        return static_cast<T*>(::operator new(count * sizeof(T), line));
    }
    void deallocate(T* memory, std::size_t) { ::operator delete(memory, line); }
    friend bool operator==(const LineAllocator&, const LineAllocator&) { return true; }
};
template <class T>
using Lines = std::vector<T, LineAllocator<T>>;

/// The arrays of a ColourTree; a device that searches has those of level 0 too. A tree of 16 branches without
/// pointers: child l of block b is block 16 b + l of the level below, and slot s is lane s % 16 of block
/// s / 16. Level 0 holds the distinct colours, each with the lowest raster index that is left of it; the
/// levels above hold, for every child, the box of its colours and the lowest raster index in it.
struct ColourTreeArrays {
    static constexpr std::size_t lanes = 16;
    int planes = 0;
    std::vector<std::size_t> level_begin;  ///< first block of levels 1, 2, … in `boxes`; then the end
    Lines<float> points;                   ///< [block][plane][lane]; +∞ where no pixel is left
    Lines<std::uint32_t> first;            ///< [block][lane]
    Lines<float> boxes;  ///< [block][low of plane, …, high of plane, …][lane]; empty: +∞, −∞
    Lines<std::uint32_t> lowest;  ///< [block][lane]
    /// Levels above the colours.
    [[nodiscard]] int levels() const { return static_cast<int>(level_begin.size()) - 1; }
};

class ColourTree {
  public:
    static constexpr std::size_t lanes = ColourTreeArrays::lanes;
    static constexpr std::uint32_t none = std::numeric_limits<std::uint32_t>::max();

    /// Precondition: all values finite, at least one pixel, fewer than `none` pixels.
    ColourTree(const Colours& colours, Metric metric);

    struct Hit {
        ColourKey key = no_colour;  ///< distance (float32, squared for l2) and raster index
        std::uint32_t slot = none;  ///< of the colour
    };
    using Search = Hit (*)(const ColourTreeArrays&, const float*);
    /// Brings the box of a block of `level`, a lane of the level above, up to date.
    /// \return whether it changed
    using Tighten = bool (*)(ColourTreeArrays&, int level, std::size_t block);
    /// The nearest pixel that is left, the one of lowest raster index among equals.
    [[nodiscard]] Hit nearest(const float* colour) const { return search_(arrays_, colour); }
    /// The pixel of lowest raster index that is left of a colour; `none` when none is.
    [[nodiscard]] std::uint32_t first(std::uint32_t slot) const { return arrays_.first[slot]; }
    /// Takes that pixel away.
    void take(std::uint32_t slot);
    [[nodiscard]] std::size_t left() const { return left_; }
    [[nodiscard]] std::size_t colours() const { return queues_.size(); }
    [[nodiscard]] const ColourTreeArrays& arrays() const { return arrays_; }

    /// Slots of colours that changed since the last clear_changes(), each once; nothing is noted before the
    /// first.
    [[nodiscard]] const std::vector<std::uint32_t>& changes() const { return changes_; }
    void clear_changes();

  private:
    struct Queue {
        std::uint32_t at = 0, end = 0;  ///< pixels of the colour that are left, in `pixels_`
    };
    void build(const std::vector<float>& distinct, const std::vector<std::uint32_t>& order);
    ColourTreeArrays arrays_;
    Search search_;
    Tighten tighten_;
    std::vector<std::uint32_t> pixels_;  ///< raster indices by colour, ascending
    std::vector<Queue> queues_;          ///< by slot
    std::size_t left_ = 0;
    bool noting_ = false;
    std::vector<std::uint32_t> changes_;
    std::vector<bool> noted_;  ///< by slot
};

/// The searches and updates that this processor can run, widest instruction set first. They agree to the bit.
[[nodiscard]] std::vector<ColourTree::Search> colour_searches(Metric metric, int planes);
[[nodiscard]] std::vector<ColourTree::Tighten> box_updates();

}  // namespace btfield::detail

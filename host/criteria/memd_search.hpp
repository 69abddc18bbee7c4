#pragma once

// The greedy loop of MEMD: candidates from the device in blocks, one pixel after the other on the host.

#include <algorithm>
#include <functional>

#include "host/cl/device_impl.hpp"
#include "host/criteria/colour_tree.hpp"

namespace btfield::detail {

/// How the search is cut up; no choice changes a result.
struct MemdBlocks {
    int candidates = 2;          ///< for each pixel of A; 2 measured best on 2 cores
    std::size_t smallest = 512;  ///< pixels of a block
    std::size_t largest = 8192;
    std::size_t parts = 48;          ///< a block takes at most this part of B's pixels that are left
    std::size_t device_from = 8192;  ///< fewer pixels are not worth a launch
    /// Share of pixels whose candidates were all gone from which the host goes on alone.
    double hopeless = 0.5;
    bool exhaustive = false;  ///< candidates from all colours of B instead of the tree
};

/// What MemdSearch::automatic stands for; others stand for themselves. On a GPU, comparing with up to this
/// many colours is a matter of microseconds per block without a divergent branch; no GPU has been measured,
/// so the limit is low.
inline constexpr std::size_t exhaustive_colours = 4096;
[[nodiscard]] MemdSearch chosen_search(const DeviceImpl& device, MemdSearch asked, std::size_t pixels,
                                       std::size_t colours);

/// Takes min(#A, #B) pixels out of the tree in raster order of A.
/// \param error called with (pixel of A, key of the pixel it takes) in that order
template <class Error>
void take_all(const Colours& a, ColourTree& tree, const Error& error) {
    const std::size_t count = std::min(a.pixels(), tree.left());
    for (std::size_t pixel = 0; pixel < count; ++pixel) {
        const ColourTree::Hit hit = tree.nearest(a.at(pixel));
        tree.take(hit.slot);
        error(pixel, hit.key);
    }
}

/// The same with candidates from the device.
/// \return how many pixels were searched for on the host
std::size_t take_all(DeviceImpl& device, const Colours& a, const Buffer& device_a, ColourTree& tree,
                     Metric metric, const MemdBlocks& blocks,
                     const std::function<void(std::size_t, ColourKey)>& error);

}  // namespace btfield::detail

#pragma once

// The greedy loop of MEMD: candidates from the device in blocks, one pixel after the other on the host.

#include <algorithm>
#include <functional>

#include "host/cl/device_impl.hpp"
#include "host/criteria/colour_tree.hpp"

namespace btfield::detail {

/// What MemdSearch::automatic stands for; others stand for themselves.
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

/// The same with candidates from the device, block by block.
/// \return how many pixels were searched for on the host
std::size_t take_all(DeviceImpl& device, const Colours& a, const Buffer& device_a, ColourTree& tree,
                     Metric metric, const MemdBlocks& blocks,
                     const std::function<void(std::size_t, ColourKey)>& error);

}  // namespace btfield::detail

#include "host/criteria/memd_search.hpp"

#include <algorithm>
#include <bit>
#include <optional>
#include <span>
#include <utility>
#include <vector>

namespace btfield::detail {
namespace {

using std::size_t;

/// Blocks of colours that fit into local memory, up to as many as wanted.
int fitting_tile(const DeviceImpl& device, int wanted, size_t block_bytes) {
    while (wanted > 0 && static_cast<size_t>(wanted) * block_bytes > device.local_memory()) wanted /= 2;
    return wanted;
}

/// The colours on the device, brought up to date between blocks, and the candidates of one block.
class DeviceColours {
  public:
    DeviceColours(DeviceImpl& device, ColourTree& tree, Metric metric, const MemdBlocks& blocks)
        : device_(&device), tree_(&tree), k_(static_cast<size_t>(blocks.candidates)) {
        const ColourTreeArrays& arrays = tree.arrays();
        points_ = upload(arrays.points);
        first_ = upload(arrays.first);
        const size_t results = blocks.largest * k_;
        distances_ = device.buffer(results * sizeof(float));
        rasters_ = device.buffer(results * sizeof(std::uint32_t));
        slots_ = device.buffer(results * sizeof(std::uint32_t));
        const size_t block_bytes = sizeof(float) * ColourTree::lanes * static_cast<size_t>(arrays.planes);
        const int tile = fitting_tile(device, blocks.tile, block_bytes);
        tile_bytes_ = tile > 0 ? static_cast<size_t>(tile) * block_bytes : sizeof(float);
        parameters_ = device.lanes();
        parameters_.set("BTFIELD_PLANES", arrays.planes)
            .set("BTFIELD_METRIC", static_cast<int>(metric))
            .set("BTFIELD_CANDIDATES", blocks.candidates)
            .set("BTFIELD_TILE", tile);
        tree.clear_changes();
    }

    /// Begins the search for pixels [begin, begin + count) among what was left at the last update().
    void begin(const Buffer& a, size_t begin, size_t count) {
        const auto width = static_cast<size_t>(device_->vector_width());
        const auto blocks = static_cast<std::uint32_t>(tree_->arrays().first.size() / ColourTree::lanes);
        // Of every pixel with every colour and each plane: difference, magnitude, sum; then the lesser.
        const auto d = static_cast<double>(tree_->arrays().planes);
        const double pairs = static_cast<double>(count) * blocks * ColourTree::lanes;
        const LaunchWork work{.bytes = static_cast<double>(points_.bytes() + count * sizeof(float)),
                              .operations = pairs * (3.0 * d + 1.0)};
        device_->launch(device_->kernel("memd_search", "nearest_candidates", parameters_),
                        {(count + width - 1) / width}, Grain::fine, work, a,
                        static_cast<std::uint32_t>(begin), static_cast<std::uint32_t>(count), points_, first_,
                        blocks, distances_, rasters_, slots_, LocalMemory{tile_bytes_});
        device_->flush();
        count_ = count;
    }

    struct Candidates {
        std::vector<float> distances;
        std::vector<std::uint32_t> rasters, slots;
    };
    /// Waits for the search.
    void end(Candidates& out) {
        const size_t results = count_ * k_;
        out.distances.resize(results);
        out.rasters.resize(results);
        out.slots.resize(results);
        device_->read(distances_, out.distances.data(), results * sizeof(float));
        device_->read(rasters_, out.rasters.data(), results * sizeof(std::uint32_t));
        device_->read(slots_, out.slots.data(), results * sizeof(std::uint32_t));
    }

    void update() {
        const std::vector<std::uint32_t>& slots = tree_->changes();
        if (slots.empty()) return;
        const ColourTreeArrays& arrays = tree_->arrays();
        const auto d = static_cast<size_t>(arrays.planes);
        std::vector<float> values;
        std::vector<std::uint32_t> rasters;
        values.reserve(slots.size() * d);
        rasters.reserve(slots.size());
        for (const std::uint32_t slot : slots) {
            for (size_t i = 0; i < d; ++i)
                values.push_back(arrays.points[(slot / ColourTree::lanes * d + i) * ColourTree::lanes +
                                               slot % ColourTree::lanes]);
            rasters.push_back(arrays.first[slot]);
        }
        const Buffer device_slots = device_->upload(slots), device_values = device_->upload(values),
                     device_rasters = device_->upload(rasters);
        device_->launch(device_->kernel("memd_search", "update_colours", parameters_), {slots.size()},
                        Grain::fine, points_, first_, device_slots, device_values, device_rasters,
                        static_cast<std::uint32_t>(slots.size()));
        tree_->clear_changes();
        device_->finish();  // the pool may lend the three buffers again
    }

  private:
    template <class T>
    Buffer upload(const Lines<T>& values) {
        return device_->upload(std::span<const T>(values));
    }

    DeviceImpl* device_;
    ColourTree* tree_;
    size_t k_;
    Buffer points_, first_, distances_, rasters_, slots_;
    size_t tile_bytes_ = 0;
    BuildParameters parameters_;
    size_t count_ = 0;
};

ColourKey key_of(float distance, std::uint32_t raster) {
    return static_cast<ColourKey>(std::bit_cast<std::uint32_t>(distance)) << 32 | raster;
}

/// The nearest of a pixel's k candidates that is left, if nothing outside the list can be nearer. Keys only
/// grow as pixels are taken: what was not in the list came after its last key, and still does.
std::optional<ColourTree::Hit> proven(const ColourTree& tree, const float* distances,
                                      const std::uint32_t* rasters, const std::uint32_t* slots, size_t k) {
    ColourTree::Hit best;
    for (size_t i = 0; i < k && slots[i] != ColourTree::none; ++i) {
        const std::uint32_t raster = tree.first(slots[i]);
        if (raster == ColourTree::none) continue;
        const ColourKey key = key_of(distances[i], raster);
        if (key < best.key) best = {key, slots[i]};
    }
    const ColourKey last =
        slots[k - 1] == ColourTree::none ? no_colour : key_of(distances[k - 1], rasters[k - 1]);
    if (best.slot == ColourTree::none || best.key > last) return std::nullopt;
    return best;
}

}  // namespace

MemdSearch chosen_search(const DeviceImpl& device, MemdSearch asked, std::size_t pixels,
                         std::size_t colours) {
    if (asked != MemdSearch::automatic) return asked;
    const Tuning& tuning = device.tuning();
    return pixels >= tuning.memd_pixels && colours <= tuning.memd_colours ? MemdSearch::exhaustive
                                                                          : MemdSearch::host_tree;
}

std::size_t take_all(DeviceImpl& device, const Colours& a, const Buffer& device_a, ColourTree& tree,
                     Metric metric, const MemdBlocks& blocks,
                     const std::function<void(std::size_t, ColourKey)>& error) {
    const size_t count = std::min(a.pixels(), tree.left());
    const auto k = static_cast<size_t>(blocks.candidates);
    size_t searched = 0;
    const auto take = [&](size_t pixel, const ColourTree::Hit& hit) {
        tree.take(hit.slot);
        error(pixel, hit.key);
    };
    const auto search = [&](size_t pixel) {
        ++searched;
        take(pixel, tree.nearest(a.at(pixel)));
    };
    size_t done = 0;
    DeviceColours on_device(device, tree, metric, blocks);
    DeviceColours::Candidates candidates;
    const auto length = [&](size_t begin) {
        return std::min(std::clamp(tree.left() / blocks.parts, blocks.smallest, blocks.largest),
                        count - begin);
    };
    size_t size = length(0);
    on_device.begin(device_a, 0, size);
    while (size > 0) {
        // The device searches the next block while the host resolves this one.
        on_device.end(candidates);
        on_device.update();
        const size_t next = done + size;
        const size_t next_size = length(next);
        if (next_size > 0) on_device.begin(device_a, next, next_size);
        const size_t before = searched;
        for (size_t n = 0; n < size; ++n) {
            const auto hit = proven(tree, candidates.distances.data() + n * k,
                                    candidates.rasters.data() + n * k, candidates.slots.data() + n * k, k);
            if (hit) {
                take(done + n, *hit);
            } else {
                search(done + n);
            }
        }
        done = next;
        if (static_cast<double>(searched - before) > blocks.hopeless * static_cast<double>(size)) {
            device.finish();
            break;
        }
        size = next_size;
    }
    for (; done < count; ++done) search(done);
    return searched;
}

}  // namespace btfield::detail

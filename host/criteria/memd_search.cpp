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

/// The tree on the device, brought up to date between blocks, and the candidates of one block.
class DeviceTree {
  public:
    DeviceTree(DeviceImpl& device, ColourTree& tree, Metric metric, const MemdBlocks& blocks)
        : device_(&device), tree_(&tree), blocks_(blocks), k_(static_cast<size_t>(blocks.candidates)) {
        const ColourTreeArrays& arrays = tree.arrays();
        points_ = upload(arrays.points);
        first_ = upload(arrays.first);
        if (!blocks.exhaustive) {
            // OpenCL has no empty buffers; a tree of one block has no boxes.
            boxes_ = arrays.boxes.empty() ? device.buffer(sizeof(float)) : upload(arrays.boxes);
            lowest_ = arrays.lowest.empty() ? device.buffer(sizeof(float)) : upload(arrays.lowest);
            const std::vector<std::uint32_t> begin(arrays.level_begin.begin(), arrays.level_begin.end());
            level_begin_ = device.upload(begin);
        }
        const size_t results = blocks.largest * k_;
        distances_ = device.buffer(results * sizeof(float));
        rasters_ = device.buffer(results * sizeof(std::uint32_t));
        slots_ = device.buffer(results * sizeof(std::uint32_t));
        parameters_ = device.lanes();
        parameters_.set("BTFIELD_PLANES", arrays.planes)
            .set("BTFIELD_METRIC", static_cast<int>(metric))
            .set("BTFIELD_CANDIDATES", blocks.candidates);
        tree.clear_changes();
    }

    /// Begins the search for pixels [begin, begin + count) among what was left at the last update().
    void begin(const Buffer& a, size_t begin, size_t count) {
        const auto from = static_cast<cl_uint>(begin), pixels = static_cast<cl_uint>(count);
        if (blocks_.exhaustive) {
            const auto width = static_cast<size_t>(device_->vector_width());
            device_->launch(device_->kernel("exhaustive_pixel", "exhaustive_candidates", parameters_),
                            {(count + width - 1) / width}, Grain::fine, a, from, pixels, points_, first_,
                            static_cast<cl_uint>(tree_->arrays().first.size() / ColourTree::lanes),
                            distances_, rasters_, slots_);
        } else {
            device_->launch(device_->kernel("nearest_pixel", "nearest_candidates", parameters_), {count},
                            Grain::fine, a, from, pixels, points_, first_, boxes_, lowest_, level_begin_,
                            tree_->arrays().levels(), distances_, rasters_, slots_);
        }
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
        const ColourTreeArrays& arrays = tree_->arrays();
        const auto d = static_cast<size_t>(arrays.planes);
        const ColourTree::Changes& changes = tree_->changes();
        update(points_, first_, changes.points, arrays.points, arrays.first, d);
        if (!blocks_.exhaustive) update(boxes_, lowest_, changes.boxes, arrays.boxes, arrays.lowest, 2 * d);
        tree_->clear_changes();
    }

  private:
    template <class T>
    Buffer upload(const Lines<T>& values) {
        return device_->upload(std::span<const T>(values));
    }

    void update(const Buffer& fields, const Buffer& rasters, const std::vector<std::uint32_t>& slots,
                const Lines<float>& from, const Lines<std::uint32_t>& from_rasters, size_t per_slot) {
        if (slots.empty()) return;
        constexpr size_t lanes = ColourTree::lanes;
        std::vector<float> values;
        std::vector<std::uint32_t> new_rasters;
        values.reserve(slots.size() * per_slot);
        new_rasters.reserve(slots.size());
        for (const std::uint32_t slot : slots) {
            for (size_t f = 0; f < per_slot; ++f)
                values.push_back(from[(slot / lanes * per_slot + f) * lanes + slot % lanes]);
            new_rasters.push_back(from_rasters[slot]);
        }
        const Buffer device_slots = device_->upload(slots), device_values = device_->upload(values),
                     device_rasters = device_->upload(new_rasters);
        device_->launch(device_->kernel("nearest_pixel", "update_slots", parameters_), {slots.size()},
                        Grain::fine, fields, rasters, device_slots, device_values, device_rasters,
                        static_cast<cl_uint>(slots.size()), static_cast<cl_int>(per_slot));
        device_->finish();  // the pool may lend the three buffers again
    }

    DeviceImpl* device_;
    ColourTree* tree_;
    MemdBlocks blocks_;
    size_t k_;
    Buffer points_, first_, boxes_, lowest_, level_begin_, distances_, rasters_, slots_;
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
    if (device.is_cpu() || pixels < MemdBlocks{}.device_from) return MemdSearch::host_tree;
    return colours <= exhaustive_colours ? MemdSearch::exhaustive : MemdSearch::device_tree;
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
    if (count >= blocks.device_from) {
        DeviceTree on_device(device, tree, metric, blocks);
        DeviceTree::Candidates candidates;
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
                const auto hit =
                    proven(tree, candidates.distances.data() + n * k, candidates.rasters.data() + n * k,
                           candidates.slots.data() + n * k, k);
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
    }
    for (; done < count; ++done) search(done);
    return searched;
}

}  // namespace btfield::detail

#include "btfield/roller.hpp"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "btfield/error.hpp"
#include "host/base/text.hpp"
#include "host/base/work_part.hpp"
#include "host/roller/block_search.hpp"
#include "host/roller/features.hpp"
#include "host/roller/quilt.hpp"
#include "host/roller/tile.hpp"

namespace btfield {

using namespace detail;

namespace {

void check(std::optional<Size> size, const RollerOptions& options, const std::string& asked) {
    if (size && std::min(size->height, size->width) < smallest_rolled_side)
        throw InputError(asked, "a side is below " + counted(smallest_rolled_side, "pixel"),
                         "ask for a larger one");
    if (!(options.tolerance >= 0.0) || !std::isfinite(options.tolerance))
        throw InputError(asked, "the tolerance is no number from 0 on", "give one, such as 0.1");
}

int shorter(Size size) {
    return std::min(size.height, size.width);
}

}  // namespace

Image apply(const SourceMap& map, const Image& picture) {
    if (picture.size() != map.sample)
        throw InputError("roll a picture of " + text_of(picture.size()) + " pixels",
                         "the sample that was cut is " + text_of(map.sample) + " pixels",
                         "give a picture that lies on the sample pixel by pixel");
    Image result(map.size, picture.planes(), picture.space());
    result.set_names(picture.names());
    result.set_plane_spaces(picture.plane_spaces());
    for (int p = 0; p < picture.planes(); ++p) {
        const std::span<const float> from = picture.plane(p);
        const std::span<float> to = result.plane(p);
        for (std::size_t i = 0; i < to.size(); ++i) to[i] = from[map.source[i]];
    }
    return result;
}

class Roller::Impl {
  public:
    Impl(Device& device, std::span<const Image> sample)
        : features(features_of(sample)), search(device.impl(), features) {}

    Features features;
    BlockSearch search;
};

Roller::Roller(Device& device, std::span<const Image> sample)
    : impl_(std::make_unique<Impl>(device, sample)) {}
Roller::~Roller() = default;
Roller::Roller(Roller&&) noexcept = default;
Roller& Roller::operator=(Roller&&) noexcept = default;

SourceMap Roller::quilt(Size size, const RollerOptions& options) {
    const std::string asked = "roll a quilt of " + text_of(size);
    check(size, options, asked);
    const int block = options.block ? *options.block : default_block();
    const Size sample = impl_->features.size;
    if (block < smallest_block || block > shorter(sample))
        throw InputError(
            asked, "patches of " + counted(block, "pixel") + " out of a sample of " + text_of(sample),
            "give a block from " + std::to_string(smallest_block) + " to the sample's shorter side");
    const int overlap = options.overlap.value_or(block / 4);
    if (overlap < 2 || overlap > block / 2)
        throw InputError(
            asked,
            "an overlap of " + counted(overlap, "pixel") + " between patches of " + std::to_string(block),
            "give one from 2 to half of the patches' side");
    const Stage stage("quilt");
    return make_quilt(impl_->features, impl_->search, size, block, overlap, options);
}

SourceMap Roller::tile(std::optional<Size> size, const RollerOptions& options) {
    return std::move(tiles(1, size, options).front());
}

std::vector<SourceMap> Roller::tiles(int count, std::optional<Size> size, const RollerOptions& options) {
    const std::string asked = size ? "roll a tile of " + text_of(*size) : "roll a tile";
    check(size, options, asked);
    if (count < 1) throw InputError(asked, std::to_string(count) + " are asked for", "ask for 1 or more");
    const int side = shorter(size.value_or(impl_->features.size));
    const int overlap = options.overlap.value_or(std::max(2, side / (size ? 8 : 12)));
    if (overlap < 2 || overlap > side / 2)
        throw InputError(asked, "an overlap of " + counted(overlap, "pixel"),
                         "give one from 2 to half of the tile's shorter side");
    const Stage stage("tile");
    return make_tiles(impl_->features, impl_->search, count, size, overlap, options.seed, options.tolerance,
                      asked);
}

Size Roller::sample_size() const {
    return impl_->features.size;
}

int Roller::default_block() const {
    return usual_block_of(impl_->features);
}

}  // namespace btfield

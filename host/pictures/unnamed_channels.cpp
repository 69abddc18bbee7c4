#include "host/pictures/unnamed_channels.hpp"

#include <algorithm>
#include <utility>
#include <vector>

#include "host/pictures/channels.hpp"
#include "host/pictures/orientation.hpp"
#include "host/pictures/picture_format.hpp"

namespace btfield::detail {

void understand_unnamed(Picture& picture, int channels, int alpha, const Surroundings& around,
                        const ReadOptions& options, const std::string& asked) {
    const auto said = said_spaces(around.description, picture.image.planes());
    if (picture.image.planes() == 1)
        picture.image.set_plane_spaces(said.value_or(std::vector{ColourSpace::srgb}));
    if (!said) apply_meaning(picture, around.meaning, options.keep_values);
    if (!around.remark.empty()) picture.remarks.push_back(around.remark);
    if (around.exif.from_xmp) picture.remarks.emplace_back(xmp_orientation_remark);
    make_upright(picture, Orientation(around.exif.orientation));
    if (options.planes.empty()) return;
    const ChannelPlan plan = plan_channels(channel_names(channels), options.planes, alpha, asked);
    const bool wanted = std::ranges::any_of(plan.planes, [&](int c) { return c >= picture.image.planes(); });
    if (wanted && !picture.alpha.empty()) {
        Image with(picture.image.size(), picture.image.planes() + 1);
        std::ranges::copy(picture.image.values(), with.values().begin());
        std::ranges::copy(picture.alpha, with.plane(picture.image.planes()).begin());
        picture.image = std::move(with);
        picture.alpha.clear();
    }
    keep_planes(picture, plan);
}

}  // namespace btfield::detail

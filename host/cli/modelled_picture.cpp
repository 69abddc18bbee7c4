#include "host/cli/modelled_picture.hpp"

#include <algorithm>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

namespace btfield::cli {

Provenance provenance_of(const std::filesystem::path& path, const Picture& picture) {
    Provenance result;
    result.source = path.filename().string();
    result.type = picture.type;
    result.picture_bytes = static_cast<std::uint64_t>(picture.image.values().size()) *
                           static_cast<std::uint64_t>(bytes_per_value(picture.type));
    result.software = "btfield " BTFIELD_VERSION;
    result.chromaticities = picture.chromaticities;
    result.file_bytes = picture.file_bytes;
    std::vector<PlaneLimits> limits = plane_limits(picture.image);
    const auto reached = [](PlaneLimits own) { return own.low || own.high; };
    if (std::ranges::any_of(limits, reached)) result.limits = std::move(limits);
    return result;
}

}  // namespace btfield::cli

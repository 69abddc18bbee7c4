#pragma once

// Control fields of any size, by the roller (theory 18.2; P1 2.1).

#include <cstdint>
#include <functional>
#include <optional>

#include "btfield/compound.hpp"
#include "btfield/device.hpp"
#include "host/roller/block_search.hpp"

namespace btfield::detail {

/// A roller's tile of the field: cut where the conditional mean of the picture shows it least.
/// \param mean of the picture that the field is of
/// \throws InputError as Roller::tile()
[[nodiscard]] ControlField control_tile(Device& device, const ControlField& field, const Image& mean,
                                        Size size);

class ControlGrowth {
  public:
    ControlGrowth(Device& device, const CompoundModel& model);
    // The search points to its features.
    ControlGrowth(const ControlGrowth&) = delete;
    ControlGrowth& operator=(const ControlGrowth&) = delete;

    /// A quilt, or of a few that of the sample's shares of regions: P1's figure is 3 % (theory 18.2).
    /// \param size     sides of at least 16
    /// \param progress told what share is done at least: half of what is left with every quilt, 1 at the end
    [[nodiscard]] ControlField grow(Size size, std::uint64_t seed,
                                    const std::function<void(double)>& progress = {});

  private:
    /// Sets up the search at 1 / scale of the resolution.
    void compare(Device& device, const Image& look, int scale);
    [[nodiscard]] ControlField rolled(Size size, std::uint64_t seed,
                                      const std::function<void(double)>& progress);

    ControlField sample_;  ///< a tile is continued beyond its edges
    int scale_ = 1;        ///< pixels of the sample to one of `compared_`, along each side
    int block_ = 0;        ///< the roller's own choice, pixels of the sample
    Features compared_;    ///< what patches are found by
    Features cut_;         ///< what they are cut by, the sample's size; none where `compared_` has that
    std::optional<BlockSearch> search_;  ///< none of a single region
};

}  // namespace btfield::detail

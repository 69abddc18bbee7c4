#pragma once

/// \file
/// The roller (theory 17; P1 2.1, P3 2.1): texture of any size from a sample's own pixels, patches of it laid
/// on a torus such that they overlap, and cut where they differ least.

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "btfield/api.hpp"
#include "btfield/device.hpp"
#include "btfield/image.hpp"

namespace btfield {

/// A texture on the torus as a choice among a sample's pixels.
struct BTFIELD_API SourceMap {
    Size size;
    Size sample;
    /// [row][column]: row · sample.width + column of the sample's pixel
    std::vector<std::uint32_t> source;
    /// Mean squared difference of the two patches at the pixels along the cuts, over the sample's variance,
    /// as the Roller saw it; 0 without a cut.
    double cut_cost = 0.0;
    /// Mean distance of colours across cuts, the wrap included, over the mean distance of neighbours inside
    /// of patches; 1 where a cut does not show, 0 without a cut.
    double seam = 0.0;
};

/// The pixels of `picture`, any picture registered with the sample, as they are: none is resampled.
/// \throws InputError when it has another size than the sample
[[nodiscard]] BTFIELD_API Image apply(const SourceMap& map, const Image& picture);

struct RollerOptions {
    std::uint64_t seed = 0;
    /// Side of a quilt's patches in pixels, at least 8; without one, a few times the distance over which the
    /// sample is correlated.
    std::optional<int> block;
    /// Pixels over which neighbours are compared and cut, at least 2 and at most half a block; without one, a
    /// quarter of the block.
    std::optional<int> overlap;
    /// Patches are drawn among those whose squared difference to what lies there is at most this much larger,
    /// relatively, than the least.
    double tolerance = 0.1;
    /// Called by quilt() now and then with the share of the patches that are laid, in the caller's thread;
    /// what it throws ends the work.
    std::function<void(double)> progress;
};

/// Cuts one sample. Patches are compared on the planes of all its pictures, in integers of 11 bits: a choice
/// is the same on every device. Variances of pictures, and of unlike kinds of planes in one (theory 3),
/// count alike. Any number of threads may roll at a time; they take turns at the search.
class BTFIELD_API Roller {
  public:
    /// \param sample pictures of one size, registered: colour, height, labels, ...
    /// \param device outlives the Roller
    /// \throws InputError when there is none, their sizes differ, a value is not finite, a side is below 16
    ///     or above 16384, or every plane is constant
    Roller(Device& device, std::span<const Image> sample);
    ~Roller();
    Roller(Roller&&) noexcept;
    Roller& operator=(Roller&&) noexcept;

    /// Patches on a torus of this size: each found among all of the sample's positions, but for those that
    /// would only go on with a neighbour.
    /// \throws InputError when a side is below 16, or options cannot be met: the message says which
    [[nodiscard]] SourceMap quilt(Size size, const RollerOptions& options = {});

    /// The patch of the sample whose opposite borders fit best when they overlap. Without a size, one from
    /// three quarters of what the sample holds on, or from eight times the distance over which it is
    /// correlated where that is more.
    /// \throws InputError when the sample does not hold the size and an overlap
    [[nodiscard]] SourceMap tile(std::optional<Size> size = {}, const RollerOptions& options = {});

    /// `count` tiles of one size with the same borders, so that any may lie beside any: the first is a tile()
    /// of at most half of the sample's sides, unless a size is given, the others have other insides.
    /// \throws InputError as tile() does, or when count < 1
    [[nodiscard]] std::vector<SourceMap> tiles(int count, std::optional<Size> size = {},
                                               const RollerOptions& options = {});

    [[nodiscard]] Size sample_size() const;
    /// The block that quilt() takes without one.
    [[nodiscard]] int default_block() const;

  private:
    class Impl;
    std::unique_ptr<Impl> impl_;
};

}  // namespace btfield

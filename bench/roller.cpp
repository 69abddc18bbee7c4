#include "btfield/roller.hpp"

#include <cmath>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "bench/cases.hpp"
#include "bench/peers/roller.hpp"
#include "bench/report.hpp"

namespace btfield::bench {
namespace {

constexpr Size sample_size{512, 512};

struct Sample {
    Image picture = bench::picture(sample_size);
    Roller roller{device(), std::span(&picture, 1)};
};

/// Steps of a quilt, the wrap included, between pixels that are not neighbours in the sample.
struct Cuts {
    double steps = 0.0;
    double squared_difference = 0.0;  ///< mean
};

Cuts cuts(const Image& picture, const std::vector<std::uint32_t>& source, Size size) {
    Cuts result;
    const auto width = static_cast<std::uint32_t>(picture.width());
    const auto at = [&](int r, int c) {
        return source[static_cast<std::size_t>(r % size.height) * static_cast<std::size_t>(size.width) +
                      static_cast<std::size_t>(c % size.width)];
    };
    const auto add_step = [&](std::uint32_t a, std::uint32_t b) {
        result.steps += 1.0;
        for (int p = 0; p < picture.planes(); ++p) {
            const auto difference = static_cast<double>(picture.plane(p)[a] - picture.plane(p)[b]);
            result.squared_difference += difference * difference;
        }
    };
    for (int r = 0; r < size.height; ++r)
        for (int c = 0; c < size.width; ++c) {
            const std::uint32_t a = at(r, c), right = at(r, c + 1), below = at(r + 1, c);
            if (right != a + 1 || right % width == 0) add_step(a, right);
            if (below != a + width) add_step(a, below);
        }
    result.squared_difference /= result.steps;
    return result;
}

RollerOptions options_of(int block, int overlap) {
    RollerOptions options;
    options.block = block;
    options.overlap = overlap;
    return options;
}

/// Both draw at random: their quilts are alike in what their cuts cost and in how many there are.
void check_peer(Size size, int block, int overlap) {
    Sample sample;
    const SourceMap here = sample.roller.quilt(size, options_of(block, overlap));
    const std::vector<std::uint32_t> there = peer::Roller(sample.picture, block, overlap).quilt(size, 0);
    must_agree(static_cast<double>(area(size)), static_cast<double>(there.size()), 0.0, "pixels of a quilt");
    double outside = 0.0;
    for (const std::uint32_t pixel : there) outside += pixel < area(sample_size) ? 0.0 : 1.0;
    must_agree(0.0, outside, 0.0, "pixels from outside of the sample");
    const Cuts ours = cuts(sample.picture, here.source, size), its = cuts(sample.picture, there, size);
    constexpr double factor_of_two = 1.0;
    must_agree(std::log2(ours.squared_difference), std::log2(its.squared_difference), factor_of_two,
               "log2 of the squared difference across cuts");
    must_agree(std::log2(ours.steps), std::log2(its.steps), factor_of_two, "log2 of the steps across cuts");
}

void add_quilt(const std::string& name, int side, int block, int overlap, bool with_peer) {
    const Size size{side, side};
    const Work work{.items = static_cast<double>(area(size))};
    add(name, [=] {
        const auto sample = std::make_shared<Sample>();
        const RollerOptions options = options_of(block, overlap);
        return std::pair(work, std::function<void()>([sample, size, options] {
                             benchmark::DoNotOptimize(sample->roller.quilt(size, options).source.data());
                         }));
    });
    if (!with_peer) return;
    add(name + peer_suffix, [=] {
        check_peer(size, block, overlap);
        const auto roller = std::make_shared<peer::Roller>(picture(sample_size), block, overlap);
        return std::pair(work, std::function<void()>([roller, size] {
                             benchmark::DoNotOptimize(roller->quilt(size, 0).data());
                         }));
    });
}

}  // namespace

void add_roller() {
    add_quilt("roller quilt 1024 of 512 rgb", 1024, 96, 24, true);
    add_quilt("roller quilt 1024 of 512 rgb, blocks of 64", 1024, 64, 16, true);
    add_quilt("roller quilt 2048 of 512 rgb", 2048, 96, 24, false);
    add("roller tile of 512 rgb", [] {
        const auto sample = std::make_shared<Sample>();
        // Without a size, the tile is as large as fits best: the same one each time.
        const Work work{.items = static_cast<double>(area(sample->roller.tile().size))};
        return std::pair(work, std::function<void()>([sample] {
                             benchmark::DoNotOptimize(sample->roller.tile().source.data());
                         }));
    });
}

}  // namespace btfield::bench

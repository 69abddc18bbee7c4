#include "host/synthesis/synthesis_layout.hpp"

#include <algorithm>
#include <utility>

#include "btfield/error.hpp"
#include "btfield/pyramid.hpp"
#include "host/analysis/pyramid_stages.hpp"
#include "host/base/text.hpp"
#include "host/cl/fft.hpp"

namespace btfield::detail {
namespace {

using std::size_t;

constexpr int largest_side = 1 << 20;

/// n^(K−1): what a tileable side is a multiple of. 0 when it exceeds every possible side.
int coarsest_step(const TextureModel& model) {
    long long step = 1;
    for (size_t k = 1; k < model.levels.size(); ++k) {
        step *= model.factor;
        if (step > (1 << 24)) return 0;
    }
    return static_cast<int>(step);
}

/// The smallest side of at least this whose coarsest level suits the FFT.
int torus_side(int side, int step) {
    return step * next_fft_size((side + step - 1) / step);
}

/// Expanding a level wraps its edges, which do not continue each other when a recursion made them. A weight
/// reaches n pixels to both sides: where m pixels of the coarser level are spoilt, the next has n·m + 1 at
/// its beginning and n·m + n at its end.
struct SpoiltByWrapping {
    int first, last;
    SpoiltByWrapping(int factor, int step)
        : first((step - 1) / (factor - 1)), last(factor * ((step - 1) / (factor - 1))) {}
};

}  // namespace

SynthesisLayout::SynthesisLayout(const TextureModel& model, Size wanted, std::vector<LevelRoute> level_routes,
                                 std::vector<RecursionMargins> level_margins)
    : size(wanted), routes(std::move(level_routes)), margins(std::move(level_margins)) {
    const int step = coarsest_step(model);
    if (step == 0 || size.height > largest_side || size.width > largest_side)
        throw InputError("synthesise " + compact_text_of(size),
                         "sides are limited to " + std::to_string(largest_side), "give a smaller size");
    const bool recursive = routes.front() == LevelRoute::recursion;
    if (recursive) {
        const SpoiltByWrapping spoilt(model.factor, step);
        crop = {spoilt.first, spoilt.first};
        const auto side = [&](int n) { return step * ((n + spoilt.first + spoilt.last + step - 1) / step); };
        lattice = {side(size.height), side(size.width)};
    } else {
        lattice = {torus_side(size.height, step), torus_side(size.width, step)};
    }
    sizes = pyramid_sizes(lattice, static_cast<int>(model.levels.size()), model.factor);
    for (const Size& s : sizes)
        transforms.push_back(recursive ? s : Size{next_fft_size(s.height), next_fft_size(s.width)});
    for (size_t k = 0; k < routes.size(); ++k) {
        const bool transformed = routes[k] == LevelRoute::spectrum || routes[k] == LevelRoute::transfer;
        if (!transformed || std::max(transforms[k].height, transforms[k].width) <= fft_longest_side) continue;
        throw InputError("synthesise " + compact_text_of(size),
                         "its torus has a side above " + std::to_string(fft_longest_side) +
                             " pixels, which cannot be transformed",
                         "give a smaller size (windows: a smaller period); causal models also grow by raster "
                         "recursion, which has no such limit");
    }
}

SynthesisLayout SynthesisLayout::resized(const TextureModel& model, Size other) const {
    return {model, other, routes, margins};
}

bool SynthesisLayout::tiles() const {
    return routes.front() != LevelRoute::recursion && lattice == size && transforms == sizes;
}

double SynthesisLayout::domain(size_t level) const {
    const Size s = sizes[level];
    const RecursionMargins& m = margins[level];
    return static_cast<double>(s.height + m.top) * static_cast<double>(s.width + m.left + m.right);
}

double SynthesisLayout::bytes(int planes, bool packed) const {
    // What a level takes until it is done. Coarser levels take less, and their memory is used again.
    const Size t = transforms.front();
    const auto count = static_cast<double>(planes), pixels = static_cast<double>(area(t));
    const auto half = static_cast<double>(spectrum_floats(t, 1));
    constexpr double room = static_cast<double>(fft_packed_room) / sizeof(float);
    double floats = count * pixels;
    switch (routes.front()) {
        case LevelRoute::spectrum:
            // Both parts of the spectrum, in the image's memory or their own; then room for the transform.
            floats = packed ? 2.0 * half * count + std::min(2.0 * half * count, std::max(2.0 * half, room))
                            : floats + 4.0 * half * count;
            break;
        case LevelRoute::transfer:
            floats += 4.0 * half * count;
            break;
        case LevelRoute::convolution:
            floats += count * pixels;  // the noise
            break;
        case LevelRoute::recursion:
            floats += count * domain(0);
            break;
    }
    double bytes = sizeof(float) * floats;
    // The coarser levels' sum, and where it is added to what is cropped.
    if (sizes.size() > 1) bytes += sizeof(float) * count * static_cast<double>(area(transforms[1]));
    if (sizes.size() > 1 && t != sizes.front())
        bytes += sizeof(float) * count * static_cast<double>(area(sizes.front()));
    return bytes;
}

double SynthesisLayout::largest(int planes, bool packed) const {
    const auto half = static_cast<double>(spectrum_floats(transforms.front(), 1));
    double floats = static_cast<double>(area(transforms.front()));
    if (routes.front() == LevelRoute::recursion)
        floats = domain(0);
    else if (routes.front() != LevelRoute::convolution)
        floats = std::max(floats, packed && routes.front() == LevelRoute::spectrum ? 2.0 * half : half);
    return sizeof(float) * static_cast<double>(planes) * floats;
}

}  // namespace btfield::detail

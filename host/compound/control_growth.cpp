#include "host/compound/control_growth.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <utility>
#include <vector>

#include "btfield/error.hpp"
#include "btfield/spectral_basis.hpp"
#include "host/base/text.hpp"
#include "host/cl/device_impl.hpp"
#include "host/compound/conditional_mean.hpp"
#include "host/roller/features.hpp"
#include "host/roller/quilt.hpp"

namespace btfield::detail {
namespace {

using std::size_t;

/// The roller looks for patches at half resolution where this many pixels remain on a side, which takes a
/// quarter of the time; cuts follow at full resolution, as steps of some pixels show. Of large structures a
/// quarter of the resolution is as good (patch distances of textures: bark 0.053 for 0.050, rock 0.067 for
/// 0.062, moss 0.085 for 0.096), of small ones it is not (gravel 0.053 for 0.044, sand 0.058 for 0.043).
constexpr int smallest_reduced_side = 128;
/// Directions of colour with less than this share of the variance do not decide where cuts run.
constexpr double smallest_compared_share = 0.05;
/// Where the roller would take larger patches, structures are so large that few of these fit: those of 64
/// pixels come more evenly, which keeps shares and shapes better (of 64, 80, 96, 128, 192 and 256 pixels on
/// moss and rock).
constexpr int largest_block = 96, smaller_block = 64;
/// Shares of regions are to be the sample's to this much; of quilts that are not, the nearest is taken. One
/// is enough unless structures are as large as the sample.
constexpr double tolerated_share = 0.015;
constexpr std::uint64_t most_attempts = 6;
/// A tile is continued by this share of its sides, so that patches may lie across its edges.
constexpr int continued_share = 4;

/// Mean of scale × scale pixels.
Image reduced_by(const Image& image, int scale) {
    if (scale == 1) return image;
    Image result({image.height() / scale, image.width() / scale}, image.planes(), image.space());
    result.set_names(image.names());
    result.set_plane_spaces(image.plane_spaces());
    const auto width = static_cast<size_t>(image.width()), n = static_cast<size_t>(scale);
    for (int p = 0; p < image.planes(); ++p) {
        const std::span<const float> from = image.plane(p);
        float* to = result.plane(p).data();
        for (size_t r = 0; r < static_cast<size_t>(result.height()); ++r)
            for (size_t c = 0; c < static_cast<size_t>(result.width()); ++c) {
                float sum = 0.0F;
                for (size_t i = 0; i < n; ++i)
                    for (size_t j = 0; j < n; ++j) sum += from[(n * r + i) * width + n * c + j];
                *to++ = sum / static_cast<float>(scale * scale);
            }
    }
    return result;
}

bool varies(const Image& image) {
    for (int p = 0; p < image.planes(); ++p) {
        const std::span<const float> plane = image.plane(p);
        if (std::any_of(plane.begin(), plane.end(), [&](float v) { return v != plane.front(); })) return true;
    }
    return false;
}

/// The eigenplanes that hold nearly all of the variance.
Image main_planes(const Image& image) {
    const SpectralBasis basis = spectral_basis(image);
    const Image eigenplanes = to_eigenplanes(basis, image);
    std::vector<double> variances;
    double all = 0.0;
    for (int p = 0; p < eigenplanes.planes(); ++p) {
        double sum = 0.0;
        for (const float v : eigenplanes.plane(p)) sum += static_cast<double>(v) * static_cast<double>(v);
        variances.push_back(sum);
        all += sum;
    }
    int kept = 1;
    while (kept < eigenplanes.planes() &&
           variances[static_cast<size_t>(kept)] >= smallest_compared_share * all)
        ++kept;
    Image result(eigenplanes.size(), kept, ColourSpace::linear);  // of one kind: they keep their proportions
    for (int p = 0; p < kept; ++p) std::ranges::copy(eigenplanes.plane(p), result.plane(p).begin());
    return result;
}

/// What Roller::tile() takes.
int overlap_of(int shorter_side) {
    return std::max(2, shorter_side / 8);
}

int largest_tile(int side) {
    int tile = 8 * side / 9;
    while (tile + 1 + overlap_of(tile + 1) <= side) ++tile;
    return tile;
}

bool has_several(const ControlField& field) {
    return std::any_of(field.labels.begin(), field.labels.end(),
                       [&](std::uint8_t label) { return label != field.labels.front(); });
}

Image numbers_of(const ControlField& field) {
    Image numbers(field.size, 1);
    std::ranges::transform(field.labels, numbers.plane(0).begin(),
                           [](std::uint8_t label) { return static_cast<float>(label); });
    return numbers;
}

/// What the labels look like, or the labels themselves where all look alike.
Image looks(Device& device, const CompoundModel& model, const ControlField& sample) {
    Image image = conditional_mean(device.impl(), mean_weights(model), sample);
    image.set_space(model.space);
    image.set_names(model.names);
    if (varies(image)) return image;
    return numbers_of(sample);
}

}  // namespace

ControlField control_tile(Device& device, const ControlField& field, const Image& mean, Size size) {
    const std::string asked = "keep a tile of " + text_of(size) + " of the control field";
    if (size.height > field.size.height || size.width > field.size.width)
        throw InputError(asked, "the picture is " + text_of(field.size),
                         "ask for a smaller tile, or for none");
    if (!has_several(field))
        return {size, field.regions, std::vector<std::uint8_t>(area(size), field.labels.front())};
    const auto beyond = [overlap = overlap_of(std::min(size.height, size.width))](int side) {
        return side + overlap;
    };
    if (beyond(size.height) > field.size.height || beyond(size.width) > field.size.width)
        throw InputError(asked,
                         "with what its edges overlap by, " +
                             counted(overlap_of(std::min(size.height, size.width)), "pixel") +
                             ", it does not fit into the picture of " + text_of(field.size),
                         "ask for at most " +
                             std::to_string(largest_tile(std::min(field.size.height, field.size.width))) +
                             " along the shorter side, or for none: then all of the control field is kept");
    const std::array<Image, 1> compared{varies(mean) ? main_planes(mean) : numbers_of(field)};
    const SourceMap map = Roller(device, compared).tile(size);
    ControlField tile{size, field.regions, {}};
    tile.labels.reserve(map.source.size());
    for (const std::uint32_t at : map.source) tile.labels.push_back(field.labels[at]);
    return tile;
}

ControlGrowth::ControlGrowth(Device& device, const CompoundModel& model) : sample_(model.control) {
    if (model.periodic) {
        const auto continued = [](int side) { return side + side / continued_share; };
        sample_ = on_lattice(sample_, {continued(sample_.size.height), continued(sample_.size.width)});
    }
    if (!has_several(sample_)) return;
    const Image look = looks(device, model, sample_);
    const int side = std::min(sample_.size.height, sample_.size.width);
    compare(device, look, side >= 2 * smallest_reduced_side ? 2 : 1);
    if (block_ > largest_block && side >= 4 * smallest_reduced_side) compare(device, look, 4);
    if (scale_ == 1) return;
    const std::array<Image, 1> whole{main_planes(look)};
    cut_ = features_of(whole);
}

void ControlGrowth::compare(Device& device, const Image& look, int scale) {
    scale_ = scale;
    const std::array<Image, 1> compared{main_planes(reduced_by(look, scale))};
    search_.reset();
    compared_ = features_of(compared);
    search_.emplace(device.impl(), compared_);
    block_ = usual_block_of(compared_) * scale_;
}

ControlField ControlGrowth::grow(Size size, std::uint64_t seed, const std::function<void(double)>& progress) {
    if (!search_) {
        if (progress) progress(1.0);
        return {size, sample_.regions, std::vector<std::uint8_t>(area(size), sample_.labels.front())};
    }
    const std::vector<double> wanted = shares(sample_);
    ControlField best;
    double least = 2.0;
    for (std::uint64_t attempt = 0; attempt < most_attempts && least > tolerated_share; ++attempt) {
        // Most sizes take one quilt, none takes all that may be needed: every one is half of what is left.
        const double left = std::exp2(-static_cast<double>(attempt));
        std::function<void(double)> told;
        if (progress) told = [&](double share) { progress(1.0 - left * (1.0 - 0.5 * share)); };
        ControlField field = rolled(size, attempt == 0 ? seed : draw(seed, attempt), told);
        const std::vector<double> own = shares(field);
        double largest = 0.0;
        for (size_t k = 0; k < own.size(); ++k) largest = std::max(largest, std::abs(own[k] - wanted[k]));
        if (largest < least) {
            least = largest;
            best = std::move(field);
        }
    }
    if (progress) progress(1.0);
    return best;
}

ControlField ControlGrowth::rolled(Size size, std::uint64_t seed,
                                   const std::function<void(double)>& progress) {
    // Of an odd side the roller lays one pixel more, which is cut off: only where the side is odd, the field
    // has a step at the edge.
    const auto reduced = [&](int side) { return (side + scale_ - 1) / scale_; };
    RollerOptions options;
    options.seed = seed;
    options.progress = progress;
    const int side = (block_ > largest_block ? smaller_block : block_) / scale_;
    QuiltPlan plan;
    SourceMap map = make_quilt(compared_, *search_,
                               {std::max(smallest_rolled_side, reduced(size.height)),
                                std::max(smallest_rolled_side, reduced(size.width))},
                               side, side / 4, options, &plan);
    if (scale_ > 1) map = lay_finer(cut_, plan, scale_);
    ControlField result{size, sample_.regions, {}};
    result.labels.reserve(area(size));
    for (size_t r = 0; r < static_cast<size_t>(size.height); ++r)
        for (size_t c = 0; c < static_cast<size_t>(size.width); ++c)
            result.labels.push_back(sample_.labels[map.source[r * static_cast<size_t>(map.size.width) + c]]);
    return result;
}

}  // namespace btfield::detail

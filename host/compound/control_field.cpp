#include "btfield/control_field.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <numeric>
#include <utility>

#include "btfield/error.hpp"
#include "host/base/text.hpp"
#include "host/base/work_part.hpp"
#include "host/compound/cluster_features.hpp"
#include "host/compound/cluster_sample.hpp"
#include "host/compound/compound_names.hpp"
#include "host/compound/k_means.hpp"
#include "host/compound/region_divergence.hpp"

namespace btfield {

using namespace detail;

namespace {

using std::size_t;

/// Over all pixels, once the number of regions is known.
constexpr int final_iterations = 2;

void check_regions(int regions, const std::string& asked) {
    if (regions < 1 || regions > most_regions)
        throw InputError(asked, "there are to be " + std::to_string(regions) + " regions",
                         "ask for 1 to " + std::to_string(most_regions));
}

void check_clustering(const Image& image, const ClusterOptions& options, const std::string& asked) {
    if (image.values().empty()) throw InputError(asked, "it has no pixels", "give a picture");
    check_regions(options.regions.value_or(options.most), asked);
    if (!(options.divergence >= 0.0) || !std::isfinite(options.divergence))
        throw InputError(asked, "the divergence is no number from 0 on", "give one, such as 0.25");
    if (!std::ranges::all_of(image.values(), [](float v) { return std::isfinite(v); }))
        throw InputError(asked, "a pixel is not a finite number", "repair the picture");
}

void check_colours(int colours, int regions, const std::string& which, const std::string& asked) {
    if (colours >= regions) return;
    const auto there = static_cast<size_t>(colours);
    throw InputError(asked,
                     "it has " + counted(there, "colour") + (which.empty() ? "" : " " + which) +
                         ", and there are to be " + counted(regions, "region"),
                     "ask for at most " + counted(there, "region"));
}

/// Labels such that regions go from the darkest to the lightest.
void sort_by_lightness(const Image& image, ControlField& field, const std::string& asked) {
    const auto regions = static_cast<size_t>(field.regions);
    std::vector<double> sums(regions), counts(regions);
    for (const std::uint8_t label : field.labels) ++counts[label];
    const auto filled = std::ranges::count_if(counts, [](double count) { return count > 0.0; });
    check_colours(static_cast<int>(filled), field.regions, "that smoothing in float32 leaves apart", asked);
    for (int p = 0; p < image.planes(); ++p) {
        const std::span<const float> plane = image.plane(p);
        for (size_t i = 0; i < plane.size(); ++i) sums[field.labels[i]] += static_cast<double>(plane[i]);
    }
    std::vector<std::uint8_t> order(regions), place(regions);
    std::iota(order.begin(), order.end(), std::uint8_t{0});
    std::ranges::stable_sort(order,
                             [&](size_t a, size_t b) { return sums[a] / counts[a] < sums[b] / counts[b]; });
    for (size_t k = 0; k < regions; ++k) place[order[k]] = static_cast<std::uint8_t>(k);
    for (std::uint8_t& label : field.labels) label = place[label];
}

/// Two digits after the point, towards 0: what is below a bound does not look as if it met it.
std::string nats(double divergence) {
    std::array<char, 400> text{};  // of any double
    const double shown = std::floor(divergence * 100.0) / 100.0;
    const auto end =
        std::to_chars(text.data(), text.data() + text.size(), shown, std::chars_format::fixed, 2);
    return std::string(text.data(), end.ptr) + " nats";
}

/// The pixels of a picture, ready for any number of regions.
class Pixels {
  public:
    Pixels(const Image& image, ClusterSpace space, std::uint64_t seed)
        : size_(image.size()),
          seed_(seed),
          features_(cluster_features_of(image, space)),
          compared_(space == ClusterSpace::rgb ? features_ : smoothed(features_, size_)),
          sample_(cluster_sample(compared_, size_)) {}

    [[nodiscard]] Size size() const { return size_; }
    [[nodiscard]] std::vector<float> centres(int regions) const {
        return k_means_centres(sample_, regions, seed_);
    }
    /// \param iterations  over all pixels, from the centres on
    [[nodiscard]] ControlField field(const std::vector<float>& centres, int regions, int iterations) const {
        return {size_, regions, k_means_labels(compared_, centres, regions, iterations)};
    }
    [[nodiscard]] RegionDistances distances(const ControlField& field) const {
        return region_distances(features_, field.labels, field.regions);
    }

  private:
    Size size_;
    std::uint64_t seed_;
    PixelPlanes features_, compared_, sample_;
};

ControlField one_region(Size size) {
    return {size, 1, std::vector<std::uint8_t>(area(size))};
}

std::string reason_of(const RegionDistances& found, int regions) {
    return std::to_string(regions) + " regions: any two are at least " + nats(found.least) +
           " apart, the smallest has " + counted(found.fewest_pixels, "pixel");
}

/// Why regions are too many; empty where they are not.
std::string defect_of(const RegionDistances& found, const ClusterOptions& options) {
    if (found.fewest_pixels < std::max<size_t>(options.pixels, 1))
        return "one would have " + counted(found.fewest_pixels, "pixel");
    if (found.least < options.divergence) return "two would be " + nats(found.least) + " apart";
    return {};
}

/// Empty where there are enough.
std::string too_few(int colours, int regions) {
    return colours < regions ? "the picture has " + counted(colours, "colour") : "";
}

/// \param colours  at least 2: how many the picture has, counted up to options.most
Clustering most_regions_apart(const Pixels& pixels, const ClusterOptions& options, int colours) {
    std::string defect = too_few(colours, options.most);
    const double all = 0.5 * colours * (colours + 1);  // what k clusters take is about k times what one takes
    for (int k = colours; k >= 2; --k) {
        const WorkPart share(k / all);
        const std::vector<float> centres = pixels.centres(k);
        std::string next;
        for (const int iterations : {0, final_iterations}) {  // most numbers fail without the latter
            ControlField field = pixels.field(centres, k, iterations);
            const RegionDistances found = pixels.distances(field);
            next = defect_of(found, options);
            if (!next.empty()) break;
            if (iterations == final_iterations)
                return {std::move(field), reason_of(found, k) + (defect.empty() ? "" : "; ") + defect};
        }
        defect = "of " + std::to_string(k) + ", " + next;
    }
    return {one_region(pixels.size()), "1 region: " + defect};
}

}  // namespace

void check(const ControlField& field) {
    const std::string asked = "use a control field of " + text_of(field.size) + " pixels";
    if (field.size.height < 1 || field.size.width < 1)
        throw InputError(asked, "it has no pixels", "give sides from 1 on");
    check_regions(field.regions, asked);
    if (field.labels.size() != area(field.size))
        throw InputError(asked, "it has " + counted(field.labels.size(), "label"), "give one for each pixel");
    const auto wrong = std::ranges::find_if(field.labels, [&](int label) { return label >= field.regions; });
    if (wrong == field.labels.end()) return;
    const auto at = static_cast<size_t>(wrong - field.labels.begin());
    const auto width = static_cast<size_t>(field.size.width);
    throw InputError(asked,
                     "the label at row " + std::to_string(at / width) + ", column " +
                         std::to_string(at % width) + " is " + std::to_string(*wrong) + ", of " +
                         counted(field.regions, "region"),
                     "use labels from 0 to " + std::to_string(field.regions - 1));
}

std::vector<double> shares(const ControlField& field) {
    check(field);
    std::vector<double> result(static_cast<size_t>(field.regions));
    for (const std::uint8_t label : field.labels) ++result[label];
    for (double& share : result) share /= static_cast<double>(field.labels.size());
    return result;
}

ControlField on_lattice(const ControlField& field, Size lattice) {
    ControlField result{lattice, field.regions, {}};
    result.labels.reserve(area(lattice));
    for (int r = 0; r < lattice.height; ++r) {
        const auto row = static_cast<size_t>(r % field.size.height) * static_cast<size_t>(field.size.width);
        for (int c = 0; c < lattice.width; ++c)
            result.labels.push_back(field.labels[row + static_cast<size_t>(c % field.size.width)]);
    }
    return result;
}

std::string_view name(ClusterSpace space) {
    return word_of(space);
}

Clustering cluster(const Image& image, const ClusterOptions& options) {
    const std::string asked = "find the regions of a picture of " + text_of(image.size()) + " pixels";
    check_clustering(image, options, asked);
    const ClusterSpace space = space_of(image, options.space, asked);
    const int most = options.regions.value_or(options.most), colours = distinct_colours(image, most);
    if (options.regions) check_colours(colours, most, "", asked);
    if (most == 1) return {one_region(image.size()), options.regions ? "" : "1 region"};
    if (colours == 1) return {one_region(image.size()), "1 region: " + too_few(colours, most)};
    const Pixels pixels(image, space, options.seed);
    Clustering result = options.regions
                            ? Clustering{pixels.field(pixels.centres(most), most, final_iterations), {}}
                            : most_regions_apart(pixels, options, colours);
    sort_by_lightness(image, result.field, asked);
    return result;
}

}  // namespace btfield

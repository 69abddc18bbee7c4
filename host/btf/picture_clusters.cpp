#include "host/btf/picture_clusters.hpp"

#include <algorithm>
#include <limits>
#include <numeric>

namespace btfield::detail {
namespace {

using std::size_t;

constexpr int settling_iterations = 50;

/// Means of the clusters' pictures, [cluster][feature].
std::vector<double> centres_of(const PixelPlanes& features, const std::vector<std::uint8_t>& labels,
                               size_t clusters) {
    const auto planes = static_cast<size_t>(features.planes);
    std::vector<double> centres(clusters * planes);
    std::vector<size_t> counts(clusters);
    for (const std::uint8_t label : labels) ++counts[label];
    for (size_t f = 0; f < planes; ++f) {
        const float* const plane = features.plane(static_cast<int>(f));
        for (size_t i = 0; i < labels.size(); ++i)
            centres[labels[i] * planes + f] += static_cast<double>(plane[i]);
    }
    for (size_t k = 0; k < clusters; ++k)
        for (size_t f = 0; f < planes; ++f)
            centres[k * planes + f] /= static_cast<double>(std::max<size_t>(counts[k], 1));
    return centres;
}

bool is_constant(const PictureMoments& moments) {
    for (size_t c = 0; c < moments.mean.size(); ++c)
        if (moments.deviation[c] > 1e-6 * moments.mean[c]) return false;
    return true;
}

}  // namespace

void PictureFeatures::prepare(const Image& picture, size_t pictures) {
    planes_ = PixelPlanes(feature_count(picture), pictures);
}

void PictureFeatures::put(size_t index, const Image& picture, double white) {
    std::vector<float> features(static_cast<size_t>(planes_.planes));
    put_features(picture, white, features);
    for (size_t f = 0; f < features.size(); ++f) planes_.plane(static_cast<int>(f))[index] = features[f];
}

PictureClusters cluster_pictures(const PictureFeatures& of, const std::vector<PictureMoments>& moments,
                                 int clusters) {
    const PixelPlanes& features = of.planes();
    const size_t pictures = features.pixels;
    const int most = static_cast<int>(std::min(pictures, static_cast<size_t>(clusters)));
    PictureClusters found;
    found.labels = k_means_labels(features, k_means_centres(features, most, 0), most, settling_iterations);
    const std::vector<double> centres = centres_of(features, found.labels, static_cast<size_t>(most));

    // Distances of all pictures to the centres of their own clusters.
    std::vector<double> distances(pictures);
    const auto planes = static_cast<size_t>(features.planes);
    for (size_t f = 0; f < planes; ++f) {
        const float* const plane = features.plane(static_cast<int>(f));
        for (size_t i = 0; i < pictures; ++i) {
            const double d = static_cast<double>(plane[i]) - centres[found.labels[i] * planes + f];
            distances[i] += d * d;
        }
    }
    constexpr size_t none = std::numeric_limits<size_t>::max();
    std::vector<size_t> nearest(static_cast<size_t>(most), none);
    std::vector<std::uint8_t> constant(pictures);
    for (size_t i = 0; i < pictures; ++i) {
        constant[i] = is_constant(moments[i]) ? 1 : 0;
        size_t& best = nearest[found.labels[i]];
        if (best == none || constant[i] < constant[best] ||
            (constant[i] == constant[best] && distances[i] < distances[best]))
            best = i;
    }
    // Clusters in the order of these pictures, whatever the search called them.
    std::vector<size_t> order(static_cast<size_t>(most));
    std::iota(order.begin(), order.end(), size_t{0});
    std::ranges::sort(order, {}, [&](size_t k) { return nearest[k]; });
    std::vector<std::uint8_t> renamed(static_cast<size_t>(most));
    for (const size_t k : order) {
        if (nearest[k] == none) continue;
        renamed[k] = static_cast<std::uint8_t>(found.nearest.size());
        found.nearest.push_back(nearest[k]);
    }
    for (std::uint8_t& label : found.labels) label = renamed[label];
    return found;
}

}  // namespace btfield::detail

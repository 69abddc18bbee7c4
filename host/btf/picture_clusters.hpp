#pragma once

// Pictures that look alike (theory 22.1).

#include <cstddef>
#include <cstdint>
#include <vector>

#include "host/btf/picture_features.hpp"
#include "host/compound/k_means.hpp"

namespace btfield::detail {

inline constexpr int most_clusters = most_means;

/// Histograms of all pictures, and nothing else of them.
class PictureFeatures {
  public:
    /// For so many pictures like this one.
    void prepare(const Image& picture, std::size_t pictures);
    /// Of one picture; any number of threads at a time.
    void put(std::size_t index, const Image& picture, double white);
    [[nodiscard]] const PixelPlanes& planes() const { return planes_; }

  private:
    PixelPlanes planes_;  ///< [feature][picture]
};

struct PictureClusters {
    std::vector<std::uint8_t> labels;  ///< of each picture
    std::vector<std::size_t> nearest;  ///< of each cluster: the picture next to its centre, in their order
};

/// k-means from several starts, always the same. None of the clusters is empty.
/// \param moments  pictures that are not constant go before others
[[nodiscard]] PictureClusters cluster_pictures(const PictureFeatures& features,
                                               const std::vector<PictureMoments>& moments, int clusters);

}  // namespace btfield::detail

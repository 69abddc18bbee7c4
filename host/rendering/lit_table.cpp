#include "host/rendering/lit_table.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "host/base/parallel.hpp"

namespace btfield::detail {
namespace {

/// Longitudes, and latitudes with both poles: steps of 7.5 degrees.
constexpr int longitudes = 48, latitudes = 25;
/// Sine of the diagonal of a step: entries about any place that is seen and lit are no further behind.
const double beside = std::sin(std::numbers::sqrt2 * 7.5 * std::numbers::pi / 180.0);
/// Lights and views as low as the horizon are those of the ring, wherever that is.
constexpr double lowest = 0.5 * std::numbers::pi - 1e-3;

}  // namespace

PictureWeights first_planes(PictureWeights weights, std::size_t planes) {
    const std::size_t colours = weights.mean.size(), all = weights.weights.size() / colours;
    for (std::size_t c = 1; c < colours; ++c)
        for (std::size_t k = 0; k < planes; ++k)
            weights.weights[c * planes + k] = weights.weights[c * all + k];
    weights.weights.resize(colours * planes);
    return weights;
}

PictureWeights lit_weights(const DirectionTable& table, const BtfDirection& view, const BtfDirection& light) {
    PictureWeights weights = table.weights(view, light);
    const double upward = std::cos(std::min(light.theta, table.measured().steepest_light()));
    for (double& mean : weights.mean) mean /= upward;
    return weights;
}

LitTable sphere_table(const DirectionTable& table, const Vector3& camera, const Vector3& light) {
    LitTable result{longitudes, latitudes,
                    std::vector<PictureWeights>(static_cast<std::size_t>(longitudes * latitudes))};
    std::vector<std::pair<std::size_t, PlaceFrame>> places;
    for (int j = 0; j < latitudes; ++j)
        for (int i = 0; i < longitudes; ++i) {
            const PlaceFrame place = place_frame(2.0 * std::numbers::pi * i / longitudes,
                                                 std::numbers::pi * (j / (latitudes - 1.0) - 0.5));
            if (dot(place.out, camera) > -beside && dot(place.out, light) > -beside)
                places.emplace_back(j * longitudes + i, place);
        }
    for_each_block(static_cast<int>(places.size()), [&](int block) {
        const auto& [index, place] = places[static_cast<std::size_t>(block)];
        result.entries[index] =
            lit_weights(table, seen_from(place, camera, lowest), seen_from(place, light, lowest));
    });
    return result;
}

}  // namespace btfield::detail

#include "host/rendering/lit_table.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "host/base/parallel.hpp"

namespace btfield::detail {
namespace {

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

std::vector<SpherePlace> sphere_places(const Vector3& camera, const Vector3& light) {
    std::vector<SpherePlace> places;
    for (int j = 0; j < sphere_latitudes; ++j)
        for (int i = 0; i < sphere_longitudes; ++i) {
            const PlaceFrame place = place_frame(2.0 * std::numbers::pi * i / sphere_longitudes,
                                                 std::numbers::pi * (j / (sphere_latitudes - 1.0) - 0.5));
            if (dot(place.out, camera) > -beside && dot(place.out, light) > -beside)
                places.push_back({static_cast<std::size_t>(j * sphere_longitudes + i),
                                  seen_from(place, camera, lowest), seen_from(place, light, lowest)});
        }
    return places;
}

LitTable sphere_table(const DirectionTable& table, const Vector3& camera, const Vector3& light) {
    LitTable result{
        sphere_longitudes, sphere_latitudes,
        std::vector<PictureWeights>(static_cast<std::size_t>(sphere_longitudes * sphere_latitudes))};
    const std::vector<SpherePlace> places = sphere_places(camera, light);
    for_each_block(static_cast<int>(places.size()), [&](int block) {
        const SpherePlace& place = places[static_cast<std::size_t>(block)];
        result.entries[place.index] = lit_weights(table, place.view, place.light);
    });
    return result;
}

}  // namespace btfield::detail

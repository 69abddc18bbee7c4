#pragma once

#include "btfield/models.hpp"
#include "host/base/names.hpp"

namespace btfield::detail {

template <>
struct Names<ModelKind> {
    static constexpr std::string_view what = "model";
    static constexpr auto words = std::to_array<Word<ModelKind>>({{ModelKind::car2d, "2d-car"},
                                                                  {ModelKind::car3d, "3d-car"},
                                                                  {ModelKind::ma2d, "2d-ma"},
                                                                  {ModelKind::ma3d, "3d-ma"},
                                                                  {ModelKind::msar2d, "2d-msar"},
                                                                  {ModelKind::msar3d, "3d-msar"},
                                                                  {ModelKind::mmrf2d, "2d-mmrf"},
                                                                  {ModelKind::mmrf3d, "3d-mmrf"},
                                                                  {ModelKind::pmrf2d, "2d-pmrf"},
                                                                  {ModelKind::pmrf3d, "3d-pmrf"}});
};

template <>
struct Names<Estimator> {
    static constexpr std::string_view what = "estimator";
    static constexpr auto words = std::to_array<Word<Estimator>>({{Estimator::least_squares, "ls"},
                                                                  {Estimator::maximum_likelihood, "ml"},
                                                                  {Estimator::random_decrement, "rd"},
                                                                  {Estimator::spectral_root, "sr"}});
};

template <>
struct Names<NoiseForm> {
    static constexpr std::string_view what = "noise form";
    static constexpr auto words =
        std::to_array<Word<NoiseForm>>({{NoiseForm::full, "full"}, {NoiseForm::diagonal, "diagonal"}});
};

template <>
struct Names<MapRole> {
    static constexpr std::string_view what = "role of a map";
    static constexpr auto words = std::to_array<Word<MapRole>>({{MapRole::colour, "colour"},
                                                                {MapRole::normal, "normal"},
                                                                {MapRole::height, "height"},
                                                                {MapRole::roughness, "roughness"},
                                                                {MapRole::metalness, "metalness"},
                                                                {MapRole::occlusion, "occlusion"},
                                                                {MapRole::opacity, "opacity"},
                                                                {MapRole::other, "other"}});
};

}  // namespace btfield::detail

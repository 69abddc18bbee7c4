#pragma once

#include "btfield/compound.hpp"
#include "btfield/control_field.hpp"
#include "host/base/names.hpp"

namespace btfield::detail {

template <>
struct Names<ClusterSpace> {
    static constexpr std::string_view what = "cluster space";
    static constexpr auto words = std::to_array<Word<ClusterSpace>>({{ClusterSpace::automatic, "auto"},
                                                                     {ClusterSpace::lab, "lab"},
                                                                     {ClusterSpace::rgb, "rgb"},
                                                                     {ClusterSpace::planes, "planes"}});
};

template <>
struct Names<Borders> {
    static constexpr std::string_view what = "treatment of borders";
    static constexpr auto words = std::to_array<Word<Borders>>(
        {{Borders::conditional, "conditional"}, {Borders::swap, "swap"}, {Borders::none, "none"}});
};

template <>
struct Names<AveragesEstimator> {
    static constexpr std::string_view what = "estimator of moving averages";
    static constexpr auto words = std::to_array<Word<AveragesEstimator>>(
        {{AveragesEstimator::spectral_root, "sr"}, {AveragesEstimator::random_decrement, "rd"}});
};

}  // namespace btfield::detail

#pragma once

#include "btfield/fit.hpp"
#include "host/base/names.hpp"

namespace btfield::detail {

template <>
struct Names<EstimatorChoice> {
    static constexpr std::string_view what = "estimator";
    static constexpr auto words =
        std::to_array<Word<EstimatorChoice>>({{EstimatorChoice::automatic, "auto"},
                                              {EstimatorChoice::least_squares, "ls"},
                                              {EstimatorChoice::maximum_likelihood, "ml"}});
};

template <>
struct Names<GainMode> {
    static constexpr std::string_view what = "level gains";
    static constexpr auto words =
        std::to_array<Word<GainMode>>({{GainMode::match, "match"}, {GainMode::none, "none"}});
};

template <>
struct Names<MarginalMode> {
    static constexpr std::string_view what = "marginals";
    static constexpr auto words =
        std::to_array<Word<MarginalMode>>({{MarginalMode::match, "match"}, {MarginalMode::none, "none"}});
};

template <>
struct Names<SignificanceRule> {
    static constexpr std::string_view what = "significance rule";
    static constexpr auto words =
        std::to_array<Word<SignificanceRule>>({{SignificanceRule::p4, "p4"}, {SignificanceRule::p1, "p1"}});
};

}  // namespace btfield::detail

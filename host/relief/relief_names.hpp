#pragma once

#include "btfield/height.hpp"
#include "btfield/relief.hpp"
#include "host/base/names.hpp"

namespace btfield::detail {

template <>
struct Names<SurfaceEdges> {
    static constexpr std::string_view what = "treatment of a surface's edges";
    static constexpr auto words = std::to_array<Word<SurfaceEdges>>(
        {{SurfaceEdges::mirror, "mirror"}, {SurfaceEdges::periodic, "periodic"}});
};

template <>
struct Names<Flattening> {
    static constexpr std::string_view what = "flattening";
    static constexpr auto words = std::to_array<Word<Flattening>>(
        {{Flattening::none, "none"}, {Flattening::plane, "plane"}, {Flattening::low, "low"}});
};

template <>
struct Names<NormalConvention> {
    static constexpr std::string_view what = "convention of normals";
    static constexpr auto words = std::to_array<Word<NormalConvention>>(
        {{NormalConvention::opengl, "opengl"}, {NormalConvention::directx, "directx"}});
};

template <>
struct Names<LightRule> {
    static constexpr std::string_view what = "rule";
    static constexpr auto words = std::to_array<Word<LightRule>>({{LightRule::automatic, "auto"},
                                                                  {LightRule::ls, "ls"},
                                                                  {LightRule::ranks, "ranks"},
                                                                  {LightRule::huber, "huber"},
                                                                  {LightRule::amb, "amb"},
                                                                  {LightRule::lobe, "lobe"}});
};

template <>
struct Names<LightCoding> {
    static constexpr std::string_view what = "coding of values";
    static constexpr auto words = std::to_array<Word<LightCoding>>({{LightCoding::automatic, "auto"},
                                                                    {LightCoding::linear, "linear"},
                                                                    {LightCoding::srgb, "srgb"},
                                                                    {LightCoding::gamma, "gamma"}});
};

}  // namespace btfield::detail

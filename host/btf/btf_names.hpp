#pragma once

#include "btfield/btf_measured.hpp"
#include "btfield/btf_output.hpp"
#include "btfield/btf_set.hpp"
#include "btfield/btf_textures.hpp"
#include "host/base/names.hpp"

namespace btfield::detail {

template <>
struct Names<BtfFormat> {
    static constexpr std::string_view what = "format of a BTF";
    static constexpr auto words = std::to_array<Word<BtfFormat>>({{BtfFormat::utia, "utia"},
                                                                  {BtfFormat::ubo2003, "ubo2003"},
                                                                  {BtfFormat::atrium, "atrium"},
                                                                  {BtfFormat::spectral, "spectral"},
                                                                  {BtfFormat::tbig, "tbig"},
                                                                  {BtfFormat::big, "big"},
                                                                  {BtfFormat::mif, "mif"},
                                                                  {BtfFormat::fmf, "ubo2014-fmf"}});
};

template <>
struct Names<BtfCoding> {
    static constexpr std::string_view what = "coding of values";
    static constexpr auto words = std::to_array<Word<BtfCoding>>({{BtfCoding::automatic, "auto"},
                                                                  {BtfCoding::srgb, "srgb"},
                                                                  {BtfCoding::gamma, "gamma"},
                                                                  {BtfCoding::linear, "linear"}});
};

template <>
struct Names<BtfMethod> {
    static constexpr std::string_view what = "method";
    static constexpr auto words = std::to_array<Word<BtfMethod>>(
        {{BtfMethod::joint, "joint"}, {BtfMethod::segment, "segment"}, {BtfMethod::each, "each"}});
};

template <>
struct Names<BtfMatch> {
    static constexpr std::string_view what = "match";
    static constexpr auto words =
        std::to_array<Word<BtfMatch>>({{BtfMatch::means, "means"}, {BtfMatch::none, "none"}});
};

}  // namespace btfield::detail

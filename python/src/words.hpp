#pragma once

// Words of enumerations that only Python takes; and how words become values.

#include <string>

#include "btfield/device.hpp"
#include "btfield/memd.hpp"
#include "btfield/synthesis.hpp"
#include "host/base/names.hpp"

namespace btfield::detail {

template <>
struct Names<FftBackend> {
    static constexpr std::string_view what = "fft";
    static constexpr auto words = std::to_array<Word<FftBackend>>(
        {{FftBackend::automatic, "auto"}, {FftBackend::lanes, "lanes"}, {FftBackend::clfft, "clfft"}});
};

template <>
struct Names<MovingAverageRoute> {
    static constexpr std::string_view what = "route of moving averages";
    static constexpr auto words =
        std::to_array<Word<MovingAverageRoute>>({{MovingAverageRoute::automatic, "auto"},
                                                 {MovingAverageRoute::convolution, "convolution"},
                                                 {MovingAverageRoute::transfer, "transfer"}});
};

template <>
struct Names<MemdSearch> {
    static constexpr std::string_view what = "search";
    static constexpr auto words = std::to_array<Word<MemdSearch>>({{MemdSearch::automatic, "auto"},
                                                                   {MemdSearch::host_tree, "host-tree"},
                                                                   {MemdSearch::exhaustive, "exhaustive"}});
};

}  // namespace btfield::detail

namespace btfield::python {

template <class Enum>
std::string word(Enum value) {
    return std::string(detail::word_of(value));
}

}  // namespace btfield::python

#include <array>
#include <bit>
#include <cstring>
#include <limits>

#include "host/criteria/colour_tree.hpp"

#if defined(__x86_64__)
#include <immintrin.h>
#endif

namespace btfield::detail {
namespace {

using Search = ColourTree::Search;

inline ColourKey key_of(float distance, std::uint32_t raster) {
    return static_cast<ColourKey>(std::bit_cast<std::uint32_t>(distance)) << 32 | raster;
}

constexpr std::array<int, 16> lane_numbers{0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15};
constexpr std::array<int, 16> lane_bits{1,      1 << 1, 1 << 2,  1 << 3,  1 << 4,  1 << 5,  1 << 6,  1 << 7,
                                        1 << 8, 1 << 9, 1 << 10, 1 << 11, 1 << 12, 1 << 13, 1 << 14, 1 << 15};

#if defined(__x86_64__)

#define BTFIELD_ISA avx512
#define BTFIELD_TARGET __attribute__((target("avx512f,avx512dq,avx512vl,avx2,bmi")))
#define BTFIELD_WIDTH 16
#define BTFIELD_LESS(a, b) static_cast<std::uint32_t>(_mm512_cmp_ps_mask(a, b, _CMP_LT_OQ))
#define BTFIELD_EQUAL(a, b) static_cast<std::uint32_t>(_mm512_cmp_ps_mask(a, b, _CMP_EQ_OQ))
#define BTFIELD_LOWER(a, b) static_cast<std::uint32_t>(_mm512_cmplt_epu32_mask((__m512i)(a), (__m512i)(b)))
#define BTFIELD_CHOOSE(bits, lane_bits, a, b) \
    (Integers) _mm512_mask_mov_epi32((__m512i)(b), static_cast<__mmask16>(bits), (__m512i)(a))
#include "host/criteria/nearest_colour.inc"

#define BTFIELD_ISA avx2
#define BTFIELD_TARGET __attribute__((target("avx2,bmi")))
#define BTFIELD_WIDTH 8
#define BTFIELD_BITS(m) static_cast<std::uint32_t>(_mm256_movemask_ps((__m256)(m)))
#include "host/criteria/nearest_colour.inc"

#define BTFIELD_ISA baseline
#define BTFIELD_TARGET
#define BTFIELD_WIDTH 4
#define BTFIELD_BITS(m) static_cast<std::uint32_t>(_mm_movemask_ps((__m128)(m)))
#include "host/criteria/nearest_colour.inc"

#else

#define BTFIELD_ISA baseline
#define BTFIELD_TARGET
#define BTFIELD_WIDTH 4
#define BTFIELD_BITS(m) static_cast<std::uint32_t>(((m)[0] & 1) | ((m)[1] & 2) | ((m)[2] & 4) | ((m)[3] & 8))
#include "host/criteria/nearest_colour.inc"

#endif

#if defined(__x86_64__)
bool has_avx512() {
    return __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq") &&
           __builtin_cpu_supports("avx512vl");
}

bool has_avx2() {
    return __builtin_cpu_supports("avx2") && __builtin_cpu_supports("bmi");
}
#endif

}  // namespace

std::vector<ColourTree::Search> colour_searches(Metric metric, int planes) {
    std::vector<Search> searches;
#if defined(__x86_64__)
    if (has_avx512()) searches.push_back(avx512::search_for(metric, planes));
    if (has_avx2()) searches.push_back(avx2::search_for(metric, planes));
#endif
    searches.push_back(baseline::search_for(metric, planes));
    return searches;
}

std::vector<ColourTree::Tighten> box_updates() {
    std::vector<ColourTree::Tighten> updates;
#if defined(__x86_64__)
    if (has_avx512()) updates.push_back(avx512::tighten);
    if (has_avx2()) updates.push_back(avx2::tighten);
#endif
    updates.push_back(baseline::tighten);
    return updates;
}

}  // namespace btfield::detail

#include "bench/peers/noise.hpp"

#include <bit>
#include <cmath>
#include <numbers>

#include "bench/peers/parallel.hpp"

namespace btfield::peer {
namespace {

constexpr int lanes = NoiseSource::lanes;

std::uint64_t split_mix(std::uint64_t& state) {
    std::uint64_t z = (state += 0x9e3779b97f4a7c15U);
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9U;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebU;
    return z ^ (z >> 31);
}

/// Natural logarithm on (0, 1], to about 1e-7: exponent plus an atanh series of the mantissa.
inline float fast_log(float x) {
    const auto bits = std::bit_cast<std::uint32_t>(x);
    const std::uint32_t shifted = bits - 0x3f3504f3U;  // mantissa into [√½, √2)
    const auto exponent = static_cast<float>(static_cast<std::int32_t>(shifted) >> 23);
    const float m = std::bit_cast<float>((shifted & 0x7fffffU) + 0x3f3504f3U);
    const float s = (m - 1.0F) / (m + 1.0F);
    const float z = s * s;
    const float series = 2.0F + z * (0.66666667F + z * (0.4F + z * (0.28571429F + z * 0.22222222F)));
    return exponent * std::numbers::ln2_v<float> + s * series;
}

/// Sine and cosine of the angle given in quarter turns, |quarters| <= 2, to about 1e-7.
inline void fast_sincos(float quarters, float& sine, float& cosine) {
    const float whole = std::nearbyint(quarters);
    const auto quadrant = static_cast<std::int32_t>(whole);
    const float a = (quarters - whole) * (std::numbers::pi_v<float> / 2.0F);
    const float z = a * a;
    const float s =
        a * (1.0F + z * (-1.6666667e-1F + z * (8.3333310e-3F + z * (-1.9840874e-4F + z * 2.7525562e-6F))));
    const float c = 1.0F + z * (-0.5F + z * (4.1666642e-2F + z * (-1.3888397e-3F + z * 2.4760495e-5F)));
    const bool odd = (quadrant & 1) != 0;
    const float first = odd ? c : s;
    const float second = odd ? s : c;
    sine = (quadrant & 2) != 0 ? -first : first;
    cosine = ((quadrant + 1) & 2) != 0 ? -second : second;
}

}  // namespace

NoiseSource::NoiseSource(std::uint64_t seed) {
    for (auto& word : state_)
        for (auto& lane : word) lane = static_cast<std::uint32_t>(split_mix(seed) >> 32);
}

void NoiseSource::fill(std::span<float> out) {
    auto [s0, s1, s2, s3] = state_;
    const auto next = [&](std::array<std::uint32_t, lanes>& result) {
        for (std::size_t l = 0; l < lanes; ++l) {
            result[l] = std::rotl(s0[l] + s3[l], 7) + s0[l];
            const std::uint32_t t = s1[l] << 9;
            s2[l] ^= s0[l];
            s3[l] ^= s1[l];
            s1[l] ^= s2[l];
            s0[l] ^= s3[l];
            s2[l] ^= t;
            s3[l] = std::rotl(s3[l], 11);
        }
    };
    for (std::size_t at = 0; at + 2 * lanes <= out.size(); at += 2 * lanes) {
        std::array<std::uint32_t, lanes> a{}, b{};
        next(a);
        next(b);
        float* target = out.data() + at;
        for (std::size_t l = 0; l < lanes; ++l) {
            const float u = static_cast<float>(static_cast<std::int32_t>(a[l] >> 8) + 1) * 0x1p-24F;
            const float quarters = static_cast<float>(static_cast<std::int32_t>(b[l])) * 0x1p-30F;
            const float radius = std::sqrt(-2.0F * fast_log(u));
            float sine = 0.0F, cosine = 0.0F;
            fast_sincos(quarters, sine, cosine);
            target[l] = radius * cosine;
            target[l + lanes] = radius * sine;
        }
    }
    state_ = {s0, s1, s2, s3};
}

void fill_noise(std::uint64_t seed, std::span<float> out) {
    constexpr int unit = 2 * lanes;
    const int units = static_cast<int>(out.size() / unit);
    parallel([&](int t) {
        const auto begin = static_cast<std::size_t>(share(units, t)) * unit;
        const auto end = static_cast<std::size_t>(share(units, t + 1)) * unit;
        NoiseSource(seed * threads + static_cast<std::uint64_t>(t)).fill(out.subspan(begin, end - begin));
    });
}

}  // namespace btfield::peer

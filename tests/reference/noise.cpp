#include "tests/reference/noise.hpp"

#include <cmath>
#include <cstddef>
#include <numbers>

namespace btfield::reference {

namespace {

double radius(std::uint32_t word) {
    return std::sqrt(-2.0 * std::log((static_cast<double>(word >> 1) + 0.5) * 0x1p-31));
}

double angle(std::uint32_t word) {
    return 2.0 * std::numbers::pi * static_cast<double>(word) * 0x1p-32;
}

/// The upper half of the last counter word tells noise on the lattice (0) from noise in frequency (1).
std::array<std::uint32_t, 4> block_words(std::uint64_t seed, int level, std::uint32_t domain, int plane,
                                         int line, int block) {
    return philox4x32_10(
        {static_cast<std::uint32_t>(block), static_cast<std::uint32_t>(line),
         static_cast<std::uint32_t>(plane), static_cast<std::uint32_t>(level) | domain << 16},
        {static_cast<std::uint32_t>(seed), static_cast<std::uint32_t>(seed >> 32)});
}

}  // namespace

std::array<std::uint32_t, 4> philox4x32_10(std::array<std::uint32_t, 4> c, std::array<std::uint32_t, 2> key) {
    for (int round = 0; round < 10; ++round) {
        const std::uint64_t a = std::uint64_t{0xD2511F53} * c[0];
        const std::uint64_t b = std::uint64_t{0xCD9E8D57} * c[2];
        c = {static_cast<std::uint32_t>(b >> 32) ^ c[1] ^ key[0], static_cast<std::uint32_t>(b),
             static_cast<std::uint32_t>(a >> 32) ^ c[3] ^ key[1], static_cast<std::uint32_t>(a)};
        key[0] += 0x9E3779B9;
        key[1] += 0xBB67AE85;
    }
    return c;
}

std::array<double, 4> normals(const std::array<std::uint32_t, 4>& words) {
    const double r0 = radius(words[0]), r1 = radius(words[2]);
    const double a0 = angle(words[1]), a1 = angle(words[3]);
    return {r0 * std::cos(a0), r0 * std::sin(a0), r1 * std::cos(a1), r1 * std::sin(a1)};
}

Draw spatial_noise(std::uint64_t seed, int level, int plane, int row, int column) {
    // Block b of a row makes columns 64·⌊b/16⌋ + b mod 16 + {0, 16, 32, 48}.
    const int block = column / 64 * 16 + column % 16;
    const auto part = static_cast<std::size_t>(column % 64 / 16);
    const auto words = block_words(seed, level, 0, plane, row, block);
    return {normals(words)[part], radius(words[part / 2 * 2])};
}

std::complex<double> spectral_noise(std::uint64_t seed, int level, int plane, Size lattice, int kx, int ky) {
    // Block b of a column kx makes ky = 32·⌊b/16⌋ + b mod 16 + {0, 16}.
    const auto own = [&](int column) {
        const auto n = normals(block_words(seed, level, 1, plane, column, ky / 32 * 16 + ky % 16));
        return ky % 32 < 16 ? std::complex(n[0], n[1]) : std::complex(n[2], n[3]);
    };
    // The conjugate of bin (kx, ky) is (−kx, −ky): in the stored half only where ky = −ky.
    if (ky != 0 && 2 * ky != lattice.height) return own(kx);
    const int mirror = (lattice.width - kx) % lattice.width;
    if (kx == mirror) return std::numbers::sqrt2 * own(kx).real();
    return kx < mirror ? own(kx) : std::conj(own(mirror));
}

}  // namespace btfield::reference

#include "host/ranking.hpp"

#include <array>
#include <bit>
#include <string>
#include <utility>

#include "btfield/error.hpp"

namespace btfield {
namespace {

using std::size_t;
using std::uint32_t;
using std::uint64_t;

constexpr uint32_t sign = 0x80000000U;

/// A bijection of [0, 2^bits) without visible order: multiplications by odd numbers, additions and shifted
/// exclusive ors are bijections each.
class Scatter {
  public:
    Scatter(int bits, uint32_t stream)
        : mask_((uint64_t{1} << bits) - 1), shift_((bits + 1) / 2), stream_(stream) {}
    uint64_t operator()(uint64_t x) const {
        for (uint64_t round = 0; round < 3; ++round) {
            x = (x + (stream_ + 1) * 0x9E3779B97F4A7C15U + round) & mask_;
            x ^= x >> shift_;
            x = (x * (0xD1342543DE82EF95U + 2 * round)) & mask_;
            x ^= x >> shift_;
        }
        return x;
    }

  private:
    uint64_t mask_;
    int shift_;
    uint64_t stream_;
};

}  // namespace

uint32_t sort_key(float value) {
    const auto bits = std::bit_cast<uint32_t>(value + 0.0F);  // −0 becomes +0
    return (bits & sign) != 0 ? ~bits : bits | sign;
}

float sorted_value(uint32_t key) {
    return std::bit_cast<float>((key & sign) != 0 ? key & ~sign : ~key);
}

std::vector<RankedPixel> ascending(std::span<const float> values, uint32_t stream) {
    const uint64_t count = values.size();
    if (count > uint64_t{1} << 32)
        throw InputError("rank the pixels of a picture", "it has more than 2^32 of them",
                         "use a smaller picture");
    // The sort below is stable: pixels enter it in scattered order, and equal ones stay in it.
    constexpr int digit_bits = 11, digits = 3;
    constexpr size_t radix = size_t{1} << digit_bits;
    std::array<std::array<size_t, radix>, digits> places{};
    std::vector<RankedPixel> pixels(count), other(count);
    const int bits = count > 1 ? 64 - std::countl_zero(count - 1) : 1;
    const Scatter scatter(bits, stream);
    size_t next = 0;
    for (uint64_t x = 0; x < uint64_t{1} << bits; ++x) {
        const uint64_t place = scatter(x);
        if (place >= count) continue;
        const uint32_t key = sort_key(values[place]);
        pixels[next++] = {key, static_cast<uint32_t>(place)};
        for (int digit = 0; digit < digits; ++digit)
            ++places[static_cast<size_t>(digit)][(key >> (digit * digit_bits)) % radix];
    }
    for (int digit = 0; digit < digits; ++digit) {
        std::array<size_t, radix>& place = places[static_cast<size_t>(digit)];
        size_t sum = 0;
        bool trivial = false;  // all pixels share this digit
        for (size_t& p : place) {
            trivial = trivial || p == count;
            sum += std::exchange(p, sum);
        }
        if (trivial) continue;
        for (const RankedPixel& pixel : pixels)
            other[place[(pixel.key >> (digit * digit_bits)) % radix]++] = pixel;
        pixels.swap(other);
    }
    return pixels;
}

}  // namespace btfield

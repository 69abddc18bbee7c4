#include "host/analysis/ranking.hpp"

#include <array>
#include <bit>
#include <string>
#include <utility>

#include "btfield/error.hpp"

#include "host/base/stop.hpp"
namespace btfield::detail {
namespace {

using std::size_t;
using std::uint32_t;
using std::uint64_t;

constexpr uint32_t sign = 0x80000000U;

/// SplitMix64 (Steele, Lea and Flood 2014): the tie order must be the same with every standard library.
class Generator {
  public:
    explicit Generator(uint32_t stream) : state_((uint64_t{stream} << 32) | stream) {}
    /// Uniform in [0, bound), bound <= 2³², to 2⁻³² relative.
    uint32_t below(uint64_t bound) {
        state_ += 0x9E3779B97F4A7C15U;
        uint64_t z = state_;
        z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9U;
        z = (z ^ (z >> 27)) * 0x94D049BB133111EBU;
        return static_cast<uint32_t>((((z ^ (z >> 31)) >> 32) * bound) >> 32);
    }

  private:
    uint64_t state_;
};

/// Fisher and Yates, on every run of equal keys.
void shuffle_ties(std::span<RankedPixel> pixels, uint32_t stream) {
    Generator generator(stream);
    for (size_t first = 0; first < pixels.size();) {
        size_t end = first + 1;
        while (end < pixels.size() && pixels[end].key == pixels[first].key) ++end;
        for (size_t n = end - first; n > 1; --n)
            std::swap(pixels[first + n - 1], pixels[first + generator.below(n)]);
        first = end;
    }
}

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
    // Least significant digit first.
    constexpr int digit_bits = 11, digits = 3;
    constexpr size_t radix = size_t{1} << digit_bits;
    const auto digit_of = [](uint32_t key, int digit) { return (key >> (digit * digit_bits)) % radix; };
    std::array<std::array<size_t, radix>, digits> places{};
    std::vector<RankedPixel> pixels(count), other(count);
    for (size_t place = 0; place < count; ++place) {
        const uint32_t key = sort_key(values[place]);
        pixels[place] = {key, static_cast<uint32_t>(place)};
        for (int digit = 0; digit < digits; ++digit)
            ++places[static_cast<size_t>(digit)][digit_of(key, digit)];
    }
    for (int digit = 0; digit < digits; ++digit) {
        std::array<size_t, radix>& place = places[static_cast<size_t>(digit)];
        size_t sum = 0;
        bool shared = false;  // by all pixels
        for (size_t& p : place) {
            shared = shared || p == count;
            sum += std::exchange(p, sum);
        }
        stop_if_asked();
        if (shared) continue;
        for (const RankedPixel& pixel : pixels) other[place[digit_of(pixel.key, digit)]++] = pixel;
        pixels.swap(other);
    }
    shuffle_ties(pixels, stream);
    return pixels;
}

}  // namespace btfield::detail

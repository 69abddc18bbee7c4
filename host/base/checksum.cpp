#include "host/base/checksum.hpp"

#include <algorithm>
#include <bit>
#include <cstring>

namespace btfield::detail {
namespace {

static_assert(std::endian::native == std::endian::little);

constexpr std::array<std::uint64_t, 5> primes{0x9e3779b185ebca87U, 0xc2b2ae3d27d4eb4fU, 0x165667b19e3779f9U,
                                              0x85ebca77c2b2ae63U, 0x27d4eb2f165667c5U};

template <class Number>
Number number_at(const std::byte* from) {
    Number number = 0;
    std::memcpy(&number, from, sizeof number);
    return number;
}

std::uint64_t turned(std::uint64_t lane, std::uint64_t word) {
    return std::rotl(lane + word * primes[1], 31) * primes[0];
}

void add_stripe(std::array<std::uint64_t, 4>& lanes, const std::byte* from) {
    for (std::size_t i = 0; i < lanes.size(); ++i)
        lanes[i] = turned(lanes[i], number_at<std::uint64_t>(from + 8 * i));
}

}  // namespace

void Checksum::add(std::span<const std::byte> bytes) {
    const std::size_t held = size_ % waiting_.size();
    size_ += bytes.size();
    if (held > 0) {
        const std::size_t taken = std::min(bytes.size(), waiting_.size() - held);
        std::ranges::copy(bytes.first(taken), waiting_.begin() + static_cast<std::ptrdiff_t>(held));
        bytes = bytes.subspan(taken);
        if (held + taken < waiting_.size()) return;
        add_stripe(lanes_, waiting_.data());
    }
    auto lanes = lanes_;
    for (; bytes.size() >= waiting_.size(); bytes = bytes.subspan(waiting_.size()))
        add_stripe(lanes, bytes.data());
    lanes_ = lanes;
    std::ranges::copy(bytes, waiting_.begin());
}

std::uint64_t Checksum::value() const {
    std::uint64_t sum = primes[4];
    if (size_ >= waiting_.size()) {
        sum = std::rotl(lanes_[0], 1) + std::rotl(lanes_[1], 7) + std::rotl(lanes_[2], 12) +
              std::rotl(lanes_[3], 18);
        for (const std::uint64_t lane : lanes_) sum = (sum ^ turned(0, lane)) * primes[0] + primes[3];
    }
    sum += size_;
    std::span<const std::byte> rest(waiting_.data(), size_ % waiting_.size());
    for (; rest.size() >= 8; rest = rest.subspan(8))
        sum = std::rotl(sum ^ turned(0, number_at<std::uint64_t>(rest.data())), 27) * primes[0] + primes[3];
    if (rest.size() >= 4) {
        sum = std::rotl(sum ^ number_at<std::uint32_t>(rest.data()) * primes[0], 23) * primes[1] + primes[2];
        rest = rest.subspan(4);
    }
    for (const std::byte byte : rest)
        sum = std::rotl(sum ^ std::to_integer<std::uint64_t>(byte) * primes[4], 11) * primes[0];
    sum = (sum ^ sum >> 33) * primes[1];
    sum = (sum ^ sum >> 29) * primes[2];
    return sum ^ sum >> 32;
}

std::uint64_t checksum(std::span<const std::byte> bytes) {
    Checksum sum;
    sum.add(bytes);
    return sum.value();
}

}  // namespace btfield::detail

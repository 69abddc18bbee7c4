#include "btfield/memd.hpp"

#include <cmath>
#include <functional>
#include <memory>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "bench/cases.hpp"
#include "bench/peers/memd.hpp"
#include "bench/report.hpp"

namespace btfield::bench {
namespace {

struct Pair {
    Image a, b;
};

/// Eight bit values lie on their grid, others carry noise of one step and are all different.
Image toned(Size size, bool eight_bit, float gain, float offset, float noise, unsigned seed) {
    Image image = picture(size);
    std::mt19937 generator(seed);
    std::normal_distribution<float> normal(0.0F, noise);
    for (float& value : image.values()) {
        value = offset + gain * value + normal(generator);
        if (eight_bit) value = std::round(value * 255.0F) / 255.0F;
    }
    return image;
}

Pair similar(Size size, bool eight_bit) {
    return {toned(size, eight_bit, 1.0F, 0.0F, 0.01F, 1), toned(size, eight_bit, 1.0F, 0.0F, 0.01F, 2)};
}

Pair dark_and_bright(Size size, bool eight_bit) {
    return {toned(size, eight_bit, 0.4F, 0.0F, 0.01F, 1), toned(size, eight_bit, 0.4F, 0.6F, 0.01F, 2)};
}

Pair few_and_many(Size size, bool eight_bit) {
    Image few = picture(size);
    for (float& value : few.values()) value = std::floor(value * 4.0F) / 4.0F;
    return {std::move(few), toned(size, eight_bit, 1.0F, 0.0F, 0.01F, 2)};
}

Pair all_equal(Size size, bool) {
    return {Image(size, 3), Image(size, 3)};
}

std::vector<float> interleaved(const Image& image) {
    std::vector<float> values;
    values.reserve(image.values().size());
    for (std::size_t pixel = 0; pixel < area(image.size()); ++pixel)
        for (int p = 0; p < image.planes(); ++p) values.push_back(image.plane(p)[pixel] * 255.0F);
    return values;
}

using Peer = double (*)(const std::vector<float>&, const std::vector<float>&);

void add_case(const std::string& name, Pair (*make)(Size, bool), int side, bool eight_bit) {
    const Size size{side, side};
    const Work work{.items = static_cast<double>(area(size))};
    add(name, [=] {
        const auto pictures = std::make_shared<Pair>(make(size, eight_bit));
        return std::pair(work, std::function<void()>([pictures] {
                             benchmark::DoNotOptimize(memd(device(), pictures->a, pictures->b).memd);
                         }));
    });
    const auto add_peer = [=](const std::string& suffix, Peer peer) {
        add(name + suffix, [=] {
            const Pair pictures = make(size, eight_bit);
            const auto a = std::make_shared<std::vector<float>>(interleaved(pictures.a));
            const auto b = std::make_shared<std::vector<float>>(interleaved(pictures.b));
            // The same float32 distances summed in the same order.
            must_agree(memd(device(), pictures.a, pictures.b).memd, peer(*a, *b), 0.0, "memd");
            return std::pair(work,
                             std::function<void()>([a, b, peer] { benchmark::DoNotOptimize(peer(*a, *b)); }));
        });
    };
    add_peer(peer_suffix, peer::memd_tree);
    if (side <= 128) add_peer(" plain loop", peer::memd_loop);  // 36 s at 512²
}

/// The baseline: every pixel of A against every colour of B. Items are pairs.
void add_exhaustive(int side) {
    const Size size{side, side};
    const auto name = "memd pairs " + std::to_string(side) + " float similar";
    // All colours differ: a pair is a pixel of A and a pixel of B, taken or not.
    const Work work{.items = static_cast<double>(area(size)) * static_cast<double>(area(size))};
    const MemdOptions options{.search = MemdSearch::exhaustive};
    add(name, [=] {
        const auto pictures = std::make_shared<Pair>(similar(size, false));
        return std::pair(work, std::function<void()>([pictures, options] {
                             benchmark::DoNotOptimize(memd(device(), pictures->a, pictures->b, options).memd);
                         }));
    });
    if (side > 128) return;  // the plain loop takes seconds
    add(name + peer_suffix, [=] {
        const Pair pictures = similar(size, false);
        const auto a = std::make_shared<std::vector<float>>(interleaved(pictures.a));
        const auto b = std::make_shared<std::vector<float>>(interleaved(pictures.b));
        must_agree(memd(device(), pictures.a, pictures.b, options).memd, peer::memd_loop(*a, *b), 0.0,
                   "memd");
        return std::pair(
            work, std::function<void()>([a, b] { benchmark::DoNotOptimize(peer::memd_loop(*a, *b)); }));
    });
}

}  // namespace

void add_memd() {
    struct Situation {
        const char* name;
        Pair (*make)(Size, bool);
        int largest;  ///< side up to which the peer takes seconds, not minutes
    };
    for (const Situation& one :
         {Situation{"similar", similar, 800}, Situation{"dark/bright", dark_and_bright, 512},
          Situation{"few/many", few_and_many, 512}, Situation{"all equal", all_equal, 128}})
        for (const int side : {128, 256, 512, 800})
            for (const bool eight_bit : {true, false})
                if (side <= one.largest)
                    add_case("memd " + std::to_string(side) + (eight_bit ? " 8 bit " : " float ") + one.name,
                             one.make, side, eight_bit);
    for (const int side : {128, 256}) add_exhaustive(side);
}

}  // namespace btfield::bench

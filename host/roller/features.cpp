#include "host/roller/features.hpp"

#include <algorithm>
#include <cmath>
#include <string>

#include "btfield/error.hpp"
#include "host/analysis/plane_kinds.hpp"
#include "host/base/stop.hpp"
#include "host/base/text.hpp"
#include "host/base/wide.hpp"

namespace btfield::detail {
namespace {

using std::size_t;

constexpr double feature_range = 1023.0;
/// Values farther from the mean than this many standard deviations count as if they were there.
constexpr double clamped_deviations = 6.0;
constexpr double uncorrelated = 0.2;

void check_sample(std::span<const Image> sample) {
    const char* asked = "roll a sample";
    if (sample.empty()) throw InputError(asked, "there is no picture", "give at least one");
    const Size size = sample.front().size();
    for (const Image& picture : sample) {
        if (picture.size() != size)
            throw InputError(
                asked, "its pictures are " + text_of(size) + " and " + text_of(picture.size()) + " pixels",
                "give pictures that lie on each other pixel by pixel");
        for (const float value : picture.values())
            if (!std::isfinite(value))
                throw InputError(asked, "a pixel is not a finite number", "repair the picture");
    }
    if (std::min(size.height, size.width) < smallest_rolled_side ||
        std::max(size.height, size.width) > largest_rolled_side)
        throw InputError(asked, "it is " + text_of(size) + " pixels",
                         "give one with sides from " + std::to_string(smallest_rolled_side) + " to " +
                             std::to_string(largest_rolled_side));
}

}  // namespace

BTFIELD_WIDE std::int64_t squared_difference(const std::int16_t* a, const std::int16_t* b, size_t count) {
    std::int64_t sum = 0;
    while (count > 0) {  // parts whose sum 32 bits hold: 2046² · 512
        const size_t part = std::min<size_t>(count, 512);
        std::int32_t squares = 0;
        for (size_t i = 0; i < part; ++i) {
            const auto d =
                static_cast<std::int16_t>(a[i] - b[i]);  // processors add products of such in pairs
            squares += std::int32_t{d} * d;
        }
        sum += squares;
        a += part;
        b += part;
        count -= part;
    }
    return sum;
}

std::uint64_t draw(std::uint64_t seed, std::uint64_t number) {
    std::uint64_t z = seed + 0x9e3779b97f4a7c15U * (number + 1);
    z = (z ^ z >> 30) * 0xbf58476d1ce4e5b9U;
    z = (z ^ z >> 27) * 0x94d049bb133111ebU;
    return z ^ z >> 31;
}

Features features_of(std::span<const Image> sample) {
    check_sample(sample);
    Features features;
    features.size = sample.front().size();
    for (const Image& picture : sample) features.planes += picture.planes();
    const size_t pixels = area(features.size);
    const auto d = static_cast<size_t>(features.planes);

    std::vector<double> means,
        deviations;  // of planes; of the planes of a picture that are of one kind together
    for (const Image& picture : sample) {
        const std::vector<int> kinds = plane_kinds(picture);
        std::vector<double> variances(kinds.size(), 0.0);
        for (int p = 0; p < picture.planes(); ++p) {
            double sum = 0.0, squares = 0.0;
            for (const float v : picture.plane(p)) sum += static_cast<double>(v);
            const double mean = sum / static_cast<double>(pixels);
            for (const float v : picture.plane(p))
                squares += (static_cast<double>(v) - mean) * (static_cast<double>(v) - mean);
            means.push_back(mean);
            stop_if_asked();
            variances[static_cast<size_t>(kinds[static_cast<size_t>(p)])] +=
                squares / static_cast<double>(pixels);
        }
        for (const int kind : kinds) deviations.push_back(std::sqrt(variances[static_cast<size_t>(kind)]));
    }
    double largest = 0.0;
    const auto for_each_plane = [&](auto work) {
        size_t p = 0;
        for (const Image& picture : sample)
            for (int q = 0; q < picture.planes(); ++q, ++p)
                if (deviations[p] > 0.0) work(p, picture.plane(q));
    };
    for_each_plane([&](size_t p, std::span<const float> plane) {
        for (const float v : plane)
            largest = std::max(largest, std::abs(static_cast<double>(v) - means[p]) / deviations[p]);
    });
    if (!(largest > 0.0))
        throw InputError("roll a sample", "every plane has one value everywhere",
                         "give a picture in which there is something to cut");
    const double scale = feature_range / std::min(largest, clamped_deviations);
    features.values.assign(pixels * d, 0);
    for_each_plane([&](size_t p, std::span<const float> plane) {
        stop_if_asked();
        for (size_t i = 0; i < pixels; ++i) {
            const double v = (static_cast<double>(plane[i]) - means[p]) / deviations[p] * scale;
            features.values[i * d + p] =
                static_cast<std::int16_t>(std::lround(std::clamp(v, -feature_range, feature_range)));
        }
    });
    double squares = 0.0;
    for (const std::int16_t v : features.values) squares += static_cast<double>(v) * static_cast<double>(v);
    features.variance = squares / static_cast<double>(pixels);
    return features;
}

int correlation_length(const Features& features, bool along_rows) {
    const int side = along_rows ? features.size.width : features.size.height;
    const int lines = along_rows ? features.size.height : features.size.width;
    const int step = std::max(1, lines / 128);
    const auto at = [&](int line, int place) {
        return along_rows ? features.at(line, place) : features.at(place, line);
    };
    for (int lag = 1; lag < side / 2; ++lag) {
        std::int64_t products = 0, squares = 0;
        for (int line = 0; line < lines; line += step)
            for (int place = 0; place + lag < side; ++place) {
                const std::int16_t *a = at(line, place), *b = at(line, place + lag);
                for (int p = 0; p < features.planes; ++p) {
                    products += static_cast<std::int64_t>(a[p]) * b[p];
                    squares += static_cast<std::int64_t>(a[p]) * a[p];
                }
            }
        if (static_cast<double>(products) < uncorrelated * static_cast<double>(squares)) return lag;
    }
    return std::max(1, side / 2);
}

}  // namespace btfield::detail

#include "tests/btf_bytes.hpp"

#include <bit>
#include <cmath>

#include "btfield/error.hpp"

namespace btfield::test {
namespace {

constexpr std::uint32_t width = 3, height = 2, pixels = 6;

void put_scalar(Bytes& bytes, int scalar, double value) {
    if (scalar == 2) bytes.put(half(value));
    if (scalar == 4) bytes.put(static_cast<float>(value));
    if (scalar == 8) bytes.put(value);
}

void put_direction(Bytes& bytes, double theta, double phi) {
    bytes.put(static_cast<float>(theta * 3.14159265358979 / 180.0));
    bytes.put(static_cast<float>(phi * 3.14159265358979 / 180.0));
}

void put_sampling(Bytes& bytes) {
    bytes.put(std::uint32_t{2});
    put_direction(bytes, 0, 0);
    bytes.put(ubo2014_lights[0]);
    put_direction(bytes, 11, 15);
    put_direction(bytes, 30, -165);  // wrapped: 195
    put_direction(bytes, 75, 0);
    put_direction(bytes, 45, -160);  // 200
    bytes.put(ubo2014_lights[1]);
    put_direction(bytes, 11, 15);
    put_direction(bytes, 30, 195);
}

void put_meta(Bytes& bytes, const Ubo2014Case& what) {
    Bytes rest;
    rest.put(what.version);
    for (int i = 0; i < 3; ++i) rest.text(std::string(80, '\0'));
    rest.put(8.0F);
    for (int i = 0; i < 3; ++i) rest.put(1.0F);
    if (what.version > 1) rest.put(std::uint32_t{0});
    if (what.version > 2) rest.put(std::uint32_t{6}).text("<xml/>");
    if (what.version > 3) {
        rest.put(what.channels);
        for (std::uint32_t c = 0; c < what.channels; ++c)
            rest.put(std::uint32_t{2}).text("c" + std::to_string(c));
    }
    bytes.put(static_cast<std::uint32_t>(rest.size() + 4));
    bytes.text(rest.str());
}

void put_rotations(Bytes& bytes) {
    bytes.put(std::uint32_t{2});
    for (int i = 0; i < 18; ++i) bytes.put(0.5F);
}

/// Two columns: channel and picture of one, pixel of the other. ubo2014_value is (1 + c + n) (1 + x) / 4 + c.
std::array<double, 2> of_direction(std::uint32_t c, std::uint32_t n) {
    return {(1.0 + c + n) / 4.0, static_cast<double>(c)};
}
std::array<double, 2> of_pixel(std::uint32_t x) {
    return {1.0 + x, 1.0};
}
/// The same with channels beside pixels: weights of picture n are n and 1.
std::array<double, 2> of_channel_and_pixel(std::uint32_t c, std::uint32_t x) {
    return {(1.0 + x) / 4.0, (1.0 + c) * (1.0 + x) / 4.0 + c};
}

void put_factors(Bytes& bytes, const Ubo2014Case& what, std::uint32_t first, std::uint32_t channels) {
    const std::uint32_t pictures = ubo2014_lights[0] + ubo2014_lights[1];
    const std::uint32_t rows = channels * (what.by_pixel ? pixels : pictures);
    bytes.put(static_cast<std::uint8_t>(what.scalar)).put(std::uint32_t{2}).put(rows);
    bytes.put(what.by_pixel ? pictures : pixels);
    put_scalar(bytes, what.scalar, 3.0);  // singular values are part of the second factor already
    put_scalar(bytes, what.scalar, 2.0);
    for (std::uint32_t at = 0; at < rows / channels; ++at)
        for (std::uint32_t c = 0; c < channels; ++c)
            for (const double value :
                 what.by_pixel ? of_channel_and_pixel(first + c, at) : of_direction(first + c, at))
                put_scalar(bytes, what.scalar, value);
    for (std::uint32_t at = 0; at < (what.by_pixel ? pictures : pixels); ++at)
        for (const double value :
             what.by_pixel ? std::array<double, 2>{static_cast<double>(at), 1.0} : of_pixel(at))
            put_scalar(bytes, what.scalar, value);
}

/// Value = mean + components · weights, the mean being c.
void put_views(Bytes& bytes, const Ubo2014Case& what) {
    std::uint32_t first = 0;
    for (const std::uint32_t lights : ubo2014_lights) {
        const std::uint32_t dim = what.channels * (what.by_pixel ? pixels : lights);
        const std::uint32_t weights = what.by_pixel ? lights : pixels;
        bytes.put(static_cast<std::uint8_t>(what.scalar)).put(std::uint32_t{2}).put(weights).put(dim);
        put_scalar(bytes, what.scalar, 1.0);
        put_scalar(bytes, what.scalar, 1.0);
        for (std::uint32_t i = 0; i < dim; ++i) put_scalar(bytes, what.scalar, i % what.channels);
        for (std::uint32_t at = 0; at < dim / what.channels; ++at)
            for (std::uint32_t c = 0; c < what.channels; ++c) {
                if (what.by_pixel) {
                    put_scalar(bytes, what.scalar, (1.0 + at) / 4.0);
                    put_scalar(bytes, what.scalar, (1.0 + c) * (1.0 + at) / 4.0);
                } else {
                    put_scalar(bytes, what.scalar, (1.0 + c + first + at) / 4.0);
                    put_scalar(bytes, what.scalar, 0.0);
                }
            }
        for (std::uint32_t at = 0; at < weights; ++at) {
            put_scalar(bytes, what.scalar, what.by_pixel ? first + at : 1.0 + at);
            put_scalar(bytes, what.scalar, 1.0);
        }
        first += lights;
    }
}

void put_texels(Bytes& bytes, const Ubo2014Case& what) {
    bytes.put(std::uint32_t{1}).put(what.compression);
    for (std::uint32_t x = 0; x < pixels; ++x) bytes.put(static_cast<std::uint8_t>(x == 2 || x == 4 ? 0 : 1));
    put_rotations(bytes);
    const bool sparse = what.compression == 2;
    std::vector<std::uint32_t> stored;
    for (std::uint32_t x = 0; x < pixels; ++x)
        if (!sparse || (x != 2 && x != 4)) stored.push_back(x);
    const std::uint32_t pictures = ubo2014_lights[0] + ubo2014_lights[1];
    for (std::size_t begin = 0; begin < stored.size(); begin += width) {
        const std::size_t end = std::min<std::size_t>(stored.size(), begin + width);
        bytes.put(static_cast<std::uint32_t>((end - begin) * pictures * what.channels * 2));
        for (std::size_t i = begin; i < end; ++i)
            for (std::uint32_t n = 0; n < pictures; ++n)
                for (std::uint32_t c = 0; c < what.channels; ++c)
                    bytes.put(half(ubo2014_value(c, n, stored[i])));
    }
}

void put_extras(Bytes& bytes, const Ubo2014Case& what) {
    bytes.put(what.extras);
    if (what.extras >= 1) bytes.put(what.logarithms);
    if (what.extras < 2) return;
    bytes.put(width).put(height);
    for (std::uint32_t x = 0; x < pixels; ++x) bytes.put(half(0.25 * x));
}

void put_chunk(Bytes& bytes, std::int64_t id, std::int64_t value) {
    bytes.put(id).put(std::int64_t{8}).put(value);
}

void put_pictures(Bytes& bytes, int scalar, int i, int tiles) {
    for (int t = 0; t < tiles; ++t)
        for (int y = 0; y < 2; ++y)
            for (int x = 0; x < 3; ++x)
                for (int p = 0; p < 3; ++p) put_scalar(bytes, scalar, container_value(i, t, y, x, p));
}

/// Lights (0, 0) and (45, 200), views (0, 0) and (30, 30), view by view.
constexpr float angles[4][4] = {{0, 0, 0, 0}, {45, 200, 0, 0}, {0, 0, 30, 30}, {45, 200, 30, 30}};

}  // namespace

std::uint16_t half(double value) {
    if (value == 0.0) return 0;
    int exponent = 0;
    const double fraction = std::frexp(std::abs(value), &exponent);  // in [.5, 1)
    const auto mantissa = static_cast<unsigned>(fraction * 2048.0) - 1024U;
    return static_cast<std::uint16_t>((value < 0.0 ? 0x8000U : 0U) +
                                      (static_cast<unsigned>(exponent + 14) << 10U) + mantissa);
}

double ubo2014_value(std::uint32_t c, std::uint32_t n, std::uint32_t x) {
    return (1.0 + c + n) * (1.0 + x) / 4.0 + c;
}

std::string ubo2014_bytes(const Ubo2014Case& what) {
    Bytes bytes;
    bytes.text(what.signature);
    const std::string kind = what.signature.substr(1, 3);
    if (what.old_pvf) {
        bytes.put(std::int32_t{301074}).put(std::uint32_t{2}).put(width).put(height).put(std::uint32_t{2});
        put_sampling(bytes);
        put_views(bytes, what);
        return bytes.str();
    }
    put_meta(bytes, what);
    put_sampling(bytes);
    bytes.put(width).put(height);
    if (what.signature.back() == 'R') put_rotations(bytes);
    if (what.signature == "!FMF12FCER") put_extras(bytes, what);
    if (kind == "FMF") {
        bytes.put(std::uint32_t{2});
        put_factors(bytes, what, 0, what.channels);
    } else if (kind == "DFM") {
        bytes.put(std::uint32_t{2}).put(what.colour_model);
        for (int i = 0; i < 3; ++i) bytes.put(0.25F * static_cast<float>(i));
        for (int i = 0; i < 9; ++i) bytes.put(0.5F * static_cast<float>(i));
        for (std::uint32_t c = 0; c < what.channels; ++c) put_factors(bytes, what, c, 1);
    } else if (kind == "PVF") {
        bytes.put(std::uint32_t{2}).put(std::uint32_t{2});
        put_views(bytes, what);
    } else {
        put_texels(bytes, what);
    }
    return bytes.str();
}

double container_value(int i, int t, int y, int x, int plane) {
    return 16.0 * i + 8.0 * t + 4.0 * y + x + 0.25 * plane;
}

std::string tbig_bytes(int scalar, int tiles) {
    Bytes bytes;
    put_chunk(bytes, 1, 3);
    put_chunk(bytes, 2, 2);
    put_chunk(bytes, 3, 3);
    put_chunk(bytes, 4, 4);
    put_chunk(bytes, 5, scalar == 2 ? 2 : 4);
    put_chunk(bytes, 8, 2);
    put_chunk(bytes, 20, tiles);
    bytes.put(std::int64_t{18}).put(std::int64_t{5}).text("stone");
    bytes.put(std::int64_t{14}).put(std::int64_t{64});
    for (const auto& each : angles)
        for (const float angle : each) bytes.put(angle);
    bytes.put(std::int64_t{6}).put(std::int64_t{4 * 18 * tiles * scalar});
    for (int i = 0; i < 4; ++i) put_pictures(bytes, scalar, i, tiles);
    return bytes.str();
}

std::string big_bytes(int scalar) {
    Bytes bytes;
    bytes.text(std::string_view("BIG\0\0\0\0\0", 8));
    put_chunk(bytes, 1, 4);
    put_chunk(bytes, 2, 1);
    put_chunk(bytes, 3, 2);
    put_chunk(bytes, 4, 3);
    put_chunk(bytes, 5, 3);
    put_chunk(bytes, 7, scalar == 2 ? 2 : 4);
    put_chunk(bytes, 9, 3);
    bytes.put(std::int64_t{16}).put(std::int64_t{64});
    for (const auto& each : angles)
        for (const float angle : each) bytes.put(angle * 0.01745329252F);  // radians
    bytes.put(std::int64_t{8}).put(std::int64_t{4 * 18 * scalar});
    for (int i = 0; i < 4; ++i) put_pictures(bytes, scalar, i, 1);
    return bytes.str();
}

std::string mif_bytes(int scalar) {
    Bytes bytes;
    bytes.text("MIF FILE").put(std::uint64_t{0}).put(std::uint64_t{1});
    std::string xml = "<btfield-angles>";
    for (const auto& each : angles)
        for (const float angle : each) xml += " " + std::to_string(angle);
    xml += "</btfield-angles>";
    for (const int i : {2, 0, 3, 1}) {
        bytes.put(std::uint64_t{0}).put(static_cast<std::uint64_t>(48 + 18 * scalar));
        bytes.put(static_cast<std::uint64_t>(i)).put(std::uint64_t{0});
        bytes.put(std::uint64_t{scalar == 2 ? 9U : 10U})
            .put(std::uint64_t{2})
            .put(std::uint64_t{3})
            .put(std::uint64_t{3});
        put_pictures(bytes, scalar, i, 1);
    }
    bytes.put(std::uint64_t{1}).put(std::uint64_t{xml.size()}).text(xml);
    return bytes.str();
}

BtfSet BtfFile::open(const std::string& bytes) const {
    put_bytes(folder_ / name_, bytes);
    return BtfSet::open(folder_ / name_);
}

std::string BtfFile::refusal(const std::string& bytes) const {
    try {
        const BtfSet set = open(bytes);
        for (const BtfPair& pair : set.pictures()) static_cast<void>(set.picture(pair.view, pair.light));
    } catch (const InputError& error) {
        return error.what();
    }
    return "";
}

}  // namespace btfield::test

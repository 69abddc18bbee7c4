#include "host/compound/label_code.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <random>
#include <string>
#include <vector>

#include "btfield/error.hpp"
#include "btfield/image_io.hpp"
#include "tests/label_cases.hpp"
#include "tests/places.hpp"

namespace btfield {

using namespace detail;

namespace {

using std::size_t;
using Bytes = std::vector<std::uint8_t>;

const std::string data = test::data_folder();

ControlField random_labels(Size size, int regions) {
    std::mt19937 generator(static_cast<unsigned>(regions * 1000 + size.width));
    ControlField field{size, regions, Bytes(area(size))};
    for (std::uint8_t& label : field.labels)
        label = static_cast<std::uint8_t>(generator() % static_cast<unsigned>(regions));
    return field;
}

Bytes decoded(const Bytes& code, const ControlField& field) {
    return decode_labels(code, field.size, field.regions, "read a model");
}

double bits_per_pixel(const ControlField& field) {
    const Bytes code = encode_labels(field);
    EXPECT_EQ(decoded(code, field), field.labels);
    return 8.0 * static_cast<double>(code.size()) / static_cast<double>(area(field.size));
}

/// Whatever the code: the field's own labels, or an error.
void expect_labels_or_error(const Bytes& code, const ControlField& field, int& refused) {
    try {
        EXPECT_EQ(decoded(code, field), field.labels);
    } catch (const InputError& error) {
        EXPECT_EQ(error.asked(), "read a model");
        ++refused;
    }
}

TEST(LabelCode, AnyNumberOfRegions) {
    for (int regions = 1; regions <= most_regions; ++regions) {
        const ControlField field = random_labels({23, 17}, regions);
        EXPECT_EQ(decoded(encode_labels(field), field), field.labels) << regions;
        ControlField patches = test::patchy_labels({31, 20}, regions);
        EXPECT_EQ(decoded(encode_labels(patches), patches), patches.labels) << regions;
        std::fill(patches.labels.begin(), patches.labels.end(), static_cast<std::uint8_t>(regions - 1));
        EXPECT_EQ(decoded(encode_labels(patches), patches), patches.labels) << regions;
    }
}

TEST(LabelCode, AnySize) {
    for (const Size size :
         {Size{1, 1}, Size{1, 2}, Size{2, 1}, Size{1, 100}, Size{100, 1}, Size{2, 2}, Size{3, 67}})
        for (const int regions : {1, 2, 3, 32}) {
            const ControlField field = random_labels(size, regions);
            EXPECT_EQ(decoded(encode_labels(field), field), field.labels);
        }
}

TEST(LabelCode, IsShort) {
    ControlField constant{{256, 256}, 12, Bytes(65536, 7)};
    EXPECT_LE(encode_labels(constant).size(), 20U);
    constant.regions = 1;
    constant.labels.assign(65536, 0);
    EXPECT_LE(encode_labels(constant).size(), 20U);
    EXPECT_LT(bits_per_pixel(random_labels({128, 128}, 8)), 3.3);  // 3 say all that there is
    ControlField steps{{256, 256}, 32, Bytes(65536)};
    for (size_t i = 0; i < steps.labels.size(); ++i) steps.labels[i] = static_cast<std::uint8_t>(i / 2048);
    EXPECT_LT(bits_per_pixel(steps), 0.02);
}

TEST(LabelCode, RegionsOfAPictureAreShort) {
    const Image picture = read_picture(data + "/rock.png", Crop{0, 0, 160, 160}).image;
    ClusterOptions options;
    options.regions = 8;
    EXPECT_LT(bits_per_pixel(cluster(picture, options).field), 1.0);
    options.regions = 12;
    EXPECT_LT(bits_per_pixel(cluster(picture, options).field), 1.3);
}

/// A file that was written once is read for ever.
TEST(LabelCode, BytesStay) {
    const Bytes code = encode_labels(test::patchy_labels({9, 11}, 5));
    std::uint32_t sum = 0;
    for (const std::uint8_t byte : code) sum = sum * 31 + byte;
    EXPECT_EQ(code.size(), 34U);
    EXPECT_EQ(sum, 3792629203U);
}

TEST(LabelCode, TruncatedCodeIsRefused) {
    const ControlField field = test::patchy_labels({19, 13}, 6);
    const Bytes code = encode_labels(field);
    for (size_t length = 0; length < code.size(); ++length)
        EXPECT_THROW(static_cast<void>(decoded(
                         Bytes(code.begin(), code.begin() + static_cast<std::ptrdiff_t>(length)), field)),
                     InputError)
            << length;
    Bytes longer = code;
    longer.push_back(0);
    EXPECT_THROW(static_cast<void>(decoded(longer, field)), InputError);
}

TEST(LabelCode, DamagedCodeIsRefused) {
    const ControlField field = test::patchy_labels({13, 10}, 6);
    const Bytes code = encode_labels(field);
    int refused = 0;
    for (size_t byte = 0; byte < code.size(); ++byte)
        for (int bit = 0; bit < 8; ++bit) {
            Bytes damaged = code;
            damaged[byte] = static_cast<std::uint8_t>(damaged[byte] ^ 1 << bit);
            expect_labels_or_error(damaged, field, refused);
        }
    EXPECT_GE(refused,
              static_cast<int>(code.size() * 8) - 16);  // the last byte of the labels has bits to spare
}

TEST(LabelCode, NoBytesDoHarm) {
    std::mt19937 generator(4);
    int refused = 0;
    for (int k = 0; k < 300; ++k) {
        const int regions = 1 + k % most_regions;
        const ControlField field = random_labels({1 + k % 7, 1 + k % 23}, regions);
        Bytes code(static_cast<size_t>(4 + k % 60));
        for (std::uint8_t& byte : code)
            byte = static_cast<std::uint8_t>(k % 3 == 0 ? 255 : k % 3 == 1 ? 0 : generator());
        expect_labels_or_error(code, field, refused);
    }
    EXPECT_GE(refused, 299);
}

TEST(LabelCode, FieldsThatAreNoneAreRefused) {
    const ControlField field = random_labels({6, 5}, 4);
    const Bytes code = encode_labels(field);
    const auto refused = [&](Size size, int regions) {
        EXPECT_THROW(static_cast<void>(decode_labels(code, size, regions, "read a model")), InputError);
    };
    refused({0, 5}, 4);
    refused({6, -5}, 4);
    refused({6, 5}, 0);
    refused({6, 5}, 33);
    refused({5, 6}, 4);
    refused({6, 5}, 5);
    for (const int regions : {1, 4}) refused({2147483647, 2147483647}, regions);
    EXPECT_THROW(static_cast<void>(encode_labels({{1, 1}, 2, {2}})), InputError);
}

}  // namespace
}  // namespace btfield

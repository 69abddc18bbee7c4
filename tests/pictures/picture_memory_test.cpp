#include "host/pictures/picture_memory.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstddef>
#include <vector>

#include "host/pictures/picture_room.hpp"

namespace btfield {

using namespace detail;

namespace {

constexpr Size large{1024, 768};  // of one plane: two huge pages
constexpr ColourSpace space = ColourSpace::unspecified;

TEST(PictureMemory, HoldsMoreThanThePictureShows) {
    Image image = PictureRoom::make({3, 5}, 2, ColourSpace::linear, 100);
    EXPECT_EQ(image.size(), (Size{3, 5}));
    EXPECT_EQ(image.planes(), 2);
    EXPECT_EQ(image.space(), ColourSpace::linear);
    EXPECT_EQ(image.values().size(), 30U);
    EXPECT_GE(PictureRoom::of(image).size(), 100U);
    EXPECT_EQ(PictureRoom::of(image).data(), image.values().data());
    std::ranges::fill(PictureRoom::of(image), 7.0F);
    Image copy = image;
    EXPECT_TRUE(std::ranges::equal(copy.values(), image.values()));
    copy.at(0, 0, 0) = 1.0F;
    EXPECT_EQ(image.at(0, 0, 0), 7.0F);
    EXPECT_EQ(PictureRoom::make(large, 1, space, 0).values().size(), area(large));
}

TEST(PictureMemory, ServesTheNextPictureThatIsToBeFilled) {
    const float* first = nullptr;
    {
        Image image = PictureRoom::make(large, 1, space, 0);
        first = image.values().data();
    }
    EXPECT_EQ(PictureRoom::make(large, 1, space, 0).values().data(), first);
}

TEST(PictureMemory, OtherPicturesBeginAtZero) {
    {
        Image image(large, 1);
        std::ranges::fill(image.values(), 7.0F);
    }
    const Image next(large, 1);
    EXPECT_TRUE(std::ranges::all_of(next.values(), [](float value) { return value == 0.0F; }));
}

TEST(PictureMemory, IsNotKeptWithoutEnd) {
    constexpr std::size_t bytes = 2 * sizeof(float) * area({1024, 512}), count = 40;
    static_assert(bytes * count > 2 * idle_picture_bytes);
    const auto take_all = [&] {
        std::vector<void*> taken;
        for (std::size_t i = 0; i < count; ++i) taken.push_back(take_picture_memory(bytes, false));
        return taken;
    };
    const std::vector<void*> first = take_all();
    for (void* const memory : first) static_cast<float*>(memory)[bytes / sizeof(float) - 1] = 7.0F;
    for (void* const memory : first) leave_picture_memory(memory, bytes);
    const std::vector<void*> second = take_all();
    std::size_t kept = 0;
    for (void* const memory : second)
        kept += static_cast<const float*>(memory)[bytes / sizeof(float) - 1] == 7.0F ? 1 : 0;
    for (void* const memory : second) leave_picture_memory(memory, bytes);
    EXPECT_LE(kept, idle_picture_bytes / bytes);
}

}  // namespace
}  // namespace btfield

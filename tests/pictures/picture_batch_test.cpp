#include "btfield/picture_batch.hpp"

#include <gtest/gtest.h>
#include <sys/resource.h>

#include <filesystem>
#include <string>
#include <thread>
#include <vector>

#include "btfield/error.hpp"
#include "tests/device_cases.hpp"
#include "tests/temporary_folder.hpp"

namespace btfield {
namespace {

namespace fs = std::filesystem;
using test::TemporaryFolder;

constexpr Size size{24, 20};

Image picture(unsigned seed) {
    Image image = test::random_image(size, 3, 0.0F, seed);
    for (float& v : image.values()) v = 0.5F + 0.1F * v;
    image.set_space(ColourSpace::srgb);
    return image;
}

WriteOptions as_bytes() {
    WriteOptions options;
    options.source = PixelType::uint8;
    return options;
}

TEST(PictureBatch, WritesWhatWritePictureWrites) {
    const TemporaryFolder folder;
    PictureBatch batch;
    for (const char* name : {"a.png", "a.tif", "a.ppm", "a.exr"}) {
        const WriteReport one =
            write_picture(folder / (std::string("alone-") + name), picture(1), as_bytes());
        const WriteReport of_many = batch.write(folder / name, picture(1), as_bytes());
        EXPECT_EQ(of_many.clamped_pixels, one.clamped_pixels);
        EXPECT_EQ(of_many.remarks, one.remarks);
    }
    batch.finish();
    for (const char* name : {"a.png", "a.tif", "a.ppm", "a.exr"})
        EXPECT_EQ(test::bytes_of(folder / name), test::bytes_of(folder / (std::string("alone-") + name)))
            << name;
}

TEST(PictureBatch, NamesAppearWholeAndAllOfThem) {
    const TemporaryFolder folder;
    constexpr int threads = 3, each = 50;  // more than a group
    {
        PictureBatch batch;
        std::vector<std::thread> crew;
        for (int t = 0; t < threads; ++t)
            crew.emplace_back([&batch, &folder, t] {
                for (int i = 0; i < each; ++i)
                    batch.write(folder / (std::to_string(t * each + i) + ".png"),
                                picture(static_cast<unsigned>(t * each + i)), as_bytes());
            });
        for (std::thread& thread : crew) thread.join();
    }  // which finishes
    int found = 0;
    for (const auto& entry : fs::directory_iterator(folder.path())) {
        const auto seed = static_cast<unsigned>(std::stoul(entry.path().stem().string()));
        const Image image = read_picture(entry.path()).image, expected = picture(seed);
        for (std::size_t i = 0; i < image.values().size(); ++i)
            ASSERT_NEAR(image.values()[i], expected.values()[i], 0.51F / 255.0F) << entry.path();
        ++found;
    }
    EXPECT_EQ(found, threads * each);
}

TEST(PictureBatch, OneThatFailsCostsNoOther) {
    const TemporaryFolder folder;
    PictureBatch batch;
    batch.write(folder / "first.png", picture(1), as_bytes());
    EXPECT_THROW(batch.write(folder / "none" / "b.png", picture(2), as_bytes()), InputError);
    EXPECT_THROW(batch.write(folder / "c.unknown", picture(2), as_bytes()), InputError);
    // A name that is taken by a folder once the picture is encoded.
    batch.write(folder / "taken.png", picture(3), as_bytes());
    fs::create_directory(folder / "taken.png");
    batch.write(folder / "last.png", picture(4), as_bytes());
    EXPECT_THROW(batch.finish(), InputError);
    EXPECT_TRUE(fs::exists(folder / "first.png"));
    EXPECT_TRUE(fs::exists(folder / "last.png"));
    EXPECT_EQ(std::distance(fs::directory_iterator(folder.path()), fs::directory_iterator()), 3);
    EXPECT_NO_THROW(batch.finish());
}

TEST(PictureBatch, FewOpenFilesAreEnough) {
    const TemporaryFolder folder;
    rlimit before{};
    ASSERT_EQ(::getrlimit(RLIMIT_NOFILE, &before), 0);
    rlimit few = before;
    few.rlim_cur = 64;
    ASSERT_EQ(::setrlimit(RLIMIT_NOFILE, &few), 0);
    {
        PictureBatch batch;
        for (unsigned i = 0; i < 80; ++i)
            EXPECT_NO_THROW(batch.write(folder / (std::to_string(i) + ".png"), picture(i), as_bytes())) << i;
        EXPECT_NO_THROW(batch.finish());
    }
    ASSERT_EQ(::setrlimit(RLIMIT_NOFILE, &before), 0);
    EXPECT_EQ(std::distance(fs::directory_iterator(folder.path()), fs::directory_iterator()), 80);
}

TEST(PictureBatch, SidesThatFormatsHold) {
    const TemporaryFolder folder;
    const Image wide({1, 65501}, 1, ColourSpace::srgb), wider({1, 1000001}, 1, ColourSpace::srgb);
    EXPECT_THROW(write_picture(folder / "a.jpg", wide, as_bytes()), InputError);
    EXPECT_TRUE(folder.names().empty());
    EXPECT_THROW(write_picture(folder / "a.png", wider, as_bytes()), InputError);
    EXPECT_TRUE(folder.names().empty());
    write_picture(folder / "a.png", wide, as_bytes());
    EXPECT_TRUE(fs::exists(folder / "a.png"));
}

TEST(PictureBatch, CompressionChangesBytesAndNoPixel) {
    const TemporaryFolder folder;
    Image image({96, 96}, 3, ColourSpace::srgb);
    for (std::size_t i = 0; i < image.values().size(); ++i)
        image.values()[i] = static_cast<float>(i % 96 / 8) / 16.0F;
    for (const char* extension : {".png", ".tif", ".exr"}) {
        std::vector<std::uintmax_t> bytes;
        std::vector<Image> images;
        for (const int effort : {0, 1, 9}) {
            WriteOptions how = as_bytes();
            how.compression = effort;
            const fs::path file = folder / (std::to_string(effort) + extension);
            write_picture(file, image, how);
            bytes.push_back(fs::file_size(file));
            images.push_back(read_picture(file).image);
        }
        EXPECT_GT(bytes[0], 3U * bytes[1]) << extension;
        EXPECT_GE(bytes[1], bytes[2]) << extension;
        for (const Image& other : images)
            EXPECT_TRUE(std::ranges::equal(other.values(), images.front().values())) << extension;
    }
}

}  // namespace
}  // namespace btfield

// The module with the picture codecs: who loads it, and what happens without it.
#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <string>
#include <thread>
#include <vector>

#include "btfield/error.hpp"
#include "btfield/image_io.hpp"
#include "tests/places.hpp"
#include "tests/run_program.hpp"
#include "tests/temporary_folder.hpp"

namespace btfield {
namespace {

namespace fs = std::filesystem;

const std::string cork = test::data_folder() + "/cork.png";

/// The command under the system's account of every library that it loads.
test::Ended run_traced(std::vector<std::string> words) {
    words.insert(words.begin(), {"/usr/bin/env", "LD_DEBUG=files", test::command_path()});
    return test::run_program(std::move(words));
}

bool says(const std::string& text, const std::string& part) {
    return text.find(part) != std::string::npos;
}

/// The cork as a format of OpenImageIO's.
std::string tiff_in(const test::TemporaryFolder& folder) {
    const fs::path path = folder / "a.tif";
    write_picture(path, read_picture(cork).image);
    return path.string();
}

TEST(picture_codec, only_commands_with_its_formats_load_it) {
    const test::TemporaryFolder folder;
    const std::string tiff = tiff_in(folder), pnm = (folder / "a.pgm").string(),
                      jpeg = (folder / "a.jpg").string();
    Image diagonal({64, 64}, 1);
    for (int i = 0; i < 64; ++i) diagonal.at(0, i, i) = static_cast<float>(i) / 64.0F;
    write_picture(pnm, diagonal);
    write_picture(jpeg, diagonal);
    const std::string model = (folder / "m.json").string(), texture = (folder / "t.png").string();
    for (const std::vector<std::string>& words :
         std::vector<std::vector<std::string>>{{"--version"},
                                               {"synth", "--help"},
                                               {"devices"},
                                               {"compare", pnm, jpeg},
                                               {"compare", cork, cork},
                                               {"fit", cork, "-o", model},
                                               {"synth", model, "-o", texture, "--size", "32"}}) {
        const test::Ended ended = run_traced(words);
        EXPECT_EQ(ended.code, 0) << words.front() << ": " << ended.err.substr(0, 400);
        EXPECT_TRUE(says(ended.err, "libbtfield")) << words.front();
        EXPECT_FALSE(says(ended.err, "libOpenImageIO")) << words.front();
    }
    const test::Ended ended = run_traced({"compare", tiff, tiff});
    EXPECT_EQ(ended.code, 0);
    EXPECT_TRUE(says(ended.err, "libOpenImageIO"));
}

TEST(picture_codec, without_it_the_error_names_the_file) {
    const test::TemporaryFolder folder;
    const std::string tiff = tiff_in(folder);
    const fs::path library(test::library_path());
    fs::copy_file(library, folder.path() / library.filename());
    const std::string path = "LD_LIBRARY_PATH=" + folder.path().string();
    const test::Ended ended =
        test::run_program({"/usr/bin/env", path, test::command_path(), "compare", tiff, tiff});
    EXPECT_EQ(ended.code, 1);
    EXPECT_TRUE(says(ended.err, "read '" + tiff + "'")) << ended.err;
    const fs::path looked_for = fs::canonical(folder.path()) / "btfield" / "btfield_pictures.so";
    EXPECT_TRUE(says(ended.err, "'" + looked_for.string() + "'")) << ended.err;
    const test::Ended png =
        test::run_program({"/usr/bin/env", path, test::command_path(), "compare", cork, cork});
    EXPECT_EQ(png.code, 0) << png.err;
}

TEST(picture_codec, its_errors_are_caught_by_type) {
    const test::TemporaryFolder folder;
    const std::string tiff = tiff_in(folder);
    fs::resize_file(tiff, fs::file_size(tiff) / 2);
    preload_picture_formats();
    std::vector<int> caught(4, 0);
    {
        std::vector<std::jthread> threads;
        for (int& one : caught) {
            threads.emplace_back([&] {
                preload_picture_formats();
                try {
                    static_cast<void>(read_picture(tiff));
                } catch (const InputError& error) {
                    one = error.asked().empty() ? 2 : 1;
                } catch (...) {
                    one = 3;
                }
            });
        }
    }
    EXPECT_EQ(caught, std::vector<int>(4, 1));
}

TEST(picture_codec, a_process_may_end_while_it_loads) {
    const test::TemporaryFolder folder;
    const auto end_at_once = [] {
        preload_picture_formats();
        std::exit(7);
    };
    GTEST_FLAG_SET(death_test_style, "threadsafe");  // a fresh process
    EXPECT_EXIT(end_at_once(), testing::ExitedWithCode(7), "");
}

}  // namespace
}  // namespace btfield

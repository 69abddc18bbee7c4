// Ends that the program does not choose: signals in the middle of a batch, surroundings without a place for
// the driver's cache, a damaged one.

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <csignal>
#include <filesystem>
#include <string>
#include <thread>

#include "btfield/image_io.hpp"
#include "tests/cli_cases.hpp"
#include "tests/places.hpp"
#include "tests/temporary_folder.hpp"

namespace btfield {
namespace {

namespace fs = std::filesystem;
using test::btfield;
using test::Ended;
using test::put_model;
using test::run_program;
using test::Running;
using test::Surroundings;
using test::TemporaryFolder;
using test::Words;

const std::string data = test::data_folder();

// Also when a signal arrives while a texture is being written; what is complete stays complete.
TEST(CliEnding, SignalsLeaveWholeTexturesOnly) {
    const TemporaryFolder folder;
    put_model(folder / "m.json");
    constexpr std::array signals{SIGINT, SIGTERM, SIGHUP, SIGQUIT, SIGUSR1, SIGXCPU, SIGABRT, SIGKILL};
    for (std::size_t k = 0; k < signals.size(); ++k) {
        const fs::path out = folder / ("out" + std::to_string(k));
        fs::create_directory(out);
        Running batch({test::command_path(), "synth", (folder / "m.json").string(), "-o",
                       (out / "t.png").string(), "--count", "1000", "--size", "64x64"},
                      folder.path());
        const auto late = std::chrono::steady_clock::now() + std::chrono::minutes(2);
        while (!fs::exists(out / "t-001.png") && std::chrono::steady_clock::now() < late)
            std::this_thread::sleep_for(std::chrono::milliseconds(1));
        std::this_thread::sleep_for(std::chrono::milliseconds(7 * k));
        batch.kill(signals[k]);
        EXPECT_EQ(batch.wait(), 128 + signals[k]) << batch.err();
        std::size_t textures = 0;
        for (const auto& entry : fs::directory_iterator(out)) {
            EXPECT_EQ(entry.path().filename().string().front(), 't') << entry.path();
            EXPECT_EQ(read_picture(entry.path()).image.size(), (Size{64, 64}));
            ++textures;
        }
        EXPECT_GE(textures, 2U);
        EXPECT_LT(textures, 1000U);
    }
}

// As nohup has it.
TEST(CliEnding, IgnoredSignalsStayIgnored) {
    const TemporaryFolder folder;
    put_model(folder / "m.json");
    const Ended ended = run_program({"/bin/sh", "-c",
                                     "trap '' HUP; " + test::command_path() +
                                         " synth m.json -o t.png --count 20 --size 64x64 & sleep 0.3; "
                                         "kill -HUP $!; wait $!"},
                                    {.folder = folder.path().string()});
    EXPECT_EQ(ended.code, 0) << ended.err;
    EXPECT_TRUE(fs::exists(folder / "t-19.png"));
}

/// What a daemon or a container may find: no home, none that can be written, no folder for temporary files.
TEST(CliEnding, WorksWithoutAPlaceForCaches) {
    const TemporaryFolder folder;
    put_model(folder / "m.json");
    for (const std::string& variables :
         {std::string("HOME=/dev/null"), std::string("HOME=/dev/null TMPDIR=/dev/null"),
          std::string("POCL_CACHE_DIR=/dev/null/none"), std::string("XDG_CACHE_HOME=/dev/null")}) {
        const Ended ended =
            run_program({"/bin/sh", "-c",
                         "env -u POCL_CACHE_DIR -u XDG_CACHE_HOME -u BTFIELD_CACHE_DIR " + variables + " " +
                             test::command_path() + " synth m.json -o t.png --size 16x16 --json"},
                        {.folder = folder.path().string()});
        EXPECT_EQ(ended.code, 0) << variables << ": " << ended.err;
    }
}

// PoCL ends the process over it.
TEST(CliEnding, DamagedDriverCacheIsNamed) {
    const TemporaryFolder folder;
    put_model(folder / "m.json");
    const std::string caches = "POCL_CACHE_DIR=" + (folder / "kernels").string() +
                               " BTFIELD_CACHE_DIR=" + (folder / "own").string() + " ";
    const Words synth{"/bin/sh", "-c",
                      caches + test::command_path() + " synth m.json -o t.png --size 16x16 --device cpu"};
    const Surroundings here{.folder = folder.path().string()};
    const Ended first = run_program(synth, here);
    ASSERT_EQ(first.code, 0) << first.err;
    std::size_t damaged = 0;
    for (const auto& entry : fs::recursive_directory_iterator(folder / "kernels")) {
        if (!entry.is_regular_file()) continue;
        fs::resize_file(entry.path(), 0);
        ++damaged;
    }
    if (damaged == 0) return;  // another driver, whose cache is its own
    fs::remove(folder / "t.png");
    const Ended ended = run_program(synth, here);
    EXPECT_EQ(ended.code, 3) << ended.err;
    EXPECT_NE(ended.err.find("remove '" + (folder / "kernels").string() + "'"), std::string::npos)
        << ended.err;
    EXPECT_FALSE(fs::exists(folder / "t.png"));
}

}  // namespace
}  // namespace btfield

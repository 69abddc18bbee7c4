// `btfield btf fit` that is killed goes on where it was.

#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <csignal>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <numbers>
#include <random>
#include <string>
#include <thread>

#include "btfield/btf_output.hpp"
#include "btfield/btf_textures.hpp"
#include "btfield/made_btf.hpp"
#include "tests/cli_cases.hpp"
#include "tests/device_cases.hpp"
#include "tests/json_text.hpp"
#include "tests/mpi_cases.hpp"
#include "tests/places.hpp"
#include "tests/temporary_folder.hpp"

namespace btfield {
namespace {

namespace fs = std::filesystem;
using test::btfield;
using test::Ended;
using test::expect_failure;
using test::expect_object;
using test::Running;
using test::Words;

/// A made set of 13 views and lights.
class CliBtfPart : public testing::Test {
  protected:
    CliBtfPart() {
        BtfMaterial rough;
        rough.height = Image({32, 40}, 1);
        rough.albedo = Image({32, 40}, 3, ColourSpace::linear);
        std::mt19937 random(4);
        const auto next = [&] { return static_cast<float>(random()) / 4294967296.0F; };
        for (float& value : rough.height.values()) value = next();
        for (float& value : rough.albedo.values()) value = 0.3F + 0.4F * next();
        rough.normals = Image({32, 40}, 3);
        std::ranges::fill(rough.normals.plane(2), 1.0F);
        MadeBtfOptions how;
        how.views = {{}};
        for (const double theta : {25.0, 50.0})
            for (int k = 0; k < 6; ++k)
                how.views.push_back({theta * std::numbers::pi / 180.0, std::numbers::pi * k / 3.0});
        how.lights = how.views;
        write_btf(at("set"), make_btf(test::default_device(), rough, how));
    }
    [[nodiscard]] std::string at(const std::string& name) const { return (folder_ / name).string(); }
    [[nodiscard]] Words fit(const std::string& model, Words more = {}, const char* levels = "1") const {
        Words words{"btf",      "fit", at("set"), "-o", at(model),  "--periodic",
                    "--planes", "6",   "--order", "1",  "--levels", levels};
        words.insert(words.end(), more.begin(), more.end());
        return words;
    }
    test::TemporaryFolder folder_;
};

TEST_F(CliBtfPart, KilledFitsGoOn) {
    const auto whole = expect_object(fit("whole.btfm"));
    EXPECT_EQ(whole["resumed"], 0);
    EXPECT_FALSE(fs::exists(at("whole.btfm.part")));
    const std::string bytes = test::bytes_of(at("whole.btfm"));
    std::size_t resumed = 0;
    for (int round = 0; round < 4; ++round) {
        Words words = fit("m.btfm", {"--overwrite"});
        words.insert(words.begin(), test::command_path());
        fs::remove(at("m.btfm"));
        {
            Running run(words, folder_.path());
            const auto late = std::chrono::steady_clock::now() + std::chrono::minutes(2);
            std::error_code none;
            const auto begun = [&] {
                const std::uintmax_t size = fs::file_size(at("m.btfm.part"), none);
                return (!none && size > 4096) || fs::exists(at("m.btfm"));
            };
            while (!begun() && std::chrono::steady_clock::now() < late)
                std::this_thread::sleep_for(std::chrono::milliseconds(1));
            std::this_thread::sleep_for(std::chrono::milliseconds(10 * round));
            run.kill(SIGKILL);
            static_cast<void>(run.wait());
        }
        const auto again = expect_object(fit("m.btfm"));
        resumed += again["resumed"].get<std::size_t>();
        EXPECT_EQ(test::bytes_of(at("m.btfm")), bytes) << round;
        EXPECT_FALSE(fs::exists(at("m.btfm.part")));
    }
    EXPECT_GT(resumed, 0U);
}

TEST_F(CliBtfPart, WhatIsDoneIsTold) {
    // As it is left by a fit that cannot go on.
    expect_failure(fit("m.btfm", {}, "30"), 1, "level");
    ASSERT_TRUE(fs::exists(at("m.btfm.part")));
    expect_failure(fit("m.btfm", {"--leave-out", "7"}), 1, "it was begun with other options");
    expect_failure(fit("m.btfm", {"--light-stride", "2"}), 1, "it was begun with another set");
    expect_failure({"btf", "fit", at("set"), "-o", at("m.btfm"), "--method", "each"}, 1,
                   "it was begun with other options");
    EXPECT_FALSE(fs::exists(at("m.btfm")));
    const Ended told = btfield(fit("m.btfm"));
    EXPECT_EQ(told.code, 0) << told.err;
    EXPECT_NE(told.out.find("169 of them were read before, by a run that did not end."), std::string::npos)
        << told.out;
    EXPECT_FALSE(fs::exists(at("m.btfm.part")));

    test::Surroundings full;
    full.file_limit = 100'000;
    expect_failure(fit("n.btfm"), 1, "make room, and run the fit again", full);
    EXPECT_GT(expect_object(fit("n.btfm"))["resumed"], 0);
    test::put_bytes(at("x.btfm.part"), "mine\n");
    expect_failure(fit("x.btfm"), 1, "it is no part of a BTF fit");
    EXPECT_EQ(test::bytes_of(at("x.btfm.part")), "mine\n");
    // Standard output has no place beside it.
    test::Surroundings out;
    out.out = at("piped.json");
    EXPECT_EQ(btfield(fit("/dev/stdout"), out).code, 0);
    EXPECT_GT(fs::file_size(at("piped.json")), 1000U);
}

TEST_F(CliBtfPart, ShardsOfEachAreJoined) {
    const auto each = [&](const std::string& model, Words more = {}) {
        Words words{"btf",  "fit",     at("set"), "-o",       at(model), "--method",
                    "each", "--order", "1",       "--levels", "1"};
        words.insert(words.end(), more.begin(), more.end());
        return words;
    };
    static_cast<void>(expect_object(each("whole.btfm")));
    const auto shard = expect_object(each("m.btfm", {"--shard", "2/3"}));
    test::expect_keys(shard, {"output", "part", "shard", "method", "pictures", "resumed", "device"});
    EXPECT_EQ(shard["part"], at("m.btfm.part-2-of-3"));
    EXPECT_EQ(shard["pictures"], 56);  // of 169
    EXPECT_EQ(shard["resumed"], 0);
    EXPECT_FALSE(fs::exists(at("m.btfm")));
    // Again: nothing to do. Another, of other options: told at the join.
    EXPECT_EQ(expect_object(each("m.btfm", {"--shard", "2/3"}))["resumed"], 56);
    EXPECT_EQ(expect_object(each("m.btfm", {"--shard", "3/3"}))["pictures"], 56);
    fs::copy_file(at("m.btfm.part-3-of-3"), at("other.btfm.part-3-of-3"));
    expect_failure(each("other.btfm", {"--leave-out", "5"}), 1, "it was begun with other options");
    // The first is missing: its pictures are fitted now.
    fs::copy_file(at("m.btfm.part-3-of-3"), at("cut.btfm.part-3-of-3"));
    const Ended joined = btfield(each("m.btfm", {"--json"}));
    EXPECT_EQ(joined.code, 0) << joined.err;
    EXPECT_EQ(test::parsed(joined.out)["resumed"], 112);
    EXPECT_NE(
        joined.err.find("of 3 shards shard 1 left no part: 57 pictures that no shard has are fitted now\n"),
        std::string::npos)
        << joined.err;
    EXPECT_EQ(test::bytes_of(at("m.btfm")), test::bytes_of(at("whole.btfm")));
    for (const char* part : {"m.btfm.part", "m.btfm.part-2-of-3", "m.btfm.part-3-of-3"})
        EXPECT_FALSE(fs::exists(at(part))) << part;
    // Of the third half is lost, and the others.
    fs::resize_file(at("cut.btfm.part-3-of-3"), fs::file_size(at("cut.btfm.part-3-of-3")) / 2);
    const Ended cut = btfield(each("cut.btfm"));
    EXPECT_EQ(cut.code, 0) << cut.err;
    EXPECT_NE(cut.err.find("of 3 shards shards 1, 2 left no parts, shard 3 has not all of its pictures: 14"),
              std::string::npos)
        << cut.err;
    EXPECT_EQ(test::bytes_of(at("cut.btfm")), test::bytes_of(at("whole.btfm")));
    expect_failure(fit("m.btfm", {"--shard", "1/2", "--overwrite"}), 2, "--shard goes with --method each");
    expect_failure(each("/dev/stdout", {"--shard", "1/2"}), 2, "name a file");
#ifdef BTFIELD_MPI
    Words words = each("ranks.btfm", {"--json"});
    words.insert(words.begin(), test::command_path());
    const Ended run = test::run_program(test::ranks(3, words));
    ASSERT_EQ(run.code, 0) << run.err;
    const auto told = test::parsed(run.out);  // rank 0's alone
    EXPECT_EQ(told["pictures"], 169);
    EXPECT_EQ(told["resumed"], 0);
    EXPECT_EQ(test::bytes_of(at("ranks.btfm")), test::bytes_of(at("whole.btfm")));
    EXPECT_TRUE(btf_shard_parts(at("ranks.btfm.part")).empty());
    // What rank 0 refuses ends all of them.
    words[5] = at("none/x.btfm");
    const Ended wrong = test::run_program(test::ranks(2, words));
    EXPECT_EQ(wrong.code, 1);
    EXPECT_NE(wrong.err.find("none/x.btfm"), std::string::npos) << wrong.err;
#endif
}

}  // namespace
}  // namespace btfield

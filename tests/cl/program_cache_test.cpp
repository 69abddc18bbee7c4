#include "host/cl/program.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <regex>

#include "host/cl/embedded_kernels.hpp"
#include "tests/device_cases.hpp"
#include "tests/full_disk.hpp"
#include "tests/temporary_folder.hpp"

namespace btfield {

using namespace detail;

namespace {

using Statistics = ProgramCache::Statistics;

const std::string source = "__kernel void fill(__global float* out) { out[get_global_id(0)] = VALUE; }\n";

class ProgramCaches : public testing::Test {
  protected:
    /// A new cache, as a new process would have.
    ProgramCache cache() { return cache(folder_.path()); }
    ProgramCache cache(const std::filesystem::path& folder) {
        const cl::Context& context = device_.impl().context();
        return {context, context.getInfo<CL_CONTEXT_DEVICES>().front(), folder};
    }

    /// What the kernel that the cache gives computes.
    float value_of(ProgramCache& programs, int value = 7, const std::string& text = source) {
        cl::Kernel& kernel =
            programs.kernel_from_source("fill", text, "fill", "-DVALUE=" + std::to_string(value));
        const Buffer out = device_.impl().buffer(sizeof(float));
        device_.impl().launch(kernel, {1}, Grain::coarse, out);
        return test::read_all<float>(device_, out).front();
    }

    void expect_statistics(const ProgramCache& programs, int compiled, int loaded, int discarded) {
        EXPECT_EQ(programs.statistics().compiled, compiled);
        EXPECT_EQ(programs.statistics().loaded, loaded);
        EXPECT_EQ(programs.statistics().discarded, discarded);
    }

    std::filesystem::path only_file() {
        EXPECT_EQ(folder_.names().size(), 1U);
        return folder_ / folder_.names().front();
    }

    /// The only file of the folder, damaged: it is noticed, the program still works, and the file is whole
    /// again.
    void expect_rebuilt(const std::string& damaged) {
        const std::filesystem::path path = only_file();
        test::put_bytes(path, damaged);
        ProgramCache second = cache();
        EXPECT_EQ(value_of(second), 7.0F);
        expect_statistics(second, 1, 0, 1);
        ProgramCache third = cache();
        EXPECT_EQ(value_of(third), 7.0F);
        expect_statistics(third, 0, 1, 0);
        EXPECT_EQ(only_file(), path);
    }

    Device device_;
    test::TemporaryFolder folder_;
};

TEST_F(ProgramCaches, BuildsOnceAProcessAndOnceADisk) {
    ProgramCache first = cache();
    EXPECT_EQ(value_of(first), 7.0F);
    EXPECT_EQ(value_of(first), 7.0F);
    expect_statistics(first, 1, 0, 0);
    const std::string stored = test::bytes_of(only_file());

    ProgramCache second = cache();
    EXPECT_EQ(value_of(second), 7.0F);
    EXPECT_EQ(value_of(second), 7.0F);
    expect_statistics(second, 0, 1, 0);
    EXPECT_EQ(test::bytes_of(only_file()), stored);
}

TEST_F(ProgramCaches, KernelsKeepTheirPlace) {
    // Callers hold references while other programs are built.
    ProgramCache programs = cache({});
    cl::Kernel* first = &programs.kernel_from_source("fill", source, "fill", "-DVALUE=1");
    for (int value = 2; value < 6; ++value)
        programs.kernel_from_source("fill", source, "fill", "-DVALUE=" + std::to_string(value));
    EXPECT_EQ(first, &programs.kernel_from_source("fill", source, "fill", "-DVALUE=1"));
}

TEST_F(ProgramCaches, OptionsAndSourcesHaveFilesOfTheirOwn) {
    ProgramCache programs = cache();
    EXPECT_EQ(value_of(programs, 7), 7.0F);
    EXPECT_EQ(value_of(programs, 8), 8.0F);
    EXPECT_EQ(folder_.names().size(), 2U);
    EXPECT_EQ(value_of(programs, 7, "// another text\n" + source), 7.0F);
    EXPECT_EQ(folder_.names().size(), 3U);
    expect_statistics(programs, 3, 0, 0);

    ProgramCache second = cache();
    EXPECT_EQ(value_of(second, 8), 8.0F);
    EXPECT_EQ(value_of(second, 7), 7.0F);
    expect_statistics(second, 0, 2, 0);
}

TEST_F(ProgramCaches, TruncatedFilesAreRebuilt) {
    ProgramCache first = cache();
    EXPECT_EQ(value_of(first), 7.0F);
    const std::string whole = test::bytes_of(only_file());
    // Ends inside the magic, the lengths, the key, the checksum and the binary.
    std::vector<std::size_t> lengths{
        0, 1, 10, 16, 17, 18, 24, 25, 26, 100, whole.size() - 100, whole.size() - 1};
    for (std::size_t i = 1; i < 12; ++i) lengths.push_back(whole.size() * i / 12);
    for (const std::size_t length : lengths) {
        SCOPED_TRACE(length);
        expect_rebuilt(whole.substr(0, length));
    }
}

TEST_F(ProgramCaches, FlippedBytesAreRebuilt) {
    ProgramCache first = cache();
    EXPECT_EQ(value_of(first), 7.0F);
    const std::string whole = test::bytes_of(only_file());
    // Magic, length of the key, key, and from there evenly to the last byte.
    std::vector<std::size_t> places{0, 15, 17, 23, 24, 25, 30, whole.size() - 1};
    for (std::size_t i = 1; i < 12; ++i) places.push_back(whole.size() * i / 12);
    for (const std::size_t place : places) {
        SCOPED_TRACE(place);
        std::string damaged = whole;
        damaged[place] = static_cast<char>(damaged[place] ^ 0x20);
        expect_rebuilt(damaged);
    }
}

TEST_F(ProgramCaches, ForeignContentIsRebuilt) {
    ProgramCache first = cache();
    EXPECT_EQ(value_of(first), 7.0F);
    const std::string whole = test::bytes_of(only_file());
    {
        SCOPED_TRACE("more than the program");
        expect_rebuilt(whole + "x");
    }
    {
        SCOPED_TRACE("another version");
        std::string damaged = whole;
        const std::size_t digit = damaged.find(" 1\n");
        ASSERT_LT(digit, 20U);
        damaged[digit + 1] = '0';
        expect_rebuilt(damaged);
    }
    {
        SCOPED_TRACE("lengths that overflow");
        std::string damaged = whole;
        const std::size_t length = damaged.find('\n') + 1;
        damaged.replace(length, 8, 8, '\xFF');
        expect_rebuilt(damaged);
    }
    {
        SCOPED_TRACE("a whole file of another program");
        const test::TemporaryFolder elsewhere;
        ProgramCache other = cache(elsewhere.path());
        EXPECT_EQ(value_of(other, 8), 8.0F);
        expect_rebuilt(test::bytes_of(elsewhere / elsewhere.names().front()));
    }
    {
        SCOPED_TRACE("a text");
        expect_rebuilt("not a kernel\n");
    }
}

TEST_F(ProgramCaches, RefusedBinariesAreRebuilt) {
    // Right in every respect, but for a driver that no longer takes it: key and checksum agree with an empty
    // binary's.
    ProgramCache first = cache();
    EXPECT_EQ(value_of(first), 7.0F);
    const std::string whole = test::bytes_of(only_file());
    const std::size_t header = whole.find('\n') + 1;
    std::uint64_t key_length = 0;
    std::copy_n(whole.begin() + static_cast<std::ptrdiff_t>(header), 8, reinterpret_cast<char*>(&key_length));
    std::string refused = whole.substr(0, header + 8 + key_length);
    const auto append = [&](const std::string& part) {
        const std::uint64_t size = part.size();
        refused.append(reinterpret_cast<const char*>(&size), 8).append(part);
    };
    append("cbf29ce4842223259ae16a3b2f90404f");  // FNV-1a of nothing: its two starting values
    append("");
    expect_rebuilt(refused);
}

TEST_F(ProgramCaches, WorksWhereNothingCanBeStored) {
    const std::filesystem::path file = folder_ / "file";
    test::put_bytes(file, "in the way");
    // No cache, a file in its place, a folder below a file, one that even root cannot make.
    for (const std::filesystem::path& place :
         {std::filesystem::path{}, file, file / "below", std::filesystem::path("/proc/btfield")}) {
        SCOPED_TRACE(place);
        ProgramCache programs = cache(place);
        EXPECT_EQ(value_of(programs), 7.0F);
        EXPECT_EQ(value_of(programs), 7.0F);
        expect_statistics(programs, 1, 0, 0);
    }
    EXPECT_EQ(folder_.names(), std::vector<std::string>{"file"});
    EXPECT_EQ(test::bytes_of(file), "in the way");
}

TEST_F(ProgramCaches, FolderInPlaceOfAFileIsDoneWithout) {
    {
        ProgramCache first = cache();
        EXPECT_EQ(value_of(first), 7.0F);
    }
    const std::filesystem::path path = only_file();
    std::filesystem::remove(path);
    std::filesystem::create_directories(path / "deep");
    ProgramCache second = cache();
    EXPECT_EQ(value_of(second), 7.0F);
    EXPECT_EQ(second.statistics().compiled, 1);
    EXPECT_EQ(only_file(), path);
}

TEST_F(ProgramCaches, FullDiskLeavesNothingBehind) {
    const std::filesystem::path place = folder_ / "cache";
    // Drivers write files too, the source among them. Ours holds the source and more: with a long comment
    // there is a limit between.
    const std::string large = "/*" + std::string(std::size_t{4} << 20, '-') + "*/\n" + source;
    ProgramCache programs = cache(place);
    {
        const test::FullDisk full(large.size() + 16);
        EXPECT_EQ(value_of(programs, 7, large), 7.0F);
    }
    expect_statistics(programs, 1, 0, 0);
    EXPECT_TRUE(std::filesystem::is_empty(place));
    ProgramCache after = cache(place);
    EXPECT_EQ(value_of(after, 7, large), 7.0F);
    expect_statistics(after, 1, 0, 0);
    EXPECT_FALSE(std::filesystem::is_empty(place));
}

TEST_F(ProgramCaches, BuildFailuresPointAtFileAndLine) {
    ProgramCache programs = cache();
    const std::string broken = "#line 1 \"kernels/broken.cl\"\n// fine\n\n__kernel void k() { abacus(); ]\n";
    try {
        programs.kernel_from_source("broken", broken, "k", "-DVALUE=7");
        ADD_FAILURE() << "a program that cannot be built was built";
    } catch (const DeviceError& error) {
        EXPECT_NE(error.log().find("kernels/broken.cl:3"), std::string::npos) << error.log();
        const std::string text = error.what();
        EXPECT_NE(text.find("build kernels/broken.cl"), std::string::npos) << text;
        EXPECT_NE(text.find("CL_BUILD_PROGRAM_FAILURE"), std::string::npos) << text;
        EXPECT_NE(text.find("-DVALUE=7"), std::string::npos) << text;
        EXPECT_NE(text.find(device_.info().name), std::string::npos) << text;
        EXPECT_EQ(text.find('\n'), std::string::npos) << text;
    }
    EXPECT_TRUE(folder_.names().empty());
    EXPECT_EQ(value_of(programs), 7.0F);  // one failure does not spoil the rest
}

TEST_F(ProgramCaches, MissingMacrosAreNamed) {
    ProgramCache programs = cache();
    for (const std::string stem : {"noise", "pyramid", "spectral_factors", "fft"}) {
        const std::string text(embedded_kernel(stem));
        std::vector<std::string> macros, files;
        const std::regex guard("#ifndef (BTFIELD_[A-Z_]+)\n#error \"\\1 ");
        for (std::sregex_iterator i(text.begin(), text.end(), guard), end; i != end; ++i) {
            if (std::ranges::find(macros, (*i)[1].str()) != macros.end())
                continue;  // asked again further down
            macros.push_back((*i)[1]);
            const std::size_t line = text.rfind("\n#line ", static_cast<std::size_t>(i->position()));
            const std::size_t name = text.find('"', line == std::string::npos ? 0 : line) + 1;
            files.push_back(text.substr(name, text.find('"', name) - name) + ":");
        }
        ASSERT_FALSE(macros.empty()) << stem;
        EXPECT_EQ(macros.front(), "BTFIELD_VECTOR_WIDTH");
        EXPECT_EQ(files.front(), "kernels/base/lanes.clh:");
        for (std::size_t n = 0; n < macros.size(); ++n) {
            const std::string& missing = macros[n];
            SCOPED_TRACE(stem + " without " + missing);
            BuildParameters parameters;
            for (const std::string& macro : macros)
                if (macro != missing) parameters.set(macro, 1);
            try {
                programs.kernel(stem, "any", parameters);
                ADD_FAILURE() << "it was built";
            } catch (const DeviceError& error) {
                const std::string wanted = missing + " (";
                EXPECT_NE(error.log().find(wanted), std::string::npos) << error.log();
                EXPECT_NE(std::string(error.what()).find(wanted), std::string::npos) << error.what();
                EXPECT_NE(error.log().find(files[n]), std::string::npos) << error.log();
            }
        }
    }
}

TEST(BuildParameters, OptionsDoNotDependOnTheOrderOfSetting) {
    const std::string ab = BuildParameters().set("A", 1).set("B", -2).options();
    EXPECT_EQ(ab, "-DA=1 -DB=-2");
    EXPECT_EQ(BuildParameters().set("B", -2).set("A", 1).options(), ab);
    EXPECT_EQ(BuildParameters().set("A", 3).set("A", 1).set("B", -2).options(), ab);
    EXPECT_EQ(BuildParameters().options(), "");
}

}  // namespace
}  // namespace btfield

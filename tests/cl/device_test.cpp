#include "btfield/device.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <ctime>
#include <limits>
#include <optional>

#include "btfield/error.hpp"
#include "tests/device_cases.hpp"
#include "tests/temporary_folder.hpp"

namespace btfield {
namespace {

/// An environment variable with another value, or none, while it lives.
class Environment {
  public:
    Environment(const char* name, const char* value) : name_(name) {
        if (const char* before = std::getenv(name)) before_ = before;
        set(value);
    }
    ~Environment() { set(before_ ? before_->c_str() : nullptr); }
    Environment(const Environment&) = delete;
    Environment& operator=(const Environment&) = delete;

  private:
    void set(const char* value) const {
        if (value)
            ::setenv(name_, value, 1);
        else
            ::unsetenv(name_);
    }
    const char* name_;
    std::optional<std::string> before_;
};

DeviceInfo default_device() {
    const std::vector<DeviceInfo> all = list_devices();
    const auto found = std::find_if(all.begin(), all.end(), [](const DeviceInfo& i) { return i.is_default; });
    return found == all.end() ? DeviceInfo{} : *found;
}

void expect_same(const DeviceInfo& a, const DeviceInfo& b) {
    EXPECT_EQ(a.platform_index, b.platform_index);
    EXPECT_EQ(a.device_index, b.device_index);
    EXPECT_EQ(a.platform, b.platform);
    EXPECT_EQ(a.name, b.name);
}

std::string error_of(std::string_view spec) {
    try {
        Device device(spec);
    } catch (const DeviceError& error) {
        return error.what();
    }
    return {};
}

/// A vector of normals: the smallest launch of a kernel of this project.
void launch_something(Device& device) {
    device.impl().launch(device.impl().kernel("noise", "philox_block", device.impl().lanes()), {1},
                         Grain::fine, device.impl().buffer(256), device.impl().buffer(256), std::uint32_t{1},
                         std::uint32_t{2}, int{16});
}

TEST(Device, ListHasOneDefaultAndPlausibleEntries) {
    const std::vector<DeviceInfo> all = list_devices();
    ASSERT_FALSE(all.empty()) << "no OpenCL device on this machine";
    EXPECT_EQ(std::count_if(all.begin(), all.end(), [](const DeviceInfo& i) { return i.is_default; }), 1);
    for (const DeviceInfo& info : all) {
        EXPECT_FALSE(info.name.empty());
        EXPECT_FALSE(info.platform.empty());
        EXPECT_GE(info.compute_units, 1);
        EXPECT_GT(info.memory_bytes, 0U);
        EXPECT_EQ(std::count_if(all.begin(), all.end(),
                                [&](const DeviceInfo& other) {
                                    return other.platform_index == info.platform_index &&
                                           other.device_index == info.device_index;
                                }),
                  1);
    }
    const bool has_gpu =
        std::any_of(all.begin(), all.end(), [](const DeviceInfo& i) { return i.type == DeviceType::gpu; });
    EXPECT_EQ(default_device().type == DeviceType::gpu, has_gpu);
}

TEST(Device, SpecsOpenWhatTheyName) {
    const DeviceInfo wanted = default_device();
    const std::string platform = std::to_string(wanted.platform_index),
                      index = std::to_string(wanted.device_index);
    std::string shouting = wanted.name;
    std::transform(shouting.begin(), shouting.end(), shouting.begin(),
                   [](unsigned char c) { return static_cast<char>(std::toupper(c)); });
    for (const std::string& spec :
         {std::string("auto"), platform + ":" + index, wanted.platform + ":" + wanted.name,
          platform + ":" + wanted.name, wanted.platform.substr(0, 5) + ":" + index, wanted.name, shouting,
          wanted.name.substr(1)}) {
        SCOPED_TRACE(spec);
        const Device device(spec);
        expect_same(device.info(), wanted);
    }
}

TEST(Device, SpecsByTypeOpenThatType) {
    for (const DeviceType type : {DeviceType::cpu, DeviceType::gpu}) {
        const std::vector<DeviceInfo> all = list_devices();
        const auto first =
            std::find_if(all.begin(), all.end(), [&](const DeviceInfo& i) { return i.type == type; });
        if (first == all.end())
            EXPECT_NE(error_of(name(type)), "");
        else
            expect_same(Device(name(type)).info(), *first);
    }
    EXPECT_EQ(name(DeviceType::cpu), "cpu");
    EXPECT_EQ(name(DeviceType::gpu), "gpu");
    EXPECT_EQ(name(DeviceType::accelerator), "accelerator");
}

TEST(Device, EmptySpecFollowsTheEnvironment) {
    const DeviceInfo wanted = default_device();
    {
        const Environment unset("BTFIELD_DEVICE", nullptr);
        expect_same(Device().info(), wanted);
    }
    {
        const Environment named("BTFIELD_DEVICE", wanted.name.c_str());
        expect_same(Device().info(), wanted);
    }
    {
        const Environment empty("BTFIELD_DEVICE", "");
        expect_same(Device().info(), wanted);
    }
    const Environment wrong("BTFIELD_DEVICE", "abacus");
    const std::string error = error_of("");
    EXPECT_NE(error.find("abacus"), std::string::npos) << error;
    EXPECT_NE(error.find("BTFIELD_DEVICE"), std::string::npos) << error;
    expect_same(Device("auto").info(), wanted);  // an explicit spec stands above the environment
}

TEST(Device, UnknownSpecsListWhatThereIs) {
    for (const char* spec : {"abacus", "99:0", "0:99", ":", "99:", ":abacus", "-1:0", "0x0:0"}) {
        SCOPED_TRACE(spec);
        const std::string error = error_of(spec);
        EXPECT_NE(error.find(spec), std::string::npos) << error;
        for (const DeviceInfo& info : list_devices()) {
            EXPECT_NE(error.find(info.name), std::string::npos) << error;
            EXPECT_NE(
                error.find(std::to_string(info.platform_index) + ":" + std::to_string(info.device_index)),
                std::string::npos)
                << error;
        }
        EXPECT_EQ(error.find('\n'), std::string::npos) << error;
    }
}

TEST(Device, VectorWidths) {
    for (const int width : test::vector_widths) EXPECT_EQ(test::device_of_width(width).vector_width(), width);
    for (const int width : {-1, 2, 3, 5, 12, 17, 32, 64})
        EXPECT_THROW(test::device_of_width(width), InputError);

    const Device device;
    const int native = device.info().vector_width;
    if (device.info().type == DeviceType::cpu)
        EXPECT_EQ(device.vector_width(), native >= 16 ? 16 : native >= 8 ? 8 : native >= 4 ? 4 : 1);
    else
        EXPECT_EQ(device.vector_width(), 1);
}

TEST(Device, TwoDevicesCoexist) {
    Device a = test::device_of_width(4);
    std::optional<Device> b = test::device_of_width(8);
    const std::vector<float> left{1.0F, 2.0F, 3.0F}, right{4.0F, 5.0F};
    const Buffer in_a = a.impl().upload(left);
    {
        const Buffer in_b = b->impl().upload(right);
        launch_something(a);
        launch_something(*b);
        launch_something(a);
        EXPECT_EQ(test::read_all<float>(*b, in_b), right);
    }
    EXPECT_EQ(a.launch_count(), 2U);
    EXPECT_EQ(b->launch_count(), 1U);
    b.reset();
    EXPECT_EQ(test::read_all<float>(a, in_a), left);
    launch_something(a);
    a.impl().finish();

    Device moved = std::move(a);
    EXPECT_EQ(moved.vector_width(), 4);
    EXPECT_EQ(moved.launch_count(), 3U);
    EXPECT_EQ(test::read_all<float>(moved, in_a), left);
}

TEST(Device, LaunchRefusesWrongArgumentsAndEmptyRanges) {
    Device device;
    DeviceImpl& impl = device.impl();
    const Kernel kernel = impl.kernel("noise", "philox_block", impl.lanes());
    const Buffer words = impl.buffer(256), counters = impl.buffer(256);
    const auto error = [&](auto&& launch) -> std::string {
        try {
            launch();
        } catch (const DeviceError& e) {
            return e.what();
        }
        return {};
    };
    const std::uint32_t key = 1;
    const int count = 16;
    const std::string errors[] = {
        error([&] { impl.launch(kernel, {1}, Grain::fine, words, counters, key, key); }),
        error([&] { impl.launch(kernel, {1}, Grain::fine, words, counters, key, key, count, count); }),
        error([&] { impl.launch(kernel, {1}, Grain::fine); }),
        error([&] { impl.launch(kernel, {1}, Grain::fine, words, counters, key, key, std::uint64_t{16}); }),
        error([&] { impl.launch(kernel, {0}, Grain::fine, words, counters, key, key, count); }),
        error([&] {
            impl.launch(kernel, {1, 0}, Grain::fine, words, counters, key, key, count);
        }),
        error([&] {
            impl.launch(kernel, {1, 1, 0}, Grain::coarse, words, counters, key, key, count);
        }),
    };
    for (const std::string& text : errors) {
        EXPECT_NE(text.find("philox_block"), std::string::npos) << text;
        EXPECT_NE(text.find(device.info().name), std::string::npos) << text;
    }
    EXPECT_NE(errors[0].find("takes 5 arguments, 4 were given"), std::string::npos) << errors[0];
    EXPECT_NE(errors[4].find("global size is 0"), std::string::npos) << errors[4];
    EXPECT_EQ(device.launch_count(), 0U);
    EXPECT_NO_THROW(impl.launch(kernel, {1}, Grain::fine, words, counters, key, key, count));
    EXPECT_EQ(device.launch_count(), 1U);
}

TEST(Device, MissingKernelsAndProgramsAreNamed) {
    Device device;
    DeviceImpl& impl = device.impl();
    EXPECT_THROW(impl.kernel("abacus", "count", impl.lanes()), DeviceError);
    try {
        impl.kernel("noise", "abacus", impl.lanes());
        ADD_FAILURE() << "a kernel that does not exist was found";
    } catch (const DeviceError& error) {
        EXPECT_NE(std::string(error.what()).find("abacus"), std::string::npos) << error.what();
        EXPECT_NE(std::string(error.what()).find("kernels/synthesis/noise.cl"), std::string::npos)
            << error.what();
    }
}

TEST(Device, CopiesStayInsideTheirBuffers) {
    Device device;
    DeviceImpl& impl = device.impl();
    const std::vector<float> values{1.0F, 2.0F, 3.0F, 4.0F};
    const Buffer buffer = impl.upload(values);
    std::vector<float> back(2);
    impl.read(buffer, back.data(), 8, 8);
    EXPECT_EQ(back, (std::vector<float>{3.0F, 4.0F}));
    impl.write(buffer, values.data(), 4, 12);
    EXPECT_EQ(test::read_all<float>(device, buffer), (std::vector<float>{1.0F, 2.0F, 3.0F, 1.0F}));

    const Buffer empty = impl.upload(std::vector<float>{});
    impl.read(empty, back.data(), 0);

    std::vector<float> large(8);
    EXPECT_THROW(impl.read(buffer, large.data(), 20), DeviceError);
    EXPECT_THROW(impl.read(buffer, large.data(), 8, 12), DeviceError);
    EXPECT_THROW(impl.read(buffer, large.data(), 4, std::numeric_limits<std::size_t>::max() - 3),
                 DeviceError);
    EXPECT_THROW(impl.write(buffer, large.data(), 20), DeviceError);
    EXPECT_THROW(impl.write(buffer, large.data(), 4, 16), DeviceError);
    EXPECT_THROW(impl.write(buffer, large.data(), 4, std::numeric_limits<std::size_t>::max() - 3),
                 DeviceError);
}

TEST(Device, ProfileSumsLaunchesByKernel) {
    DeviceOptions options;
    options.profile = true;
    Device device({}, options);
    EXPECT_TRUE(device.take_profile().empty());
    launch_something(device);
    launch_something(device);
    DeviceImpl& impl = device.impl();
    const Buffer field = impl.buffer(sizeof(float) << 20), keys = test::upload_seeds(device, {1});
    impl.launch(impl.kernel("noise", "normal_field", impl.lanes()),
                {(1 << 14) / static_cast<std::size_t>(device.vector_width()), 16}, Grain::fine, field, keys,
                int{16}, int{1 << 16}, int{1}, std::uint32_t{0});

    const std::vector<ProfileEntry> profile = device.take_profile();
    ASSERT_EQ(profile.size(), 2U);
    EXPECT_GE(profile[0].seconds, profile[1].seconds);
    for (const ProfileEntry& entry : profile) {
        EXPECT_GT(entry.seconds, 0.0) << entry.kernel;
        EXPECT_LT(entry.seconds, 60.0) << entry.kernel;
        EXPECT_EQ(entry.launches, entry.kernel == "philox_block" ? 2 : 1) << entry.kernel;
    }
    EXPECT_EQ(profile[0].kernel, "normal_field");  // a million normals against one vector of words
    EXPECT_EQ(profile[1].kernel, "philox_block");
    EXPECT_EQ(device.launch_count(), 3U);
    EXPECT_TRUE(device.take_profile().empty());
    launch_something(device);
    EXPECT_EQ(device.take_profile().size(), 1U);
    EXPECT_EQ(device.launch_count(), 4U);
}

TEST(Device, NoProfileUnlessAskedFor) {
    Device device;
    launch_something(device);
    EXPECT_TRUE(device.take_profile().empty());
    EXPECT_EQ(device.launch_count(), 1U);
}

/// The CPU device of the machine, of which parts can be had.
DeviceInfo cpu_device() {
    return Device("cpu").info();
}

/// Processor time of this process over the time that passes while the device draws noise.
double cores_in_use(Device& device) {
    DeviceImpl& impl = device.impl();
    const Buffer field = impl.buffer(sizeof(float) << 22), keys = test::upload_seeds(device, {1});
    const auto draw = [&] {
        for (int repeat = 0; repeat < 20; ++repeat)
            impl.launch(impl.kernel("noise", "normal_field", impl.lanes()),
                        {(1 << 12) / static_cast<std::size_t>(device.vector_width()), 1024}, Grain::fine,
                        field, keys, int{1024}, int{1 << 12}, int{1}, std::uint32_t{0});
        impl.finish();
    };
    draw();
    const auto start = std::chrono::steady_clock::now();
    const std::clock_t before = std::clock();
    draw();
    const double processor = static_cast<double>(std::clock() - before) / CLOCKS_PER_SEC;
    return processor / std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

TEST(Device, ThreadsOfACpuAreAsManyAsAskedFor) {
    DeviceOptions options;
    options.threads = 1;
    Device one("cpu", options);
    EXPECT_EQ(one.info().compute_units, 1);
    EXPECT_EQ(one.info().name, cpu_device().name);
    // Intel's driver lets the thread that waits compute beside the one asked for.
    const bool waits_idly = one.info().platform.find("Intel") == std::string::npos;
    EXPECT_LT(cores_in_use(one), waits_idly ? 1.2 : 2.2);
    options.threads = 1000000;
    EXPECT_EQ(Device("cpu", options).info().compute_units, cpu_device().compute_units);
    options.threads = -1;
    EXPECT_THROW(Device("cpu", options), InputError);
}

TEST(Device, ThreadsFollowTheEnvironment) {
    {
        const Environment one("BTFIELD_THREADS", "1");
        EXPECT_EQ(cpu_device().compute_units, 1);
    }
    for (const char* text : {"0", "-1", "two", "1.5", "99999999999"}) {
        const Environment wrong("BTFIELD_THREADS", text);
        try {
            Device device("cpu");
            ADD_FAILURE() << text;
        } catch (const InputError& error) {
            EXPECT_NE(std::string(error.what()).find("'" + std::string(text) + "'"), std::string::npos)
                << error.what();
        }
    }
}

TEST(Device, MemoryIsPlannedAsAskedFor) {
    Device all;
    const auto whole = static_cast<double>(all.info().memory_bytes);
    EXPECT_LT(all.impl().memory_limit(), whole);
    DeviceOptions options;
    options.memory_bytes = 5'000'000;
    EXPECT_EQ(Device({}, options).impl().memory_limit(), 5e6);
    options.memory_bytes = std::numeric_limits<std::uint64_t>::max();
    EXPECT_EQ(Device({}, options).impl().memory_limit(), whole);
    const Environment environment("BTFIELD_MEMORY", "7M");
    EXPECT_EQ(Device().impl().memory_limit(), 7e6);
    options.memory_bytes = 5'000'000;
    EXPECT_EQ(Device({}, options).impl().memory_limit(), 5e6);
    const Environment wrong("BTFIELD_MEMORY", "much");
    EXPECT_THROW(Device(), InputError);
}

TEST(Device, CacheFolderFollowsOptionsThenEnvironment) {
    const test::TemporaryFolder own, base, home, given;
    const auto files_after_launch = [](const std::filesystem::path& folder, const DeviceOptions& options) {
        Device device({}, options);
        launch_something(device);
        if (!std::filesystem::exists(folder)) return std::ptrdiff_t{0};
        return std::distance(std::filesystem::directory_iterator(folder), {});
    };
    DeviceOptions explicit_folder;
    explicit_folder.cache_dir = given.path();
    const Environment a("BTFIELD_CACHE_DIR", own.path().c_str());
    const Environment b("XDG_CACHE_HOME", base.path().c_str());
    const Environment c("HOME", home.path().c_str());
    EXPECT_EQ(files_after_launch(given.path(), explicit_folder), 1);
    EXPECT_TRUE(own.names().empty());
    DeviceOptions none;
    none.disk_cache = false;
    EXPECT_EQ(files_after_launch(own.path(), none), 0);
    EXPECT_EQ(files_after_launch(own.path(), {}), 1);
    const Environment no_own("BTFIELD_CACHE_DIR", nullptr);
    EXPECT_EQ(files_after_launch(base.path() / "btfield", {}), 1);
    const Environment no_base("XDG_CACHE_HOME", nullptr);
    EXPECT_EQ(files_after_launch(home.path() / ".cache" / "btfield", {}), 1);
}

}  // namespace
}  // namespace btfield

#include "btfield/ceilings.hpp"

#include <gtest/gtest.h>

#include <cstddef>
#include <cstdint>
#include <vector>

#include "host/cl/device_impl.hpp"
#include "tests/device_cases.hpp"

namespace btfield {

using namespace detail;

namespace {

TEST(Ceilings, TheNearerOneCounts) {
    const Ceilings ceilings{.bytes_per_second = 10e9, .operations_per_second = 100e9, .launch_seconds = 0};
    ProfileEntry kernel{.kernel = "k", .launches = 1, .seconds = 2.0, .bytes = 10e9, .operations = 20e9};
    EXPECT_DOUBLE_EQ(share_of_ceiling(kernel, ceilings), 0.5);
    kernel.operations = 150e9;
    EXPECT_DOUBLE_EQ(share_of_ceiling(kernel, ceilings), 0.75);
    kernel.bytes = kernel.operations = 0.0;
    EXPECT_EQ(share_of_ceiling(kernel, ceilings), 0.0);
    kernel.bytes = 1.0;
    kernel.seconds = 0.0;
    EXPECT_EQ(share_of_ceiling(kernel, ceilings), 0.0);
}

class CeilingsSmall : public testing::TestWithParam<int> {
  protected:
    Device device_ = test::device_of_width(GetParam());
};
INSTANTIATE_TEST_SUITE_P(Widths, CeilingsSmall, testing::ValuesIn(test::vector_widths),
                         testing::PrintToStringParamName());

TEST_P(CeilingsSmall, CopiesAreWholeAndMultiplyAddsAreDone) {
    DeviceImpl& impl = device_.impl();
    const auto lanes = static_cast<std::size_t>(impl.vector_width());
    const std::size_t items = 11, count = items * lanes;
    std::vector<float> values(count), found(count);
    for (std::size_t i = 0; i < count; ++i) values[i] = static_cast<float>(i) + 0.5F;
    const Buffer in = impl.upload(values), out = impl.buffer(sizeof(float) * count);
    impl.launch(impl.kernel("ceilings", "copy_values", impl.lanes()), {items}, Grain::fine, in, out,
                static_cast<std::uint32_t>(count));
    impl.read(out, found.data(), sizeof(float) * count);
    EXPECT_EQ(found, values);

    // Twelve chains from item + lane + c: x ← x/2 + 1, thrice, is x/8 + 1.75, exactly.
    const std::size_t padded = (items + impl.largest_group(Grain::fine)) * lanes;
    const Buffer sums = impl.buffer(sizeof(float) * padded);
    impl.launch(impl.kernel("ceilings", "multiply_add", impl.lanes()), {items}, Grain::fine, sums, 0.5F, 1.0F,
                3);
    impl.read(sums, found.data(), sizeof(float) * count);
    for (std::size_t i = 0; i < count; ++i) {
        const auto start = static_cast<float>(i / lanes + i % lanes);
        EXPECT_EQ(found[i], 12.0F * (start / 8.0F + 1.75F) + 66.0F / 8.0F) << "item and lane " << i;
    }
}

TEST(Profile, TellsBytesAndOperations) {
    DeviceOptions options;
    options.profile = true;
    Device device("", options);
    DeviceImpl& impl = device.impl();
    const auto lanes = static_cast<std::uint32_t>(impl.vector_width());
    const Buffer in = impl.upload(std::vector<float>(lanes)), out = impl.buffer(sizeof(float) * lanes);
    const Kernel copy = impl.kernel("ceilings", "copy_values", impl.lanes());
    impl.launch(copy, {1}, Grain::fine, in, out, lanes);
    impl.launch(copy, {1}, Grain::fine, LaunchWork{.bytes = 100.0, .operations = 7.0}, in, out, lanes);
    const std::vector<ProfileEntry> profile = device.take_profile();
    ASSERT_EQ(profile.size(), 1U);
    EXPECT_EQ(profile[0].launches, 2);
    EXPECT_EQ(profile[0].bytes, 100.0 + 2.0 * sizeof(float) * lanes);
    EXPECT_EQ(profile[0].operations, 7.0);
}

}  // namespace
}  // namespace btfield

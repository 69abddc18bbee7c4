#include "host/cl/host_memory.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>
#include <span>
#include <utility>
#include <vector>

#include "host/base/huge_pages.hpp"
#include "tests/device_cases.hpp"

namespace btfield {
namespace {

constexpr std::size_t count = 3 * huge_page / (2 * sizeof(float));

class HostMemories : public testing::Test {
  protected:
    HostMemories() : at_(map_huge(count * sizeof(float))) {}
    ~HostMemories() override { unmap_huge(at_, count * sizeof(float)); }
    HostMemories(const HostMemories&) = delete;
    HostMemories& operator=(const HostMemories&) = delete;
    [[nodiscard]] std::span<float> memory() const { return {static_cast<float*>(at_), count}; }

    Device device_;

  private:
    void* at_;
};

TEST_F(HostMemories, AreLargeAndAligned) {
    const bool shares = device_.impl().shares_memory();
    EXPECT_EQ(HostMemory::suits(device_.impl(), memory()), shares);
    EXPECT_TRUE(shares || device_.info().type != DeviceType::cpu);
    EXPECT_FALSE(HostMemory::suits(device_.impl(), memory().subspan(16)));
    EXPECT_FALSE(HostMemory::suits(device_.impl(), memory().first(huge_page / sizeof(float) - 1)));
}

TEST_F(HostMemories, HoldWhatTheDeviceLeaves) {
    DeviceImpl& device = device_.impl();
    std::vector<float> values(count);
    std::iota(values.begin(), values.end(), 1.0F);
    HostMemory target(device, memory());
    const Buffer source = device.upload(values);
    EXPECT_EQ(target.buffer().bytes(), count * sizeof(float));
    device.launch(device.kernel("ceilings", "copy_values", device.lanes()),
                  {count / static_cast<std::size_t>(device.vector_width())}, Grain::fine, source,
                  target.buffer(), static_cast<std::uint32_t>(count));
    target.show();
    target.wait();
    EXPECT_TRUE(std::ranges::equal(memory(), values));
}

TEST_F(HostMemories, WaitAtTheirEnd) {
    DeviceImpl& device = device_.impl();
    for (const bool shown : {false, true}) {
        std::ranges::fill(memory(), 0.0F);
        const std::vector<float> values(count, shown ? 2.0F : 1.0F);
        const Buffer source = device.upload(values);
        {
            HostMemory first(device, memory());
            for (int repeat = 0; repeat < 20; ++repeat)
                device.launch(device.kernel("ceilings", "copy_values", device.lanes()),
                              {count / static_cast<std::size_t>(device.vector_width())}, Grain::fine, source,
                              first.buffer(), static_cast<std::uint32_t>(count));
            if (shown) first.show();
            const HostMemory last = std::move(first);
        }
        // Nothing writes any more.
        EXPECT_TRUE(std::ranges::equal(memory(), values)) << shown;
    }
}

}  // namespace
}  // namespace btfield

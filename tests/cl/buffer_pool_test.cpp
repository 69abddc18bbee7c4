#include "host/cl/buffer_pool.hpp"

#include <gtest/gtest.h>

#include <optional>
#include <utility>

#include "btfield/error.hpp"
#include "tests/device_cases.hpp"

namespace btfield {

using namespace detail;

namespace {

constexpr std::size_t largest = std::size_t{1} << 20;

class BufferPools : public testing::Test {
  protected:
    Device device_;
    BufferPool pool_{device_.impl().context(), "a device", largest};
};

TEST_F(BufferPools, ReturnedMemoryIsLentAgain) {
    const cl::Buffer* first = nullptr;
    {
        const Buffer buffer = pool_.take(1000);
        EXPECT_TRUE(buffer);
        EXPECT_EQ(buffer.bytes(), 1000U);
        first = buffer.handle();
        EXPECT_EQ(pool_.idle_bytes(), 0U);
    }
    EXPECT_EQ(pool_.idle_bytes(), 1000U);
    const Buffer smaller = pool_.take(900);
    EXPECT_EQ(smaller.handle(), first);
    EXPECT_EQ(smaller.bytes(), 900U);
    EXPECT_EQ(pool_.idle_bytes(), 0U);
}

TEST_F(BufferPools, MemoryOnLoanIsNotLentTwice) {
    const Buffer a = pool_.take(1000), b = pool_.take(1000);
    EXPECT_NE(a.handle(), b.handle());
}

TEST_F(BufferPools, CapacitySurvivesASmallerLoan) {
    const cl::Buffer* first = nullptr;
    {
        const Buffer buffer = pool_.take(4000);
        first = buffer.handle();
    }
    { const Buffer smaller = pool_.take(100); }
    EXPECT_EQ(pool_.idle_bytes(), 4000U);
    EXPECT_EQ(pool_.take(4000).handle(), first);
}

TEST_F(BufferPools, SmallRequestsLeaveLargeMemoryAlone) {
    { const Buffer buffer = pool_.take(largest); }
    const Buffer small = pool_.take(16);
    EXPECT_EQ(pool_.idle_bytes(), largest);
    EXPECT_EQ(small.bytes(), 16U);
}

TEST_F(BufferPools, SmallestFittingMemoryIsTaken) {
    { const Buffer a = pool_.take(3000), b = pool_.take(2000), c = pool_.take(1000); }
    const Buffer buffer = pool_.take(1500);
    EXPECT_EQ(pool_.idle_bytes(), 3000U + 1000U);
}

TEST_F(BufferPools, NothingAskedForStillIsMemory) {
    const Buffer buffer = pool_.take(0);
    EXPECT_TRUE(buffer);
    EXPECT_NE(buffer.handle(), nullptr);
}

TEST_F(BufferPools, RefusesMoreThanTheDeviceAllocates) {
    EXPECT_NO_THROW((void)pool_.take(largest));
    try {
        (void)pool_.take(largest + 1);
        ADD_FAILURE() << "an allocation beyond the largest was made";
    } catch (const DeviceError& error) {
        const std::string text = error.what();
        EXPECT_NE(text.find(std::to_string(largest + 1)), std::string::npos) << text;
        EXPECT_NE(text.find("its largest allocation is " + std::to_string(largest)), std::string::npos)
            << text;
        EXPECT_NE(text.find("a device"), std::string::npos) << text;
    }
}

TEST_F(BufferPools, DeviceRefusesItsOwnLimit) {
    EXPECT_THROW((void)device_.impl().buffer(device_.impl().largest_allocation() + 1), DeviceError);
    EXPECT_THROW((void)device_.impl().buffer(std::numeric_limits<std::size_t>::max()), DeviceError);
}

TEST_F(BufferPools, ClearFreesIdleMemory) {
    const Buffer kept = pool_.take(500);
    { const Buffer buffer = pool_.take(1000); }
    pool_.clear();
    EXPECT_EQ(pool_.idle_bytes(), 0U);
    EXPECT_TRUE(kept);
}

TEST_F(BufferPools, MovesHandTheLoanOver) {
    Buffer a = pool_.take(1000);
    const cl::Buffer* const handle = a.handle();
    Buffer b = std::move(a);
    EXPECT_EQ(b.handle(), handle);
    EXPECT_EQ(b.bytes(), 1000U);
    EXPECT_FALSE(a);  // NOLINT(bugprone-use-after-move): moved-from buffers are empty
    EXPECT_EQ(a.bytes(), 0U);
    EXPECT_EQ(pool_.idle_bytes(), 0U);

    Buffer c = pool_.take(2000);
    c = std::move(b);
    EXPECT_EQ(c.handle(), handle);
    EXPECT_EQ(pool_.idle_bytes(), 2000U);  // what c held before went back
    EXPECT_FALSE(b);                       // NOLINT(bugprone-use-after-move)
    Buffer& same = c;
    c = std::move(same);
    EXPECT_EQ(c.handle(), handle);
    c = Buffer();
    EXPECT_EQ(pool_.idle_bytes(), 3000U);
}

TEST_F(BufferPools, BuffersOutliveTheirPool) {
    std::optional<BufferPool> pool(std::in_place, device_.impl().context(), "a device", largest);
    Buffer buffer = pool->take(1000);
    pool.reset();
    const std::vector<float> values{1.0F, 2.0F};
    device_.impl().write(buffer, values.data(), 8);
    std::vector<float> back(2);
    device_.impl().read(buffer, back.data(), 8);
    EXPECT_EQ(back, values);
}

}  // namespace
}  // namespace btfield

#include "btfield/ceilings.hpp"

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <cstdint>

#include "host/cl/device_impl.hpp"

namespace btfield {

using namespace detail;

namespace {

constexpr int runs = 7;

/// Seconds of the fastest run, after one that is not counted.
template <class Work>
double fastest(DeviceImpl& device, Work work) {
    double best = 0.0;
    for (int run = 0; run <= runs; ++run) {
        const auto start = std::chrono::steady_clock::now();
        work();
        device.finish();
        const double seconds =
            std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
        if (run == 1 || (run > 1 && seconds < best)) best = seconds;
    }
    return best;
}

double copied_bytes_per_second(DeviceImpl& device) {
    // More than any last-level cache of a desktop holds, if the device has it.
    const std::size_t wanted = std::size_t{128} << 20;
    const auto lanes = static_cast<std::size_t>(device.vector_width());
    const std::size_t most = std::min(
        {wanted, device.largest_allocation(), static_cast<std::size_t>(device.memory_limit() / 4.0)});
    const std::size_t count = std::max<std::size_t>(most / sizeof(float) / lanes, 1) * lanes;
    const Buffer in = device.buffer(sizeof(float) * count), out = device.buffer(sizeof(float) * count);
    const Kernel copy = device.kernel("ceilings", "copy_values", device.lanes());
    const auto values = static_cast<std::uint32_t>(count);
    const double seconds = fastest(device, [&] {
        device.launch(copy, {count / lanes}, Grain::fine, in, out, values);
        device.launch(copy, {count / lanes}, Grain::fine, out, in, values);
    });
    return 4.0 * sizeof(float) * static_cast<double>(count) / seconds;
}

double multiply_adds_per_second(DeviceImpl& device) {
    constexpr double operations_of_step = 24.0;
    const auto lanes = static_cast<std::size_t>(device.vector_width());
    // Enough work-items to fill a device whose lanes are work-items.
    const std::size_t items = static_cast<std::size_t>(device.info().compute_units) *
                              (device.info().type == DeviceType::cpu ? 64 : 4096);
    const int steps = 1 << 13;
    const Buffer out = device.buffer(sizeof(float) * lanes * (items + device.largest_group(Grain::fine)));
    const Kernel kernel = device.kernel("ceilings", "multiply_add", device.lanes());
    const double seconds =
        fastest(device, [&] { device.launch(kernel, {items}, Grain::fine, out, 0.999F, 1e-3F, steps); });
    return operations_of_step * steps * static_cast<double>(items * lanes) / seconds;
}

double seconds_of_launch(DeviceImpl& device) {
    constexpr int launches = 256;
    const Buffer out = device.buffer(sizeof(float));
    const Kernel kernel = device.kernel("ceilings", "launch_only", device.lanes());
    const double seconds = fastest(device, [&] {
        for (int i = 0; i < launches; ++i) device.launch(kernel, {1}, Grain::fine, out);
    });
    return seconds / launches;
}

}  // namespace

Ceilings measure_ceilings(Device& device) {
    DeviceImpl& impl = device.impl();
    // What was enqueued before is not to be measured.
    impl.finish();
    return {copied_bytes_per_second(impl), multiply_adds_per_second(impl), seconds_of_launch(impl)};
}

double share_of_ceiling(const ProfileEntry& kernel, const Ceilings& ceilings) {
    const auto share = [&](double amount, double rate) {
        return kernel.seconds > 0.0 && rate > 0.0 ? amount / kernel.seconds / rate : 0.0;
    };
    return std::max(share(kernel.bytes, ceilings.bytes_per_second),
                    share(kernel.operations, ceilings.operations_per_second));
}

}  // namespace btfield

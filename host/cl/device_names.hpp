#pragma once

#include "btfield/device.hpp"
#include "host/base/names.hpp"

namespace btfield::detail {

template <>
struct Names<DeviceType> {
    static constexpr std::string_view what = "device type";
    static constexpr auto words = std::to_array<Word<DeviceType>>(
        {{DeviceType::cpu, "cpu"}, {DeviceType::gpu, "gpu"}, {DeviceType::accelerator, "accelerator"}});
};

}  // namespace btfield::detail

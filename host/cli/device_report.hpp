#pragma once

#include <vector>

#include "btfield/device.hpp"
#include "host/cli/report.hpp"

namespace btfield::cli {

/// The list `devices` of docs/command-line.md.
[[nodiscard]] Json devices_json(const std::vector<DeviceInfo>& devices);

}  // namespace btfield::cli

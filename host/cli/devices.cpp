#include <memory>

#include "btfield/device.hpp"
#include "host/cli/command.hpp"
#include "host/cli/command_text.hpp"
#include "host/cli/device_report.hpp"
#include "host/cli/options.hpp"
#include "host/cli/report.hpp"

namespace btfield::cli {

Json devices_json(const std::vector<DeviceInfo>& devices) {
    Json list = Json::array();
    for (const DeviceInfo& device : devices) {
        Json entry;
        entry["platform"] = device.platform;
        entry["name"] = device.name;
        entry["spec"] = std::to_string(device.platform_index) + ":" + std::to_string(device.device_index);
        entry["type"] = name(device.type);
        entry["default"] = device.is_default;
        entry["compute_units"] = device.compute_units;
        entry["vector_width"] = device.vector_width;
        entry["memory_bytes"] = device.memory_bytes;
        list.push_back(std::move(entry));
    }
    return list;
}

namespace {

void report_json(const std::vector<DeviceInfo>& devices) {
    Json object;
    object["devices"] = devices_json(devices);
    emit_json(object);
}

void report_text(const std::vector<DeviceInfo>& devices) {
    std::vector<std::vector<std::string>> rows{
        {"device", "name", "type", "units", "lanes", "memory", "platform", "default"}};
    for (const DeviceInfo& device : devices) {
        const std::string numbers =
            std::to_string(device.platform_index) + ":" + std::to_string(device.device_index);
        rows.push_back({numbers, device.name, std::string(name(device.type)),
                        std::to_string(device.compute_units), std::to_string(device.vector_width),
                        std::to_string(device.memory_bytes >> 20) + " MiB", device.platform,
                        device.is_default ? "yes" : ""});
    }
    emit_text(table(rows, "lllrrrll"));
}

void run(bool json) {
    const std::vector<DeviceInfo> devices = list_devices();
    if (devices.empty())
        warn("no OpenCL device is installed; install a driver, such as pocl-opencl-icd for the CPU");
    if (json) {
        report_json(devices);
    } else if (!devices.empty()) {
        report_text(devices);
    }
}

}  // namespace

void add_devices(CLI::App& app, Action& action) {
    CLI::App* command = app.add_subcommand("devices", "list the OpenCL devices");
    const auto json = std::make_shared<bool>(false);
    add_json(*command, *json);
    set_guide(*command, {.usual = {{"btfield devices"}},
                         .more = {{"btfield synth cork.json -o out.png --device cpu"},
                                  {"BTFIELD_DEVICE=0:0 btfield synth cork.json -o out.png"}}});
    command->callback([json, &action] { action = [json] { run(*json); }; });
}

}  // namespace btfield::cli

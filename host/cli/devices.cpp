#include <memory>

#include "btfield/ceilings.hpp"
#include "btfield/device.hpp"
#include "host/base/limits.hpp"
#include "host/cli/command.hpp"
#include "host/cli/command_text.hpp"
#include "host/cli/device_report.hpp"
#include "host/cli/options.hpp"
#include "host/cli/profile_text.hpp"
#include "host/cli/report.hpp"

namespace btfield::cli {

namespace {

std::string spec_of(const DeviceInfo& device) {
    return std::to_string(device.platform_index) + ":" + std::to_string(device.device_index);
}

/// Of each device in turn: no other is at work.
std::vector<Ceilings> measured(const std::vector<DeviceInfo>& devices) {
    std::vector<Ceilings> result;
    for (const DeviceInfo& info : devices) {
        Device device(spec_of(info));
        result.push_back(measure_ceilings(device));
    }
    return result;
}

}  // namespace

Json devices_json(const std::vector<DeviceInfo>& devices) {
    Json list = Json::array();
    for (const DeviceInfo& device : devices) {
        Json entry;
        entry["platform"] = device.platform;
        entry["name"] = device.name;
        entry["spec"] = spec_of(device);
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

/// \param ceilings of the devices, or none
void report_json(const std::vector<DeviceInfo>& devices, const std::vector<Ceilings>& ceilings) {
    Json object;
    Json& list = object["devices"] = devices_json(devices);
    for (std::size_t i = 0; i < ceilings.size(); ++i) {
        list[i]["copy_bytes_per_second"] = ceilings[i].bytes_per_second;
        list[i]["operations_per_second"] = ceilings[i].operations_per_second;
        list[i]["launch_seconds"] = ceilings[i].launch_seconds;
    }
    emit_json(object);
}

void report_text(const std::vector<DeviceInfo>& devices, const std::vector<Ceilings>& ceilings) {
    std::vector<std::vector<std::string>> rows{
        {"device", "name", "type", "units", "lanes", "memory", "platform", "default"}};
    for (const DeviceInfo& device : devices) {
        rows.push_back({spec_of(device), device.name, std::string(name(device.type)),
                        std::to_string(device.compute_units), std::to_string(device.vector_width),
                        std::to_string(device.memory_bytes >> 20) + " MiB", device.platform,
                        device.is_default ? "yes" : ""});
    }
    std::string text = table(rows, "lllrrrll");
    for (std::size_t i = 0; i < ceilings.size(); ++i)
        text += spec_of(devices[i]) + " reaches " + ceilings_text(ceilings[i]) + "\n";
    emit_text(text);
}

void run(bool measure, bool json) {
    const std::vector<DeviceInfo> devices = list_devices();
    if (devices.empty()) {
        const std::string limit = detail::address_space_text();
        warn(limit.empty()
                 ? "no OpenCL device is installed; install a driver, such as pocl-opencl-icd for the CPU"
                 : "no OpenCL driver loads, and " + limit + ", which may be too few for one; " +
                       detail::more_address_space);
    }
    const std::vector<Ceilings> ceilings = measure ? measured(devices) : std::vector<Ceilings>();
    if (json) {
        report_json(devices, ceilings);
    } else if (!devices.empty()) {
        report_text(devices, ceilings);
    }
}

}  // namespace

void add_devices(CLI::App& app, Action& action) {
    CLI::App* command = app.add_subcommand("devices", "list the OpenCL devices");
    const auto json = std::make_shared<bool>(false), measure = std::make_shared<bool>(false);
    command->add_flag("--measure", *measure,
                      "measure what each device reaches: copies, multiply-adds, launches");
    add_json(*command, *json);
    set_guide(*command, {.usual = {{"btfield devices"}, {"btfield devices --measure"}},
                         .more = {{"btfield synth cork.json -o out.png --device cpu"},
                                  {"BTFIELD_DEVICE=0:0 btfield synth cork.json -o out.png"}}});
    command->callback([measure, json, &action] { action = [measure, json] { run(*measure, *json); }; });
}

}  // namespace btfield::cli

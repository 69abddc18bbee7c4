#include "btfield/version.hpp"

#include <memory>
#include <string>

#include "host/cli/command.hpp"
#include "host/cli/command_text.hpp"
#include "host/cli/device_report.hpp"
#include "host/cli/options.hpp"
#include "host/cli/report.hpp"

namespace btfield::cli {
namespace {

#ifdef NDEBUG
constexpr bool checked = false;
#else
constexpr bool checked = true;
#endif
#ifdef BTFIELD_MPI
constexpr bool with_mpi = true;
#else
constexpr bool with_mpi = false;
#endif
#ifdef __clang__
constexpr const char* compiler = __VERSION__;
#else
constexpr const char* compiler = "GCC " __VERSION__;
#endif

void report_json(const std::vector<DeviceInfo>& devices) {
    Json object;
    object["version"] = version();
    object["command_version"] = BTFIELD_VERSION;
    object["opencl"] = "1.2";
    object["build"] = {{"compiler", compiler}, {"assertions", checked}, {"mpi", with_mpi}};
    object["devices"] = devices_json(devices);
    emit_json(object);
}

void report_text(const std::vector<DeviceInfo>& devices) {
    std::string text = "btfield " + std::string(version()) + ", built by " + compiler +
                       (checked ? ", with assertions" : "") + (with_mpi ? ", with MPI" : "") + "\n";
    if (devices.empty()) text += "no OpenCL device\n";
    for (const DeviceInfo& device : devices)
        text += std::to_string(device.platform_index) + ":" + std::to_string(device.device_index) + " " +
                device.name + ", " + device.platform + "\n";
    emit_text(text);
}

void run(bool json) {
    const std::vector<DeviceInfo> devices = list_devices();
    if (json)
        report_json(devices);
    else
        report_text(devices);
}

}  // namespace

void add_version(CLI::App& app, Action& action) {
    CLI::App* command = app.add_subcommand("version", "tell versions and devices, for reports of defects");
    const auto json = std::make_shared<bool>(false);
    add_json(*command, *json);
    set_guide(*command, {.usual = {{"btfield version --json"}}});
    command->callback([json, &action] { action = [json] { run(*json); }; });
}

}  // namespace btfield::cli

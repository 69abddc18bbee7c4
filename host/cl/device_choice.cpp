#include "host/cl/device_choice.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <csignal>
#include <cstdlib>
#include <map>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include "host/base/limits.hpp"
#include "host/cl/device_names.hpp"
#include "host/cl/pocl_cache.hpp"

namespace btfield {

using namespace detail;
namespace {

DeviceType type_of(const cl::Device& device) {
    const auto type = device.getInfo<CL_DEVICE_TYPE>();
    if (type & CL_DEVICE_TYPE_GPU) return DeviceType::gpu;
    if (type & CL_DEVICE_TYPE_CPU) return DeviceType::cpu;
    return DeviceType::accelerator;
}

/// All but its place among others.
DeviceInfo properties_of(const cl::Device& device) {
    DeviceInfo info;
    info.platform = cl::Platform(device.getInfo<CL_DEVICE_PLATFORM>()).getInfo<CL_PLATFORM_NAME>();
    info.platform_index = info.device_index = -1;
    info.name = device.getInfo<CL_DEVICE_NAME>();
    info.type = type_of(device);
    info.compute_units = static_cast<int>(device.getInfo<CL_DEVICE_MAX_COMPUTE_UNITS>());
    info.vector_width = static_cast<int>(device.getInfo<CL_DEVICE_NATIVE_VECTOR_WIDTH_FLOAT>());
    info.memory_bytes = device.getInfo<CL_DEVICE_GLOBAL_MEM_SIZE>();
    return info;
}

/// PoCL's compiler takes the signals of crashes from the program, whose own handlers it drops: they are put
/// back.
class KeptCrashSignals {
  public:
    KeptCrashSignals() {
        for (std::size_t i = 0; i < signals.size(); ++i) ::sigaction(signals[i], nullptr, &before_[i]);
    }
    ~KeptCrashSignals() {
        for (std::size_t i = 0; i < signals.size(); ++i) ::sigaction(signals[i], &before_[i], nullptr);
    }
    KeptCrashSignals(const KeptCrashSignals&) = delete;
    KeptCrashSignals& operator=(const KeptCrashSignals&) = delete;

  private:
    static constexpr std::array signals{SIGABRT, SIGBUS, SIGSEGV, SIGILL};
    std::array<struct sigaction, signals.size()> before_{};
};

std::vector<DeviceCandidate> candidates() {
    // Drivers set themselves up when they are first asked, and not all of them (PoCL 3.1) bear to be asked by
    // two threads at a time.
    static std::mutex asking;
    const std::lock_guard lock(asking);
    give_pocl_a_cache();
    const KeptCrashSignals kept;
    std::vector<DeviceCandidate> found;
    std::vector<cl::Platform> platforms;
    try {
        cl::Platform::get(&platforms);
    } catch (const cl::Error&) {
        return found;  // the loader reports "no platform" as an error
    }
    for (std::size_t p = 0; p < platforms.size(); ++p) {
        std::vector<cl::Device> devices;
        try {
            platforms[p].getDevices(CL_DEVICE_TYPE_ALL, &devices);
        } catch (const cl::Error&) {
            continue;  // a platform without devices is one of those that do not matter
        }
        for (std::size_t i = 0; i < devices.size(); ++i) {
            const cl::Device& device = devices[i];
            DeviceInfo info = properties_of(device);
            info.platform_index = static_cast<int>(p);
            info.device_index = static_cast<int>(i);
            found.push_back({device, info});
        }
    }
    const auto mark = [&](auto wanted) {
        const auto it = std::find_if(found.begin(), found.end(), wanted);
        if (it == found.end()) return false;
        it->info.is_default = true;
        return true;
    };
    mark([](const DeviceCandidate& c) { return c.info.type == DeviceType::gpu; }) ||
        mark([](const DeviceCandidate& c) { return c.info.type == DeviceType::cpu; }) ||
        mark([](const DeviceCandidate&) { return true; });
    return found;
}

std::string lower(std::string text) {
    std::transform(text.begin(), text.end(), text.begin(),
                   [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
    return text;
}

bool matches(const std::string& text, int index, const std::string& wanted) {
    if (wanted.empty()) return false;
    if (std::all_of(wanted.begin(), wanted.end(), [](unsigned char c) { return std::isdigit(c); }))
        return wanted == std::to_string(index);
    return lower(text).find(lower(wanted)) != std::string::npos;
}

bool matches(const DeviceCandidate& c, const std::string& spec) {
    if (spec == "auto") return c.info.is_default;
    if (spec == "cpu") return c.info.type == DeviceType::cpu;
    if (spec == "gpu") return c.info.type == DeviceType::gpu;
    if (lower(c.info.name).find(lower(spec)) != std::string::npos) return true;
    for (std::size_t colon = spec.find(':'); colon != std::string::npos; colon = spec.find(':', colon + 1))
        if (matches(c.info.platform, c.info.platform_index, spec.substr(0, colon)) &&
            matches(c.info.name, c.info.device_index, spec.substr(colon + 1)))
            return true;
    return false;
}

}  // namespace

DeviceCandidate detail::choose_device(std::string_view asked) {
    std::string spec(asked);
    std::string origin = "--device";
    if (spec.empty()) {
        const char* env = std::getenv("BTFIELD_DEVICE");
        spec = env ? env : "";
        origin = "BTFIELD_DEVICE";
    }
    if (spec.empty()) {
        spec = "auto";
        origin = "--device";
    }
    const std::vector<DeviceCandidate> all = candidates();
    if (all.empty()) {
        const std::string limit = address_space_text();
        const std::string cache =
            "set POCL_CACHE_DIR to a folder that can be written (now '" + pocl_cache_folder().string() + "')";
        if (!limit.empty())
            throw DeviceError(
                "open an OpenCL device", "no driver loads, and " + limit + ", which may be too few for one",
                std::string(more_address_space) +
                    "; else install a driver, for any CPU the package pocl-opencl-icd, or " + cache);
        throw DeviceError("open an OpenCL device", "there is none on this machine",
                          "install a driver, for any CPU the package pocl-opencl-icd; where it is installed, "
                          "give it a cache: " +
                              cache);
    }
    for (const DeviceCandidate& c : all)
        if (matches(c, spec)) return c;
    std::string names;
    for (const DeviceCandidate& c : all)
        names += (names.empty() ? "" : ", ") + std::to_string(c.info.platform_index) + ":" +
                 std::to_string(c.info.device_index) + " '" + c.info.name + "'";
    throw DeviceError("open device '" + spec + "'", "the devices here are " + names,
                      "give " + origin + " auto, cpu, gpu, PLATFORM:DEVICE or a part of a name");
}

DeviceInfo detail::info_of(const cl::Device& device) {
    for (const DeviceCandidate& c : candidates())
        if (c.device() == device()) return c.info;
    return properties_of(device);
}

namespace {

/// So many compute units of a device. Each such part is made once and never given back: a thread of PoCL's
/// may look at a part when its last command is already waited for (seen as crashes of a loaded machine).
cl::Device part_of(const cl::Device& device, int threads) {
    static std::mutex mutex;
    static auto& parts = *new std::map<std::pair<cl_device_id, int>, cl::Device>;
    const std::lock_guard lock(mutex);
    cl::Device& part = parts[{device(), threads}];
    if (part() == nullptr) {
        const cl_device_partition_property counts[] = {CL_DEVICE_PARTITION_BY_COUNTS, threads,
                                                       CL_DEVICE_PARTITION_BY_COUNTS_LIST_END, 0};
        cl::Device whole = device;
        std::vector<cl::Device> made;
        whole.createSubDevices(counts, &made);
        part = made.at(0);
    }
    return part;
}

}  // namespace

void detail::restrict_threads(DeviceCandidate& candidate, int threads) {
    const std::string asked = "compute with " + std::to_string(threads) + " threads";
    if (threads < 0)
        throw InputError(asked, "there is at least one", "give 1 or more, or 0 for as many as there are");
    if (candidate.info.type != DeviceType::cpu) return;
    if (threads == 0) threads = threads_of_environment();
    if (threads == 0 || threads >= candidate.info.compute_units) return;
    try {
        candidate.device = part_of(candidate.device, threads);
    } catch (const cl::Error& error) {
        throw DeviceError(
            "compute with " + std::to_string(threads) + " threads on device '" + candidate.info.name + "'",
            "its driver does not divide it: " + cl_error_name(error.err()),
            "do without a number of threads here, and look for the driver's own setting");
    }
    candidate.info.compute_units = threads;
}

std::vector<DeviceInfo> list_devices() {
    std::vector<DeviceInfo> infos;
    for (const DeviceCandidate& c : candidates()) infos.push_back(c.info);
    return infos;
}

std::string_view name(DeviceType type) {
    return word_of(type);
}

}  // namespace btfield

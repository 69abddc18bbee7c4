#include "btfield/device.hpp"

#include "host/cl/device_impl.hpp"

#include <algorithm>
#include <cctype>
#include <cstdlib>
#include <map>
#include <mutex>

namespace btfield {

namespace {

struct Candidate {
    cl::Device device;
    DeviceInfo info;
};

DeviceType type_of(const cl::Device& device) {
    const auto type = device.getInfo<CL_DEVICE_TYPE>();
    if (type & CL_DEVICE_TYPE_GPU) return DeviceType::gpu;
    if (type & CL_DEVICE_TYPE_CPU) return DeviceType::cpu;
    return DeviceType::accelerator;
}

std::vector<Candidate> candidates() {
    // Drivers set themselves up when they are first asked, and not all of them (PoCL 3.1) bear to be asked by
    // two threads at a time.
    static std::mutex asking;
    const std::lock_guard lock(asking);
    std::vector<Candidate> found;
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
            DeviceInfo info;
            info.platform = platforms[p].getInfo<CL_PLATFORM_NAME>();
            info.platform_index = static_cast<int>(p);
            info.device_index = static_cast<int>(i);
            info.name = device.getInfo<CL_DEVICE_NAME>();
            info.type = type_of(device);
            info.compute_units = static_cast<int>(device.getInfo<CL_DEVICE_MAX_COMPUTE_UNITS>());
            info.vector_width = static_cast<int>(device.getInfo<CL_DEVICE_NATIVE_VECTOR_WIDTH_FLOAT>());
            info.memory_bytes = device.getInfo<CL_DEVICE_GLOBAL_MEM_SIZE>();
            found.push_back({device, info});
        }
    }
    const auto mark = [&](auto wanted) {
        const auto it = std::find_if(found.begin(), found.end(), wanted);
        if (it == found.end()) return false;
        it->info.is_default = true;
        return true;
    };
    mark([](const Candidate& c) { return c.info.type == DeviceType::gpu; }) ||
        mark([](const Candidate& c) { return c.info.type == DeviceType::cpu; }) ||
        mark([](const Candidate&) { return true; });
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

bool matches(const Candidate& c, const std::string& spec) {
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

Candidate choose(std::string_view asked) {
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
    const std::vector<Candidate> all = candidates();
    if (all.empty())
        throw DeviceError("open an OpenCL device", "there is none on this machine",
                          "install a driver, for any CPU the package pocl-opencl-icd");
    for (const Candidate& c : all)
        if (matches(c, spec)) return c;
    std::string names;
    for (const Candidate& c : all)
        names += (names.empty() ? "" : ", ") + std::to_string(c.info.platform_index) + ":" +
                 std::to_string(c.info.device_index) + " '" + c.info.name + "'";
    throw DeviceError("open device '" + spec + "'", "the devices here are " + names,
                      "give " + origin + " auto, cpu, gpu, PLATFORM:DEVICE or a part of a name");
}

std::filesystem::path cache_folder(const DeviceOptions& options) {
    if (!options.disk_cache) return {};
    if (!options.cache_dir.empty()) return options.cache_dir;
    const auto env = [](const char* name) -> std::filesystem::path {
        const char* value = std::getenv(name);
        return value ? value : "";
    };
    if (auto own = env("BTFIELD_CACHE_DIR"); !own.empty()) return own;
    if (auto base = env("XDG_CACHE_HOME"); !base.empty()) return base / "btfield";
    if (auto home = env("HOME"); !home.empty()) return home / ".cache" / "btfield";
    return {};
}

int lanes_for(const DeviceInfo& info, int asked) {
    if (asked != 0) {
        if (asked != 1 && asked != 4 && asked != 8 && asked != 16)
            throw InputError("use a vector width of " + std::to_string(asked), "widths are 1, 4, 8 and 16",
                             "give one of these, or 0 for the device's own");
        return asked;
    }
    if (info.type != DeviceType::cpu) return 1;
    return info.vector_width >= 16 ? 16 : info.vector_width >= 8 ? 8 : info.vector_width >= 4 ? 4 : 1;
}

}  // namespace

struct Device::Impl::Choice {
    Candidate candidate;
};

Device::Impl::Impl(std::string_view spec, const DeviceOptions& options)
    : Impl(Choice{choose(spec)}, options) {}

Device::Impl::Impl(const Choice& choice, const DeviceOptions& options)
    : info_(choice.candidate.info),
      options_(options),
      vector_width_(lanes_for(info_, options.vector_width)),
      largest_allocation_(
          static_cast<std::size_t>(choice.candidate.device.getInfo<CL_DEVICE_MAX_MEM_ALLOC_SIZE>())),
      device_(choice.candidate.device),
      context_(guarded("create a context", info_.name, [&] { return cl::Context(device_); })),
      queue_(guarded("create a queue", info_.name,
                     [&] {
                         return cl::CommandQueue(
                             context_, device_,
                             options.profile ? CL_QUEUE_PROFILING_ENABLE : cl_command_queue_properties{0});
                     })),
      programs_(context_, device_, cache_folder(options)),
      pool_(context_, info_.name, largest_allocation_) {}

Device::Impl::~Impl() {
    try {
        queue_.finish();
    } catch (const cl::Error&) {
        // Nothing is left to report to.
    }
}

void Device::Impl::write(const Buffer& target, const void* source, std::size_t bytes, std::size_t offset) {
    if (offset > target.bytes() || bytes > target.bytes() - offset)
        throw DeviceError("write to device memory", "the copy ends after the buffer", "report this defect");
    if (bytes == 0) return;  // OpenCL has no empty copies; a model without offsets has empty tables
    guarded("copy to the device", info_.name,
            [&] { queue_.enqueueWriteBuffer(target.handle(), CL_TRUE, offset, bytes, source); });
}

void Device::Impl::read(const Buffer& source, void* target, std::size_t bytes, std::size_t offset) {
    if (offset > source.bytes() || bytes > source.bytes() - offset)
        throw DeviceError("read device memory", "the copy begins or ends outside the buffer",
                          "report this defect");
    if (bytes == 0) return;
    guarded("copy from the device", info_.name,
            [&] { queue_.enqueueReadBuffer(source.handle(), CL_TRUE, offset, bytes, target); });
}

void Device::Impl::finish() {
    guarded("wait for the device", info_.name, [&] { queue_.finish(); });
}

void Device::Impl::flush() {
    guarded("start the device", info_.name, [&] { queue_.flush(); });
}

std::string Device::Impl::kernel_name(const cl::Kernel& kernel) {
    return kernel.getInfo<CL_KERNEL_FUNCTION_NAME>();
}

void Device::Impl::enqueue(cl::Kernel& kernel, cl_uint arguments, const Range& global, Grain grain) {
    const auto refuse = [&](const std::string& found) {
        throw DeviceError("launch kernel '" + kernel_name(kernel) + "' on device '" + info_.name + "'", found,
                          "report this defect");
    };
    if (kernel.getInfo<CL_KERNEL_NUM_ARGS>() != arguments)
        refuse("it takes " + std::to_string(kernel.getInfo<CL_KERNEL_NUM_ARGS>()) + " arguments, " +
               std::to_string(arguments) + " were given");
    if (global.x == 0 || global.y == 0 || global.z == 0) refuse("a global size is 0");

    std::size_t local = 1;
    if (options_.work_group_size > 0)
        local = static_cast<std::size_t>(options_.work_group_size);
    else if (!is_cpu())
        local = grain == Grain::fine ? 64 : 1;
    else if (grain == Grain::fine)
        local = 8;
    local = std::min(local, kernel.getWorkGroupInfo<CL_KERNEL_WORK_GROUP_SIZE>(device_));
    Range range{(global.x + local - 1) / local * local, global.y, global.z};
    if (rehearsing_) range = {local, 1, 1};

    guarded("launch kernel '" + kernel_name(kernel) + "'", info_.name, [&] {
        cl::Event event;
        // The work dimension is part of what drivers specialise kernels for: it follows the full range.
        const bool deep = global.z > 1;
        queue_.enqueueNDRangeKernel(
            kernel, cl::NullRange,
            deep ? cl::NDRange(range.x, range.y, range.z) : cl::NDRange(range.x, range.y),
            deep ? cl::NDRange(local, 1, 1) : cl::NDRange(local, 1), nullptr,
            options_.profile ? &event : nullptr);
        if (!rehearsing_) record(kernel_name(kernel), event);
    });
}

void Device::Impl::record(std::string label, cl::Event event) {
    ++launches_;
    if (options_.profile) events_.emplace_back(std::move(label), std::move(event));
}

std::vector<ProfileEntry> Device::Impl::take_profile() {
    finish();
    std::map<std::string, ProfileEntry> sums;
    guarded("read launch times", info_.name, [&] {
        for (const auto& [label, event] : events_) {
            ProfileEntry& entry = sums[label];
            entry.kernel = label;
            ++entry.launches;
            entry.seconds += 1e-9 * static_cast<double>(event.getProfilingInfo<CL_PROFILING_COMMAND_END>() -
                                                        event.getProfilingInfo<CL_PROFILING_COMMAND_START>());
        }
    });
    events_.clear();
    std::vector<ProfileEntry> entries;
    entries.reserve(sums.size());
    for (auto& [label, entry] : sums) entries.push_back(std::move(entry));
    std::sort(entries.begin(), entries.end(),
              [](const ProfileEntry& a, const ProfileEntry& b) { return a.seconds > b.seconds; });
    return entries;
}

std::vector<DeviceInfo> list_devices() {
    std::vector<DeviceInfo> infos;
    for (const Candidate& c : candidates()) infos.push_back(c.info);
    return infos;
}

std::string_view name(DeviceType type) {
    switch (type) {
        case DeviceType::cpu:
            return "cpu";
        case DeviceType::gpu:
            return "gpu";
        default:
            return "accelerator";
    }
}

Device::Device(std::string_view spec, const DeviceOptions& options)
    : impl_(std::make_unique<Impl>(spec, options)) {}
Device::~Device() = default;
Device::Device(Device&&) noexcept = default;
Device& Device::operator=(Device&&) noexcept = default;
const DeviceInfo& Device::info() const {
    return impl_->info();
}
int Device::vector_width() const {
    return impl_->vector_width();
}
std::vector<ProfileEntry> Device::take_profile() {
    return impl_->take_profile();
}
std::uint64_t Device::launch_count() const {
    return impl_->launch_count();
}
Device::Impl& Device::impl() {
    return *impl_;
}

}  // namespace btfield

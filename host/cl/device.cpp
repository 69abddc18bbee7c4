#include "btfield/device.hpp"

#include <algorithm>
#include <cstdlib>
#include <map>

#include "host/cl/device_choice.hpp"
#include "host/cl/device_impl.hpp"

namespace btfield {

using namespace detail;

namespace {

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

struct DeviceImpl::Choice {
    DeviceCandidate candidate;
};

DeviceImpl::DeviceImpl(std::string_view spec, const DeviceOptions& options)
    : DeviceImpl(Choice{choose_device(spec)}, options) {}

DeviceImpl::DeviceImpl(const Choice& choice, const DeviceOptions& options)
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

DeviceImpl::~DeviceImpl() {
    try {
        queue_.finish();
    } catch (const cl::Error&) {
        // Nothing is left to report to.
    }
}

void DeviceImpl::write(const Buffer& target, const void* source, std::size_t bytes, std::size_t offset) {
    if (offset > target.bytes() || bytes > target.bytes() - offset)
        throw DeviceError("write to device memory", "the copy ends after the buffer", "report this defect");
    if (bytes == 0) return;  // OpenCL has no empty copies; a model without offsets has empty tables
    guarded("copy to the device", info_.name,
            [&] { queue_.enqueueWriteBuffer(target.handle(), CL_TRUE, offset, bytes, source); });
}

void DeviceImpl::read(const Buffer& source, void* target, std::size_t bytes, std::size_t offset) {
    if (offset > source.bytes() || bytes > source.bytes() - offset)
        throw DeviceError("read device memory", "the copy begins or ends outside the buffer",
                          "report this defect");
    if (bytes == 0) return;
    guarded("copy from the device", info_.name,
            [&] { queue_.enqueueReadBuffer(source.handle(), CL_TRUE, offset, bytes, target); });
}

void DeviceImpl::finish() {
    guarded("wait for the device", info_.name, [&] { queue_.finish(); });
}

void DeviceImpl::flush() {
    guarded("start the device", info_.name, [&] { queue_.flush(); });
}

std::string DeviceImpl::kernel_name(const cl::Kernel& kernel) {
    return kernel.getInfo<CL_KERNEL_FUNCTION_NAME>();
}

void DeviceImpl::enqueue(cl::Kernel& kernel, cl_uint arguments, const Range& global, Grain grain) {
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

void DeviceImpl::record(std::string label, cl::Event event) {
    ++launches_;
    if (options_.profile) events_.emplace_back(std::move(label), std::move(event));
}

std::vector<ProfileEntry> DeviceImpl::take_profile() {
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

Device::Device(std::string_view spec, const DeviceOptions& options)
    : impl_(std::make_unique<DeviceImpl>(spec, options)) {}
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
DeviceImpl& Device::impl() {
    return *impl_;
}

}  // namespace btfield

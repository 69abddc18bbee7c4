#include "btfield/device.hpp"

#include <algorithm>
#include <cstdlib>
#include <map>
#include <mutex>
#include <set>

#include "host/base/limits.hpp"
#include "host/cl/device_choice.hpp"
#include "host/cl/device_impl.hpp"
#include "host/cl/program.hpp"

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
    const int native = std::min(info.vector_width, tuning(info.type).widest_vector);
    return native >= 16 ? 16 : native >= 8 ? 8 : native >= 4 ? 4 : 1;
}

std::string name_of(const cl::Kernel& kernel) {
    return kernel.getInfo<CL_KERNEL_FUNCTION_NAME>();
}

}  // namespace

struct DeviceImpl::OpenCl {
    OpenCl(const cl::Device& of, const cl::Context& in, const cl::CommandQueue* on, const std::string& name,
           const DeviceOptions& options, std::size_t largest_allocation, bool shares_memory)
        : device(of),
          context(in),
          queue(on ? *on : guarded("create a queue", name, [&] { return own_queue(options); })),
          programs(context, device, cache_folder(options)),
          pool(context, name, largest_allocation, shares_memory) {}

    [[nodiscard]] cl::CommandQueue own_queue(const DeviceOptions& options) const {
        return {context, device,
                options.profile ? CL_QUEUE_PROFILING_ENABLE : cl_command_queue_properties{0}};
    }

    cl::Device device;
    cl::Context context;
    cl::CommandQueue queue;
    ProgramCache programs;
    BufferPool pool;
    std::mutex
        mutex;  ///< of kernels' arguments, from setting them until they are enqueued, and of what follows
    struct Launch {
        std::string label;
        cl::Event event;
        LaunchWork work;
    };
    std::vector<Launch> events;
};

DeviceImpl::DeviceImpl(std::string_view spec, const DeviceOptions& options) : options_(options) {
    DeviceCandidate chosen = choose_device(spec);
    restrict_threads(chosen, options.threads);
    info_ = chosen.info;
    look_at(chosen.device);
    const cl::Context context =
        guarded("create a context", info_.name, [&] { return cl::Context(chosen.device); });
    opencl_ = std::make_unique<OpenCl>(chosen.device, context, nullptr, info_.name, options,
                                       largest_allocation_, shares_memory_);
}

DeviceImpl::DeviceImpl(const DeviceCandidate& device, const cl::Context& context,
                       const cl::CommandQueue* queue, const DeviceOptions& options)
    : info_(device.info), options_(options) {
    look_at(device.device);
    opencl_ = std::make_unique<OpenCl>(device.device, context, queue, info_.name, options,
                                       largest_allocation_, shares_memory_);
}

void DeviceImpl::look_at(const cl::Device& device) {
    tuning_ = &detail::tuning(info_.type);
    vector_width_ = lanes_for(info_, options_.vector_width);
    guarded("ask for the device's limits", info_.name, [&] {
        largest_allocation_ = static_cast<std::size_t>(device.getInfo<CL_DEVICE_MAX_MEM_ALLOC_SIZE>());
        local_memory_ = static_cast<std::size_t>(device.getInfo<CL_DEVICE_LOCAL_MEM_SIZE>());
        largest_group_ = device.getInfo<CL_DEVICE_MAX_WORK_GROUP_SIZE>();
        shares_memory_ = device.getInfo<CL_DEVICE_TYPE>() == CL_DEVICE_TYPE_CPU ||
                         device.getInfo<CL_DEVICE_HOST_UNIFIED_MEMORY>() == CL_TRUE;
    });
    const std::uint64_t asked = options_.memory_bytes > 0 ? options_.memory_bytes : memory_of_environment();
    const auto all = static_cast<double>(info_.memory_bytes);
    memory_limit_ = asked > 0 ? std::min(all, static_cast<double>(asked)) : tuning_->memory_share * all;
}

DeviceImpl::~DeviceImpl() {
    try {
        opencl_->queue.finish();
    } catch (const cl::Error&) {
        // Nothing is left to report to.
    }
}

std::size_t DeviceImpl::largest_group(Grain grain) const {
    const std::size_t usual = grain == Grain::fine     ? tuning_->fine_group
                              : grain == Grain::coarse ? tuning_->coarse_group
                                                       : tuning_->serial_group;
    const auto asked = static_cast<std::size_t>(std::max(options_.work_group_size, 0));
    return std::min(asked > 0 ? asked : usual, largest_group_);
}

Kernel DeviceImpl::kernel(std::string_view stem, const std::string& name, const BuildParameters& parameters) {
    return opencl_->programs.kernel(stem, name, parameters);
}

BufferPool& DeviceImpl::pool() {
    return opencl_->pool;
}
const cl::Context& DeviceImpl::context() const {
    return opencl_->context;
}
const cl::CommandQueue& DeviceImpl::queue() const {
    return opencl_->queue;
}
const cl::Device& DeviceImpl::device() const {
    return opencl_->device;
}

void DeviceImpl::write(const Buffer& target, const void* source, std::size_t bytes, std::size_t offset) {
    if (offset > target.bytes() || bytes > target.bytes() - offset)
        throw DeviceError("write to device memory", "the copy ends after the buffer", "report this defect");
    if (bytes == 0) return;  // OpenCL has no empty copies; a model without offsets has empty tables
    guarded("copy to the device", info_.name,
            [&] { opencl_->queue.enqueueWriteBuffer(*target.handle(), CL_TRUE, offset, bytes, source); });
}

template <class Work>
void DeviceImpl::mapped(const Buffer& buffer, bool to_write, std::size_t offset, std::size_t bytes,
                        const Work& work) {
    const auto unmap = [&](void* at) {
        guarded("unmap device memory", info_.name,
                [&] { opencl_->queue.enqueueUnmapMemObject(*buffer.handle(), at); });
    };
    void* at = guarded("map device memory", info_.name, [&] {
        return opencl_->queue.enqueueMapBuffer(*buffer.handle(), CL_TRUE,
                                               to_write ? CL_MAP_WRITE_INVALIDATE_REGION : CL_MAP_READ,
                                               offset, bytes);
    });
    try {
        work(static_cast<std::byte*>(at));
    } catch (...) {
        unmap(at);
        throw;
    }
    unmap(at);
}

void DeviceImpl::fill(const Buffer& target, const std::function<void(std::byte*)>& work) {
    mapped(target, true, 0, target.bytes(), work);
}

void DeviceImpl::look(const Buffer& source, std::size_t offset, std::size_t bytes,
                      const std::function<void(const std::byte*)>& work) {
    check_inside(source, bytes, offset);
    mapped(source, false, offset, bytes, work);
}

void DeviceImpl::check_inside(const Buffer& source, std::size_t bytes, std::size_t offset) {
    if (offset > source.bytes() || bytes > source.bytes() - offset)
        throw DeviceError("read device memory", "the copy begins or ends outside the buffer",
                          "report this defect");
}

void DeviceImpl::read(const Buffer& source, void* target, std::size_t bytes, std::size_t offset) {
    check_inside(source, bytes, offset);
    if (bytes == 0) return;
    guarded("copy from the device", info_.name,
            [&] { opencl_->queue.enqueueReadBuffer(*source.handle(), CL_TRUE, offset, bytes, target); });
}

void DeviceImpl::check_target(const DeviceMemory& target, std::size_t bytes,
                              const std::string& result) const {
    const std::string asked = "leave " + result + " on device '" + info_.name + "'";
    const bool ours = guarded("look at memory of the program's own", info_.name, [&] {
        return target.buffer().handle()->getInfo<CL_MEM_CONTEXT>()() == opencl_->context();
    });
    if (!ours)
        throw InputError(asked, "the memory belongs to another context",
                         "make it with device_memory() of the same Device");
    if (bytes > target.bytes())
        throw InputError(asked,
                         "that takes " + std::to_string(bytes) + " bytes, the memory holds " +
                             std::to_string(target.bytes()),
                         "give more memory, or ask for fewer textures at a time");
}

void DeviceImpl::copy(const Buffer& source, const PlaneWindow& window, const DeviceMemory& target,
                      std::size_t at) {
    const std::size_t row = sizeof(float) * static_cast<std::size_t>(window.lattice.width),
                      target_row = sizeof(float) * static_cast<std::size_t>(window.size.width);
    const std::size_t begin = target.offset() + sizeof(float) * at,
                      end = begin + sizeof(float) * window.planes * area(window.size);
    if (end > target.buffer().bytes() ||
        sizeof(float) * (window.first + window.planes) * area(window.lattice) > source.bytes())
        throw DeviceError("copy planes on the device", "the copy ends after the buffer",
                          "report this defect");
    guarded("copy planes on the device", info_.name, [&] {
        opencl_->queue.enqueueCopyBufferRect(
            *source.handle(), *target.buffer().handle(),
            {sizeof(float) * static_cast<std::size_t>(window.column), static_cast<std::size_t>(window.row),
             window.first},
            {begin, 0, 0}, {target_row, static_cast<std::size_t>(window.size.height), window.planes}, row,
            sizeof(float) * area(window.lattice), target_row, sizeof(float) * area(window.size));
    });
}

void DeviceImpl::finish() {
    guarded("wait for the device", info_.name, [&] { opencl_->queue.finish(); });
}

void DeviceImpl::flush() {
    guarded("start the device", info_.name, [&] { opencl_->queue.flush(); });
}

double DeviceImpl::bytes_of(std::initializer_list<Argument> arguments) {
    std::set<const void*> seen;
    double bytes = 0.0;
    for (const Argument& argument : arguments)
        if (argument.buffer && argument.buffer->handle() &&
            seen.insert((*argument.buffer->handle())()).second)
            bytes += static_cast<double>(argument.buffer->bytes());
    return bytes;
}

void DeviceImpl::enqueue(Kernel handle, const Range& global, Grain grain,
                         const std::optional<LaunchWork>& work, std::initializer_list<Argument> arguments) {
    cl::Kernel& kernel = handle.handle();
    const std::lock_guard lock(opencl_->mutex);
    cl_uint index = 0;
    try {
        for (const Argument& argument : arguments) {
            if (argument.buffer) {
                const cl::Buffer* const buffer = argument.buffer->handle();
                kernel.setArg(index, buffer ? *buffer : cl::Buffer());
            } else {
                kernel.setArg(index, argument.bytes, argument.value);
            }
            ++index;
        }
    } catch (const cl::Error& error) {
        throw device_error(error,
                           "set argument " + std::to_string(index) + " of kernel '" + name_of(kernel) + "'",
                           info_.name);
    }
    const auto refuse = [&](const std::string& found) {
        throw DeviceError("launch kernel '" + name_of(kernel) + "' on device '" + info_.name + "'", found,
                          "report this defect");
    };
    if (kernel.getInfo<CL_KERNEL_NUM_ARGS>() != index)
        refuse("it takes " + std::to_string(kernel.getInfo<CL_KERNEL_NUM_ARGS>()) + " arguments, " +
               std::to_string(index) + " were given");
    if (global.x == 0 || global.y == 0 || global.z == 0) refuse("a global size is 0");

    const std::size_t local =
        std::min(largest_group(grain), kernel.getWorkGroupInfo<CL_KERNEL_WORK_GROUP_SIZE>(opencl_->device));
    Range range{(global.x + local - 1) / local * local, global.y, global.z};
    if (rehearsing_) range = {local, 1, 1};

    guarded("launch kernel '" + name_of(kernel) + "'", info_.name, [&] {
        cl::Event event;
        // The work dimension is part of what drivers specialise kernels for: it follows the full range.
        const bool deep = global.z > 1;
        opencl_->queue.enqueueNDRangeKernel(
            kernel, cl::NullRange,
            deep ? cl::NDRange(range.x, range.y, range.z) : cl::NDRange(range.x, range.y),
            deep ? cl::NDRange(local, 1, 1) : cl::NDRange(local, 1), nullptr,
            options_.profile ? &event : nullptr);
        if (rehearsing_) return;
        if (options_.profile)
            record_enqueued(name_of(kernel), event, work ? *work : LaunchWork{.bytes = bytes_of(arguments)});
        else
            record_enqueued({}, event, {});
    });
}

void DeviceImpl::record(std::string label, const cl::Event& event) {
    const std::lock_guard lock(opencl_->mutex);
    record_enqueued(std::move(label), event, {});
}

void DeviceImpl::record_enqueued(std::string label, const cl::Event& event, const LaunchWork& work) {
    launches_.fetch_add(1, std::memory_order_relaxed);
    if (options_.profile) opencl_->events.push_back({std::move(label), event, work});
}

std::vector<ProfileEntry> DeviceImpl::take_profile() {
    std::vector<OpenCl::Launch> events;
    {
        const std::lock_guard lock(opencl_->mutex);
        events.swap(opencl_->events);
    }
    finish();
    std::map<std::string, ProfileEntry> sums;
    guarded("read launch times", info_.name, [&] {
        for (const auto& [label, event, work] : events) {
            ProfileEntry& entry = sums[label];
            entry.kernel = label;
            ++entry.launches;
            entry.bytes += work.bytes;
            entry.operations += work.operations;
            entry.seconds += 1e-9 * static_cast<double>(event.getProfilingInfo<CL_PROFILING_COMMAND_END>() -
                                                        event.getProfilingInfo<CL_PROFILING_COMMAND_START>());
        }
    });
    std::vector<ProfileEntry> entries;
    entries.reserve(sums.size());
    for (auto& [label, entry] : sums) entries.push_back(std::move(entry));
    std::sort(entries.begin(), entries.end(),
              [](const ProfileEntry& a, const ProfileEntry& b) { return a.seconds > b.seconds; });
    return entries;
}

Device::Device(std::string_view spec, const DeviceOptions& options)
    : impl_(std::make_unique<DeviceImpl>(spec, options)) {}
Device::Device(std::unique_ptr<DeviceImpl> impl) : impl_(std::move(impl)) {}
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
void Device::finish() {
    impl_->finish();
}
DeviceImpl& Device::impl() {
    return *impl_;
}

}  // namespace btfield

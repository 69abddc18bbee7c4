#pragma once

/// \file
/// What stands behind Device: context, queue, program cache, buffer pool, FFT plans and the one launch().

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "btfield/device.hpp"
#include "host/cl/api.hpp"
#include "host/cl/buffer_pool.hpp"
#include "host/cl/fft.hpp"
#include "host/cl/program.hpp"

namespace btfield::detail {

/// Work-items of a launch along up to three dimensions. Kernels check their bounds along dimension 0, which
/// is rounded up to the local size.
struct Range {
    std::size_t x = 1, y = 1, z = 1;
};

/// How much one work-item does.
enum class Grain {
    fine,    ///< a few vectors: many work-items share a work-group
    coarse,  ///< a whole row with private arrays: one work-item per work-group on CPUs
};

class DeviceImpl {
  public:
    DeviceImpl(std::string_view spec, const DeviceOptions& options);
    ~DeviceImpl();
    DeviceImpl(const DeviceImpl&) = delete;
    DeviceImpl& operator=(const DeviceImpl&) = delete;

    [[nodiscard]] const DeviceInfo& info() const { return info_; }
    [[nodiscard]] const DeviceOptions& options() const { return options_; }
    [[nodiscard]] int vector_width() const { return vector_width_; }
    [[nodiscard]] bool is_cpu() const { return info_.type == DeviceType::cpu; }
    [[nodiscard]] std::size_t largest_allocation() const { return largest_allocation_; }

    [[nodiscard]] Buffer buffer(std::size_t bytes) { return pool_.take(bytes); }
    template <class T>
    [[nodiscard]] Buffer upload(std::span<const T> values) {
        Buffer target = buffer(values.size_bytes());
        write(target, values.data(), values.size_bytes());
        return target;
    }
    template <class T>
    [[nodiscard]] Buffer upload(const std::vector<T>& values) {
        return upload(std::span<const T>(values));
    }
    void write(const Buffer& target, const void* source, std::size_t bytes, std::size_t offset = 0);
    /// Blocks until the bytes are there.
    void read(const Buffer& source, void* target, std::size_t bytes, std::size_t offset = 0);
    void finish();
    /// Makes the device begin what was enqueued, without waiting.
    void flush();

    /// BTFIELD_VECTOR_WIDTH and nothing else: where every program starts.
    [[nodiscard]] BuildParameters lanes() const {
        return BuildParameters().set("BTFIELD_VECTOR_WIDTH", vector_width_);
    }
    cl::Kernel& kernel(std::string_view stem, const std::string& name, const BuildParameters& parameters) {
        return programs_.kernel(stem, name, parameters);
    }

    /// Sets the arguments and enqueues. Buffers are passed as Buffer, numbers as the kernel's own type.
    template <class... Args>
    void launch(cl::Kernel& kernel, const Range& global, Grain grain, const Args&... args) {
        cl_uint index = 0;
        const auto where = [&] {
            return "set argument " + std::to_string(index) + " of kernel '" + kernel_name(kernel) + "'";
        };
        try {
            (kernel.setArg(index++, argument(args)), ...);
        } catch (const cl::Error& error) {
            throw device_error(error, where(), info_.name);
        }
        enqueue(kernel, index, global, grain);
    }

    [[nodiscard]] std::vector<ProfileEntry> take_profile();
    [[nodiscard]] std::uint64_t launch_count() const { return launches_; }
    [[nodiscard]] ProgramCache& programs() { return programs_; }
    [[nodiscard]] BufferPool& pool() { return pool_; }
    [[nodiscard]] FftPlans& ffts() { return ffts_; }
    [[nodiscard]] const cl::Context& context() const { return context_; }
    [[nodiscard]] const cl::CommandQueue& queue() const { return queue_; }
    /// While it lives, launches run a single work-group and go unrecorded: a rehearsal makes drivers compile
    /// what they compile at the first launch, and fills the buffer pool, without doing the work.
    class Rehearsal {
      public:
        explicit Rehearsal(DeviceImpl& device) : device_(&device) { device_->rehearsing_ = true; }
        ~Rehearsal() { device_->rehearsing_ = false; }
        Rehearsal(const Rehearsal&) = delete;
        Rehearsal& operator=(const Rehearsal&) = delete;

      private:
        DeviceImpl* device_;
    };
    [[nodiscard]] bool rehearsing() const { return rehearsing_; }
    /// Adds an event of a library call (clFFT) to the profile.
    void record(std::string label, cl::Event event);

  private:
    struct Choice;
    explicit DeviceImpl(const Choice& choice, const DeviceOptions& options);
    static const cl::Buffer& argument(const Buffer& buffer) { return buffer.handle(); }
    template <class T>
    static const T& argument(const T& value) {
        return value;
    }
    static std::string kernel_name(const cl::Kernel& kernel);
    void enqueue(cl::Kernel& kernel, cl_uint arguments, const Range& global, Grain grain);

    DeviceInfo info_;
    DeviceOptions options_;
    int vector_width_ = 1;
    std::size_t largest_allocation_ = 0;
    cl::Device device_;
    cl::Context context_;
    cl::CommandQueue queue_;
    ProgramCache programs_;
    BufferPool pool_;
    FftPlans ffts_;
    std::vector<std::pair<std::string, cl::Event>> events_;
    std::uint64_t launches_ = 0;
    bool rehearsing_ = false;
};

}  // namespace btfield::detail

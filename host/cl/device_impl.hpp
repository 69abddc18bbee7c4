#pragma once

/// \file
/// What stands behind Device: context, queue, program cache, buffer pool, FFT plans and the one launch(). No
/// room but this one sees OpenCL.
///
/// Any number of threads may work with one device: its queue is in order, and setting a kernel's arguments
/// and enqueuing it is one step. Sequences of launches of several threads interleave, so what a sequence
/// hands from one launch to the next is memory of its own, on loan from the pool.

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <initializer_list>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include "btfield/device.hpp"
#include "btfield/image.hpp"
#include "host/cl/buffer_pool.hpp"
#include "host/cl/build_parameters.hpp"
#include "host/cl/fft.hpp"
#include "host/cl/tuning.hpp"

namespace cl {
class CommandQueue;
class Device;
class Context;
class Event;
class Kernel;
}  // namespace cl

namespace btfield::detail {

class ProgramCache;
struct DeviceCandidate;

/// Work-items of a launch along up to three dimensions. Kernels check their bounds along dimension 0, which
/// is rounded up to the local size.
struct Range {
    std::size_t x = 1, y = 1, z = 1;
};

/// A kernel of a program that the device keeps.
class Kernel {
  public:
    Kernel(cl::Kernel& kernel) : handle_(&kernel) {}
    [[nodiscard]] cl::Kernel& handle() const { return *handle_; }

  private:
    cl::Kernel* handle_;
};

/// Part of planes in device memory: of planes [first, first + planes), each on the lattice, `size` pixels
/// from (row, column) on.
struct PlaneWindow {
    Size lattice;
    std::size_t first = 0, planes = 0;
    int row = 0, column = 0;
    Size size;
};

/// Uninitialised local memory, as an argument of a launch.
struct LocalMemory {
    std::size_t bytes = 0;
};

/// What a launch cannot do without, for the profile; see ProfileEntry.
struct LaunchWork {
    double bytes = 0.0, operations = 0.0;
};

class DeviceImpl {
  public:
    DeviceImpl(std::string_view spec, const DeviceOptions& options);
    /// On a context of the caller's, and on its queue where there is one.
    DeviceImpl(const DeviceCandidate& device, const cl::Context& context, const cl::CommandQueue* queue,
               const DeviceOptions& options);
    ~DeviceImpl();
    DeviceImpl(const DeviceImpl&) = delete;
    DeviceImpl& operator=(const DeviceImpl&) = delete;

    [[nodiscard]] const DeviceInfo& info() const { return info_; }
    [[nodiscard]] const DeviceOptions& options() const { return options_; }
    [[nodiscard]] const Tuning& tuning() const { return *tuning_; }
    [[nodiscard]] int vector_width() const { return vector_width_; }
    [[nodiscard]] std::size_t largest_allocation() const { return largest_allocation_; }
    /// Bytes of device memory that may be planned with.
    [[nodiscard]] double memory_limit() const { return memory_limit_; }
    /// Bytes of local memory of a work-group.
    [[nodiscard]] std::size_t local_memory() const { return local_memory_; }
    /// Whether the device works in the host's own memory.
    [[nodiscard]] bool shares_memory() const { return shares_memory_; }
    /// Work-items that a group of a launch has at most.
    [[nodiscard]] std::size_t largest_group(Grain grain) const;

    [[nodiscard]] Buffer buffer(std::size_t bytes) { return pool().take(bytes); }
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
    /// Lets `work` write the memory, all of it, where it lies or where the device fetches it from: on a CPU
    /// nothing is copied.
    void fill(const Buffer& target, const std::function<void(std::byte*)>& work);
    /// Lets `work` read memory where it lies or where the device puts it: on a CPU nothing is copied.
    void look(const Buffer& source, std::size_t offset, std::size_t bytes,
              const std::function<void(const std::byte*)>& work);
    /// Blocks until the bytes are there.
    void read(const Buffer& source, void* target, std::size_t bytes, std::size_t offset = 0);
    /// \param result what is to be left there
    /// \throws InputError unless the target lies in this device's context and holds `bytes`
    void check_target(const DeviceMemory& target, std::size_t bytes, const std::string& result) const;
    /// A window of planes to consecutive planes of the target, without padding. Enqueued, not waited for.
    /// \param at floats of the target that lie before
    void copy(const Buffer& source, const PlaneWindow& window, const DeviceMemory& target, std::size_t at);
    void finish();
    /// Makes the device begin what was enqueued, without waiting.
    void flush();

    /// BTFIELD_VECTOR_WIDTH and nothing else: where every program starts.
    [[nodiscard]] BuildParameters lanes() const {
        return BuildParameters().set("BTFIELD_VECTOR_WIDTH", vector_width_);
    }
    /// The kernel of an embedded program; built or loaded when first asked for.
    Kernel kernel(std::string_view stem, const std::string& name, const BuildParameters& parameters);

    /// Sets the arguments and enqueues. Buffers are passed as Buffer, local memory as LocalMemory, numbers as
    /// the kernel's own type, its vectors as arrays.
    template <class... Args>
    void launch(Kernel kernel, const Range& global, Grain grain, const Args&... args) {
        enqueue(kernel, global, grain, std::nullopt, {Argument(args)...});
    }
    /// The same, telling the profile what there was to do.
    template <class... Args>
    void launch(Kernel kernel, const Range& global, Grain grain, const LaunchWork& work,
                const Args&... args) {
        enqueue(kernel, global, grain, work, {Argument(args)...});
    }

    [[nodiscard]] std::vector<ProfileEntry> take_profile();
    [[nodiscard]] std::uint64_t launch_count() const { return launches_.load(std::memory_order_relaxed); }
    [[nodiscard]] BufferPool& pool();
    [[nodiscard]] FftPlans& ffts() { return ffts_; }
    [[nodiscard]] const cl::Context& context() const;
    [[nodiscard]] const cl::CommandQueue& queue() const;
    [[nodiscard]] const cl::Device& device() const;
    /// While it lives, launches of its thread run a single work-group and go unrecorded: a rehearsal makes
    /// drivers compile what they compile at the first launch, and fills the buffer pool, without doing the
    /// work.
    class Rehearsal {
      public:
        Rehearsal() { rehearsing_ = true; }
        ~Rehearsal() { rehearsing_ = false; }
        Rehearsal(const Rehearsal&) = delete;
        Rehearsal& operator=(const Rehearsal&) = delete;
    };
    [[nodiscard]] static bool rehearsing() { return rehearsing_; }
    /// Adds an event of a library call (clFFT) to the profile.
    void record(std::string label, const cl::Event& event);

  private:
    /// What a kernel's argument is set to: bytes, local memory where there is no value, or a buffer.
    struct Argument {
        explicit Argument(const Buffer& of) : buffer(&of) {}
        explicit Argument(const LocalMemory& memory) : bytes(memory.bytes) {}
        template <class T>
        explicit Argument(const T& number) : value(&number), bytes(sizeof number) {
            static_assert(std::is_trivially_copyable_v<T> && !std::is_pointer_v<T>);
        }
        const Buffer* buffer = nullptr;
        const void* value = nullptr;
        std::size_t bytes = 0;
    };
    void enqueue(Kernel kernel, const Range& global, Grain grain, const std::optional<LaunchWork>& work,
                 std::initializer_list<Argument> arguments);
    /// Bytes of the buffers among them, of each once.
    [[nodiscard]] static double bytes_of(std::initializer_list<Argument> arguments);

    /// record(), the mutex held.
    void record_enqueued(std::string label, const cl::Event& event, const LaunchWork& work);

    static void check_inside(const Buffer& source, std::size_t bytes, std::size_t offset);
    /// work(where the bytes are)
    template <class Work>
    void mapped(const Buffer& buffer, bool to_write, std::size_t offset, std::size_t bytes, const Work& work);

    struct OpenCl;
    /// What depends on the device alone.
    void look_at(const cl::Device& device);

    DeviceInfo info_;
    DeviceOptions options_;
    const Tuning* tuning_;
    int vector_width_ = 1;
    double memory_limit_ = 0.0;
    bool shares_memory_ = false;
    std::size_t largest_allocation_ = 0, local_memory_ = 0, largest_group_ = 0;
    std::unique_ptr<OpenCl> opencl_;
    FftPlans ffts_;
    std::atomic<std::uint64_t> launches_ = 0;
    static inline thread_local bool rehearsing_ = false;
};

}  // namespace btfield::detail

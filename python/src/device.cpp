#include "btfield/device.hpp"

#include "btfield/threads.hpp"
#include "btfield/version.hpp"
#include "python/src/device.hpp"
#include "python/src/options.hpp"
#include "python/src/parts.hpp"
#include "python/src/words.hpp"

namespace btfield::python {
namespace {

void add_info(nb::module_& module) {
    nb::class_<DeviceInfo>(module, "DeviceInfo", "An OpenCL device, as list_devices() finds it.")
        .def_ro("platform", &DeviceInfo::platform)
        .def_ro("name", &DeviceInfo::name)
        .def_prop_ro(
            "type", [](const DeviceInfo& self) { return std::string(name(self.type)); },
            "'cpu', 'gpu' or 'accelerator'.")
        .def_ro("is_default", &DeviceInfo::is_default, "The one that spec 'auto' opens.")
        .def_ro("platform_index", &DeviceInfo::platform_index)
        .def_ro("device_index", &DeviceInfo::device_index)
        .def_ro("compute_units", &DeviceInfo::compute_units)
        .def_ro("vector_width", &DeviceInfo::vector_width, "Native float lanes.")
        .def_ro("memory_bytes", &DeviceInfo::memory_bytes)
        .def("__repr__", [](const DeviceInfo& self) {
            return "<btfield.DeviceInfo " + std::to_string(self.platform_index) + ":" +
                   std::to_string(self.device_index) + " " + self.name + ", " + self.platform + ">";
        });
    nb::class_<ProfileEntry>(module, "ProfileEntry", "Time of all launches of one kernel.")
        .def_ro("kernel", &ProfileEntry::kernel)
        .def_ro("launches", &ProfileEntry::launches)
        .def_ro("seconds", &ProfileEntry::seconds)
        .def("__repr__", [](const ProfileEntry& self) {
            return "<btfield.ProfileEntry " + self.kernel + ": " + std::to_string(self.launches) +
                   " launches, " + std::to_string(self.seconds) + " s>";
        });
}

}  // namespace

void add_device(nb::module_& module) {
    add_info(module);
    module.def(
        "list_devices", [] { return unlocked([] { return list_devices(); }); },
        "Every OpenCL device of every platform, in platform order; empty when there is none.");
    module.def(
        "thread_limit", &thread_limit,
        "Threads of this process that compute for one caller at a time: as many as there are cores, unless\n"
        "limit_threads() or $BTFIELD_THREADS says fewer.");
    module.def("limit_threads", &limit_threads, nb::arg("count"),
               "Sets thread_limit() from now on; 0: as in the beginning. Results do not depend on it.\n\n"
               "Raises InputError below 0.");

    nb::class_<Held<Device>>(
        module, "Device",
        "An OpenCL device, opened once and passed to whatever computes on it. Any number of threads may use\n"
        "one at a time.")
        .def(
            "__init__",
            [](Held<Device>* self, const std::string& spec, int vector_width, int work_group_size,
               bool profile, const std::string& fft, const std::filesystem::path& cache_dir, bool disk_cache,
               int threads, std::uint64_t memory_bytes) {
                const DeviceOptions options{
                    vector_width, work_group_size, profile, detail::value_of<FftBackend>(fft),
                    cache_dir,    disk_cache,      threads, memory_bytes};
                new (self) Held<Device>([&] { return unlocked([&] { return Device(spec, options); }); });
            },
            nb::arg("spec") = "", nb::kw_only(), nb::arg("vector_width") = 0, nb::arg("work_group_size") = 0,
            nb::arg("profile") = false, nb::arg("fft") = "auto", nb::arg("cache_dir") = "",
            nb::arg("disk_cache") = true, nb::arg("threads") = 0, nb::arg("memory_bytes") = 0,
            "spec: 'auto' (a GPU, else a CPU, else anything), 'cpu', 'gpu', 'PLATFORM:DEVICE' (two indices "
            "as\n"
            "    list_devices() has them, or parts of names), or part of a device's name; empty: "
            "$BTFIELD_DEVICE,\n"
            "    else 'auto'.\n"
            "vector_width: lanes of the hot kernels, 1, 4, 8 or 16; 0: native on CPUs, 1 on GPUs.\n"
            "profile: collect the time of every launch, for take_profile().\n"
            "fft: 'auto', 'lanes' or 'clfft'.\n"
            "cache_dir: where built programs are kept; empty: $BTFIELD_CACHE_DIR, else ~/.cache/btfield.\n"
            "threads: that a CPU device computes with at most; 0: $BTFIELD_THREADS, else all.\n"
            "memory_bytes: of the device, that work is planned with at most; 0: $BTFIELD_MEMORY, else 70 % "
            "of a\n"
            "    CPU device's memory, 90 % of another's.\n\n"
            "Raises DeviceError when nothing matches, listing what there is; InputError for options that do "
            "not\n"
            "exist.")
        .def_prop_ro("info", [](Held<Device>& self) { return self->info(); })
        .def_prop_ro(
            "vector_width", [](Held<Device>& self) { return self->vector_width(); },
            "Lanes that hot kernels are built with.")
        .def_prop_ro(
            "launch_count", [](Held<Device>& self) { return self->launch_count(); },
            "Kernel launches since opening.")
        .def(
            "take_profile", [](Held<Device>& self) { return unlocked([&] { return self->take_profile(); }); },
            "Launches since opening or the last call, most expensive first. Empty unless profile.")
        .def("__repr__", [](Held<Device>& self) { return "<btfield.Device " + self->info().name + ">"; });
}

}  // namespace btfield::python

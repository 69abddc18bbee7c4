#pragma once

/// \file
/// The one place that includes OpenCL, and the translation of its errors.

#include <CL/opencl.hpp>
#include <string>
#include <utility>

#include "btfield/error.hpp"

namespace btfield::detail {

/// "CL_OUT_OF_RESOURCES" for −5, and so on; "error N" for codes without a name.
[[nodiscard]] std::string cl_error_name(int code);

/// DeviceError for a failed OpenCL call. `where` names the kernel or purpose, `device` the device.
[[nodiscard]] DeviceError device_error(const cl::Error& error, const std::string& where,
                                       const std::string& device);

/// Runs f, translating cl::Error.
template <class F>
decltype(auto) guarded(const std::string& where, const std::string& device, F&& f) {
    try {
        return std::forward<F>(f)();
    } catch (const cl::Error& error) {
        throw device_error(error, where, device);
    }
}

}  // namespace btfield::detail

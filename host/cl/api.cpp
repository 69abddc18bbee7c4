#include "host/cl/api.hpp"

#include <array>

namespace btfield::detail {

std::string cl_error_name(int code) {
    struct Entry {
        int code;
        const char* name;
    };
#define BTFIELD_CODE(x) \
    Entry {             \
        x, #x           \
    }
    static constexpr std::array entries{
        BTFIELD_CODE(CL_DEVICE_NOT_FOUND),
        BTFIELD_CODE(CL_DEVICE_NOT_AVAILABLE),
        BTFIELD_CODE(CL_COMPILER_NOT_AVAILABLE),
        BTFIELD_CODE(CL_MEM_OBJECT_ALLOCATION_FAILURE),
        BTFIELD_CODE(CL_OUT_OF_RESOURCES),
        BTFIELD_CODE(CL_OUT_OF_HOST_MEMORY),
        BTFIELD_CODE(CL_PROFILING_INFO_NOT_AVAILABLE),
        BTFIELD_CODE(CL_MEM_COPY_OVERLAP),
        BTFIELD_CODE(CL_BUILD_PROGRAM_FAILURE),
        BTFIELD_CODE(CL_MAP_FAILURE),
        BTFIELD_CODE(CL_MISALIGNED_SUB_BUFFER_OFFSET),
        BTFIELD_CODE(CL_EXEC_STATUS_ERROR_FOR_EVENTS_IN_WAIT_LIST),
        BTFIELD_CODE(CL_COMPILE_PROGRAM_FAILURE),
        BTFIELD_CODE(CL_LINK_PROGRAM_FAILURE),
        BTFIELD_CODE(CL_INVALID_VALUE),
        BTFIELD_CODE(CL_INVALID_DEVICE_TYPE),
        BTFIELD_CODE(CL_INVALID_PLATFORM),
        BTFIELD_CODE(CL_INVALID_DEVICE),
        BTFIELD_CODE(CL_INVALID_CONTEXT),
        BTFIELD_CODE(CL_INVALID_QUEUE_PROPERTIES),
        BTFIELD_CODE(CL_INVALID_COMMAND_QUEUE),
        BTFIELD_CODE(CL_INVALID_HOST_PTR),
        BTFIELD_CODE(CL_INVALID_MEM_OBJECT),
        BTFIELD_CODE(CL_INVALID_BINARY),
        BTFIELD_CODE(CL_INVALID_BUILD_OPTIONS),
        BTFIELD_CODE(CL_INVALID_PROGRAM),
        BTFIELD_CODE(CL_INVALID_PROGRAM_EXECUTABLE),
        BTFIELD_CODE(CL_INVALID_KERNEL_NAME),
        BTFIELD_CODE(CL_INVALID_KERNEL_DEFINITION),
        BTFIELD_CODE(CL_INVALID_KERNEL),
        BTFIELD_CODE(CL_INVALID_ARG_INDEX),
        BTFIELD_CODE(CL_INVALID_ARG_VALUE),
        BTFIELD_CODE(CL_INVALID_ARG_SIZE),
        BTFIELD_CODE(CL_INVALID_KERNEL_ARGS),
        BTFIELD_CODE(CL_INVALID_WORK_DIMENSION),
        BTFIELD_CODE(CL_INVALID_WORK_GROUP_SIZE),
        BTFIELD_CODE(CL_INVALID_WORK_ITEM_SIZE),
        BTFIELD_CODE(CL_INVALID_GLOBAL_OFFSET),
        BTFIELD_CODE(CL_INVALID_EVENT_WAIT_LIST),
        BTFIELD_CODE(CL_INVALID_EVENT),
        BTFIELD_CODE(CL_INVALID_OPERATION),
        BTFIELD_CODE(CL_INVALID_BUFFER_SIZE),
        BTFIELD_CODE(CL_INVALID_GLOBAL_WORK_SIZE),
        BTFIELD_CODE(CL_INVALID_PROPERTY),
        Entry{-1001, "CL_PLATFORM_NOT_FOUND_KHR"},
    };
#undef BTFIELD_CODE
    for (const Entry& entry : entries)
        if (entry.code == code) return entry.name;
    return "error " + std::to_string(code);
}

DeviceError device_error(const cl::Error& error, const std::string& where, const std::string& device) {
    const int code = error.err();
    const bool memory = code == CL_MEM_OBJECT_ALLOCATION_FAILURE || code == CL_OUT_OF_HOST_MEMORY ||
                        code == CL_INVALID_BUFFER_SIZE;
    return {where + " on device '" + device + "'",
            std::string(error.what()) + " failed with " + cl_error_name(code),
            memory ? "use a smaller size or batch, or a device with more memory"
                   : "check the driver with clinfo, or choose another device with --device"};
}

}  // namespace btfield::detail

#pragma once

/// \file
/// Kernel programs, built once per full key: source, options, device, driver. Kept in process and on disk.

#include <filesystem>
#include <map>
#include <mutex>
#include <string>
#include <string_view>
#include <vector>

#include "host/cl/api.hpp"
#include "host/cl/build_parameters.hpp"

namespace btfield::detail {

/// Builds programs for one device and remembers them. For any number of threads, one of which builds at a
/// time; kernels stay where they are.
class ProgramCache {
  public:
    /// \param folder  empty = no disk cache
    ProgramCache(cl::Context context, cl::Device device, std::filesystem::path folder);

    /// The kernel of an embedded program; built or loaded when first asked for.
    /// \throws DeviceError with the build log when the program does not compile.
    cl::Kernel& kernel(std::string_view stem, const std::string& name, const BuildParameters& parameters);

    /// The same for any source text.
    cl::Kernel& kernel_from_source(std::string_view stem, std::string_view source, const std::string& name,
                                   const std::string& options);

    struct Statistics {
        int compiled = 0;   ///< built from source
        int loaded = 0;     ///< taken from disk
        int discarded = 0;  ///< damaged or refused files on disk
    };
    [[nodiscard]] Statistics statistics() const;

    /// File that holds, or would hold, the program of this key.
    [[nodiscard]] std::filesystem::path file_of(const std::string& key) const;

  private:
    struct Program {
        cl::Program program;
        std::map<std::string, cl::Kernel> kernels;
    };
    Program& program(std::string_view stem, std::string_view source, const std::string& options);
    bool load(const std::string& key, const std::string& options, cl::Program& out);
    void store(const std::string& key, const cl::Program& program) const;

    cl::Context context_;
    cl::Device device_;
    std::string device_name_, device_key_;
    std::filesystem::path folder_;
    mutable std::mutex mutex_;  ///< of what follows
    std::map<std::string, Program> programs_;
    Statistics statistics_;
};

}  // namespace btfield::detail

#include "host/cl/program.hpp"

#include <array>
#include <cstdint>
#include <cstring>
#include <fstream>
#include <optional>
#include <sstream>

#include "host/base/file_output.hpp"
#include "host/cl/embedded_kernels.hpp"
#include "host/cl/pocl_cache.hpp"

namespace btfield::detail {

namespace {

constexpr std::string_view magic = "btfield kernel 1\n";

std::uint64_t fnv1a(std::string_view text, std::uint64_t hash) {
    for (const char c : text) hash = (hash ^ static_cast<unsigned char>(c)) * 0x100000001b3ULL;
    return hash;
}

/// Two independent 64-bit hashes; the file repeats the whole key, so a collision costs a rebuild, not a wrong
/// program.
std::string digest(std::string_view text) {
    std::array<char, 33> hex{};
    std::snprintf(hex.data(), hex.size(), "%016llx%016llx",
                  static_cast<unsigned long long>(fnv1a(text, 0xcbf29ce484222325ULL)),
                  static_cast<unsigned long long>(fnv1a(text, 0x9ae16a3b2f90404fULL)));
    return hex.data();
}

void append(std::string& out, std::string_view part) {
    const std::uint64_t size = part.size();
    out.append(reinterpret_cast<const char*>(&size), sizeof size);
    out.append(part);
}

std::optional<std::string_view> take(std::string_view& in) {
    std::uint64_t size = 0;
    if (in.size() < sizeof size) return {};
    std::memcpy(&size, in.data(), sizeof size);
    in.remove_prefix(sizeof size);
    if (in.size() < size) return {};
    const std::string_view part = in.substr(0, size);
    in.remove_prefix(size);
    return part;
}

std::string first_error_line(const std::string& log) {
    const std::size_t at = log.find("error");
    if (at == std::string::npos) return log.substr(0, log.find('\n'));
    const std::size_t begin = log.rfind('\n', at) == std::string::npos ? 0 : log.rfind('\n', at) + 1;
    return log.substr(begin, log.find('\n', at) - begin);
}

/// "kernels/cl/fft.cl": what the first line of an embedded program calls its file.
std::string file_name(std::string_view stem, std::string_view source) {
    constexpr std::string_view before = "#line 1 \"";
    if (source.substr(0, before.size()) == before) {
        source.remove_prefix(before.size());
        return std::string(source.substr(0, source.find('"')));
    }
    return std::string(stem) + ".cl";
}

}  // namespace

std::string BuildParameters::options() const {
    std::string text;
    for (const auto& [name, value] : definitions_) {
        if (!text.empty()) text += ' ';
        text.append("-D").append(name).append("=").append(value);
    }
    return text;
}

ProgramCache::ProgramCache(cl::Context context, cl::Device device, std::filesystem::path folder)
    : context_(std::move(context)), device_(std::move(device)), folder_(std::move(folder)) {
    device_name_ = device_.getInfo<CL_DEVICE_NAME>();
    const cl::Platform platform(device_.getInfo<CL_DEVICE_PLATFORM>());
    device_key_ = device_name_ + '\n' + device_.getInfo<CL_DEVICE_VENDOR>() + '\n' +
                  device_.getInfo<CL_DEVICE_VERSION>() + '\n' + device_.getInfo<CL_DRIVER_VERSION>() + '\n' +
                  platform.getInfo<CL_PLATFORM_VERSION>();
}

cl::Kernel& ProgramCache::kernel(std::string_view stem, const std::string& name,
                                 const BuildParameters& parameters) {
    const std::string_view source = embedded_kernel(stem);
    if (source.empty())
        throw DeviceError("build the kernels of '" + std::string(stem) + "'", "no such program is embedded",
                          "reinstall btfield: the library and its headers do not match");
    // One kernel a program: only what is launched is ever compiled.
    return kernel_from_source(stem, source, name, parameters.options() + " -DBTFIELD_KERNEL_" + name);
}

cl::Kernel& ProgramCache::kernel_from_source(std::string_view stem, std::string_view source,
                                             const std::string& name, const std::string& options) {
    const std::lock_guard lock(mutex_);
    Program& built = program(stem, source, options);
    const auto found = built.kernels.find(name);
    if (found != built.kernels.end()) return found->second;
    return guarded(
        "create kernel '" + name + "' of " + file_name(stem, source), device_name_, [&]() -> cl::Kernel& {
            return built.kernels.emplace(name, cl::Kernel(built.program, name.c_str())).first->second;
        });
}

ProgramCache::Program& ProgramCache::program(std::string_view stem, std::string_view source,
                                             const std::string& options) {
    const std::string all_options = "-cl-std=CL1.2 -w" + (options.empty() ? "" : ' ' + options);
    std::string key = std::string(stem) + '\n' + all_options + '\n' + device_key_ + '\n';
    key += source;
    const auto found = programs_.find(key);
    if (found != programs_.end()) return found->second;

    cl::Program built;
    if (load(key, all_options, built)) {
        ++statistics_.loaded;
    } else {
        const std::string where = "build " + file_name(stem, source);
        guarded(where, device_name_, [&] { built = cl::Program(context_, std::string(source)); });
        try {
            built.build(device_, all_options.c_str());
        } catch (const cl::Error& error) {
            std::string log;
            try {
                log = built.getBuildInfo<CL_PROGRAM_BUILD_LOG>(device_);
            } catch (const cl::Error&) {
                log = "no build log";
            }
            throw DeviceError(where + " on device '" + device_name_ + "' with " + all_options,
                              cl_error_name(error.err()) + ", " + first_error_line(log),
                              pocl_cache_remedy() + ", or report it with the whole build log", log);
        }
        ++statistics_.compiled;
        store(key, built);
    }
    return programs_.emplace(std::move(key), Program{std::move(built), {}}).first->second;
}

ProgramCache::Statistics ProgramCache::statistics() const {
    const std::lock_guard lock(mutex_);
    return statistics_;
}

std::filesystem::path ProgramCache::file_of(const std::string& key) const {
    return folder_ / (digest(key) + ".clbin");
}

bool ProgramCache::load(const std::string& key, const std::string& options, cl::Program& out) {
    if (folder_.empty()) return false;
    const std::filesystem::path path = file_of(key);
    std::ifstream file(path, std::ios::binary);
    if (!file) return false;
    // Inserting notes a failed read (a folder of that name, say) in the stream; bare iterators would throw.
    std::ostringstream content;
    content << file.rdbuf();
    const std::string text = content.str();
    file.close();

    std::string_view rest = text;
    const bool known = rest.substr(0, magic.size()) == magic;
    if (known) rest.remove_prefix(magic.size());
    const auto stored_key = known ? take(rest) : std::nullopt;
    const auto checksum = stored_key ? take(rest) : std::nullopt;
    const auto binary = checksum ? take(rest) : std::nullopt;
    if (binary && rest.empty() && *stored_key == key && *checksum == digest(*binary)) {
        try {
            out = cl::Program(context_, {device_}, cl::Program::Binaries{{binary->begin(), binary->end()}});
            out.build(device_, options.c_str());
            return true;
        } catch (const cl::Error&) {
            // A driver may refuse a binary that it made itself, after an update say: build anew.
        }
    }
    ++statistics_.discarded;
    return false;
}

void ProgramCache::store(const std::string& key, const cl::Program& program) const {
    if (folder_.empty()) return;
    // A cache that cannot be written is done without: nothing that the user asked for depends on it.
    try {
        const auto binaries = program.getInfo<CL_PROGRAM_BINARIES>();
        if (binaries.empty() || binaries.front().empty()) return;
        const std::string_view binary(reinterpret_cast<const char*>(binaries.front().data()),
                                      binaries.front().size());
        std::string text(magic);
        append(text, key);
        append(text, digest(binary));
        append(text, binary);

        std::error_code failed;
        std::filesystem::create_directories(folder_, failed);
        write_file(file_of(key), text, "keep a kernel", false);
    } catch (const cl::Error&) {
    } catch (const InputError&) {
    }
}

}  // namespace btfield::detail

#include "host/pictures/picture_codec.hpp"

#ifdef BTFIELD_PICTURES_MODULE
#include <dlfcn.h>

#include <filesystem>
#include <future>
#include <system_error>

#include "btfield/error.hpp"
#endif

namespace btfield {

using namespace detail;

#ifdef BTFIELD_PICTURES_MODULE
namespace {

namespace fs = std::filesystem;

/// Full name of the module, beside the file that this function is in.
fs::path find_module() {
    Dl_info self{};
    if (::dladdr(reinterpret_cast<void*>(&find_module), &self) == 0) return BTFIELD_PICTURES_MODULE;
    std::error_code error;
    fs::path library = fs::canonical(self.dli_fname, error);
    if (error) library = self.dli_fname;
    return library.parent_path() / BTFIELD_PICTURES_MODULE;
}

// Found while btfield itself is loaded: the system may know its name relative to a working folder that
// changes.
const fs::path module_file = find_module();

struct Loaded {
    const PictureCodec* codec = nullptr;
    std::string error;
};

Loaded load() {
    // RTLD_NODELETE: exceptions and threads of the codecs may outlive any use of the handle.
    void* const handle = ::dlopen(module_file.c_str(), RTLD_NOW | RTLD_LOCAL | RTLD_NODELETE);
    void* const entry = handle != nullptr ? ::dlsym(handle, "btfield_picture_codec") : nullptr;
    if (entry == nullptr) return {nullptr, ::dlerror()};
    return {reinterpret_cast<decltype(&btfield_picture_codec)>(entry)(), {}};
}

/// Its destructor, at the end of the process, waits for loading that has begun: initialisers of libraries
/// must not run beside destructors. (No dlclose() can get here, which would wait for itself: btfield is
/// linked with -z nodelete.) Deferred where the system grants no more threads.
std::shared_future<Loaded> loading() {
    static const std::shared_future<Loaded> once =
        std::async(std::launch::async | std::launch::deferred, &load).share();
    return once;
}

}  // namespace

void preload_picture_formats() {
    static_cast<void>(loading());
}

const PictureCodec& detail::picture_codec(const std::string& asked) {
    const std::shared_future<Loaded> future = loading();
    const Loaded& loaded = future.get();  // lives as long as loading()'s own copy
    if (loaded.codec == nullptr) {
        throw InputError(
            asked,
            "the picture formats, '" + module_file.string() + "', cannot be loaded (" + loaded.error + ")",
            "install btfield and OpenImageIO again, or use PNG or PNM pictures");
    }
    return *loaded.codec;
}

#else

void preload_picture_formats() {}

const PictureCodec& detail::picture_codec(const std::string& /*asked*/) {
    return *btfield_picture_codec();
}

#endif

}  // namespace btfield

#include "host/base/temporary_names.hpp"

#include <dlfcn.h>

#include <set>
#include <system_error>

#include "btfield/api.hpp"

namespace btfield::detail {
namespace {

struct Noted {
    std::mutex changing;
    std::set<std::filesystem::path> names;
};

/// Never destroyed: threads may outlive static objects.
Noted& own() {
    static Noted& all = *new Noted;
    return all;
}

}  // namespace
}  // namespace btfield::detail

/// Library, experiments and command each have this file inside: they agree on the first that the process
/// has loaded.
extern "C" BTFIELD_API void* btfield_temporary_names() {
    return &btfield::detail::own();
}

namespace btfield::detail {
namespace {

Noted& noted() {
    static Noted& all = [&]() -> Noted& {
        void* const first = ::dlsym(RTLD_DEFAULT, "btfield_temporary_names");
        if (first == nullptr) return own();  // a static btfield, or one that a module keeps to itself
        return *static_cast<Noted*>(reinterpret_cast<decltype(&btfield_temporary_names)>(first)());
    }();
    return all;
}

}  // namespace

TemporaryStep::TemporaryStep() : lock_(noted().changing) {}

void TemporaryStep::note(const std::filesystem::path& name) const {
    noted().names.insert(name);
}

void TemporaryStep::forget(const std::filesystem::path& name) const noexcept {
    noted().names.erase(name);
}

void remove_temporaries() noexcept {
    Noted& all = noted();
    all.changing.lock();  // for ever
    std::error_code ignored;
    for (const std::filesystem::path& name : all.names) std::filesystem::remove_all(name, ignored);
}

}  // namespace btfield::detail

// One program for all targets, which libFuzzer drives:
//   btfield_fuzz --list
//   btfield_fuzz TARGET --seeds FOLDER
//   btfield_fuzz TARGET [words of libFuzzer]

#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <stdexcept>

#include <sys/mman.h>
#include <unistd.h>

#include "btfield/error.hpp"
#include "host/base/text.hpp"
#include "tests/fuzz/fuzz_target.hpp"
#include "tests/temporary_folder.hpp"

extern "C" std::size_t LLVMFuzzerMutate(std::uint8_t* bytes, std::size_t size, std::size_t most);

namespace btfield::test {

void demand(bool condition, const char* what) {
    if (!condition) throw std::logic_error(what);
}

const std::filesystem::path& file_with(std::string_view bytes) {
    static const int descriptor = ::memfd_create("fuzz", MFD_CLOEXEC);
    static const std::filesystem::path path = "/proc/self/fd/" + std::to_string(descriptor);
    const bool written = ::ftruncate(descriptor, 0) == 0 && ::pwrite(descriptor, bytes.data(), bytes.size(),
                                                                     0) == static_cast<ssize_t>(bytes.size());
    demand(written, "the bytes cannot be kept in memory");
    return path;
}

void check_message(std::string_view message) {
    demand(detail::valid_utf8(message) == message, "a message is no UTF-8");
    for (const char c : message)
        demand(static_cast<unsigned char>(c) >= 0x20 && c != 0x7f, "a message holds a control character");
}

namespace {

const FuzzTarget* chosen = nullptr;

std::vector<FuzzTarget> all_targets() {
    std::vector<FuzzTarget> all = model_targets();
    for (const FuzzTarget& target : picture_targets()) all.push_back(target);
    for (const FuzzTarget& target : btf_targets()) all.push_back(target);
    return all;
}

[[noreturn]] void fail(const std::string& message) {
    std::fprintf(stderr, "%s\n", message.c_str());
    std::exit(2);
}

void put_seeds(const std::filesystem::path& folder) {
    std::filesystem::create_directories(folder);
    std::size_t number = 0;
    for (const std::string& seed : chosen->seeds())
        put_bytes(folder / (std::string(chosen->name) + "-" + std::to_string(number++)), seed);
}

}  // namespace
}  // namespace btfield::test

using namespace btfield::test;

extern "C" int LLVMFuzzerInitialize(int* count, char*** words) {
    static const std::vector<FuzzTarget> targets = all_targets();
    const std::string name = *count > 1 ? (*words)[1] : "";
    for (const FuzzTarget& target : targets) {
        if (name == "--list") std::printf("%s\n", std::string(target.name).c_str());
        if (target.name == name) chosen = &target;
    }
    if (name == "--list") std::exit(0);
    if (chosen == nullptr) fail("no such target: '" + name + "'; --list has them all");
    if (*count > 3 && std::string_view((*words)[2]) == "--seeds") {
        put_seeds((*words)[3]);
        std::exit(0);
    }
    // The rest is libFuzzer's.
    for (int i = 1; i + 1 < *count; ++i) (*words)[i] = (*words)[i + 1];
    (*words)[--*count] = nullptr;
    for (const std::string& seed : chosen->seeds())
        chosen->read(seed);  // good ones are taken; codecs are loaded
    return 0;
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* bytes, std::size_t size) {
    try {
        chosen->read({reinterpret_cast<const char*>(bytes), size});
    } catch (const btfield::InputError& error) {
        check_message(error.what());
    }
    return 0;
}

extern "C" std::size_t LLVMFuzzerCustomMutator(std::uint8_t* bytes, std::size_t size, std::size_t most,
                                               unsigned /*seed*/) {
    const std::size_t changed = LLVMFuzzerMutate(bytes, size, most);
    if (chosen->repair != nullptr) chosen->repair(bytes, changed);
    return changed;
}

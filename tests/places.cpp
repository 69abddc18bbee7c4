#include "tests/places.hpp"

namespace btfield::test {

const std::string& data_folder() {
    static const std::string folder = BTFIELD_SOURCE_DIR "/tests/data";
    return folder;
}

const std::string& source_folder() {
    static const std::string folder = BTFIELD_SOURCE_DIR;
    return folder;
}

const std::string& command_path() {
    static const std::string path = BTFIELD_CLI;
    return path;
}

const std::string& library_path() {
    static const std::string path = BTFIELD_LIBRARY;
    return path;
}

const std::string& mpiexec_path() {
    static const std::string path = BTFIELD_MPIEXEC;
    return path;
}

}  // namespace btfield::test

#pragma once

// Programs as several ranks of mpirun.

#include <cstdlib>
#include <map>
#include <string>
#include <vector>

#include "tests/places.hpp"

namespace btfield::test {

#ifdef BTFIELD_MPI
/// A command as so many ranks, in an environment in which they start wherever tests run.
inline std::vector<std::string> ranks(int count, std::vector<std::string> words) {
    // What a container without network, remote shells or a user of its own needs from Open MPI.
    for (const auto& [variable, value] :
         std::map<std::string, std::string>{{"OMPI_ALLOW_RUN_AS_ROOT", "1"},
                                            {"OMPI_ALLOW_RUN_AS_ROOT_CONFIRM", "1"},
                                            {"OMPI_MCA_rmaps_base_oversubscribe", "1"},
                                            {"OMPI_MCA_plm_rsh_agent", "/bin/false"},
                                            {"OMPI_MCA_btl", "self,vader"},
                                            {"OMPI_MCA_btl_vader_single_copy_mechanism", "none"}})
        ::setenv(variable.c_str(), value.c_str(), 1);
    // Open MPI keeps memory in modules that it unloads: no suppression can name them.
    const char* const options = std::getenv("ASAN_OPTIONS");
    if (options != nullptr && std::string(options).find("detect_leaks=0") == std::string::npos)
        ::setenv("ASAN_OPTIONS", (std::string(options) + ":detect_leaks=0").c_str(), 1);
    words.insert(words.begin(), {mpiexec_path(), "-n", std::to_string(count)});
    return words;
}
#endif

}  // namespace btfield::test

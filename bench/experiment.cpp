#include "btfield/experiment.hpp"

#include <unistd.h>

#include <filesystem>
#include <memory>
#include <stdexcept>
#include <string>
#include <thread>

#include "bench/cases.hpp"
#include "bench/report.hpp"
#include "host/experiment/config_text.hpp"

namespace btfield::bench {

using namespace detail;

namespace {

namespace fs = std::filesystem;

const char* const configuration = R"json({
    "pictures": [{"material": "bark", "files": ["bark.png"], "crop": [0, 0, 128, 128]},
                 {"material": "cork", "files": ["cork.png"], "crop": [0, 0, 128, 128]}],
    "models": ["2d-car", "3d-car", "3d-ma", "3d-mmrf"], "orders": [1, 3, 5], "levels": [1, 2], "seeds": [0, 1]
})json";
constexpr double jobs = 2 * 4 * 3 * 2 * 2;

/// Times are per job; the peer is the same experiment one job at a time, without what jobs share.
void add_case(const std::string& name, int threads, int unit) {
    add(name, [=] {
        Work work;
        work.textures = jobs;
        const auto database = std::make_shared<fs::path>(
            fs::temp_directory_path() / ("btfield-bench-" + std::to_string(::getpid()) + ".db"));
        const auto config = std::make_shared<ExperimentConfig>(
            experiment_from_text(configuration, BTFIELD_TEST_DATA, "read the experiment of the benchmark"));
        return std::pair(work, std::function<void()>([=] {
                             fs::remove(*database);
                             ExperimentRunOptions options;
                             options.jobs = threads;
                             options.unit = unit;
                             const ExperimentResult result = run_experiment(*config, *database, options);
                             fs::remove(*database);
                             if (result.done != static_cast<std::uint64_t>(jobs)) {
                                 throw std::runtime_error("jobs were refused: " + result.failure);
                             }
                         }));
    });
}

}  // namespace

void add_experiment() {
    const std::string name = "experiment 128x128, per job, ";
    add_case(name + "1 thread", 1, 0);
    add_case(name + "1 thread" + peer_suffix, 1, 1);
    const int cores = static_cast<int>(std::thread::hardware_concurrency());
    add_case(name + std::to_string(cores) + " threads", cores, 0);
}

}  // namespace btfield::bench

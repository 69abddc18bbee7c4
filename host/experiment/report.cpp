#include "btfield/experiment.hpp"
namespace btfield { void write_experiment_report(const std::filesystem::path&, const std::filesystem::path&, int) {} }

#pragma once

/// \file
/// Several processes of one experiment, started by mpirun.

#include <memory>

#include "btfield/experiment.hpp"

namespace btfield::cli {

/// The ranks that this process is one of; nullptr when nobody started it as one. Ends MPI when destroyed.
/// \throws InputError when it was started as one and was built without MPI.
[[nodiscard]] std::unique_ptr<ExperimentRanks> open_ranks();

}  // namespace btfield::cli

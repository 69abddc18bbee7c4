#pragma once

#include "btfield/device.hpp"
#include "host/cli/report.hpp"
#include "host/cli/synth_job.hpp"

namespace btfield::cli {

/// Grows the textures of one job and writes them, and notes in the job what it took. Those of a batch are
/// written in threads of their own, while the device grows the next ones.
/// \param done, share  of all work, for the bar: what was done before, and what this job is
void grow(Device& device, const SynthArguments& options, SynthJob& job, Progress& bar, double done,
          double share);

}  // namespace btfield::cli

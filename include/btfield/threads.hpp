#pragma once

/// \file
/// How many of the machine's cores host work may take.

#include "btfield/api.hpp"

namespace btfield {

/// Threads of this process that compute for one caller at a time, its own among them: as many as there are
/// cores, unless limit_threads() or $BTFIELD_THREADS says fewer. Several callers share the others. What a CPU
/// device computes has a limit of its own: DeviceOptions::threads.
/// \throws InputError when $BTFIELD_THREADS counts and is no whole number from 1 on
[[nodiscard]] BTFIELD_API int thread_limit();

/// Sets thread_limit() from now on, work under way excepted; 0 = as in the beginning. Results do not depend
/// on it.
/// \throws InputError below 0
BTFIELD_API void limit_threads(int count);

}  // namespace btfield

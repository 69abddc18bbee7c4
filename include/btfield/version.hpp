#pragma once

/// \file
/// The version of these headers, and of the library that runs. Before 1.0.0 a new minor version may ask for
/// changes in programs; patches never do.

#include <string_view>

#include "btfield/api.hpp"

#define BTFIELD_VERSION "0.1.0"
#define BTFIELD_VERSION_MAJOR 0
#define BTFIELD_VERSION_MINOR 1
#define BTFIELD_VERSION_PATCH 0
/// To compare with: `#if BTFIELD_VERSION_NUMBER >= 200` from 0.2.0 on.
#define BTFIELD_VERSION_NUMBER \
    (10000 * BTFIELD_VERSION_MAJOR + 100 * BTFIELD_VERSION_MINOR + BTFIELD_VERSION_PATCH)

namespace btfield {

/// BTFIELD_VERSION of the library that runs, which a shared one's headers need not be.
[[nodiscard]] BTFIELD_API std::string_view version();

}  // namespace btfield

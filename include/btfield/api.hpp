#pragma once

/// \file
/// What a shared btfield offers: names marked BTFIELD_API and no others.

#if defined(__GNUC__)
#define BTFIELD_API __attribute__((visibility("default")))
#else
#define BTFIELD_API
#endif

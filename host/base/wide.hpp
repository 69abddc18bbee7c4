#pragma once

/// Marks a function that is compiled for wider vector registers too; the program takes the widest that its
/// processor has. Sums then round as that processor does (products may be added unrounded), and never
/// differently for another number of threads. Names of such functions are unique in the library. Sanitizers
/// run the plain version: they are not ready when the choice is made.
#if defined(__has_feature)
#if __has_feature(address_sanitizer) || __has_feature(thread_sanitizer) || __has_feature(memory_sanitizer)
#define BTFIELD_WIDE
#endif
#endif
#if !defined(BTFIELD_WIDE) && !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__) && \
    defined(__x86_64__) && defined(__linux__)
#define BTFIELD_WIDE __attribute__((target_clones("default", "arch=haswell", "arch=skylake-avx512")))
#endif
#if !defined(BTFIELD_WIDE)
#define BTFIELD_WIDE
#endif

#pragma once

// Writing .btf files of UBO2014: one factorisation of all pictures (FMF12).

#include <cstdint>
#include <filesystem>
#include <functional>

#include "btfield/btf_output.hpp"
#include "btfield/btf_set.hpp"

namespace btfield::detail {

struct FmfReport {
    int components = 0;
    double relative_error = 0.0;  ///< root mean square, to that of all values
};

/// Reads the set factor_readings times. Colours become linear RGB with white 1; other planes stay.
/// \param type  half or float32
/// \param components  as many as pictures can have where there are fewer
/// \param next  told how many pictures are read, of all readings
/// \throws InputError as write_btf()
FmfReport write_fmf(const std::filesystem::path& file, const BtfSet& set, PixelType type, int components,
                    const std::function<void(std::uint64_t)>& next);

}  // namespace btfield::detail

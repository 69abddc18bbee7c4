#pragma once

/// \file
/// Writing BTFs as sets that other programs know.

#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string_view>

#include "btfield/api.hpp"
#include "btfield/btf_set.hpp"
#include "btfield/image_io.hpp"

namespace btfield {

/// How a set is stored.
enum class BtfFormat {
    utia,      ///< folders tvTTT_pvPPP of PNG (sRGB) or, of halves and floats, EXR
    ubo2003,   ///< folders tvTTT_pvPPP of numbered JPEG, gamma 2.2
    atrium,    ///< the same of Radiance pictures, linear
    spectral,  ///< EXR in one folder, linear
    tbig,      ///< one file as UTIA's TBIG 2 has it, linear
    big,       ///< one file as UTIA's BIG 3 has it, linear
    mif,       ///< one file, XYZ with white 100
    fmf,       ///< one .btf file as UBO2014 has it: one factorisation of all pictures, linear
};
/// "utia", "ubo2003", "atrium", "spectral", "tbig", "big", "mif", "ubo2014-fmf".
[[nodiscard]] BTFIELD_API std::string_view name(BtfFormat format);

struct BtfWriteOptions {
    BtfFormat format = BtfFormat::utia;
    /// Of values, where the format leaves a choice: utia uint8, uint16, half, float; spectral
    /// and single files half, float.
    std::optional<PixelType> type;
    /// What linear light is multiplied by before it is stored. The file btf.json of the set says so, and
    /// BtfSet::open() divides by it. Of folders alone.
    double exposure = 1.0;
    /// Of fmf: components that stand for all pictures, from 1 on; as many as there can be where that is
    /// fewer.
    int components = 64;
    /// Called in the caller's thread, with the number of pictures that are written; of fmf, with those that
    /// are read, each of which counts as often as it is. What it throws ends the work.
    std::function<void(std::uint64_t done, std::uint64_t all)> progress;
};

struct BtfWriteReport {
    std::uint64_t pictures = 0;
    std::uintmax_t bytes = 0;           ///< of them
    std::uintmax_t clamped_pixels = 0;  ///< of all pictures, those with a value below 0 or above white
    int components = 0;                 ///< of fmf
    /// Of fmf: root mean square of what factors leave of all values, to that of the values.
    double relative_error = 0.0;
};

/// Writes all pictures that are there, several at a time. Names tell where light really comes from. A folder
/// is made where it is missing; each picture appears complete or not at all, btf.json (exposure, white of the
/// set, and its range map beside it, height.exr) before the first. A name that ends in .zip is that of an
/// archive of such a folder, which appears complete or not at all, as other files do.
/// \throws InputError when the format cannot hold the planes or the type, exposure is not above 0, a value is
///     not finite, or what BtfSet::picture() and write_picture() throw
BTFIELD_API BtfWriteReport write_btf(const std::filesystem::path& path, const BtfSet& set,
                                     const BtfWriteOptions& options = {});

/// \throws what write_btf() would throw for these options and planes, before any work is done
BTFIELD_API void check_btf_output(const std::filesystem::path& path, const BtfDescription& set,
                                  const BtfWriteOptions& options);

}  // namespace btfield

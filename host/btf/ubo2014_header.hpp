#pragma once

// What all .btf files of UBO2014 begin with.

#include <cstdint>
#include <string>
#include <vector>

#include "btfield/btf_set.hpp"
#include "host/btf/byte_file.hpp"

namespace btfield::detail {

enum class Ubo2014Kind { fmf06, fmf12, dfmf, pvf, bdi };

struct Ubo2014Header {
    Ubo2014Kind kind = Ubo2014Kind::fmf06;
    bool rotations = false;  ///< follow the size of pictures
    bool old = false;        ///< of PVF: another order, without meta data
    std::uint32_t version = 0, components = 0;
    std::uint32_t view_slots = 0;  ///< of old PVF
    float pixels_per_mm = 0.0F;
    bool cosine = false;  ///< light that falls in is multiplied by cos θ
    std::vector<std::string> channels;
    std::vector<BtfDirection> views;
    std::vector<std::vector<BtfDirection>> lights;  ///< of each view
    std::vector<std::uint64_t> first;  ///< pictures before those of each view; all of them at the end
    std::uint32_t width = 0, height = 0;

    [[nodiscard]] std::uint64_t pictures() const { return first.back(); }
    [[nodiscard]] std::uint64_t pixels() const { return std::uint64_t{width} * height; }
};

/// Reads up to what the kinds have of their own. Of BDI, whose rotations come later, up to the size.
[[nodiscard]] Ubo2014Header read_ubo2014_header(ByteCursor& cursor, const ByteFile& file);

/// u32 n, n matrices of 3 x 3: they say where the sample lay, pictures are rectified already.
void skip_rotations(ByteCursor& cursor);

}  // namespace btfield::detail

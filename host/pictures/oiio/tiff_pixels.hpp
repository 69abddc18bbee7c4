#pragma once

// Samples of a TIFF's picture.

#include <string>

#include "btfield/image.hpp"
#include "host/pictures/oiio/tiff_file.hpp"

namespace btfield::detail {

/// One file while its pixels are read.
class TiffPixels {
  public:
    /// All are to outlive it.
    /// \param message  what libtiff says
    TiffPixels(TIFF* tiff, const TiffLayout& layout, const std::string& message, const std::string& asked)
        : tiff_(tiff), layout_(layout), message_(message), asked_(asked) {}

    /// All samples of the stored rectangle; unsigned integers up to 16 bits as fractions.
    /// \param beyond_float  whether a whole number that float32 rounds was met
    [[nodiscard]] Image samples(Crop crop, bool& beyond_float) const;
    /// As libtiff shows it, 8 bits: of kinds that only it can decode.
    [[nodiscard]] Image shown(Crop crop) const;

  private:
    struct Sampler;
    [[noreturn]] void refuse() const;
    void take(const std::uint8_t* row, int begin, int from, int to, int stored_row, Crop crop, int plane,
              Image& result, Sampler& sampler) const;
    void read_strips(Crop crop, int plane, Image& result, Sampler& sampler) const;
    void read_tiles(Crop crop, int plane, Image& result, Sampler& sampler) const;
    [[nodiscard]] std::uint32_t word32(std::uint32_t tag) const;

    TIFF* tiff_;
    const TiffLayout& layout_;
    const std::string& message_;
    const std::string& asked_;
};

}  // namespace btfield::detail

#pragma once

/// \file
/// What WebP and HEIF files say beside their pixels, which OpenImageIO passes over.

#include <string>
#include <string_view>

namespace btfield::detail {

struct ContainerChunks {
    std::string profile;      ///< ICC; empty: none
    std::string exif;         ///< from its byte order mark on; empty: none
    std::string xmp;          ///< of a WebP; empty: none
    std::string code_points;  ///< primaries and transfer function by ITU-T H.273, one byte each; empty: none
};

/// ICCP, EXIF and XMP of a WebP; what is damaged is passed over.
[[nodiscard]] ContainerChunks webp_chunks(std::string_view bytes);

/// The colour properties (colr: prof, rICC, nclx) of a HEIF's first picture, or, where they belong to none,
/// the first that there are; what is damaged is passed over. How it is turned is its decoder's business.
[[nodiscard]] ContainerChunks heif_chunks(std::string_view bytes);

}  // namespace btfield::detail

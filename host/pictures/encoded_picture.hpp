#pragma once

/// \file
/// A picture that is encoded and not yet in its place.

#include <filesystem>
#include <memory>

#include "btfield/image.hpp"
#include "btfield/image_io.hpp"
#include "host/base/file_output.hpp"

namespace btfield::detail {

struct EncodedPicture {
    std::unique_ptr<FileOutput> file;  ///< to be committed
    WriteReport report;
};

/// All of write_picture() but the last step.
/// \throws InputError as that
[[nodiscard]] EncodedPicture encode(const std::filesystem::path& path, const Image& image,
                                    const WriteOptions& options);

}  // namespace btfield::detail

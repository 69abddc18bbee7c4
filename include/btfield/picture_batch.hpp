#pragma once

/// \file
/// Many pictures written at once.

#include <filesystem>
#include <memory>

#include "btfield/api.hpp"
#include "btfield/image.hpp"
#include "btfield/image_io.hpp"

namespace btfield {

/// Writes pictures as write_picture() does, and waits for the disk once for a group of them, not for each:
/// they get their names when the group is on the disk, which is full with 64 pictures, or with the first one
/// a second after the group before. So a batch that is ended, even by a loss of power, leaves whole pictures
/// only. What is written to a pipe or a device goes there at once. Any number of threads may write.
class BTFIELD_API PictureBatch {
  public:
    PictureBatch();
    /// As finish(), but silent about what fails.
    ~PictureBatch();
    PictureBatch(const PictureBatch&) = delete;
    PictureBatch& operator=(const PictureBatch&) = delete;

    /// Encodes the picture in the calling thread, which at times is the one that waits for the disk.
    /// \throws InputError as write_picture(); also when an earlier picture cannot be put in its place
    WriteReport write(const std::filesystem::path& path, const Image& image, const WriteOptions& options);
    /// Returns when all pictures are on the disk, under their names.
    /// \throws InputError when that fails
    void finish();

  private:
    class Impl;
    std::unique_ptr<Impl> impl_;
};

}  // namespace btfield

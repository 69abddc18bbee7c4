#pragma once

// Between the numbers of picture files and linear light, and names of such files.

#include <cstdint>
#include <filesystem>
#include <string>

#include "btfield/btf_output.hpp"
#include "btfield/btf_set.hpp"
#include "btfield/image_io.hpp"
#include "host/pictures/picture_format.hpp"

namespace btfield::detail {

/// From the numbers of a file to linear light.
class BtfDecoder {
  public:
    explicit BtfDecoder(const BtfOptions& options) : options_(options) {}
    /// What values are divided by.
    void set_exposure(double exposure) { exposure_ = exposure; }
    /// What read_picture() is to do for a file of this name.
    [[nodiscard]] ReadOptions reading(const std::filesystem::path& file) const;
    /// The picture's values as linear light.
    [[nodiscard]] Image operator()(Picture picture, const std::filesystem::path& file) const;

  private:
    BtfOptions options_;
    double exposure_ = 1.0;
};

/// From linear light to pictures in files.
class BtfEncoder {
  public:
    /// \throws InputError as check_btf_output()
    BtfEncoder(const BtfDescription& set, const BtfWriteOptions& options, const std::string& asked);
    /// ".png"
    [[nodiscard]] const std::string& extension() const { return extension_; }
    /// Where a picture lies in its folder.
    [[nodiscard]] std::filesystem::path name(const BtfDirection& view, const BtfDirection& light,
                                             std::uint64_t number) const;
    /// Writes to a name whose extension says nothing.
    /// \return number of pixels that were clamped
    std::uintmax_t write(const std::filesystem::path& to, Image image, const std::string& asked) const;

  private:
    BtfFormat format_;
    Storage storage_;
    std::string extension_;
    float exposure_, white_;
};

/// "045", "007.5": degrees as names have them.
[[nodiscard]] std::string angle_text(double radians);

}  // namespace btfield::detail

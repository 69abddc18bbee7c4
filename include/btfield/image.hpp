#pragma once

/// \file
/// The picture as the library sees it: planar float32 on a doubly toroidal lattice.

#include <cstddef>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "btfield/api.hpp"

namespace btfield {

namespace detail {
struct PictureRoom;
}

/// Rows × columns of a lattice.
struct Size {
    int height = 0;
    int width = 0;
    friend bool operator==(const Size&, const Size&) = default;
};

/// Number of pixels as a size that cannot overflow for any pair of ints.
[[nodiscard]] constexpr std::size_t area(Size s) {
    return static_cast<std::size_t>(s.height) * static_cast<std::size_t>(s.width);
}

/// Meaning of the plane values. Models are fitted to values as they are; the space travels to the output.
enum class ColourSpace {
    unspecified,  ///< spectral bands, heights, or planes of several kinds: Image::plane_spaces() may tell
    srgb,         ///< sRGB-encoded, as 8-bit and 16-bit pictures are unless they say otherwise
    linear,       ///< linear light, Rec. 709 primaries, as HDR pictures are unless they say otherwise
    xyz,          ///< CIE XYZ of a picture whose white is that of Rec. 709
};

/// "unspecified", "srgb", "linear", "xyz".
[[nodiscard]] BTFIELD_API std::string_view name(ColourSpace space);
/// Inverse of name().
/// \throws InputError for any other text
[[nodiscard]] BTFIELD_API ColourSpace colour_space(std::string_view name);

/// Memory of pictures, zero-filled. From 2 MiB on in huge pages where the system has them, which whoever
/// fills the picture touches first: touching fresh memory page by page takes as long as filling it with
/// texture.
template <class Value>
struct BTFIELD_API PictureAllocator {
    using value_type = Value;
    [[nodiscard]] Value* allocate(std::size_t count);
    void deallocate(Value* values, std::size_t count) noexcept;
    /// What is not given a value is what allocate() left there.
    void construct(Value* /*value*/) noexcept {}
    friend bool operator==(PictureAllocator, PictureAllocator) { return true; }
};
extern template struct BTFIELD_API PictureAllocator<float>;

/// Planar float32 picture, layout [plane][row][column]. A value type. 8-bit and 16-bit sources are scaled to
/// [0, 1]; float sources keep their values.
class BTFIELD_API Image {
  public:
    Image() = default;
    /// Zero-filled.
    /// \throws InputError when a side or the number of planes is < 1, or the total overflows
    Image(Size size, int planes, ColourSpace space = ColourSpace::unspecified);

    [[nodiscard]] Size size() const { return size_; }
    [[nodiscard]] int height() const { return size_.height; }
    [[nodiscard]] int width() const { return size_.width; }
    [[nodiscard]] int planes() const { return planes_; }
    [[nodiscard]] ColourSpace space() const { return space_; }
    /// Of all planes: what plane_spaces() had is forgotten.
    void set_space(ColourSpace space) {
        space_ = space;
        plane_spaces_.clear();
    }
    /// What the values of each plane are where space() is unspecified: colours beside data, grey. Empty, or
    /// one for each plane; xyz is of three planes, X, Y and Z, one after the other. Models take no notice;
    /// textures get it, and files are written by it.
    [[nodiscard]] const std::vector<ColourSpace>& plane_spaces() const { return plane_spaces_; }
    /// Those that are all unspecified are as none.
    /// \throws InputError when there are some, but not one for each plane, or xyz is not of three in a row
    void set_plane_spaces(std::vector<ColourSpace> spaces);
    /// Of one plane.
    [[nodiscard]] ColourSpace plane_space(int p) const {
        return plane_spaces_.empty() ? space_ : plane_spaces_[static_cast<std::size_t>(p)];
    }
    /// What the file calls its planes ("550nm", "diffuse.R"): empty, or one text per plane.
    [[nodiscard]] const std::vector<std::string>& names() const { return names_; }
    /// \throws InputError when there are names, but not one for each plane
    void set_names(std::vector<std::string> names);

    [[nodiscard]] std::span<float> plane(int p) {
        return {values_.data() + static_cast<std::size_t>(p) * area(size_), area(size_)};
    }
    [[nodiscard]] std::span<const float> plane(int p) const {
        return {values_.data() + static_cast<std::size_t>(p) * area(size_), area(size_)};
    }
    [[nodiscard]] float& at(int p, int row, int column) { return values_[index(p, row, column)]; }
    [[nodiscard]] float at(int p, int row, int column) const { return values_[index(p, row, column)]; }
    /// All planes, one after the other.
    [[nodiscard]] std::span<float> values() { return values_; }
    [[nodiscard]] std::span<const float> values() const { return values_; }

    /// Copy of the rectangle, with names and spaces; it does not wrap.
    /// \throws InputError when it is empty or leaves the picture
    [[nodiscard]] Image crop(int row, int column, Size size) const;
    /// Part of the plane that the picture tiles: pixel (r, c) is (row + r, column + c) modulo the picture's
    /// sides. Any place and size.
    /// \throws InputError when it or the picture is empty
    [[nodiscard]] Image window(int row, int column, Size size) const;

  private:
    friend struct detail::PictureRoom;
    [[nodiscard]] std::size_t index(int p, int row, int column) const {
        return (static_cast<std::size_t>(p) * static_cast<std::size_t>(size_.height) +
                static_cast<std::size_t>(row)) *
                   static_cast<std::size_t>(size_.width) +
               static_cast<std::size_t>(column);
    }
    Size size_;
    int planes_ = 0;
    ColourSpace space_ = ColourSpace::unspecified;
    std::vector<ColourSpace> plane_spaces_;
    std::vector<std::string> names_;
    std::vector<float, PictureAllocator<float>> values_;
};

}  // namespace btfield

#pragma once

/// \file
/// How a stored picture is turned to be upright: the eight values of TIFF and EXIF.

#include <algorithm>

#include "btfield/image_io.hpp"

namespace btfield::detail {

/// 1: as stored; 2: mirrored left to right; 3: turned by 180 degrees; 4: mirrored top to bottom; 5 to 8: rows
/// are columns (5: transposed, 6: to be turned clockwise, 7: transposed the other way, 8: counter-clockwise).
/// Others count as 1.
struct Orientation {
    explicit Orientation(int value) : value_(value >= 1 && value <= 8 ? value : 1) {}

    [[nodiscard]] bool stored_upright() const { return value_ == 1; }
    [[nodiscard]] bool swaps_sides() const { return value_ >= 5; }
    [[nodiscard]] Size upright(Size stored) const {
        return swaps_sides() ? Size{stored.width, stored.height} : stored;
    }
    /// Where a rectangle of the upright picture is stored.
    [[nodiscard]] Crop stored(Crop crop, Size stored) const {
        if (swaps_sides()) {
            std::swap(crop.x, crop.y);
            std::swap(crop.width, crop.height);
        }
        if (value_ == 2 || value_ == 3 || value_ == 7 || value_ == 8)
            crop.x = stored.width - crop.x - crop.width;
        if (value_ == 3 || value_ == 4 || value_ == 6 || value_ == 7)
            crop.y = stored.height - crop.y - crop.height;
        return crop;
    }
    /// Stored values of one plane, upright.
    template <class From, class To>
    void turn(const From& from, Size stored, To&& to) const {
        const Size size = upright(stored);
        for (int row = 0; row < size.height; ++row) {
            for (int column = 0; column < size.width; ++column) {
                const Crop at = this->stored({column, row, 1, 1}, stored);
                to[static_cast<std::size_t>(row) * static_cast<std::size_t>(size.width) +
                   static_cast<std::size_t>(column)] =
                    from[static_cast<std::size_t>(at.y) * static_cast<std::size_t>(stored.width) +
                         static_cast<std::size_t>(at.x)];
            }
        }
    }

  private:
    int value_;
};

/// Planes and alpha of a picture that was read as it is stored.
inline void make_upright(Picture& picture, Orientation orientation) {
    if (orientation.stored_upright()) return;
    const Size stored = picture.image.size();
    Image image(orientation.upright(stored), picture.image.planes(), picture.image.space());
    image.set_names(picture.image.names());
    image.set_plane_spaces(picture.image.plane_spaces());
    for (int p = 0; p < image.planes(); ++p) orientation.turn(picture.image.plane(p), stored, image.plane(p));
    picture.image = std::move(image);
    if (picture.alpha.empty()) return;
    std::vector<float> alpha(picture.alpha.size());
    orientation.turn(picture.alpha, stored, alpha);
    picture.alpha = std::move(alpha);
}

}  // namespace btfield::detail

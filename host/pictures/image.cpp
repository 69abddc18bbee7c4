#include "btfield/image.hpp"

#include <algorithm>
#include <cstring>
#include <limits>
#include <new>
#include <string>
#include <utility>

#include "btfield/error.hpp"
#include "host/base/huge_pages.hpp"
#include "host/base/text.hpp"
#include "host/pictures/colour.hpp"
#include "host/pictures/picture_memory.hpp"
#include "host/pictures/picture_names.hpp"
#include "host/pictures/picture_room.hpp"

namespace btfield {
namespace {

/// height · width · planes; checked factor by factor, so that no product wraps.
std::size_t checked_values(Size size, int planes) {
    const std::string asked = "make a picture of " + detail::compact_text_of(size) + " pixels and " +
                              std::to_string(planes) + " planes";
    if (size.height < 1 || size.width < 1) {
        throw InputError(asked, "a side is less than 1", "give a positive width and height");
    }
    if (planes < 1) throw InputError(asked, "there is no plane", "give at least one plane");
    constexpr auto most =
        static_cast<std::size_t>(std::numeric_limits<std::ptrdiff_t>::max()) / sizeof(float);
    if (area(size) > most / static_cast<std::size_t>(planes)) {
        throw InputError(asked, "that is more than memory can address", "ask for a smaller picture");
    }
    return area(size) * static_cast<std::size_t>(planes);
}

/// Whether the thread's next large pictures may begin with anything.
thread_local bool leaves_unfilled = false;

class Unfilled {
  public:
    Unfilled() { leaves_unfilled = true; }
    ~Unfilled() { leaves_unfilled = false; }
    Unfilled(const Unfilled&) = delete;
    Unfilled& operator=(const Unfilled&) = delete;
};

}  // namespace

template <class Value>
Value* PictureAllocator<Value>::allocate(std::size_t count) {
    const std::size_t bytes = count * sizeof(Value);
    if (bytes < detail::huge_page) return static_cast<Value*>(std::memset(::operator new(bytes), 0, bytes));
    return static_cast<Value*>(detail::take_picture_memory(bytes, !leaves_unfilled));
}

template <class Value>
void PictureAllocator<Value>::deallocate(Value* values, std::size_t count) noexcept {
    const std::size_t bytes = count * sizeof(Value);
    if (bytes < detail::huge_page)
        ::operator delete(values);
    else
        detail::leave_picture_memory(values, bytes);
}

template struct PictureAllocator<float>;

std::string_view name(ColourSpace space) {
    return detail::word_of(space);
}

ColourSpace colour_space(std::string_view name) {
    if (const auto space = detail::find_value<ColourSpace>(name)) return *space;
    throw InputError("find a colour space", "'" + std::string(name) + "' is not known",
                     "use " + detail::words_of<ColourSpace>(", ", " or "));
}

Image::Image(Size size, int planes, ColourSpace space)
    : size_(size), planes_(planes), space_(space), values_(checked_values(size, planes)) {}

Image detail::PictureRoom::make(Size size, int planes, ColourSpace space, std::size_t room) {
    Image image;
    const std::size_t values = checked_values(size, planes);
    {
        const Unfilled unfilled;
        image.values_.reserve(std::max(values, room));
    }
    image.values_.resize(values);
    image.size_ = size;
    image.planes_ = planes;
    image.space_ = space;
    return image;
}

std::span<float> detail::PictureRoom::of(Image& image) {
    return {image.values_.data(), image.values_.capacity()};
}

void Image::set_names(std::vector<std::string> names) {
    if (!names.empty() && names.size() != static_cast<std::size_t>(planes_)) {
        throw InputError("name the planes of a picture",
                         detail::counted(names.size(), "name") + " for " + detail::counted(planes_, "plane"),
                         "give one name to each plane, or none");
    }
    names_ = std::move(names);
}

void Image::set_plane_spaces(std::vector<ColourSpace> spaces) {
    if (const std::string defect = detail::defect_of(spaces, planes_); !defect.empty())
        throw InputError("give colour spaces to the planes of a picture", defect,
                         "give one to each plane, xyz to three in a row, or none");
    if (std::ranges::all_of(spaces, [](ColourSpace s) { return s == ColourSpace::unspecified; }))
        spaces.clear();
    if (!spaces.empty()) space_ = ColourSpace::unspecified;
    plane_spaces_ = std::move(spaces);
}

Image Image::crop(int row, int column, Size size) const {
    // Differences of non-negative ints: nothing here can overflow.
    const bool inside = row >= 0 && column >= 0 && size.height > 0 && size.width > 0 && row < size_.height &&
                        column < size_.width && size.height <= size_.height - row &&
                        size.width <= size_.width - column;
    if (!inside) {
        throw InputError("crop " + detail::compact_text_of(size) + " pixels at column " +
                             std::to_string(column) + ", row " + std::to_string(row),
                         "the picture has " + detail::compact_text_of(size_) + " pixels",
                         "give a rectangle of at least one pixel inside the picture");
    }
    Image part(size, planes_, space_);
    part.names_ = names_;
    part.plane_spaces_ = plane_spaces_;
    const auto width = static_cast<std::size_t>(size.width);
    for (int p = 0; p < planes_; ++p) {
        for (int r = 0; r < size.height; ++r) {
            const auto from = plane(p).subspan(index(0, row + r, column), width);
            std::copy(from.begin(), from.end(),
                      part.plane(p).begin() + static_cast<std::ptrdiff_t>(part.index(0, r, 0)));
        }
    }
    return part;
}

Image Image::window(int row, int column, Size size) const {
    if (planes_ < 1)
        throw InputError("take a window of " + detail::compact_text_of(size) + " pixels",
                         "the picture is empty", "give one with pixels");
    Image part(size, planes_, space_);
    part.names_ = names_;
    part.plane_spaces_ = plane_spaces_;
    const auto wrapped = [](long long value, int period) {
        return static_cast<int>((value % period + period) % period);
    };
    for (int p = 0; p < planes_; ++p) {
        for (int r = 0; r < size.height; ++r) {
            const int from_row = wrapped(static_cast<long long>(row) + r, size_.height);
            for (int c = 0; c < size.width;) {
                const int from = wrapped(static_cast<long long>(column) + c, size_.width);
                const int count = std::min(size.width - c, size_.width - from);
                const auto values =
                    plane(p).subspan(index(0, from_row, from), static_cast<std::size_t>(count));
                std::copy(values.begin(), values.end(),
                          part.plane(p).begin() + static_cast<std::ptrdiff_t>(part.index(0, r, c)));
                c += count;
            }
        }
    }
    return part;
}

}  // namespace btfield

#pragma once

// Pictures and tables as NumPy arrays. A picture comes in as H x W or H x W x d and is copied once; one that
// goes out is the library's own memory, H x W x d with planes apart: no copy.

#include <cstdint>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "btfield/compound.hpp"
#include "btfield/image.hpp"
#include "btfield/image_io.hpp"
#include "btfield/relief.hpp"
#include "python/src/casters.hpp"

namespace btfield::python {

/// A picture as an argument: whatever object it is, read by image_of().
struct PictureObject {
    nb::object object;
};

/// What image_of() read besides the values.
struct ArrayPicture {
    Image image;
    PixelType type = PixelType::float32;
};

/// \param asked  what the caller wants, for the message
/// \param space  "auto": srgb of three planes of whole numbers, linear of three planes of floats, else
///     unspecified, as read_picture() has it
/// \throws InputError unless it is an array of uint8, uint16 or float32 of two or three axes, none empty
[[nodiscard]] ArrayPicture read_array(const PictureObject& picture, const std::string& asked,
                                      const std::string& space = "auto");
[[nodiscard]] inline Image image_of(const PictureObject& picture, const std::string& asked,
                                    const std::string& space = "auto") {
    return read_array(picture, asked, space).image;
}
[[nodiscard]] std::vector<Image> images_of(const std::vector<PictureObject>& pictures,
                                           const std::string& asked, const std::string& space = "auto");

/// H x W x d float32, read and written; takes the image's memory along.
[[nodiscard]] nb::object array_of(Image image);
/// None where the image is empty.
[[nodiscard]] nb::object array_or_none(const Image& image);
[[nodiscard]] nb::list arrays_of(std::vector<Image> images);

/// An array that takes the vector's memory along.
template <class Value>
nb::object array_of(std::vector<Value> values, std::vector<std::size_t> shape) {
    auto* const owned = new std::vector<Value>(std::move(values));
    nb::capsule owner(owned, [](void* p) noexcept { delete static_cast<std::vector<Value>*>(p); });
    return nb::cast(nb::ndarray<nb::numpy, Value>(owned->data(), shape.size(), shape.data(), owner));
}
template <class Value>
nb::object array_of(std::vector<Value> values) {
    const std::size_t count = values.size();
    return array_of(std::move(values), {count});
}
[[nodiscard]] nb::object offsets_array(const std::vector<Offset>& offsets);

/// Numbers of an array or a sequence, whatever its shape, row by row.
/// \throws InputError unless they are so many
[[nodiscard]] std::vector<double> numbers_of(nb::handle values, std::size_t count, const char* what);
[[nodiscard]] std::vector<double> numbers_of(nb::handle values, const char* what);

}  // namespace btfield::python

namespace nanobind::detail {

template <>
struct type_caster<btfield::python::PictureObject> {
    NB_TYPE_CASTER(btfield::python::PictureObject, const_name("numpy.typing.NDArray[typing.Any]"))

    bool from_python(handle from, std::uint32_t /*flags*/, cleanup_list* /*list*/) noexcept {
        value.object = borrow(from);
        return true;
    }
    static handle from_cpp(const btfield::python::PictureObject& picture, rv_policy /*policy*/,
                           cleanup_list* /*list*/) noexcept {
        return picture.object.inc_ref();
    }
};

/// Images that functions give back are arrays.
template <>
struct type_caster<btfield::Image> {
    NB_TYPE_CASTER(btfield::Image, const_name("numpy.typing.NDArray[numpy.float32]"))

    bool from_python(handle /*from*/, std::uint32_t /*flags*/, cleanup_list* /*list*/) noexcept {
        return false;
    }
    template <class T>
    static handle from_cpp(T&& image, rv_policy /*policy*/, cleanup_list* /*list*/) noexcept {
        try {
            return btfield::python::array_of(btfield::Image(std::forward<T>(image))).release();
        } catch (python_error& error) {
            error.restore();
        } catch (const std::exception& error) {
            PyErr_SetString(PyExc_MemoryError, error.what());
        }
        return {};
    }
};

}  // namespace nanobind::detail

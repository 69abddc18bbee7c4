#include "python/src/arrays.hpp"

#include <algorithm>
#include <limits>
#include <optional>

#include "btfield/error.hpp"
#include "python/src/work.hpp"

namespace btfield::python {
namespace {

using AnyArray = nb::ndarray<nb::ro, nb::device::cpu>;

std::string dimensions(const AnyArray& array) {
    std::string text;
    for (std::size_t axis = 0; axis < array.ndim(); ++axis)
        text += (axis == 0 ? "" : " x ") + std::to_string(array.shape(axis));
    return text.empty() ? "no axis" : text;
}

/// As the reader of files scales them.
template <class Value>
float scaled(Value value) {
    if constexpr (std::is_floating_point_v<Value>) {
        return value;
    } else {
        return static_cast<float>(value) / static_cast<float>(std::numeric_limits<Value>::max());
    }
}

template <class Value>
void copy_planes(const AnyArray& array, Image& image) {
    const auto* const values = static_cast<const Value*>(array.data());
    const auto across = array.stride(1), down = array.stride(0);
    const auto apart = array.ndim() == 3 ? array.stride(2) : 0;
    for (int p = 0; p < image.planes(); ++p) {
        float* to = image.plane(p).data();
        for (int row = 0; row < image.height(); ++row) {
            const Value* from = values + apart * p + down * row;
            for (int column = 0; column < image.width(); ++column, from += across) *to++ = scaled(*from);
        }
    }
}

ColourSpace space_of(const std::string& word, int planes, bool floats) {
    if (word != "auto") return colour_space(word);
    if (planes != 3) return ColourSpace::unspecified;
    return floats ? ColourSpace::linear : ColourSpace::srgb;
}

int side(std::size_t length, const std::string& asked) {
    if (length > static_cast<std::size_t>(std::numeric_limits<int>::max()))
        throw InputError(asked, "an axis of the array is too long", "take a part of it");
    return static_cast<int>(length);
}

}  // namespace

ArrayPicture read_array(const PictureObject& picture, const std::string& asked, const std::string& space) {
    const std::string remedy = "give a NumPy array H x W x d or H x W of uint8, uint16 or float32";
    AnyArray array;
    if (nb::ndarray_check(picture.object)) nb::try_cast(picture.object, array, false);
    if (!array.is_valid()) {
        const auto type = nb::cast<std::string>(nb::str(picture.object.type().attr("__name__")));
        throw InputError(asked, "the picture is a " + type + ", or an array that cannot be read", remedy);
    }
    const bool bytes = array.dtype() == nb::dtype<std::uint8_t>();
    const bool words = array.dtype() == nb::dtype<std::uint16_t>();
    const bool floats = array.dtype() == nb::dtype<float>();
    if (!bytes && !words && !floats) {
        const nb::object type = nb::getattr(picture.object, "dtype", nb::str("of another kind"));
        throw InputError(asked, "the values of the array are " + nb::cast<std::string>(nb::str(type)),
                         remedy + ", such as array.astype(numpy.float32)");
    }
    if (array.ndim() != 2 && array.ndim() != 3)
        throw InputError(asked, "the array has " + dimensions(array) + " values", remedy);
    const int planes = array.ndim() == 3 ? side(array.shape(2), asked) : 1;
    const Size size{side(array.shape(0), asked), side(array.shape(1), asked)};
    if (array.size() == 0)
        throw InputError(asked, "the array is empty: " + dimensions(array) + " values", remedy);
    ArrayPicture result;
    result.type = bytes ? PixelType::uint8 : words ? PixelType::uint16 : PixelType::float32;
    result.image = Image(size, planes, space_of(space, planes, floats));
    const Unlocked unlocked;
    if (bytes) {
        copy_planes<std::uint8_t>(array, result.image);
    } else if (words) {
        copy_planes<std::uint16_t>(array, result.image);
    } else {
        copy_planes<float>(array, result.image);
    }
    return result;
}

std::vector<Image> images_of(const std::vector<PictureObject>& pictures, const std::string& asked,
                             const std::string& space) {
    std::vector<Image> images;
    images.reserve(pictures.size());
    for (const PictureObject& picture : pictures) images.push_back(image_of(picture, asked, space));
    return images;
}

nb::object array_of(Image image) {
    auto* const owned = new Image(std::move(image));
    nb::capsule owner(owned, [](void* p) noexcept { delete static_cast<Image*>(p); });
    const auto width = static_cast<std::int64_t>(owned->width());
    const std::size_t shape[] = {static_cast<std::size_t>(owned->height()), static_cast<std::size_t>(width),
                                 static_cast<std::size_t>(owned->planes())};
    const std::int64_t strides[] = {width, 1, width * owned->height()};
    return nb::cast(nb::ndarray<nb::numpy, float>(owned->values().data(), 3, shape, owner, strides));
}

nb::object array_or_none(const Image& image) {
    return image.planes() == 0 ? nb::none() : array_of(image);
}

nb::list arrays_of(std::vector<Image> images) {
    nb::list list;
    for (Image& image : images) list.append(array_of(std::move(image)));
    return list;
}

nb::object offsets_array(const std::vector<Offset>& offsets) {
    std::vector<int> numbers;
    numbers.reserve(2 * offsets.size());
    for (const Offset offset : offsets) {
        numbers.push_back(offset.row);
        numbers.push_back(offset.column);
    }
    return array_of(std::move(numbers), {offsets.size(), 2});
}

std::vector<double> numbers_of(nb::handle values, const char* what) {
    try {
        const nb::object numpy = nb::module_::import_("numpy");
        const nb::object flat =
            numpy.attr("ascontiguousarray")(values, nb::arg("dtype") = "float64").attr("ravel")();
        const auto array = nb::cast<nb::ndarray<nb::ro, double, nb::ndim<1>, nb::device::cpu>>(flat);
        return {array.data(), array.data() + array.size()};
    } catch (nb::python_error& error) {
        throw InputError(std::string("take ") + what, "it is no array of numbers", "give floats");
    }
}

std::vector<double> numbers_of(nb::handle values, std::size_t count, const char* what) {
    std::vector<double> numbers = numbers_of(values, what);
    if (numbers.size() != count)
        throw InputError(std::string("take ") + what, "it has " + std::to_string(numbers.size()) + " values",
                         "give " + std::to_string(count));
    return numbers;
}

}  // namespace btfield::python

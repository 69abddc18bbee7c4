#pragma once

// How values of the library become Python's, and the other way round: sizes and offsets are tuples, words of
// enumerations are str.

#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>
#include <nanobind/stl/filesystem.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/string_view.h>
#include <nanobind/stl/vector.h>

#include <array>
#include <limits>
#include <utility>

#include "btfield/btf_set.hpp"
#include "btfield/image.hpp"
#include "btfield/image_io.hpp"
#include "btfield/neighbourhood.hpp"

namespace nb = nanobind;

namespace btfield::python {

/// An int that fits, of an int of Python or whatever stands for one, as NumPy's do.
inline bool whole(nb::handle from, int& to) noexcept {
    PyObject* const index = PyNumber_Index(from.ptr());
    if (index == nullptr) {
        PyErr_Clear();
        return false;
    }
    const long value = PyLong_AsLong(index);
    Py_DECREF(index);
    if (value == -1 && PyErr_Occurred() != nullptr) {
        PyErr_Clear();
        return false;
    }
    if (value > std::numeric_limits<int>::max() || value < std::numeric_limits<int>::min()) return false;
    to = static_cast<int>(value);
    return true;
}

/// Whole numbers of a sequence of so many.
template <std::size_t N>
bool whole_numbers(nb::handle from, std::array<int, N>& to) noexcept {
    if (PySequence_Check(from.ptr()) == 0 || PyUnicode_Check(from.ptr())) return false;
    if (PySequence_Size(from.ptr()) != static_cast<Py_ssize_t>(N)) {
        PyErr_Clear();
        return false;
    }
    for (std::size_t i = 0; i < N; ++i) {
        PyObject* const item = PySequence_GetItem(from.ptr(), static_cast<Py_ssize_t>(i));
        const bool fits = item != nullptr && whole(item, to[i]);
        Py_XDECREF(item);
        if (!fits) {
            PyErr_Clear();
            return false;
        }
    }
    return true;
}

}  // namespace btfield::python

namespace nanobind::detail {

/// (height, width), or one number for a square.
template <>
struct type_caster<btfield::Size> {
    NB_TYPE_CASTER(btfield::Size, const_name("tuple[int, int]"))

    bool from_python(handle from, std::uint32_t /*flags*/, cleanup_list* /*list*/) noexcept {
        std::array<int, 2> sides{};
        if (PyIndex_Check(from.ptr()) != 0) {
            if (!btfield::python::whole(from, sides[0])) return false;
            sides[1] = sides[0];
        } else if (!btfield::python::whole_numbers(from, sides)) {
            return false;
        }
        value = {sides[0], sides[1]};
        return true;
    }
    static handle from_cpp(btfield::Size size, rv_policy /*policy*/, cleanup_list* /*list*/) noexcept {
        return Py_BuildValue("(ii)", size.height, size.width);
    }
};

/// (row, column).
template <>
struct type_caster<btfield::Offset> {
    NB_TYPE_CASTER(btfield::Offset, const_name("tuple[int, int]"))

    bool from_python(handle from, std::uint32_t /*flags*/, cleanup_list* /*list*/) noexcept {
        std::array<int, 2> numbers{};
        if (!btfield::python::whole_numbers(from, numbers)) return false;
        value = {numbers[0], numbers[1]};
        return true;
    }
    static handle from_cpp(btfield::Offset offset, rv_policy /*policy*/, cleanup_list* /*list*/) noexcept {
        return Py_BuildValue("(ii)", offset.row, offset.column);
    }
};

/// (x, y, width, height).
template <>
struct type_caster<btfield::Crop> {
    NB_TYPE_CASTER(btfield::Crop, const_name("tuple[int, int, int, int]"))

    bool from_python(handle from, std::uint32_t /*flags*/, cleanup_list* /*list*/) noexcept {
        std::array<int, 4> numbers{};
        if (!btfield::python::whole_numbers(from, numbers)) return false;
        value = {numbers[0], numbers[1], numbers[2], numbers[3]};
        return true;
    }
    static handle from_cpp(const btfield::Crop& crop, rv_policy /*policy*/, cleanup_list* /*list*/) noexcept {
        return Py_BuildValue("(iiii)", crop.x, crop.y, crop.width, crop.height);
    }
};

/// (theta, phi), radians.
template <>
struct type_caster<btfield::BtfDirection> {
    NB_TYPE_CASTER(btfield::BtfDirection, const_name("tuple[float, float]"))

    bool from_python(handle from, std::uint32_t /*flags*/, cleanup_list* /*list*/) noexcept {
        if (PySequence_Check(from.ptr()) == 0 || PyUnicode_Check(from.ptr())) return false;
        PyObject* const pair = PySequence_Tuple(from.ptr());
        const bool fits = pair != nullptr && PyArg_ParseTuple(pair, "dd", &value.theta, &value.phi) != 0;
        Py_XDECREF(pair);
        if (!fits) PyErr_Clear();
        return fits;
    }
    static handle from_cpp(const btfield::BtfDirection& direction, rv_policy /*policy*/,
                           cleanup_list* /*list*/) noexcept {
        return Py_BuildValue("(dd)", direction.theta, direction.phi);
    }
};

/// (view, light).
template <>
struct type_caster<btfield::BtfPair> {
    NB_TYPE_CASTER(btfield::BtfPair, const_name("tuple[int, int]"))

    bool from_python(handle from, std::uint32_t /*flags*/, cleanup_list* /*list*/) noexcept {
        std::array<int, 2> numbers{};
        if (!btfield::python::whole_numbers(from, numbers)) return false;
        value = {numbers[0], numbers[1]};
        return true;
    }
    static handle from_cpp(const btfield::BtfPair& pair, rv_policy /*policy*/,
                           cleanup_list* /*list*/) noexcept {
        return Py_BuildValue("(ii)", pair.view, pair.light);
    }
};

}  // namespace nanobind::detail

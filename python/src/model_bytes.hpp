#pragma once

// Models of all kinds as the bytes of their files, for files, pickles and messages.

#include <nanobind/nanobind.h>

#include <string>
#include <string_view>
#include <variant>

#include "btfield/btf_model.hpp"
#include "btfield/btf_textures.hpp"
#include "btfield/compound.hpp"
#include "btfield/models.hpp"

namespace nb = nanobind;

namespace btfield::python {

using AnyModel = std::variant<TextureModel, CompoundModel, BtfModel, BtfTextures>;

/// JSON or CBOR.
/// \throws InputError when check() refuses the model
[[nodiscard]] std::string bytes_of(const TextureModel& model, bool binary);
[[nodiscard]] std::string bytes_of(const CompoundModel& model, bool binary);
[[nodiscard]] std::string bytes_of(const BtfModel& model, bool binary);
[[nodiscard]] std::string bytes_of(const BtfTextures& model, bool binary);

/// \throws InputError as read_model()
[[nodiscard]] AnyModel model_of_bytes(std::string_view bytes, const std::string& asked);

/// Adds to the class of a model what all of them can: to_json(), to_bytes(), equality, pickling.
template <class Model, class... Others>
void add_bytes(nb::class_<Model, Others...>& type) {
    type.def(
            "to_json", [](const Model& self) { return bytes_of(self, false); },
            "The text of the model's JSON file. Numbers keep all their bits.\n\nRaises InputError for a "
            "model\n"
            "that contradicts itself.")
        .def(
            "to_bytes",
            [](const Model& self) {
                const std::string bytes = bytes_of(self, true);
                return nb::bytes(bytes.data(), bytes.size());
            },
            "The bytes of the model's .btfm file (CBOR); from_bytes() is the inverse.\n\nRaises InputError "
            "for a\n"
            "model that contradicts itself.")
        .def(
            "__eq__",
            [](const Model& self, const nb::object& other) -> nb::object {
                if (!nb::isinstance<Model>(other)) return nb::steal(Py_NewRef(Py_NotImplemented));
                return nb::bool_(bytes_of(self, true) == bytes_of(nb::cast<const Model&>(other), true));
            },
            nb::arg("other").none(), nb::sig("def __eq__(self, other: object, /) -> bool"))
        .def("__copy__", [](const Model& self) { return Model(self); })
        .def("__deepcopy__", [](const Model& self, const nb::object&) { return Model(self); })
        .def("__reduce__", [](const Model& self) {
            const std::string bytes = bytes_of(self, true);
            return nb::make_tuple(nb::module_::import_("btfield._restore").attr("model"),
                                  nb::make_tuple(nb::bytes(bytes.data(), bytes.size())));
        });
    type.attr("__hash__") = nb::none();
}

}  // namespace btfield::python

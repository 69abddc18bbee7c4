// Neighbourhoods, fields on them, and what is examined of these.

#include <nanobind/stl/variant.h>

#include "btfield/certificate.hpp"
#include "btfield/lag_covariance.hpp"
#include "btfield/models.hpp"
#include "python/src/arrays.hpp"
#include "python/src/parts.hpp"
#include "python/src/words.hpp"
#include "python/src/work.hpp"

namespace btfield::python {
namespace {

nb::object square(const std::vector<double>& values, int planes) {
    const auto d = static_cast<std::size_t>(planes);
    return array_of(values, {values.size() / (d * d), d, d});
}

std::vector<std::uint8_t> flags_of(nb::handle values, std::size_t count) {
    std::vector<std::uint8_t> flags;
    for (const double value : numbers_of(values, count, "active")) flags.push_back(value != 0.0 ? 1 : 0);
    return flags;
}

template <class Field>
void construct(Field* self, const std::vector<Offset>& offsets, const nb::object& coefficients,
               const nb::object& noise_covariance, const std::string& kind, const nb::object& active) {
    Field field;
    field.offsets = offsets;
    field.kind = neighbourhood_kind(kind);
    field.noise_covariance = numbers_of(noise_covariance, "a noise covariance");
    while (static_cast<std::size_t>(field.planes) * static_cast<std::size_t>(field.planes) <
           field.noise_covariance.size())
        ++field.planes;
    const auto d = static_cast<std::size_t>(field.planes);
    if (d == 0 || d * d != field.noise_covariance.size())
        throw InputError("take a noise covariance", "it is not square", "give d x d values");
    field.coefficients = numbers_of(coefficients, offsets.size() * d * d, "coefficients");
    if (!active.is_none()) field.active = flags_of(active, offsets.size() * d * d);
    new (self) Field(std::move(field));
}

template <class Field>
void add_field(nb::module_& module, const char* name, const char* text) {
    nb::class_<Field, LinearField>(module, name, text)
        .def("__init__", &construct<Field>, nb::arg("offsets"), nb::arg("coefficients"),
             nb::arg("noise_covariance"), nb::kw_only(), nb::arg("kind") = "custom",
             nb::arg("active") = nb::none(),
             "offsets: N of (row, column), as they are applied: y(r + s).\n"
             "coefficients: N x d x d, [offset][plane that is explained][plane that explains].\n"
             "noise_covariance: d x d.\n"
             "active: N x d x d of bool; which coefficients there are. None: all.");
}

}  // namespace

void add_fields(nb::module_& module) {
    module.def(
        "neighbourhood",
        [](int order, const std::string& kind) {
            return offsets_array(neighbourhood(order, neighbourhood_kind(kind)));
        },
        nb::arg("order"), nb::arg("kind") = "symmetric",
        "Offsets s != 0 with s1^2 + s2^2 <= q(order) in raster order, N x 2 of (row, column) (theory 4.1).\n"
        "kind: 'symmetric', 'half', 'causal' or 'unilateral'.\n\nRaises InputError when order is outside\n"
        "1..8.");
    nb::class_<LinearField>(module, "LinearField",
                            "y_i(r) = sum a_sij y_j(r + s) + noise_i; of moving averages the\n"
                            "coefficients weigh the noise.")
        .def_prop_ro(
            "kind", [](const LinearField& self) { return std::string(name(self.kind)); },
            "'symmetric', 'half', 'causal', 'unilateral' or 'custom'.")
        .def_prop_ro(
            "offsets", [](const LinearField& self) { return offsets_array(self.offsets); },
            "N x 2 of (row, column).")
        .def_ro("planes", &LinearField::planes)
        .def_prop_ro(
            "coefficients", [](const LinearField& self) { return square(self.coefficients, self.planes); },
            "N x d x d, [offset][explained][explaining]; 0 where the support lacks one.")
        .def_prop_ro(
            "noise_covariance",
            [](const LinearField& self) {
                const auto d = static_cast<std::size_t>(self.planes);
                return array_of(self.noise_covariance, {d, d});
            },
            "d x d.")
        .def_prop_ro(
            "active",
            [](const LinearField& self) -> nb::object {
                if (self.active.empty()) return nb::none();
                const auto d = static_cast<std::size_t>(self.planes);
                return array_of(self.active, {self.offsets.size(), d, d});
            },
            "N x d x d of 0 and 1; None where every pair of planes has every offset.")
        .def("__repr__", [](nb::handle self) {
            const auto& field = nb::cast<const LinearField&>(self);
            return "<btfield." + nb::cast<std::string>(self.type().attr("__name__")) + ": " +
                   std::to_string(field.offsets.size()) + " offsets, " + std::to_string(field.planes) +
                   " planes>";
        });
    add_field<CarModel>(module, "CarModel", "Causal autoregressive (theory 6).");
    add_field<SarModel>(module, "SarModel", "Simultaneous autoregressive, MSAR (theory 7).");
    add_field<MrfModel>(module, "MrfModel", "Markov random field (theory 8).");
    add_field<MaModel>(module, "MaModel", "Moving average (theory 9).");
    nb::class_<Certificate>(module, "Certificate",
                            "What the spectrum of one level's model says about it (theory 10).")
        .def_ro("valid", &Certificate::valid,
                "Proven: there is such a texture, the same everywhere, and its contrast is the picture's to "
                "a factor.")
        .def_ro(
            "min_singular", &Certificate::min_singular,
            "Least singular value of Lambda_t over all frequencies; of Markov models the least eigenvalue.")
        .def_ro("zeros", &Certificate::zeros, "Of det Lambda on the torus of frequencies.")
        .def_prop_ro(
            "variance_ratio", [](const Certificate& self) { return array_of(self.variance_ratio); },
            "Of each plane: the model's variance over the data's, without the level's gain.")
        .def(
            "__eq__",
            [](const Certificate& a, const Certificate& b) {
                return a.valid == b.valid && a.min_singular == b.min_singular && a.zeros == b.zeros &&
                       a.variance_ratio == b.variance_ratio;
            },
            nb::is_operator())
        .def("__repr__", [](const Certificate& self) {
            return std::string("<btfield.Certificate ") + (self.valid ? "valid" : "not valid") +
                   ", min_singular " + std::to_string(self.min_singular) + ", zeros " +
                   std::to_string(self.zeros) + ">";
        });
    module.def(
        "certify",
        [](const Model& model, const LagCovariance& data) {
            return unlocked([&] { return certify(model, data); });
        },
        nb::arg("model"), nb::arg("data"),
        "Examines Lambda over all frequencies (theory 10.3). data: of the level that the model was fitted\n"
        "to; its lag 0 is the variance that the model is held against.\n\nRaises InputError when the "
        "numbers\n"
        "of planes differ.");
}

}  // namespace btfield::python

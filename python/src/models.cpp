#include "btfield/models.hpp"

#include <nanobind/stl/variant.h>

#include "btfield/model_file.hpp"
#include "btfield/theory.hpp"
#include "host/base/file_output.hpp"
#include "host/model/model_json.hpp"
#include "python/src/arrays.hpp"
#include "python/src/model_bytes.hpp"
#include "python/src/parts.hpp"
#include "python/src/words.hpp"
#include "python/src/work.hpp"

namespace btfield::python {
namespace {

std::string sized(Size size) {
    return std::to_string(size.height) + " x " + std::to_string(size.width);
}

void add_basis(nb::module_& module) {
    nb::class_<SpectralBasis>(
        module, "SpectralBasis",
        "Eigenplanes m = T D^-1 (y - mean) of a picture (theory 3): uncorrelated at lag 0, of\n"
        "descending variance.")
        .def_ro("planes", &SpectralBasis::planes, "Of the picture.")
        .def_ro("rank", &SpectralBasis::rank,
                "Number of eigenplanes: less than planes where some repeat others.")
        .def_prop_ro(
            "matrix",
            [](const SpectralBasis& self) {
                return array_of(self.matrix,
                                {static_cast<std::size_t>(self.rank), static_cast<std::size_t>(self.planes)});
            },
            "T, rank x planes; rows are orthonormal.")
        .def_prop_ro("mean", [](const SpectralBasis& self) { return array_of(self.mean); })
        .def_prop_ro(
            "scale", [](const SpectralBasis& self) { return array_of(self.scale); },
            "Diagonal of D; empty where all are 1.");
}

void add_level(nb::module_& module) {
    nb::class_<LevelModel>(module, "LevelModel",
                           "One level of the pyramid: a model of its own on its own torus.")
        .def_ro("size", &LevelModel::size, "(height, width) of the level in the analysed picture.")
        .def_ro("models", &LevelModel::models, "3D: one model of all planes; 2D: one for each eigenplane.")
        .def_rw("gain", &LevelModel::gain, "Factor on the standard deviation (theory 12.2).")
        .def_prop_ro(
            "estimator", [](const LevelModel& self) { return std::string(name(self.estimator)); },
            "'ls', 'ml' or 'rd'.")
        .def_ro("iterations", &LevelModel::iterations)
        .def_ro("log_likelihood", &LevelModel::log_likelihood,
                "Whittle's, for each pixel; natural logarithm.")
        .def_ro("certificate", &LevelModel::certificate)
        .def("__repr__", [](const LevelModel& self) {
            return "<btfield.LevelModel " + sized(self.size) +
                   (self.certificate.valid ? ">" : ", not valid>");
        });
    nb::class_<Provenance>(module, "Provenance", "Where a model came from; for people, not for synthesis.")
        .def_rw("source", &Provenance::source)
        .def_prop_ro(
            "type", [](const Provenance& self) { return std::string(name(self.type)); },
            "Of the picture's values: 'uint8', 'uint16', 'half' or 'float'.")
        .def_ro("picture_bytes", &Provenance::picture_bytes)
        .def_ro("software", &Provenance::software)
        .def_ro("reasons", &Provenance::reasons,
                "Why model, order or levels are what they are, where fit() chose them.");
}

void add_texture_model(nb::module_& module) {
    nb::class_<TextureModel> type(module, "TextureModel",
                                  "Everything that synthesis needs, as fit() makes it.");
    type.def_prop_ro(
            "kind", [](const TextureModel& self) { return std::string(name(self.kind)); },
            "'2d-car', '3d-car', '2d-ma', ...")
        .def_ro("size", &TextureModel::size, "(height, width) of the analysed picture.")
        .def_ro("planes", &TextureModel::planes)
        .def_prop_ro(
            "space", [](const TextureModel& self) { return std::string(name(self.space)); },
            "'unspecified', 'srgb', 'linear' or 'xyz'.")
        .def_ro("names", &TextureModel::names, "Of the planes: none, or one for each.")
        .def_ro("factor", &TextureModel::factor, "Of the pyramid.")
        .def_prop_ro(
            "noise", [](const TextureModel& self) { return std::string(name(self.noise)); },
            "'full' or 'diagonal'.")
        .def_prop_ro(
            "mean", [](const TextureModel& self) { return array_of(self.mean); }, "One for each plane.")
        .def_prop_ro(
            "basis",
            [](const TextureModel& self) -> std::optional<SpectralBasis> {
                if (self.basis.planes == 0) return std::nullopt;
                return self.basis;
            },
            "None where planes are modelled as they are.")
        .def_prop_ro(
            "marginals",
            [](const TextureModel& self) {
                nb::list list;
                for (const Marginal& marginal : self.marginals) list.append(array_of(marginal.values));
                return list;
            },
            "Quantile functions of the eigenplanes, at knots from -3.5 to 3.5 (theory 13.2); empty without.")
        .def_ro("levels", &TextureModel::levels, nb::rv_policy::reference_internal, "Finest first.")
        .def_rw("provenance", &TextureModel::provenance)
        .def_prop_ro(
            "valid", [](const TextureModel& self) { return is_valid(self); },
            "Whether the certificate of every level is valid.")
        .def_prop_ro(
            "certificates",
            [](const TextureModel& self) {
                std::vector<Certificate> all;
                for (const LevelModel& level : self.levels) all.push_back(level.certificate);
                return all;
            },
            "One for each level, finest first.")
        .def_prop_ro(
            "parameter_count", [](const TextureModel& self) { return parameter_count(self); },
            "Numbers that a file must store to grow texture.")
        .def_prop_ro("modelled_planes", [](const TextureModel& self) { return modelled_planes(self); })
        .def(
            "check", [](const TextureModel& self) { check(self); },
            "Raises InputError naming the first defect.")
        .def("__repr__", [](const TextureModel& self) {
            return "<btfield.TextureModel " + std::string(name(self.kind)) + " of " + sized(self.size) +
                   ", " + std::to_string(self.planes) + " planes, " + std::to_string(self.levels.size()) +
                   " levels" + (is_valid(self) ? ">" : ", not valid>");
        });
    add_bytes(type);
    module.def(
        "theoretical_covariance",
        [](const TextureModel& model, Size size, const std::vector<Offset>& lags) {
            const auto d = static_cast<std::size_t>(model.planes);
            return array_of(unlocked([&] { return theoretical_covariance(model, size, lags); }),
                            {lags.size(), d, d});
        },
        nb::arg("model"), nb::arg("size"), nb::arg("lags"),
        "Covariances that textures of this size will have (theory 14.6): lags x d x d, in squared units of\n"
        "the picture's values. lags: N of (row, column).\n\nRaises InputError when the size is not "
        "positive.");
    module.def(
        "theoretical_deviation",
        [](const TextureModel& model, Size size) {
            return array_of(unlocked([&] { return theoretical_deviation(model, size); }));
        },
        nb::arg("model"), nb::arg("size"),
        "Standard deviation of each plane that textures of this size will have.");
    module.def(
        "model_kinds",
        [] {
            std::vector<std::string> all;
            for (const ModelKind kind : model_kinds()) all.emplace_back(name(kind));
            return all;
        },
        "The words of the ten models.");
}

}  // namespace

void add_models(nb::module_& module) {
    add_basis(module);
    add_level(module);
    add_texture_model(module);
    module.def(
        "read_model",
        [](const std::filesystem::path& path) {
            return unlocked([&] {
                const std::string asked = "read the model '" + path.string() + "'";
                return model_of_bytes(detail::model_bytes(path, asked), asked);
            });
        },
        nb::arg("path"),
        "Reads and checks a model of any kind, JSON or CBOR.\n\nRaises InputError for a missing, truncated "
        "or\n"
        "malformed file, or one of an unknown version.");
    module.def(
        "write_model",
        [](const std::filesystem::path& path, const nb::object& model) {
            const bool binary = detail::is_cbor_name(path);
            const nb::object bytes = nb::getattr(model, binary ? "to_bytes" : "to_json", nb::none());
            const std::string asked = "write the model '" + path.string() + "'";
            if (bytes.is_none())
                throw InputError(asked, "it is no model", "give what fit() or read_model() returned");
            const nb::object made = bytes();
            const std::string text = binary ? std::string(nb::cast<nb::bytes>(made).c_str(), nb::len(made))
                                            : nb::cast<std::string>(made);
            unlocked([&] { detail::write_file(path, text, asked); });
        },
        nb::arg("path"), nb::arg("model"),
        "Writes a model of any kind: CBOR where the name ends in .btfm, else JSON. The file appears "
        "complete\n"
        "or not at all.\n\nRaises InputError when the model contradicts itself or the file cannot be "
        "written.");
    module.def(
        "from_bytes",
        [](const nb::bytes& bytes) {
            return model_of_bytes({bytes.c_str(), bytes.size()}, "read the model");
        },
        nb::arg("bytes"),
        "A model of what to_bytes() made, or of a file's bytes.\n\nRaises InputError as read_model().");
    module.def(
        "from_json", [](const std::string& text) { return model_of_bytes(text, "read the model"); },
        nb::arg("text"), "A model of what to_json() made.\n\nRaises InputError as read_model().");
}

}  // namespace btfield::python

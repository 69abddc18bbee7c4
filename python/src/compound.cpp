#include "btfield/compound.hpp"

#include <nanobind/stl/variant.h>

#include "host/compound/compound_names.hpp"
#include "python/src/arrays.hpp"
#include "python/src/device.hpp"
#include "python/src/fitted.hpp"
#include "python/src/model_bytes.hpp"
#include "python/src/options.hpp"
#include "python/src/parts.hpp"
#include "python/src/words.hpp"

namespace btfield::python {
namespace {

using PyCompoundSynthesiser = Held<CompoundSynthesiser>;
using Labels = nb::ndarray<nb::ro, const std::uint8_t, nb::ndim<2>, nb::c_contig, nb::device::cpu>;

nb::object labels_array(const ControlField& field) {
    return array_of(field.labels, {static_cast<std::size_t>(field.size.height),
                                   static_cast<std::size_t>(field.size.width)});
}

ControlField field_of(const Labels& labels, int regions) {
    ControlField field;
    field.size = {static_cast<int>(labels.shape(0)), static_cast<int>(labels.shape(1))};
    field.labels.assign(labels.data(), labels.data() + labels.size());
    field.regions = regions;
    if (regions == 0) {
        for (const std::uint8_t label : field.labels) field.regions = std::max(field.regions, label + 1);
    }
    check(field);
    return field;
}

void add_control_field(nb::module_& module) {
    OptionsClass<ClusterOptions>(module, "ClusterOptions",
                                 "How regions are found (theory 18.2); keywords, too.")
        .field("regions", &ClusterOptions::regions, "K; None: chosen, at most `most`.")
        .field("most", &ClusterOptions::most, "")
        .field("divergence", &ClusterOptions::divergence, "Between any two regions, at least; nats.")
        .field("pixels", &ClusterOptions::pixels, "Of each region, at least.")
        .word("space", &ClusterOptions::space, "'auto', 'lab', 'rgb' or 'planes'.")
        .field("seed", &ClusterOptions::seed, "");
    nb::class_<ControlField>(module, "ControlField",
                             "Which region each pixel of a torus belongs to: labels 0..K - 1.")
        .def(
            "__init__",
            [](ControlField* self, const Labels& labels, int regions) {
                new (self) ControlField(field_of(labels, regions));
            },
            nb::arg("labels"), nb::arg("regions") = 0,
            "labels: H x W of uint8. regions: K; 0: as many as there are.\n\nRaises InputError when a label "
            "is not\n"
            "below K or K is above 32.")
        .def_ro("size", &ControlField::size)
        .def_ro("regions", &ControlField::regions)
        .def_prop_ro("labels", &labels_array, "H x W of uint8: a copy.")
        .def_prop_ro(
            "shares", [](const ControlField& self) { return array_of(shares(self)); },
            "Of the pixels, of each region.")
        .def("on_lattice", &on_lattice, nb::arg("size"), "Begun again where it ends, or cut off.");
    nb::class_<Clustering>(module, "Clustering", "Regions that cluster() found.")
        .def_ro("field", &Clustering::field, "Regions in the order of their mean, darkest first.")
        .def_ro("reason", &Clustering::reason, "Why there are as many; empty where K was given.");
    module.def(
        "cluster",
        [](const PictureObject& picture, const ClusterOptions* options, const std::string& space_,
           const nb::kwargs& keywords) {
            const ClusterOptions wanted = options_of(options, keywords);
            const Image image = image_of(picture, "find regions", space_);
            return unlocked([&] { return cluster(image, wanted); });
        },
        nb::arg("picture"), nb::arg("options").none() = nb::none(), nb::kw_only(),
        nb::arg("picture_space") = "auto", nb::arg("keywords"),
        "k-means of a picture's colours, the best of several starts.\n\nRaises InputError when the picture "
        "is\n"
        "empty, has NaN or infinity, K is out of range, or there are fewer colours than regions.");
}

void add_model(nb::module_& module) {
    nb::class_<CompoundRegion>(module, "CompoundRegion", "A region of a compound model.")
        .def_ro("share", &CompoundRegion::share, "Of the analysed pixels.")
        .def_ro("pixels", &CompoundRegion::pixels)
        .def_prop_ro(
            "colour", [](const CompoundRegion& self) { return array_of(self.colour); },
            "Mean, one for each plane.")
        .def_ro("contrast", &CompoundRegion::contrast)
        .def_ro("structure", &CompoundRegion::structure)
        .def_ro("residual", &CompoundRegion::residual,
                "TextureModel of what the control field does not tell.");
    nb::class_<CompoundModel> type(
        module, "CompoundModel",
        "A control field and regional models (theory 18), as fit_compound() makes it.");
    type.def_ro("size", &CompoundModel::size)
        .def_ro("planes", &CompoundModel::planes)
        .def_prop_ro("space", [](const CompoundModel& self) { return std::string(name(self.space)); })
        .def_ro("names", &CompoundModel::names)
        .def_prop_ro("borders", [](const CompoundModel& self) { return std::string(name(self.borders)); })
        .def_ro("control", &CompoundModel::control)
        .def_ro("periodic", &CompoundModel::periodic)
        .def_ro("regions", &CompoundModel::regions)
        .def_ro("explained", &CompoundModel::explained,
                "Share of the picture's variance that labels explain.")
        .def_rw("provenance", &CompoundModel::provenance)
        .def_prop_ro("valid", [](const CompoundModel& self) { return is_valid(self); })
        .def_prop_ro("parameter_count", [](const CompoundModel& self) { return parameter_count(self); })
        .def_prop_ro(
            "palette",
            [](const CompoundModel& self) {
                std::vector<std::uint8_t> values;
                const auto colours = palette(self);
                for (const PaletteColour& colour : colours)
                    values.insert(values.end(), colour.begin(), colour.end());
                return array_of(std::move(values), {colours.size(), 3});
            },
            "K x 3 of uint8: means of the regions, made distinct, for label pictures.")
        .def(
            "recolour",
            [](CompoundModel& self, int region, const std::vector<double>& colour) {
                recolour(self, region, colour);
            },
            nb::arg("region"), nb::arg("colour"),
            "Sets the region's mean colour.\n\nRaises InputError when there is no such region, or another "
            "number of\n"
            "planes.")
        .def(
            "scale_contrast",
            [](CompoundModel& self, int region, double factor) { scale_contrast(self, region, factor); },
            nb::arg("region"), nb::arg("factor"), "Multiplies the region's deviations from its mean colour.")
        .def(
            "transplant",
            [](CompoundModel& self, int region, const CompoundModel& other, int from) {
                transplant(self, region, other, from);
            },
            nb::arg("region"), nb::arg("other"), nb::arg("from_region"),
            "The region takes colour, contrast and residual of a region of another material.")
        .def(
            "transplant",
            [](CompoundModel& self, int region, const TextureModel& other) {
                transplant(self, region, other);
            },
            nb::arg("region"), nb::arg("other"), "The region takes mean and deviations of a texture model.")
        .def(
            "check", [](const CompoundModel& self) { check(self); },
            "Raises InputError naming the first defect.")
        .def("__repr__", [](const CompoundModel& self) {
            return "<btfield.CompoundModel of " + std::to_string(self.size.height) + " x " +
                   std::to_string(self.size.width) + ", " + std::to_string(self.regions.size()) + " regions>";
        });
    add_bytes(type);
}

void add_fit_compound(nb::module_& module) {
    OptionsClass<CompoundOptions>(module, "CompoundOptions", "What fit_compound() takes; keywords, too.")
        .nested("clusters", &CompoundOptions::clusters, "ClusterOptions.")
        .field("labels", &CompoundOptions::labels, "The control field of the picture, instead of clusters.")
        .field("tile", &CompoundOptions::tile, "(height, width) of the control field that the model keeps.")
        .word("borders", &CompoundOptions::borders, "'conditional', 'swap' or 'none'.")
        .nested("local", &CompoundOptions::local, "FitOptions of the regional models: 3d-ma of order 5.")
        .word("averages", &CompoundOptions::averages,
              "'sr', the root of each region's spectrum, or 'rd', random decrement.");
    module.def(
        "fit_compound",
        [](PyDevice& device, const PictureObject& picture, const CompoundOptions* options,
           std::optional<int> regions, const std::string& space, const std::string& source,
           const nb::object& progress, const nb::kwargs& keywords) {
            CompoundOptions wanted = options_of(options, keywords);
            if (regions) wanted.clusters.regions = regions;
            wanted.progress = stage_told(progress);
            const ArrayPicture read = read_array(picture, "fit a compound model", space);
            return unlocked([&] {
                CompoundModel model = fit_compound(*device, read.image, wanted);
                std::vector<std::string> reasons = std::move(model.provenance.reasons);
                model.provenance = provenance_of(read, source);
                model.provenance.reasons = std::move(reasons);
                return model;
            });
        },
        nb::arg("device"), nb::arg("picture"), nb::arg("options").none() = nb::none(), nb::kw_only(),
        nb::arg("regions").none() = nb::none(), nb::arg("space") = "auto", nb::arg("source") = "",
        nb::arg("progress").none() = nb::none(), nb::arg("keywords"),
        "Learns a compound model (theory 18). picture, space, source, progress: as fit(). regions: K; None:\n"
        "chosen.\n\nRaises InputError when picture or options cannot give a model.");
    nb::class_<PyCompoundSynthesiser>(
        module, "CompoundSynthesiser",
        "What textures of one compound model and size share. Any number of threads may\n"
        "ask one for textures at a time.")
        .def(
            "__init__",
            [](PyCompoundSynthesiser* self, PyDevice& device, const CompoundModel& model, Size size,
               bool allow_invalid) {
                new (self) PyCompoundSynthesiser([&] {
                    return unlocked([&] { return CompoundSynthesiser(*device, model, size, allow_invalid); });
                });
            },
            nb::arg("device"), nb::arg("model"), nb::arg("size"), nb::kw_only(),
            nb::arg("allow_invalid") = false, nb::keep_alive<1, 2>(),
            "Raises InputError when the model contradicts itself, a certificate fails (unless allowed), or a "
            "side is\n"
            "below 16 pixels or above 16384.")
        .def(
            "control_field",
            [](PyCompoundSynthesiser& self, std::uint64_t seed) {
                return unlocked([&] { return self->control_field(seed); });
            },
            nb::arg("seed"), "The roller's control field of this seed, of lattice size.")
        .def(
            "synthesise",
            [](PyCompoundSynthesiser& self, std::uint64_t seed, const ControlField* field) {
                return unlocked([&] {
                    return field != nullptr ? self->synthesise(seed, *field) : self->synthesise(seed);
                });
            },
            nb::arg("seed"), nb::arg("field").none() = nb::none(),
            "Texture of one seed, H x W x d float32, on a control field of size or lattice, or on the "
            "roller's own.\n"
            "\nRaises InputError when the field has another size, or more regions than the model.")
        .def_prop_ro("size", [](PyCompoundSynthesiser& self) { return self->size(); })
        .def_prop_ro("lattice", [](PyCompoundSynthesiser& self) { return self->lattice(); })
        .def_prop_ro("tileable", [](PyCompoundSynthesiser& self) { return self->tileable(); });
}

}  // namespace

void add_compound(nb::module_& module) {
    add_control_field(module);
    add_model(module);
    add_fit_compound(module);
}

}  // namespace btfield::python

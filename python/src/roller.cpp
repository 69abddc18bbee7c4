#include "btfield/roller.hpp"

#include "python/src/arrays.hpp"
#include "python/src/device.hpp"
#include "python/src/options.hpp"
#include "python/src/parts.hpp"

namespace btfield::python {
namespace {

using PyRoller = Held<Roller>;

void add_map(nb::module_& module) {
    nb::class_<SourceMap>(module, "SourceMap", "A texture on the torus as a choice among a sample's pixels.")
        .def_ro("size", &SourceMap::size)
        .def_ro("sample", &SourceMap::sample, "(height, width) of the sample.")
        .def_prop_ro(
            "source",
            [](const SourceMap& self) {
                return array_of(self.source, {static_cast<std::size_t>(self.size.height),
                                              static_cast<std::size_t>(self.size.width)});
            },
            "H x W: row * sample width + column of the sample's pixel.")
        .def_ro("cut_cost", &SourceMap::cut_cost,
                "Mean squared difference along the cuts, over the sample's variance.")
        .def_ro("seam", &SourceMap::seam,
                "Mean distance of colours across cuts over that of neighbours inside of patches: 1 does not "
                "show.")
        .def(
            "apply",
            [](const SourceMap& self, const PictureObject& picture) {
                const Image image = image_of(picture, "take a sample's pixels");
                return unlocked([&] { return apply(self, image); });
            },
            nb::arg("picture"),
            "The pixels of any picture that is registered with the sample; none is resampled.\n\nRaises "
            "InputError\n"
            "when it has another size than the sample.")
        .def("__repr__", [](const SourceMap& self) {
            return "<btfield.SourceMap " + std::to_string(self.size.height) + " x " +
                   std::to_string(self.size.width) + ", seam " + std::to_string(self.seam) + ">";
        });
}

}  // namespace

void add_roller(nb::module_& module) {
    OptionsClass<RollerOptions>(module, "RollerOptions", "How a sample is cut; all of it as keywords, too.")
        .field("seed", &RollerOptions::seed, "Of the choice among patches.")
        .field("block", &RollerOptions::block,
               "Side of a quilt's patches in pixels, at least 8; None: by the sample.")
        .field("overlap", &RollerOptions::overlap,
               "Pixels of neighbours that are compared and cut; None: a quarter.")
        .field("tolerance", &RollerOptions::tolerance,
               "Patches this much worse than the best are drawn, too.");
    add_map(module);
    nb::class_<PyRoller>(
        module, "Roller",
        "Cuts one sample: texture of any size out of a picture's own pixels (theory 17). Any number of\n"
        "threads may use one at a time.")
        .def(
            "__init__",
            [](PyRoller* self, PyDevice& device, const std::vector<PictureObject>& sample) {
                const std::vector<Image> images = images_of(sample, "cut a sample");
                new (self) PyRoller([&] { return unlocked([&] { return Roller(*device, images); }); });
            },
            nb::arg("device"), nb::arg("sample"), nb::keep_alive<1, 2>(),
            "sample: a list of pictures of one size, registered: colour, height, ...\n\nRaises InputError "
            "when there\n"
            "is none, sizes differ, a value is not finite, a side is below 16 or above 16384, or all is "
            "constant.")
        .def(
            "quilt",
            [](PyRoller& self, Size size, const RollerOptions* options, const nb::object& progress,
               const nb::kwargs& keywords) {
                RollerOptions wanted = options_of(options, keywords);
                wanted.progress = share_told(progress);
                return unlocked([&] { return self->quilt(size, wanted); });
            },
            nb::arg("size"), nb::arg("options").none() = nb::none(), nb::kw_only(),
            nb::arg("progress").none() = nb::none(), nb::arg("keywords"),
            "Patches on a torus of this size.\n\nRaises InputError when a side is below 16, or options "
            "cannot be met.")
        .def(
            "tile",
            [](PyRoller& self, std::optional<Size> size, const RollerOptions* options,
               const nb::kwargs& keywords) {
                const RollerOptions wanted = options_of(options, keywords);
                return unlocked([&] { return self->tile(size, wanted); });
            },
            nb::arg("size").none() = nb::none(), nb::arg("options").none() = nb::none(), nb::arg("keywords"),
            "The patch of the sample whose opposite borders fit best; without a size, one is "
            "chosen.\n\nRaises\n"
            "InputError when the sample does not hold the size and an overlap.")
        .def(
            "tiles",
            [](PyRoller& self, int count, std::optional<Size> size, const RollerOptions* options,
               const nb::kwargs& keywords) {
                const RollerOptions wanted = options_of(options, keywords);
                return unlocked([&] { return self->tiles(count, size, wanted); });
            },
            nb::arg("count"), nb::arg("size").none() = nb::none(), nb::arg("options").none() = nb::none(),
            nb::arg("keywords"), "Tiles of one size with the same borders, so that any may lie beside any.")
        .def_prop_ro("sample_size", [](PyRoller& self) { return self->sample_size(); })
        .def_prop_ro(
            "default_block", [](PyRoller& self) { return self->default_block(); },
            "The block that quilt() takes without one.");
}

}  // namespace btfield::python

// Normals and albedo from lights, height from normals, surfaces under new lights.

#include "btfield/relief.hpp"

#include <nanobind/stl/array.h>

#include "btfield/height.hpp"
#include "btfield/relighting.hpp"
#include "host/relief/relief_names.hpp"
#include "python/src/arrays.hpp"
#include "python/src/device.hpp"
#include "python/src/options.hpp"
#include "python/src/parts.hpp"
#include "python/src/words.hpp"

namespace btfield::python {
namespace {

using Vector = std::array<double, 3>;

void add_light_set(nb::module_& module) {
    nb::class_<LightPicture>(module, "LightPicture", "The file of a picture and its light.")
        .def_ro("picture", &LightPicture::picture)
        .def_ro("direction", &LightPicture::direction,
                "To the light, of length 1: x right, y up, z to the viewer.")
        .def_ro("intensity", &LightPicture::intensity,
                "What values are divided by: nothing, one number, or one for each plane.");
    nb::class_<LightSet>(module, "LightSet",
                         "Pictures of one view under many lights, as their folder describes them.")
        .def_ro("lights", &LightSet::lights)
        .def_ro("mask", &LightSet::mask)
        .def_ro("layout", &LightSet::layout, "'lp', 'diligent', 'table' or 'btf'.")
        .def_ro("remarks", &LightSet::remarks);
    module.def(
        "read_light_set",
        [](const std::filesystem::path& path, bool leave_out_behind) {
            return unlocked([&] { return read_light_set(path, {leave_out_behind}); });
        },
        nb::arg("path"), nb::kw_only(), nb::arg("leave_out_behind") = false,
        "Reads where lights are: a .lp file, or a folder as DiLiGenT's, with a table, or of a BTF. The "
        "pictures\n"
        "are the caller's to read.\n\nRaises InputError when a line cannot be understood, a picture is "
        "missing,\n"
        "or there are fewer than three lights.");
}

void add_fit_relief(nb::module_& module) {
    OptionsClass<ReliefOptions>(module, "ReliefOptions",
                                "How values under lights make a normal; keywords, too.")
        .word("rule", &ReliefOptions::rule, "'auto', 'ls', 'ranks', 'huber', 'amb' or 'lobe'.")
        .field("low", &ReliefOptions::low, "Of rule ranks: values count from here")
        .field("high", &ReliefOptions::high,
               "to there, as parts of the way from the darkest to the brightest.")
        .field("roughness", &ReliefOptions::roughness, "Of rule lobe, 0..1; None: chosen.");
    nb::class_<Relief>(module, "Relief", "What fit_relief() finds.")
        .def_prop_ro(
            "normals", [](const Relief& self) { return self.normals; }, "H x W x 3: unit vectors.")
        .def_prop_ro(
            "albedo", [](const Relief& self) { return self.albedo; }, "H x W x d, linear.")
        .def_prop_ro(
            "residual", [](const Relief& self) { return array_or_none(self.residual); },
            "Sum of |I - model| over the sum of I, of each pixel.")
        .def_prop_ro("rule", [](const Relief& self) { return word(self.rule); })
        .def_ro("roughness", &Relief::roughness)
        .def_ro("lights", &Relief::lights)
        .def_ro("median_residual", &Relief::median_residual)
        .def_ro(
            "left_out_error", &Relief::left_out_error,
            "Median of |I - model| of every fourth light, by a fit to the others; NaN with fewer than six.")
        .def_ro("left_out_least_squares", &Relief::left_out_least_squares, "The same of least squares.")
        .def_ro("shadowed", &Relief::shadowed, "Share of values too dark to be lit.")
        .def_ro("saturated", &Relief::saturated)
        .def_ro("remarks", &Relief::remarks);
    module.def(
        "fit_relief",
        [](PyDevice& device, const std::vector<PictureObject>& pictures,
           const std::vector<Vector>& directions, const ReliefOptions* options, const nb::object& progress,
           const nb::kwargs& keywords) {
            ReliefOptions wanted = options_of(options, keywords);
            wanted.progress = stage_told(progress);
            const std::vector<Image> images = images_of(pictures, "find a relief", "linear");
            return unlocked([&] { return fit_relief(*device, images, directions, wanted); });
        },
        nb::arg("device"), nb::arg("pictures"), nb::arg("directions"), nb::arg("options").none() = nb::none(),
        nb::kw_only(), nb::arg("progress").none() = nb::none(), nb::arg("keywords"),
        "Normals and albedo from pictures of one view under many lights (theory 19.3).\n\n"
        "pictures: H x W x d each, linear light: linear_of() undoes sRGB.\n"
        "directions: to the light of each picture, x right, y up, z to the viewer and above 0.\n"
        "progress: called with the stage and the share that is done.\n\n"
        "Raises InputError when there are fewer than three, they lie in one plane, or sizes differ.");
}

void add_height(nb::module_& module) {
    module.def("direction_of_angles", &direction_of_angles, nb::arg("theta"), nb::arg("phi"),
               "To a light theta degrees from the normal, phi degrees counter-clockwise from the right.");
    module.def(
        "slopes_of_normals",
        [](const PictureObject& normals) {
            const Image image = image_of(normals, "find slopes", "unspecified");
            return unlocked([&] { return slopes_of_normals(image).slopes; });
        },
        nb::arg("normals"),
        "H x W x 2 of normals H x W x 3: rise in pixels per pixel, to the right and up (theory 19).");
    module.def(
        "slopes_of_height",
        [](const PictureObject& height, const std::string& edges) {
            const Image image = image_of(height, "find slopes", "unspecified");
            return unlocked([&] { return slopes_of_height(image, detail::value_of<SurfaceEdges>(edges)); });
        },
        nb::arg("height"), nb::arg("edges") = "mirror", "H x W x 2. edges: 'mirror' or 'periodic'.");
    module.def(
        "normals_of_slopes",
        [](const PictureObject& slopes) {
            const Image image = image_of(slopes, "find normals", "unspecified");
            return unlocked([&] { return normals_of_slopes(image); });
        },
        nb::arg("slopes"), "Unit vectors H x W x 3 of slopes H x W x 2.");
    module.def(
        "integrate",
        [](PyDevice& device, const PictureObject& slopes, const std::string& edges,
           const std::string& flattening, const std::optional<PictureObject>& coarse, double wavelength,
           bool measured) {
            IntegrationOptions options;
            options.edges = detail::value_of<SurfaceEdges>(edges);
            options.flattening = detail::value_of<Flattening>(flattening);
            options.measured = measured;
            if (coarse)
                options.coarse =
                    CoarseHeight{image_of(*coarse, "integrate slopes", "unspecified"), wavelength};
            const Image image = image_of(slopes, "integrate slopes", "unspecified");
            return unlocked([&] { return integrate(*device, image, options); });
        },
        nb::arg("device"), nb::arg("slopes"), nb::kw_only(), nb::arg("edges") = "mirror",
        nb::arg("flattening") = "none", nb::arg("coarse").none() = nb::none(), nb::arg("wavelength") = 64.0,
        nb::arg("measured") = false,
        "The height H x W x 1, in pixels, whose slopes come closest to slopes H x W x 2; its mean is 0.\n\n"
        "edges: 'mirror' or 'periodic'. flattening: 'none', 'plane' or 'low'. coarse: a height that is right "
        "in\n"
        "waves longer than wavelength pixels. measured: leave out what alternates from pixel to pixel.\n\n"
        "Raises InputError unless there are two planes, all finite.");
    module.def(
        "decode_normals",
        [](const PictureObject& normals, const std::string& convention) {
            ArrayPicture read = read_array(normals, "decode normals", "unspecified");
            Picture picture;
            picture.image = std::move(read.image);
            picture.type = read.type;
            return unlocked(
                [&] { return decode_normals(picture, detail::value_of<NormalConvention>(convention)); });
        },
        nb::arg("normals"), nb::arg("convention") = "opengl",
        "Unit vectors of a normal map: whole numbers stand for -1..1. convention: 'opengl' or 'directx'.");
    module.def(
        "encode_normals",
        [](const PictureObject& normals, const std::string& convention) {
            return encode_normals(image_of(normals, "encode normals", "unspecified"),
                                  detail::value_of<NormalConvention>(convention));
        },
        nb::arg("normals"), nb::arg("convention") = "opengl", "As values from 0 to 1.");
}

void add_relighting(nb::module_& module) {
    nb::class_<Surface>(module, "Surface", "Maps of one surface, pixel by pixel.")
        .def(
            "__init__",
            [](Surface* self, const PictureObject& normals, const PictureObject& albedo,
               const std::optional<PictureObject>& height, const std::string& edges) {
                Surface surface;
                surface.normals = image_of(normals, "take a surface", "unspecified");
                surface.albedo = image_of(albedo, "take a surface", "linear");
                if (height) surface.height = image_of(*height, "take a surface", "unspecified");
                surface.edges = detail::value_of<SurfaceEdges>(edges);
                new (self) Surface(std::move(surface));
            },
            nb::arg("normals"), nb::arg("albedo"), nb::arg("height").none() = nb::none(), nb::kw_only(),
            nb::arg("edges") = "mirror",
            "normals: H x W x 3, unit vectors. albedo: H x W x d, linear. height: H x W in pixels; without "
            "one\n"
            "nothing throws shadows. edges: 'mirror' or 'periodic'.")
        .def(
            "relight",
            [](const Surface& self, const Vector& light) {
                return unlocked([&] { return relight(self, light); });
            },
            nb::arg("light"),
            "Albedo times n.l, where no higher part is in the way (theory 19.5). light: of any length, z "
            "above 0.\n\n"
            "Raises InputError when sizes do not fit, or the light is behind.");
}

}  // namespace

void add_relief(nb::module_& module) {
    add_light_set(module);
    add_fit_relief(module);
    add_height(module);
    add_relighting(module);
}

}  // namespace btfield::python

#include <algorithm>
#include <cstddef>

#include "btfield/btf_model.hpp"
#include "btfield/btf_page.hpp"
#include "btfield/btf_renderer.hpp"
#include "btfield/btf_textures.hpp"
#include "host/base/parallel.hpp"
#include "host/base/text.hpp"
#include "host/btf/btf_names.hpp"
#include "host/btf/direction_grid.hpp"
#include "host/btf/direction_table.hpp"
#include "host/rendering/rendering_names.hpp"
#include "python/src/arrays.hpp"
#include "python/src/device.hpp"
#include "python/src/model_bytes.hpp"
#include "python/src/options.hpp"
#include "python/src/parts.hpp"
#include "python/src/words.hpp"

namespace btfield::python {
namespace {

using PyBtfSynthesiser = Held<BtfSynthesiser>;
using PyTextureSynthesiser = Held<BtfTextureSynthesiser>;
using PyRenderer = Held<BtfRenderer>;

SurfaceKind surface_kind(const std::string& word) {
    if (word == "field") return SurfaceKind::field;
    if (word == "compound") return SurfaceKind::compound;
    if (word == "roll") return SurfaceKind::roll;
    throw InputError("find the surface '" + word + "'", "it is not known", "use field, compound, roll");
}

std::vector<BtfDirection> directions_of(nb::handle values, const char* what) {
    const std::vector<double> angles = numbers_of(values, what);
    if (angles.size() % 2 != 0)
        throw InputError(std::string("take ") + what, "an angle is missing", "give pairs (theta, phi)");
    std::vector<BtfDirection> directions;
    for (std::size_t i = 0; i < angles.size(); i += 2) {
        directions.push_back({angles[i], angles[i + 1]});
        detail::check_shown(directions.back(), what, "find the weights of directions");
    }
    return directions;
}

/// Means, offsets and weights of pairs of directions, one after the other.
struct WeightsOfPairs {
    std::vector<float> means, offsets, weights;
};

WeightsOfPairs weights_of(const BtfModel& model, const BtfSynthesiser& grown,
                          const std::vector<BtfDirection>& views, const std::vector<BtfDirection>& lights) {
    const detail::DirectionTable table(model, &detail::seen_planes(grown));
    const std::size_t colours = static_cast<std::size_t>(model.colours), pairs = views.size(),
                      weights = colours * static_cast<std::size_t>(model.planes());
    WeightsOfPairs found{std::vector<float>(pairs * colours), std::vector<float>(pairs * colours),
                         std::vector<float>(pairs * weights)};
    const auto put = [](const std::vector<double>& values, std::vector<float>& to, std::size_t pair) {
        std::ranges::transform(values, to.begin() + static_cast<std::ptrdiff_t>(pair * values.size()),
                               [](double value) { return static_cast<float>(value); });
    };
    detail::for_each_block(static_cast<int>(pairs), [&](int block) {
        const auto pair = static_cast<std::size_t>(block);
        const detail::PictureWeights own = table.weights(views[pair], lights[pair]);
        put(own.mean, found.means, pair);
        put(own.offsets, found.offsets, pair);
        put(own.weights, found.weights, pair);
    });
    return found;
}

void add_measured(nb::module_& module) {
    nb::class_<BtfMeasured>(module, "BtfMeasured", "What models of BTFs keep of their sets.")
        .def_ro("size", &BtfMeasured::size, "(height, width) of the pictures.")
        .def_ro("colours", &BtfMeasured::colours, "Planes of a picture.")
        .def_prop_ro("space", [](const BtfMeasured& self) { return std::string(name(self.space)); })
        .def_ro("white", &BtfMeasured::white, "Value of a white diffuse surface.")
        .def_ro("views", &BtfMeasured::views)
        .def_ro("lights", &BtfMeasured::lights)
        .def_ro("pairs", &BtfMeasured::pairs)
        .def_ro("true_lights", &BtfMeasured::true_lights,
                "Where light came from in each pair; empty: from the direction of its index.");
    nb::class_<BtfErrors>(module, "BtfErrors", "Of pictures that a fit was not shown, in their deviations.")
        .def_ro("median", &BtfErrors::median)
        .def_ro("mean", &BtfErrors::mean)
        .def_ro("mean_error", &BtfErrors::mean_error)
        .def_ro("std_error", &BtfErrors::std_error);
    nb::class_<BtfScore>(module, "BtfScore", "How well pictures are told that were left out.")
        .def_ro("pairs", &BtfScore::pairs)
        .def_ro("model", &BtfScore::model)
        .def_ro("nearest", &BtfScore::nearest, "Of the nearest picture that was shown.")
        .def_ro("neighbours", &BtfScore::neighbours, "Of the four nearest, weighted.");
}

void add_joint(nb::module_& module) {
    nb::class_<BtfModel, BtfMeasured> type(module, "BtfModel", "A BTF as one small model (theory 21).");
    type.def_prop_ro("planes", [](const BtfModel& self) { return self.planes(); })
        .def_prop_ro(
            "surface", [](const BtfModel& self) { return std::string(surface_name(self)); },
            "What grows it: '3d-car', ..., 'compound' or 'roll'.")
        .def_ro("unexplained", &BtfModel::unexplained)
        .def_ro("table_error", &BtfModel::table_error)
        .def_ro("scale_factor", &BtfModel::scale_factor)
        .def_ro("relief", &BtfModel::relief)
        .def_prop_ro("valid", [](const BtfModel& self) { return is_valid(self); })
        .def_prop_ro("parameter_count", [](const BtfModel& self) { return parameter_count(self); })
        .def("__repr__", [](const BtfModel& self) {
            return "<btfield.BtfModel of " + std::to_string(self.pairs.size()) + " pictures, " +
                   std::to_string(self.planes()) + " planes, " + std::string(surface_name(self)) + ">";
        });
    add_bytes(type);
    nb::class_<BtfFit>(module, "BtfFit", "What fit_btf() finds.")
        .def_ro("model", &BtfFit::model)
        .def_prop_ro(
            "surface", [](const BtfFit& self) { return self.surface; },
            "H x W x (1 + planes): height in pixels, then the planes, as they were found.")
        .def_ro("score", &BtfFit::score, "Of pictures that were left out; None without.")
        .def_ro("remarks", &BtfFit::remarks)
        .def_ro("resumed", &BtfFit::resumed);
    module.def(
        "fit_btf",
        [](PyDevice& device, const BtfSet& set, int planes, const std::optional<PictureObject>& height,
           std::optional<double> scale, bool find_scale, bool periodic, int leave_out, int leave_out_views,
           int leave_out_lights, double table_error, const std::string& surface, const FitOptions* field,
           std::optional<int> regions, const std::filesystem::path& part, const nb::object& progress) {
            BtfFitOptions options;
            options.planes = planes;
            if (height) options.height = image_of(*height, "fit a BTF", "unspecified");
            options.scale = scale;
            options.find_scale = find_scale;
            options.periodic = periodic;
            options.leave_out = {leave_out, leave_out_views, leave_out_lights};
            options.table_error = table_error;
            options.surface = surface_kind(surface);
            if (field != nullptr) options.field = *field;
            options.regions = regions;
            options.part = part;
            options.progress = stage_told(progress);
            return unlocked([&] { return fit_btf(*device, set, options); });
        },
        nb::arg("device"), nb::arg("set"), nb::kw_only(), nb::arg("planes") = 16,
        nb::arg("height").none() = nb::none(), nb::arg("scale").none() = nb::none(),
        nb::arg("find_scale") = false, nb::arg("periodic") = false, nb::arg("leave_out") = 0,
        nb::arg("leave_out_views") = 0, nb::arg("leave_out_lights") = 0, nb::arg("table_error") = 0.2,
        nb::arg("surface") = "field", nb::arg("field").none() = nb::none(),
        nb::arg("regions").none() = nb::none(), nb::arg("part") = "", nb::arg("progress").none() = nb::none(),
        "Finds planes of the surface that all pictures share behind its relief, and a field that grows them\n"
        "(theory 21).\n\n"
        "height: H x W in pixels; None: the set's, or by photometric stereo. leave_out: a pair in n is not\n"
        "shown, and scored, and so are all of every n-th view and light. surface: 'field', 'compound' or "
        "'roll'. field: FitOptions; None: 3d-car of order "
        "3.\n"
        "part: a file that keeps what is read, so that a fit that ended goes on; the caller removes it.\n"
        "progress: called with the stage and the share of it that is done.\n\n"
        "Raises InputError when options cannot be met, or a view has too few pictures.");
    nb::class_<PyBtfSynthesiser>(
        module, "BtfSynthesiser",
        "A grown surface of one model, size and seed, seen from anywhere. Any number of threads\n"
        "may ask one for pictures at a time.")
        .def(
            "__init__",
            [](PyBtfSynthesiser* self, PyDevice& device, const BtfModel& model, Size size, std::uint64_t seed,
               bool allow_invalid) {
                new (self) PyBtfSynthesiser([&] {
                    return unlocked(
                        [&] { return BtfSynthesiser(*device, model, size, seed, allow_invalid); });
                });
            },
            nb::arg("device"), nb::arg("model"), nb::arg("size"), nb::arg("seed") = 0, nb::kw_only(),
            nb::arg("allow_invalid") = false, nb::keep_alive<1, 2>())
        .def(
            "__init__",
            [](PyBtfSynthesiser* self, PyDevice& device, const BtfModel& model,
               const PictureObject& surface) {
                const Image image = image_of(surface, "take a surface", "unspecified");
                new (self) PyBtfSynthesiser(
                    [&] { return unlocked([&] { return BtfSynthesiser(*device, model, image); }); });
            },
            nb::arg("device"), nb::arg("model"), nb::kw_only(), nb::arg("surface"), nb::keep_alive<1, 2>(),
            "surface: BtfFit.surface, that the model was fitted to.")
        .def(
            "picture",
            [](PyBtfSynthesiser& self, const BtfDirection& view, const BtfDirection& light) {
                return unlocked([&] { return self->picture(view, light); });
            },
            nb::arg("view"), nb::arg("light"),
            "The picture under a view and a light, (theta, phi) in radians, measured or not: linear light,\n"
            "H x W x d float32.\n\nRaises InputError when a direction is not above the surface.")
        .def_prop_ro("size", [](PyBtfSynthesiser& self) { return self->size(); })
        .def_prop_ro("tileable", [](PyBtfSynthesiser& self) { return self->tileable(); })
        .def_prop_ro(
            "surface", [](PyBtfSynthesiser& self) { return self->surface(); },
            "Height in pixels, then the planes: a copy.");
    module.def(
        "btf_weights",
        [](const BtfModel& model, PyBtfSynthesiser& grown, const nb::object& views,
           const nb::object& lights) {
            const std::string asked = "find the weights of directions";
            const std::vector<BtfDirection> seen = directions_of(views, "view"),
                                            lit = directions_of(lights, "light");
            if (seen.size() != lit.size())
                throw InputError(
                    asked,
                    detail::counted(seen.size(), "view") + " and " + detail::counted(lit.size(), "light"),
                    "give a light for each view");
            if (grown->surface().planes() != model.planes() + 1)
                throw InputError(asked, "the surface has another number of planes than the model",
                                 "give one that was grown of this model");
            WeightsOfPairs found = unlocked([&] { return weights_of(model, *grown, seen, lit); });
            const auto colours = static_cast<std::size_t>(model.colours),
                       planes = static_cast<std::size_t>(model.planes());
            return nb::make_tuple(array_of(std::move(found.means), {seen.size(), colours}),
                                  array_of(std::move(found.offsets), {seen.size(), colours}),
                                  array_of(std::move(found.weights), {seen.size(), colours, planes}));
        },
        nb::arg("model"), nb::arg("grown"), nb::arg("views"), nb::arg("lights"),
        nb::sig("def btf_weights(model: BtfModel, grown: BtfSynthesiser, views: numpy.typing.ArrayLike, "
                "lights: numpy.typing.ArrayLike) -> tuple[numpy.typing.NDArray[numpy.float32], "
                "numpy.typing.NDArray[numpy.float32], numpy.typing.NDArray[numpy.float32]]"),
        "What makes light of planes under views and lights, n x 2 each, (theta, phi) in radians (theory "
        "21.3): means\n"
        "mu, n x d, offsets m, n x d, and weights U, n x d x planes, all float32. Where a view shows planes "
        "T of\n"
        "grown.surface, light is mu max(0, m + sum_k U_k T_k)^2, which has the mean mu over the pixels of a "
        "view.\n\n"
        "Raises InputError when a direction is not above the surface, or grown is of another model.");
}

void add_textures(nb::module_& module) {
    nb::class_<BtfTextures, BtfMeasured> type(
        module, "BtfTextures", "A BTF as textures of clusters of pictures, or of each (theory 22).");
    type.def_prop_ro(
            "method", [](const BtfTextures& self) { return std::string(name(self.method)); },
            "'segment' or 'each'.")
        .def_prop_ro("match", [](const BtfTextures& self) { return std::string(name(self.match)); })
        .def_ro("textures", &BtfTextures::textures)
        .def_prop_ro(
            "labels", [](const BtfTextures& self) { return array_of(self.labels); }, "Texture of each pair.")
        .def("__repr__", [](const BtfTextures& self) {
            return "<btfield.BtfTextures of " + std::to_string(self.pairs.size()) + " pictures, " +
                   std::to_string(self.textures.size()) + " textures>";
        });
    add_bytes(type);
    nb::class_<BtfStatistics>(module, "BtfStatistics", "How far statistics of pictures are off: medians.")
        .def_ro("mean_error", &BtfStatistics::mean_error)
        .def_ro("std_error", &BtfStatistics::std_error)
        .def_ro("std_error_95", &BtfStatistics::std_error_95)
        .def_ro("lag_covariance_error", &BtfStatistics::lag_covariance_error);
    nb::class_<BtfTexturesScore>(module, "BtfTexturesScore", "Of pictures that were left out.")
        .def_ro("pairs", &BtfTexturesScore::pairs)
        .def_ro("model", &BtfTexturesScore::model)
        .def_ro("nearest", &BtfTexturesScore::nearest);
    nb::class_<BtfTexturesFit>(module, "BtfTexturesFit", "What fit_btf_textures() finds.")
        .def_ro("model", &BtfTexturesFit::model)
        .def_ro("score", &BtfTexturesFit::score)
        .def_ro("remarks", &BtfTexturesFit::remarks)
        .def_ro("resumed", &BtfTexturesFit::resumed);
    module.def(
        "fit_btf_textures",
        [](PyDevice& device, const BtfSet& set, const std::string& method, int clusters,
           const std::string& match, const FitOptions* field, int leave_out, int leave_out_views,
           int leave_out_lights, int jobs, const std::filesystem::path& part, const nb::object& progress) {
            BtfTexturesOptions options(btf_method(method));
            options.clusters = clusters;
            options.match = detail::value_of<BtfMatch>(match);
            if (field != nullptr) options.field = *field;
            options.leave_out = {leave_out, leave_out_views, leave_out_lights};
            options.jobs = jobs;
            options.part = part;
            options.progress = stage_told(progress);
            return unlocked([&] { return fit_btf_textures(*device, set, options); });
        },
        nb::arg("device"), nb::arg("set"), nb::kw_only(), nb::arg("method") = "segment",
        nb::arg("clusters") = 20, nb::arg("match") = "means", nb::arg("field").none() = nb::none(),
        nb::arg("leave_out") = 0, nb::arg("leave_out_views") = 0, nb::arg("leave_out_lights") = 0,
        nb::arg("jobs") = 0, nb::arg("part") = "", nb::arg("progress").none() = nb::none(),
        "A texture for each cluster of pictures (method 'segment'), or for each ('each') (theory 22). "
        "match:\n"
        "directions keep their 'means' and contrasts, or 'none'.\n\nRaises InputError when options cannot "
        "be\n"
        "met, or a picture gives no model.");
    nb::class_<PyTextureSynthesiser>(module, "BtfTextureSynthesiser",
                                     "Grown textures of one model, size and seed, seen from anywhere.")
        .def(
            "__init__",
            [](PyTextureSynthesiser* self, PyDevice& device, const BtfTextures& textures, Size size,
               std::uint64_t seed, bool allow_invalid) {
                new (self) PyTextureSynthesiser([&] {
                    return unlocked(
                        [&] { return BtfTextureSynthesiser(*device, textures, size, seed, allow_invalid); });
                });
            },
            nb::arg("device"), nb::arg("model"), nb::arg("size"), nb::arg("seed") = 0, nb::kw_only(),
            nb::arg("allow_invalid") = false, nb::keep_alive<1, 2>())
        .def(
            "picture",
            [](PyTextureSynthesiser& self, const BtfDirection& view, const BtfDirection& light) {
                return unlocked([&] { return self->picture(view, light); });
            },
            nb::arg("view"), nb::arg("light"), "As BtfSynthesiser.picture().")
        .def(
            "texture",
            [](PyTextureSynthesiser& self, int index) {
                return unlocked([&] { return self->texture(index); });
            },
            nb::arg("index"))
        .def_prop_ro("size", [](PyTextureSynthesiser& self) { return self->size(); })
        .def_prop_ro("tileable", [](PyTextureSynthesiser& self) { return self->tileable(); });
}

void add_renderer(nb::module_& module) {
    nb::class_<PyRenderer>(module, "BtfRenderer",
                           "A grown tile of a material, shown on shapes (theory 23.1).")
        .def(
            "__init__",
            [](PyRenderer* self, PyDevice& device, const BtfModel& model, Size tile, std::uint64_t seed,
               bool allow_invalid) {
                new (self) PyRenderer([&] {
                    return unlocked([&] { return BtfRenderer(*device, model, tile, seed, allow_invalid); });
                });
            },
            nb::arg("device"), nb::arg("model"), nb::arg("tile"), nb::arg("seed") = 0, nb::kw_only(),
            nb::arg("allow_invalid") = false, nb::keep_alive<1, 2>())
        .def(
            "picture",
            [](PyRenderer& self, const BtfDirection& view, const BtfDirection& light,
               const std::string& shape, Size size, double scale, double background) {
                const BtfScene scene{detail::value_of<BtfShape>(shape), size, scale, background};
                return unlocked([&] { return self->picture(scene, view, light); });
            },
            nb::arg("view"), nb::arg("light"), nb::kw_only(), nb::arg("shape") = "sphere",
            nb::arg("size") = Size{512, 512}, nb::arg("scale") = 1.0, nb::arg("background") = 0.02,
            "H x W x d float32: linear light in shares of white. view, light: (theta, phi) in radians. "
            "shape:\n"
            "'sphere' or 'plane'. scale: pixels of the picture for one of the material.")
        .def_prop_ro("tile", [](PyRenderer& self) { return self->tile(); })
        .def_prop_ro("tileable", [](PyRenderer& self) { return self->tileable(); });
    module.def(
        "btf_page",
        [](const BtfModel& model, PyBtfSynthesiser& grown, const std::string& title, int planes,
           const nb::object& progress) {
            BtfPageOptions options;
            options.title = title;
            options.planes = planes;
            options.progress = share_told(progress);
            return unlocked([&] { return btf_page(model, *grown, options); });
        },
        nb::arg("model"), nb::arg("grown"), nb::kw_only(), nb::arg("title") = "Material",
        nb::arg("planes") = 0, nb::arg("progress").none() = nb::none(),
        "One HTML page that shows the material in a browser (theory 23.2), as text.\n\nRaises InputError "
        "when the\n"
        "model has neither one colour nor three.");
}

}  // namespace

void add_btf_models(nb::module_& module) {
    add_measured(module);
    add_joint(module);
    add_textures(module);
    add_renderer(module);
}

}  // namespace btfield::python

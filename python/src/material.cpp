#include "btfield/material.hpp"

#include <nanobind/stl/pair.h>

#include "btfield/fit.hpp"
#include "btfield/synthesis.hpp"

#include "host/model/model_names.hpp"
#include "host/relief/relief_names.hpp"
#include "python/src/arrays.hpp"
#include "python/src/device.hpp"
#include "python/src/fitted.hpp"
#include "python/src/options.hpp"
#include "python/src/parts.hpp"
#include "python/src/words.hpp"

namespace btfield::python {
namespace {

MapPicture map_of(const std::string& name, const PictureObject& picture, MapRole role) {
    MapPicture map;
    map.name = name;
    map.role = role;
    const bool colours = map.role == MapRole::colour || map.role == MapRole::other;
    ArrayPicture read = read_array(picture, "join maps: '" + name + "'", colours ? "auto" : "unspecified");
    map.picture.image = std::move(read.image);
    map.picture.type = read.type;
    map.directx = map.role == MapRole::normal && says_directx(name);
    return map;
}

nb::dict dict_of(const std::vector<MaterialMap>& maps, std::vector<Image> images) {
    nb::dict result;
    for (std::size_t i = 0; i < maps.size(); ++i)
        result[nb::str(maps[i].name.c_str(), maps[i].name.size())] = array_of(std::move(images[i]));
    return result;
}

}  // namespace

void add_material(nb::module_& module) {
    nb::class_<MaterialMap>(module, "MaterialMap",
                            "One of several maps of a material that are modelled together.")
        .def_ro("name", &MaterialMap::name)
        .def_prop_ro(
            "role", [](const MaterialMap& self) { return std::string(name(self.role)); },
            "'colour', 'normal', 'height', 'roughness', 'metalness', 'occlusion', 'opacity' or 'other'.")
        .def_ro("planes", &MaterialMap::planes, "Of the model's; 0: normals that the height tells.")
        .def_ro("scale", &MaterialMap::scale, "Of heights in pixels: how far apart black and white are.")
        .def_ro("directx", &MaterialMap::directx);
    nb::class_<Material>(module, "Material",
                         "Maps of one material side by side (theory 20), as join_maps() has them.")
        .def_prop_ro(
            "planes", [](const Material& self) { return self.image; }, "H x W x d: planes of all maps.")
        .def_ro("maps", &Material::maps)
        .def_ro("remarks", &Material::remarks);
    module.def(
        "join_maps",
        [](PyDevice& device, const std::vector<std::pair<std::string, PictureObject>>& maps,
           const std::vector<std::string>& roles, const std::string& edges) {
            std::vector<std::filesystem::path> names;
            for (const auto& map : maps) names.emplace_back(map.first);
            std::vector<MapRole> all = roles_of_names(names);
            std::vector<MapPicture> pictures;
            for (std::size_t i = 0; i < maps.size(); ++i) {
                if (i < roles.size() && roles[i] != "auto") all[i] = map_role(roles[i]);
                pictures.push_back(map_of(maps[i].first, maps[i].second, all[i]));
            }
            const auto borders = detail::value_of<SurfaceEdges>(edges);
            return unlocked([&] { return join_maps(*device, pictures, borders); });
        },
        nb::arg("device"), nb::arg("maps"), nb::kw_only(), nb::arg("roles") = std::vector<std::string>(),
        nb::arg("edges") = "mirror",
        "Registered maps as one picture (theory 20.1).\n\n"
        "maps: pairs of a name and an array, in order. Names tell roles ('bark_normal_gl.png', 'height', "
        "...),\n"
        "unless roles has one for each. Normals are not modelled, but the height that tells them.\n\n"
        "Raises InputError when sizes differ, names do, two maps are normals or heights, or normals and "
        "height\n"
        "have nothing to do with each other.");
    module.def(
        "fit_material",
        [](PyDevice& device, const Material& material, const FitOptions* options, const nb::object& progress,
           const nb::kwargs& keywords) {
            FitOptions wanted = options_of(options, keywords);
            wanted.progress = stage_told(progress);
            return unlocked([&] {
                TextureModel model = fit(*device, material.image, wanted);
                model.provenance.maps = material.maps;
                if (is_valid(model)) {
                    Synthesiser synthesiser(*device, model, model.size);
                    match_relief(*device, model.provenance.maps, material.image, synthesiser.synthesise(0));
                }
                return model;
            });
        },
        nb::arg("device"), nb::arg("material"), nb::arg("options").none() = nb::none(), nb::kw_only(),
        nb::arg("progress").none() = nb::none(), nb::arg("keywords"),
        "A model of all maps together, as fit(); heights will be as rough as the material's (theory 20.2).");
    module.def(
        "split_maps",
        [](PyDevice& device, const TextureModel& model, const PictureObject& texture, bool tileable) {
            const Image image = image_of(texture, "split maps", "unspecified");
            const SurfaceEdges edges = tileable ? SurfaceEdges::periodic : SurfaceEdges::mirror;
            std::vector<Image> images =
                unlocked([&] { return split_maps(*device, model.provenance.maps, image, edges); });
            return dict_of(model.provenance.maps, std::move(images));
        },
        nb::arg("device"), nb::arg("model"), nb::arg("texture"), nb::kw_only(), nb::arg("tileable") = true,
        nb::sig(
            "def split_maps(device: Device, model: TextureModel, texture: numpy.typing.NDArray[typing.Any], "
            "*, tileable: bool = True) -> dict[str, numpy.typing.NDArray[numpy.float32]]"),
        "The maps of a texture that fit_material()'s model grew, by name: colours as their files hold them,\n"
        "heights in pixels, normals as unit vectors of that height.");
}

}  // namespace btfield::python

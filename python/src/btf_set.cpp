#include "btfield/btf_set.hpp"

#include <nanobind/stl/array.h>
#include <nanobind/stl/shared_ptr.h>

#include "btfield/btf_output.hpp"
#include "btfield/made_btf.hpp"
#include "host/btf/btf_names.hpp"
#include "host/btf/picture_folder.hpp"
#include "python/src/arrays.hpp"
#include "python/src/device.hpp"
#include "python/src/options.hpp"
#include "python/src/parts.hpp"
#include "python/src/words.hpp"

namespace btfield::python {
namespace {

/// Pictures that a function of Python gives.
class FunctionSource : public BtfSource {
  public:
    FunctionSource(BtfDescription description, nb::object function)
        : description_(std::move(description)), function_(std::move(function)) {}
    ~FunctionSource() override {
        const nb::detail::cleanup_guard locked;
        if (locked)
            function_.reset();
        else
            function_.release();  // the interpreter has ended
    }
    FunctionSource(const FunctionSource&) = delete;
    FunctionSource& operator=(const FunctionSource&) = delete;

    [[nodiscard]] const BtfDescription& description() const override { return description_; }
    [[nodiscard]] Image picture(int view, int light) const override {
        const nb::gil_scoped_acquire locked;
        const std::string asked =
            "take picture " + std::to_string(view) + ", " + std::to_string(light) + " of a BTF";
        const ArrayPicture read = read_array({function_(view, light)}, asked);
        if (read.type != PixelType::float32)
            throw InputError(asked, "its values are whole numbers",
                             "give linear light, float32: linear_of()");
        if (read.image.size() != description_.size || read.image.planes() != description_.planes)
            throw InputError(asked, "it has another size or number of planes than described",
                             "give pictures of one size");
        Image image = read.image;
        image.set_space(description_.space);
        return image;
    }

  private:
    BtfDescription description_;
    nb::object function_;
};

BtfOptions options_with(const std::string& coding, const std::optional<std::string>& space,
                        const std::optional<Crop>& crop, int pixel_stride, int view_stride,
                        int light_stride) {
    BtfOptions options;
    options.coding = detail::value_of<BtfCoding>(coding);
    if (space) options.space = colour_space(*space);
    options.crop = crop;
    options.pixel_stride = pixel_stride;
    options.view_stride = view_stride;
    options.light_stride = light_stride;
    return options;
}

void add_set_class(nb::module_& module) {
    nb::class_<BtfSet>(
        module, "BtfSet",
        "A BTF: V views times L lights, some of which may be missing. Pictures are read when they are\n"
        "asked for. Any number of threads may use one at a time.")
        .def(
            "__init__",
            [](BtfSet* self, const nb::object& picture, Size size, int planes,
               const std::vector<BtfDirection>& views, const std::vector<BtfDirection>& lights,
               const std::optional<std::vector<BtfPair>>& pairs, const std::string& space, double white,
               const std::vector<std::string>& names, const std::string& format, std::uint64_t bytes,
               const std::optional<PictureObject>& height) {
                BtfDescription description;
                description.format = format;
                description.size = size;
                description.planes = planes;
                description.space = planes == 3 ? colour_space(space) : ColourSpace::unspecified;
                description.names = names;
                description.white = white;
                description.views = views;
                description.lights = lights;
                description.bytes = bytes;
                if (height) description.height = image_of(*height, "take a height", "unspecified");
                if (pairs) {
                    description.present.assign(views.size() * lights.size(), 0);
                    for (const BtfPair& pair : *pairs) {
                        const auto view = static_cast<std::size_t>(pair.view);
                        const auto light = static_cast<std::size_t>(pair.light);
                        if (pair.view < 0 || pair.light < 0 || view >= views.size() || light >= lights.size())
                            throw InputError("make a BTF set", "a pair has no view or light of that number",
                                             "count from 0");
                        description.present[view * lights.size() + light] = 1;
                    }
                }
                auto source = std::make_shared<const FunctionSource>(std::move(description), picture);
                new (self) BtfSet(std::move(source));
            },
            nb::arg("picture"), nb::arg("size"), nb::arg("planes"), nb::arg("views"), nb::arg("lights"),
            nb::kw_only(), nb::arg("pairs").none() = nb::none(), nb::arg("space") = "linear",
            nb::arg("white") = 1.0, nb::arg("names") = std::vector<std::string>(),
            nb::arg("format") = "pictures", nb::arg("bytes") = 0, nb::arg("height").none() = nb::none(),
            "Of pictures that a function gives: picture(view, light), indices, returns linear light, H x W x "
            "d\n"
            "float32. It is called from any thread, while others wait.\n\n"
            "views, lights: (theta, phi) in radians, theta from the normal, phi counter-clockwise from the "
            "right.\n"
            "pairs: (view, light) that there are; None: all. height: the range map, H x W in pixels.\n\n"
            "Raises InputError when that contradicts itself.")
        .def_static(
            "open_file",
            [](const std::filesystem::path& path, const std::string& coding,
               const std::optional<std::string>& space, const std::optional<Crop>& crop, int pixel_stride,
               int view_stride, int light_stride) {
                const BtfOptions options =
                    options_with(coding, space, crop, pixel_stride, view_stride, light_stride);
                return unlocked([&] { return BtfSet::open(path, options); });
            },
            nb::arg("path"), nb::kw_only(), nb::arg("coding") = "auto", nb::arg("space").none() = nb::none(),
            nb::arg("crop").none() = nb::none(), nb::arg("pixel_stride") = 1, nb::arg("view_stride") = 1,
            nb::arg("light_stride") = 1,
            "A set in one file: .btf of UBO2014, TBIG 2, BIG 3, MIF. See btfield.open_btf() for folders.\n\n"
            "crop: (x, y, width, height) of all pictures. pixel_stride, view_stride, light_stride: every "
            "n-th.\n\n"
            "Raises InputError when nothing such is there.")
        .def_prop_ro("format", [](const BtfSet& self) { return self.format(); })
        .def_prop_ro("size", [](const BtfSet& self) { return self.size(); })
        .def_prop_ro("planes", [](const BtfSet& self) { return self.planes(); })
        .def_prop_ro("space", [](const BtfSet& self) { return std::string(name(self.space())); })
        .def_prop_ro("white", [](const BtfSet& self) { return self.white(); })
        .def_prop_ro(
            "views", [](const BtfSet& self) { return self.views(); }, "(theta, phi), radians.")
        .def_prop_ro(
            "lights", [](const BtfSet& self) { return self.lights(); }, "(theta, phi), radians.")
        .def_prop_ro(
            "pictures", [](const BtfSet& self) { return self.pictures(); }, "(view, light) that are there.")
        .def_prop_ro(
            "missing", [](const BtfSet& self) { return self.missing(); }, "(view, light) that are not.")
        .def_prop_ro(
            "height", [](const BtfSet& self) { return array_or_none(self.description().height); },
            "The range map, H x W x 1 in pixels; None where there is none.")
        .def_prop_ro("remarks", [](const BtfSet& self) { return self.description().remarks; })
        .def("light", &BtfSet::light, nb::arg("view"), nb::arg("light"),
             "Where light really comes from in a picture.")
        .def("has", &BtfSet::has, nb::arg("view"), nb::arg("light"))
        .def(
            "picture",
            [](const BtfSet& self, int view, int light) {
                return unlocked([&] { return self.picture(view, light); });
            },
            nb::arg("view"), nb::arg("light"),
            "Linear light, H x W x d float32.\n\nRaises InputError when it is missing or cannot be read.")
        .def("__repr__", [](const BtfSet& self) {
            return "<btfield.BtfSet " + self.format() + ": " + std::to_string(self.views().size()) +
                   " views, " + std::to_string(self.lights().size()) + " lights>";
        });
}

void add_writing(nb::module_& module) {
    module.def(
        "write_btf",
        [](const std::filesystem::path& path, const BtfSet& set, const std::string& format) {
            BtfWriteOptions options;
            options.format = detail::value_of<BtfFormat>(format);
            return unlocked([&] { return write_btf(path, set, options).pictures; });
        },
        nb::arg("path"), nb::arg("set"), nb::kw_only(), nb::arg("format") = "tbig",
        "Writes a set as one file: 'tbig', 'big', 'mif' or 'ubo2014-fmf'; gives the number of "
        "pictures.\n\nRaises "
        "InputError\n"
        "when the format cannot hold the planes; folders of pictures are the command's, or the caller's.");
    module.def(
        "make_btf",
        [](PyDevice& device, const PictureObject& albedo, const PictureObject& normals,
           const PictureObject& height, const std::optional<PictureObject>& roughness,
           const std::vector<BtfDirection>& views, const std::vector<BtfDirection>& lights,
           double default_roughness, double reflectance) {
            BtfMaterial material;
            material.albedo = image_of(albedo, "make a BTF", "linear");
            material.normals = image_of(normals, "make a BTF", "unspecified");
            material.height = image_of(height, "make a BTF", "unspecified");
            if (roughness) material.roughness = image_of(*roughness, "make a BTF", "unspecified");
            MadeBtfOptions options;
            if (!views.empty()) options.views = views;
            if (!lights.empty()) options.lights = lights;
            options.roughness = default_roughness;
            options.reflectance = reflectance;
            return unlocked([&] { return make_btf(*device, material, options); });
        },
        nb::arg("device"), nb::arg("albedo"), nb::arg("normals"), nb::arg("height"),
        nb::arg("roughness").none() = nb::none(), nb::kw_only(),
        nb::arg("views") = std::vector<BtfDirection>(), nb::arg("lights") = std::vector<BtfDirection>(),
        nb::arg("default_roughness") = 0.45, nb::arg("reflectance") = 0.04, nb::keep_alive<0, 1>(),
        "The BTF of a material that maps tell: pictures are computed when they are asked for.\n\n"
        "albedo: H x W x d, linear. normals: H x W x 3, unit vectors. height: H x W, pixels. roughness: H x "
        "W,\n"
        "0..1. views, lights: (theta, phi); empty: 81 directions.\n\n"
        "Raises InputError when maps differ in size or a direction is not above the surface.");
    module.def("btf_directions_81", &btf_directions_81,
               "The 81 directions of the Bonn 2003, ATRIUM and UTIA sets, (theta, phi) in radians.");
    module.def("btf_directions_151", &btf_directions_151, "The 151 directions of the UBO2014 sets.");
    module.def("angle_between", &angle_between, nb::arg("a"), nb::arg("b"), "Radians.");
    module.def(
        "_angles_of_name",
        [](const std::string& stem) {
            const detail::NamedAngles angles = detail::angles_of_name(stem);
            return nb::make_tuple(angles.tl, angles.pl, angles.tv, angles.pv);
        },
        nb::arg("stem"),
        "Degrees that tl, pl, tv and pv stand before in a file's name; None where one is not there.");
}

}  // namespace

void add_btf_set(nb::module_& module) {
    add_set_class(module);
    add_writing(module);
}

}  // namespace btfield::python

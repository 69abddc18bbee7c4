// Pyramids, lag covariances, eigenplanes, marginals: what a fit is made of.

#include <nanobind/stl/array.h>

#include "btfield/lag_covariance.hpp"
#include "btfield/marginals.hpp"
#include "btfield/pyramid.hpp"
#include "btfield/spectral_basis.hpp"
#include "python/src/arrays.hpp"
#include "python/src/device.hpp"
#include "python/src/parts.hpp"

namespace btfield::python {
namespace {

nb::object values_of(const LagCovariance& covariance) {
    const Offset box = covariance.box();
    const int d = covariance.planes();
    std::vector<double> values;
    for (int row = -box.row; row <= box.row; ++row)
        for (int column = -box.column; column <= box.column; ++column)
            for (int i = 0; i < d; ++i)
                for (int j = 0; j < d; ++j) values.push_back(covariance(i, j, {row, column}));
    return array_of(std::move(values),
                    {static_cast<std::size_t>(2 * box.row + 1), static_cast<std::size_t>(2 * box.column + 1),
                     static_cast<std::size_t>(d), static_cast<std::size_t>(d)});
}

void add_lag_covariance(nb::module_& module) {
    nb::class_<LagCovariance>(
        module, "LagCovariance",
        "C_ij(s) = mean of (y_i(r) - mu_i)(y_j(r + s) - mu_j) over the torus, in squared units of\n"
        "the values, in float64 (theory 5.1). c[i, j, row, column] is C_ij(row, column).")
        .def_prop_ro("planes", &LagCovariance::planes)
        .def_prop_ro("size", &LagCovariance::size,
                     "(height, width) of the lattice that the mean was taken over.")
        .def_prop_ro("box", &LagCovariance::box, "(row, column): lags reach this far.")
        .def_prop_ro(
            "mean",
            [](const LagCovariance& self) {
                return array_of(std::vector<double>(self.mean().begin(), self.mean().end()));
            },
            "mu, one for each plane.")
        .def_prop_ro("values", &values_of, "All of them: [row + box[0]][column + box[1]][i][j].")
        .def(
            "__getitem__",
            [](const LagCovariance& self, const std::array<int, 4>& at) {
                const Offset lag{at[2], at[3]};
                if (!self.contains(lag) || at[0] < 0 || at[1] < 0 || at[0] >= self.planes() ||
                    at[1] >= self.planes())
                    throw nb::index_error("no such planes, or the lag is outside of the box");
                return self(at[0], at[1], lag);
            },
            nb::arg("at"))
        .def("__repr__", [](const LagCovariance& self) {
            return "<btfield.LagCovariance of " + std::to_string(self.planes()) + " planes, lags up to (" +
                   std::to_string(self.box().row) + ", " + std::to_string(self.box().column) + ")>";
        });
    module.def(
        "lag_covariance",
        [](const PictureObject& picture, Offset box) {
            const Image image = image_of(picture, "find lag covariances");
            return unlocked([&] { return lag_covariance(image, box); });
        },
        nb::arg("picture"), nb::arg("box"),
        "One pass over a picture H x W x d. box: (rows, columns) that lags reach; they wrap.\n\nRaises\n"
        "InputError when the picture is empty or the box negative or too large. Theory 5.1.");
    module.def(
        "covariances_at",
        [](const PictureObject& picture, const std::vector<Offset>& lags) {
            const Image image = image_of(picture, "find covariances");
            const auto d = static_cast<std::size_t>(image.planes());
            return array_of(unlocked([&] { return covariances_at(image, lags); }), {lags.size(), d, d});
        },
        nb::arg("picture"), nb::arg("lags"),
        "Covariances at the listed lags only, N of (row, column): N x d x d, means removed.");
    module.def(
        "probe_lags", [](Size size) { return offsets_array(probe_lags(size)); }, nb::arg("size"),
        "Lags that level gains and comparisons look at (theory 5.4): N x 2 of (row, column).");
    module.def("difference_box", &difference_box, nb::arg("offsets"),
               "Box of lags that a fit on these offsets reads (theory 5.2).");
}

void add_pyramid(nb::module_& module) {
    module.def(
        "pyramid_sizes", &pyramid_sizes, nb::arg("size"), nb::arg("levels"), nb::arg("factor") = 2,
        "(height, width) of the levels, finest first.\n\nRaises InputError when levels < 1 or factor < 2.");
    module.def(
        "pyramid_kernel", [](int factor) { return array_of(pyramid_kernel(factor)); }, nb::arg("factor") = 2,
        "The separable low-pass of 2 factor + 1 taps (theory 2.1).");
    module.def(
        "decompose",
        [](PyDevice& device, const PictureObject& picture, int levels, int factor) {
            const Image image = image_of(picture, "make a pyramid");
            return arrays_of(unlocked([&] { return decompose(*device, image, levels, factor); }));
        },
        nb::arg("device"), nb::arg("picture"), nb::arg("levels"), nb::arg("factor") = 2,
        "Laplacian levels of a picture, finest first, the last one the Gaussian level (theory "
        "2.3).\n\nRaises\n"
        "InputError as pyramid_sizes().",
        nb::sig("def decompose(device: Device, picture: numpy.typing.NDArray[typing.Any], levels: int, "
                "factor: int = 2) -> list[numpy.typing.NDArray[numpy.float32]]"));
    module.def(
        "collapse",
        [](PyDevice& device, const std::vector<PictureObject>& levels, int factor) {
            const std::vector<Image> images = images_of(levels, "collapse a pyramid");
            return unlocked([&] { return collapse(*device, images, factor); });
        },
        nb::arg("device"), nb::arg("levels"), nb::arg("factor") = 2,
        "Inverse of decompose() to float rounding.\n\nRaises InputError when the sizes of the levels do not\n"
        "belong to one pyramid.");
}

void add_planes(nb::module_& module) {
    module.def(
        "spectral_basis",
        [](const PictureObject& picture, const std::string& space) {
            const Image image = image_of(picture, "find eigenplanes", space);
            return unlocked([&] { return spectral_basis(image); });
        },
        nb::arg("picture"), nb::kw_only(), nb::arg("space") = "auto",
        "The Karhunen-Loeve basis of a picture's planes (theory 3).\n\nRaises InputError when the picture "
        "is\n"
        "constant or has NaN or infinity.");
    module.def(
        "to_eigenplanes",
        [](const SpectralBasis& basis, const PictureObject& picture) {
            const Image image = image_of(picture, "make eigenplanes");
            return unlocked([&] { return to_eigenplanes(basis, image); });
        },
        nb::arg("basis"), nb::arg("picture"), "T D^-1 (y - mean): H x W x rank.");
    module.def(
        "from_eigenplanes",
        [](const SpectralBasis& basis, const PictureObject& planes) {
            const Image image = image_of(planes, "take eigenplanes", "unspecified");
            return unlocked([&] { return from_eigenplanes(basis, image, ColourSpace::unspecified); });
        },
        nb::arg("basis"), nb::arg("eigenplanes"), "D T' m + mean: the picture again, to float rounding.");
    module.def(
        "gaussianise",
        [](const PictureObject& planes, int knots) {
            const Image image = image_of(planes, "gaussianise planes", "unspecified");
            GaussianPlanes made = unlocked([&] { return gaussianise(image, knots); });
            nb::list marginals;
            for (Marginal& marginal : made.marginals) marginals.append(array_of(std::move(marginal.values)));
            return nb::make_tuple(array_of(std::move(made.planes)), marginals);
        },
        nb::arg("planes"), nb::arg("knots") = default_knots,
        "Each plane as normal values of its ranks, and the quantile functions that lead back, values at\n"
        "`knots` knots from -3.5 to 3.5 (theory 13.1).\n\nRaises InputError when a plane is constant, a "
        "value\n"
        "is not finite, or knots is not in 4..64.",
        nb::sig("def gaussianise(planes: numpy.typing.NDArray[typing.Any], knots: int = 32) -> "
                "tuple[numpy.typing.NDArray[numpy.float32], list[numpy.typing.NDArray[numpy.float64]]]"));
    module.def(
        "map_back",
        [](const PictureObject& gaussian, const std::vector<nb::object>& marginals) {
            const Image image = image_of(gaussian, "map planes back", "unspecified");
            std::vector<Marginal> functions;
            for (const nb::object& values : marginals)
                functions.push_back({numbers_of(values, "a marginal")});
            for (const Marginal& function : functions) check(function);
            return unlocked([&] { return map_back(image, functions); });
        },
        nb::arg("gaussian"), nb::arg("marginals"), "Every plane through its quantile function.");
}

}  // namespace

void add_analysis(nb::module_& module) {
    add_lag_covariance(module);
    add_pyramid(module);
    add_planes(module);
}

}  // namespace btfield::python

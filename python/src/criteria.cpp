#include "btfield/criteria.hpp"

#include <nanobind/stl/array.h>

#include "btfield/curves.hpp"
#include "btfield/memd.hpp"
#include "host/criteria/metric_names.hpp"
#include "python/src/arrays.hpp"
#include "python/src/device.hpp"
#include "python/src/options.hpp"
#include "python/src/parts.hpp"
#include "python/src/words.hpp"

namespace btfield::python {
namespace {

/// What memd() found, and the shape that local errors have.
struct PyMemd : Memd {
    Size size;
};
using PyReference = Held<MemdReference>;

struct Pair {
    Image a, b;
};

Pair pair_of(const PictureObject& a, const PictureObject& b, const std::string& asked) {
    return {image_of(a, asked), image_of(b, asked)};
}

MemdOptions memd_options(const std::string& metric_word, std::array<double, 2> white, bool local_errors,
                         const std::string& search, const nb::object& progress) {
    MemdOptions options;
    options.metric = metric(metric_word);
    options.white = white;
    options.local_errors = local_errors;
    options.search = detail::value_of<MemdSearch>(search);
    options.progress = share_told(progress);
    return options;
}

void add_memd(nb::module_& module) {
    nb::class_<PyMemd>(module, "Memd",
                       "Mean exhaustive minimum distance of the colours of two pictures (theory 15.2).")
        .def_ro("memd", &PyMemd::memd, "Units 0..255.")
        .def_ro("memd_star", &PyMemd::memd_star, "100 memd / memd_max, percent.")
        .def_prop_ro(
            "pixels", [](const PyMemd& self) { return nb::make_tuple(self.pixels[0], self.pixels[1]); },
            "Of A and of B.")
        .def_prop_ro(
            "local_errors",
            [](const PyMemd& self) -> nb::object {
                if (self.local_errors.empty()) return nb::none();
                return array_of(self.local_errors, {static_cast<std::size_t>(self.size.height),
                                                    static_cast<std::size_t>(self.size.width)});
            },
            "H x W of A, units 0..255; -1 where B had no pixel left. None unless asked for.")
        .def_ro("search_seconds", &PyMemd::search_seconds)
        .def("__repr__",
             [](const PyMemd& self) { return "<btfield.Memd " + std::to_string(self.memd) + ">"; });
    module.def(
        "memd_max", [](const std::string& word, int planes) { return memd_max(metric(word), planes); },
        nb::arg("metric"), nb::arg("planes"), "Largest distance of two colours in units 0..255.");
    module.def(
        "memd",
        [](PyDevice& device, const PictureObject& a, const PictureObject& b, const std::string& metric,
           std::array<double, 2> white, bool local_errors, const std::string& search,
           const nb::object& progress) {
            const MemdOptions options = memd_options(metric, white, local_errors, search, progress);
            const Pair pair = pair_of(a, b, "find MEMD");
            return unlocked([&] { return PyMemd{memd(*device, pair.a, pair.b, options), pair.a.size()}; });
        },
        nb::arg("device"), nb::arg("a"), nb::arg("b"), nb::arg("metric") = "max", nb::kw_only(),
        nb::arg("white") = std::array<double, 2>{1.0, 1.0}, nb::arg("local_errors") = false,
        nb::arg("search") = "auto", nb::arg("progress").none() = nb::none(),
        "MEMD(A, B): each pixel of A in raster order takes the nearest pixel of B that is not yet taken; "
        "mean\n"
        "of their distances, defined to the bit (theory 15.2). Sizes may differ, planes may not.\n\n"
        "metric: over planes, 'max', 'l1' or 'l2'. white: the value of each picture that is 255 units.\n"
        "search: 'auto', 'host-tree' or 'exhaustive'; results are equal.\n"
        "progress: called with the share of the pixels that are found.\n\n"
        "Raises InputError when planes differ, a picture is empty, or a value is NaN or infinite.");
    nb::class_<PyReference>(module, "MemdReference",
                            "One reference A held against many candidates: its colours are prepared once.")
        .def(
            "__init__",
            [](PyReference* self, PyDevice& device, const PictureObject& a, const std::string& metric,
               std::array<double, 2> white) {
                const MemdOptions options = memd_options(metric, white, false, "auto", nb::none());
                const Image image = image_of(a, "prepare a reference");
                new (self) PyReference(
                    [&] { return unlocked([&] { return MemdReference(*device, image, options); }); });
            },
            nb::arg("device"), nb::arg("a"), nb::arg("metric") = "max", nb::kw_only(),
            nb::arg("white") = std::array<double, 2>{1.0, 1.0}, nb::keep_alive<1, 2>())
        .def(
            "__call__",
            [](PyReference& self, const PictureObject& candidate) {
                const Image image = image_of(candidate, "find MEMD");
                return unlocked([&] { return PyMemd{(*self)(image), image.size()}; });
            },
            nb::arg("candidate"), "MEMD(A, candidate), as memd().");
}

void add_kappa(nb::module_& module) {
    nb::class_<Kappa>(module, "Kappa", "Spectral decorrelation criterion (theory 15.1; P4 eq. 49).")
        .def_ro("kappa", &Kappa::kappa)
        .def_ro("cmax", &Kappa::cmax)
        .def_ro("white", &Kappa::white)
        .def_prop_ro(
            "two_dimensional", [](const Kappa& self) { return self.two_dimensional(); },
            "kappa <= 3: 2D models lose no colour to speak of.")
        .def_ro("white_at_threshold", &Kappa::white_at_threshold)
        .def_prop_ro(
            "covariance",
            [](const Kappa& self) {
                std::size_t d = 0;
                while (d * d < self.covariance.size()) ++d;
                return array_of(self.covariance, {d, d});
            },
            "d x d, in units where white is cmax.")
        .def("__repr__",
             [](const Kappa& self) { return "<btfield.Kappa " + std::to_string(self.kappa) + ">"; });
    module.def(
        "kappa",
        [](const PictureObject& picture, double cmax, double white) {
            const Image image = image_of(picture, "find kappa");
            return unlocked([&] { return kappa(image, cmax, white); });
        },
        nb::arg("picture"), nb::arg("cmax") = 256.0, nb::arg("white") = 1.0,
        "kappa = det(Sigma) / c^d, Sigma the covariance of the planes where white is c = cmax. white: the\n"
        "value of the picture that is white; 1 for whole numbers.\n\nRaises InputError when a value is NaN "
        "or\n"
        "infinite, or cmax or white is not positive.");
}

void add_compare(nb::module_& module) {
    nb::class_<Comparison::Plane>(module, "PlaneComparison",
                                  "Mean and standard deviation of a plane of A and B.")
        .def_ro("mean", &Comparison::Plane::mean, "[A, B].")
        .def_ro("std", &Comparison::Plane::std, "[A, B].")
        .def_ro("std_ratio", &Comparison::Plane::std_ratio, "B / A.");
    nb::class_<Comparison>(module, "Comparison", "Statistics of B held against those of A (theory 15.3).")
        .def_ro("planes", &Comparison::planes)
        .def_ro("lag_covariance_error", &Comparison::lag_covariance_error)
        .def_ro("spectral_covariance_error", &Comparison::spectral_covariance_error)
        .def("__repr__", [](const Comparison& self) {
            return "<btfield.Comparison lag_covariance_error " + std::to_string(self.lag_covariance_error) +
                   ", spectral_covariance_error " + std::to_string(self.spectral_covariance_error) + ">";
        });
    module.def(
        "compare",
        [](const PictureObject& a, const PictureObject& b) {
            const Pair pair = pair_of(a, b, "compare pictures");
            return unlocked([&] { return compare(pair.a, pair.b); });
        },
        nb::arg("a"), nb::arg("b"),
        "Means, deviations and covariances of B held against the reference A (theory 15.3). Sizes may "
        "differ.\n"
        "\nRaises InputError when the numbers of planes differ or A is constant.");
    module.def(
        "quantile_errors",
        [](const PictureObject& a, const PictureObject& b) {
            const Pair pair = pair_of(a, b, "compare pictures");
            return array_of(unlocked([&] { return quantile_errors(pair.a, pair.b); }));
        },
        nb::arg("a"), nb::arg("b"),
        "How far the histograms of each plane are apart, in A's deviations (theory 15.4).");
    module.def(
        "structure_distance",
        [](const PictureObject& a, const PictureObject& b) {
            const Pair pair = pair_of(a, b, "compare pictures");
            return unlocked([&] { return structure_distance(pair.a, pair.b); });
        },
        nb::arg("a"), nb::arg("b"),
        "How far the 8 x 8 patches are apart, at three scales, in A's deviations (theory 15.5).");
    nb::class_<StatisticCurves::Plane>(module, "PlaneCurves", "Of one plane: arrays of [A, B].")
        .def_prop_ro(
            "covariance",
            [](const StatisticCurves::Plane& self) {
                std::vector<double> v;
                for (const auto& each : self.covariance) v.insert(v.end(), each.begin(), each.end());
                return array_of(std::move(v), {self.covariance.size(), 2});
            },
            "At the lags, over A's variance.")
        .def_prop_ro(
            "spectrum",
            [](const StatisticCurves::Plane& self) {
                std::vector<double> v;
                for (const auto& each : self.spectrum) v.insert(v.end(), each.begin(), each.end());
                return array_of(std::move(v), {self.spectrum.size(), 2});
            },
            "At the frequencies, over A's variance.")
        .def_prop_ro(
            "edges", [](const StatisticCurves::Plane& self) { return array_of(self.edges); },
            "Of the histogram's bins.")
        .def_prop_ro("histogram", [](const StatisticCurves::Plane& self) {
            std::vector<double> v;
            for (const auto& each : self.histogram) v.insert(v.end(), each.begin(), each.end());
            return array_of(std::move(v), {self.histogram.size(), 2});
        });
    nb::class_<StatisticCurves>(module, "StatisticCurves",
                                "Covariance by lag, spectrum and histogram of two pictures.")
        .def_prop_ro("lags", [](const StatisticCurves& self) { return offsets_array(self.lags); })
        .def_prop_ro(
            "frequencies", [](const StatisticCurves& self) { return array_of(self.frequencies); },
            "Cycles per pixel.")
        .def_ro("planes", &StatisticCurves::planes);
    module.def(
        "statistic_curves",
        [](const PictureObject& a, const PictureObject& b) {
            const Pair pair = pair_of(a, b, "compare pictures");
            return unlocked([&] { return statistic_curves(pair.a, pair.b); });
        },
        nb::arg("a"), nb::arg("b"), "What compare() boils down to single numbers, as curves to plot.");
}

}  // namespace

void add_criteria(nb::module_& module) {
    add_memd(module);
    add_kappa(module);
    add_compare(module);
}

}  // namespace btfield::python

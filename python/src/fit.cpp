#include "btfield/fit.hpp"

#include <algorithm>

#include "btfield/version.hpp"
#include "host/analysis/neighbourhood_names.hpp"
#include "host/fit/fit_names.hpp"
#include "host/model/model_names.hpp"
#include "python/src/arrays.hpp"
#include "python/src/device.hpp"
#include "python/src/fitted.hpp"
#include "python/src/options.hpp"
#include "python/src/parts.hpp"

namespace btfield::python {

Provenance provenance_of(const ArrayPicture& picture, const std::string& source) {
    Provenance result;
    result.source = source;
    result.type = picture.type;
    result.picture_bytes = static_cast<std::uint64_t>(picture.image.values().size()) *
                           static_cast<std::uint64_t>(bytes_per_value(picture.type));
    result.software = "btfield " + std::string(version());
    std::vector<PlaneLimits> limits = plane_limits(picture.image);
    if (std::ranges::any_of(limits, [](PlaneLimits own) { return own.low || own.high; }))
        result.limits = std::move(limits);
    return result;
}

namespace {

/// Keeps what fit() noted why it chose.
void put_provenance(TextureModel& model, Provenance provenance) {
    provenance.reasons = std::move(model.provenance.reasons);
    model.provenance = std::move(provenance);
}

void add_options(nb::module_& module) {
    OptionsClass<BayesPrior>(module, "BayesPrior", "Normal-Wishart prior of the CAR estimate (theory 6.2).")
        .field("strength", &BayesPrior::strength, "In pixels.")
        .field("beta0", &BayesPrior::beta0,
               "Degrees of freedom of the prior on the noise covariance; above 1.");
    OptionsClass<MaOptions>(module, "MaOptions", "How moving averages are estimated (theory 9.2).")
        .field("threshold", &MaOptions::threshold, "In standard deviations of the plane above its mean.")
        .word("rule", &MaOptions::rule, "'p4' or 'p1'.");
    OptionsClass<FitOptions>(module, "FitOptions",
                             "What fit() takes besides the picture; all of it as keywords, too.")
        .word("model", &FitOptions::model, "'3d-car' or another of model_kinds().")
        .field("choose_model", &FitOptions::choose_model, "Choose it: kappa between 2D and 3D, BIC the rest.")
        .field("order", &FitOptions::order, "Of the neighbourhood, 1..8; 0: chosen by BIC.")
        .word("neighbourhood", &FitOptions::neighbourhood,
              "'symmetric', 'half', 'causal', 'unilateral', 'custom' (takes `offsets`); None: what suits the "
              "model.")
        .field("offsets", &FitOptions::offsets, "Of a custom neighbourhood: N of (row, column).")
        .field("correlated", &FitOptions::correlated,
               "N > 0: of order 8, the N offsets that are correlated most (theory 4.4).")
        .field("active", &FitOptions::active,
               "Of custom neighbourhoods, [offset][i][j] of 0 and 1 in one list.")
        .field("levels", &FitOptions::levels, "Of the pyramid; 0: as many as the picture determines.")
        .field("choose_levels", &FitOptions::choose_levels, "By BIC, from 1 to `levels`.")
        .field("factor", &FitOptions::factor, "Of the pyramid.")
        .word("estimator", &FitOptions::estimator, "'auto', 'ls' or 'ml'.")
        .word("noise", &FitOptions::noise, "Covariance of the noise: 'full' or 'diagonal'.")
        .word("gains", &FitOptions::gains, "Of levels: 'match' or 'none'.")
        .word("marginals", &FitOptions::marginals, "Histograms are kept: 'match', or not: 'none'.")
        .nested("prior", &FitOptions::prior, "BayesPrior.")
        .nested("moving_average", &FitOptions::moving_average, "MaOptions.");
}

/// An Analysis and what is known of its picture.
struct Analysed {
    Analysis analysis;
    Provenance provenance;
};
using PyAnalysis = Held<Analysed>;

void add_analysis_class(nb::module_& module) {
    nb::class_<PyAnalysis>(
        module, "Analysis",
        "A picture made ready for any number of fits, which share its planes, pyramids and lag\n"
        "covariances. Any number of threads may use one at a time.")
        .def(
            "__init__",
            [](PyAnalysis* self, PyDevice& device, const PictureObject& picture, const std::string& space,
               const std::vector<std::string>& names, const std::string& source) {
                ArrayPicture read = read_array(picture, "analyse a picture", space);
                read.image.set_names(names);
                new (self) PyAnalysis([&] {
                    return unlocked([&] {
                        Provenance provenance = provenance_of(read, source);
                        return Analysed{Analysis(*device, std::move(read.image)), std::move(provenance)};
                    });
                });
            },
            nb::arg("device"), nb::arg("picture"), nb::kw_only(), nb::arg("space") = "auto",
            nb::arg("names") = std::vector<std::string>(), nb::arg("source") = "", nb::keep_alive<1, 2>(),
            "picture: H x W x d of uint8, uint16 or float32. space, names, source: as fit().\n\nRaises "
            "InputError\n"
            "when the picture is empty or has NaN or infinity.")
        .def(
            "fit",
            [](PyAnalysis& self, const FitOptions* options, const nb::object& progress,
               const nb::kwargs& keywords) {
                FitOptions wanted = options_of(options, keywords);
                wanted.progress = stage_told(progress);
                TextureModel model = unlocked([&] { return self->analysis.fit(wanted); });
                put_provenance(model, self->provenance);
                return model;
            },
            nb::arg("options").none() = nb::none(), nb::kw_only(), nb::arg("progress").none() = nb::none(),
            nb::arg("keywords"), "Fits every level; as fit().")
        .def(
            "fit_all",
            [](PyAnalysis& self, const std::vector<FitOptions>& options) {
                std::vector<TextureModel> models = unlocked([&] { return self->analysis.fit_all(options); });
                for (TextureModel& model : models) put_provenance(model, self->provenance);
                return models;
            },
            nb::arg("options"),
            "fit() of each, in this order, on all cores and from one pass of lag covariances per "
            "level.\n\nRaises\n"
            "what the first of them that fails does.");
}

}  // namespace

void add_fit(nb::module_& module) {
    add_options(module);
    add_analysis_class(module);
    module.def("default_levels", &default_levels, nb::arg("size"), nb::arg("factor") = 2,
               "Levels that suit most pictures of this size (theory 2.4).");
    module.def(
        "fit",
        [](PyDevice& device, const PictureObject& picture, const FitOptions* options,
           const std::string& space, const std::vector<std::string>& names, const std::string& source,
           const nb::object& progress, const nb::kwargs& keywords) {
            FitOptions wanted = options_of(options, keywords);
            wanted.progress = stage_told(progress);
            ArrayPicture read = read_array(picture, "fit a model", space);
            read.image.set_names(names);
            return unlocked([&] {
                TextureModel model = fit(*device, read.image, wanted);
                put_provenance(model, provenance_of(read, source));
                return model;
            });
        },
        nb::arg("device"), nb::arg("picture"), nb::arg("options").none() = nb::none(), nb::kw_only(),
        nb::arg("space") = "auto", nb::arg("names") = std::vector<std::string>(), nb::arg("source") = "",
        nb::arg("progress").none() = nb::none(), nb::arg("keywords"),
        "Learns a texture model (theory 2 to 13).\n\n"
        "picture: H x W x d of uint8, uint16 (fractions of white) or float32 (as they are).\n"
        "options: FitOptions; its fields are keywords, too: fit(device, picture, model='2d-car', order=3).\n"
        "space: what the values are, 'srgb', 'linear', 'xyz' or 'unspecified'; 'auto': sRGB of three planes\n"
        "    of whole numbers, linear of three planes of floats, else unspecified.\n"
        "names: of the planes, none or one for each. source: what the model says it came from.\n"
        "progress: called with a stage's name and the seconds that it took; what it raises ends the fit.\n\n"
        "Deterministic, whatever the number of threads. Raises InputError when picture or options cannot "
        "give\n"
        "a model: a constant picture, NaN or infinity, a level smaller than the support.");
    module.def(
        "fit_car",
        [](const LagCovariance& statistic, const std::vector<Offset>& offsets, const std::string& noise,
           const BayesPrior* prior) {
            return fit_car(statistic, {NeighbourhoodKind::custom, offsets}, noise_form(noise),
                           prior != nullptr ? *prior : BayesPrior());
        },
        nb::arg("statistic"), nb::arg("offsets"), nb::arg("noise") = "full",
        nb::arg("prior").none() = nb::none(),
        "CAR estimate from lag covariances alone (theory 6.2). offsets: N of (row, column), before the "
        "centre\n"
        "in raster order; the statistic's box holds difference_box(offsets).\n\nRaises InputError when the\n"
        "offsets are not causal, a plane is constant, or the normal equations are singular.");
    module.def(
        "fit_sar",
        [](const LagCovariance& statistic, const std::vector<Offset>& offsets, const std::string& noise) {
            return fit_sar(statistic, {NeighbourhoodKind::custom, offsets}, noise_form(noise));
        },
        nb::arg("statistic"), nb::arg("offsets"), nb::arg("noise") = "full",
        "Least-squares MSAR estimate from lag covariances alone (theory 7.3); see certify().\n\nRaises\n"
        "InputError as fit_car(), but for the order of the offsets.");
}

}  // namespace btfield::python

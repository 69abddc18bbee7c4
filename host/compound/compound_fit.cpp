#include <algorithm>
#include <chrono>
#include <cmath>
#include <optional>
#include <string>
#include <utility>

#include "btfield/compound.hpp"
#include "btfield/error.hpp"
#include "btfield/image_io.hpp"
#include "host/base/stop.hpp"
#include "host/base/text.hpp"
#include "host/base/work_part.hpp"
#include "host/cl/device_impl.hpp"
#include "host/compound/conditional_mean.hpp"
#include "host/compound/control_growth.hpp"
#include "host/compound/regional_fit.hpp"

namespace btfield {

using namespace detail;

namespace {

using std::size_t;

constexpr int smallest_side = 16, largest_side = 16384;  // the roller's
constexpr int fewest_labelled = 32;

void check_picture(const Image& image) {
    const std::string asked = "fit a compound model to a picture of " + text_of(image.size());
    if (image.planes() < 1 || area(image.size()) == 0)
        throw InputError("fit a compound model", "the picture is empty", "give a picture with pixels");
    if (std::min(image.height(), image.width()) < smallest_side)
        throw InputError(asked, "a side is below " + counted(smallest_side, "pixel"),
                         "give a larger picture");
    if (std::max(image.height(), image.width()) > largest_side)
        throw InputError(asked, "a side is above " + counted(largest_side, "pixel"),
                         "give a part of the picture");
    bool varies = false;
    for (int p = 0; p < image.planes(); ++p)
        for (const float v : image.plane(p)) {
            if (!std::isfinite(v))
                throw InputError(asked, "plane " + std::to_string(p + 1) + " holds NaN or infinite values",
                                 "use finite values");
            varies = varies || v != image.plane(p).front();
        }
    if (!varies)
        throw InputError(asked, "it has one colour: there is nothing to model", "use a picture that varies");
}

Clustering control_of(const Image& image, const CompoundOptions& options) {
    if (!options.labels) {
        Clustering found = cluster(image, options.clusters);
        const std::vector<double> share = shares(found.field);
        if (*std::ranges::min_element(share) * static_cast<double>(found.field.labels.size()) < 1.5)
            throw InputError("fit a compound model with " + counted(found.field.regions, "region"),
                             "one of them has a single pixel", "use fewer regions");
        return found;
    }
    const ControlField& labels = *options.labels;
    check(labels);
    const std::string asked = "fit a compound model to these labels";
    if (labels.size != image.size())
        throw InputError(asked,
                         "they are " + text_of(labels.size) + ", the picture is " + text_of(image.size()),
                         "give one label to each pixel of the picture");
    const std::vector<double> present = shares(labels);
    for (size_t k = 0; k < present.size(); ++k)
        if (present[k] == 0.0)
            throw InputError(asked,
                             "there are " + counted(labels.regions, "region") + ", and label " +
                                 std::to_string(k) + " is nowhere",
                             "number the regions from 0 on without gaps");
    for (size_t k = 0; k < present.size(); ++k)
        if (present[k] * static_cast<double>(labels.labels.size()) < fewest_labelled)
            throw InputError(
                asked,
                "region " + std::to_string(k) + " has " +
                    std::to_string(std::lround(present[k] * static_cast<double>(labels.labels.size()))) +
                    " pixels, too few to have a mean and a variance",
                "give each region " + std::to_string(fewest_labelled) + " or more");
    return {labels, {}};
}

/// picture − mean → mean; share of the picture's variance that the mean takes.
double take_away(const Image& image, Image& mean) {
    double before = 0.0, after = 0.0;
    for (int p = 0; p < image.planes(); ++p) {
        const std::span<const float> y = image.plane(p);
        const std::span<float> m = mean.plane(p);
        double sum = 0.0, squares = 0.0, left = 0.0, left_squares = 0.0;
        for (size_t n = 0; n < y.size(); ++n) {
            m[n] = y[n] - m[n];
            const auto a = static_cast<double>(y[n]), b = static_cast<double>(m[n]);
            sum += a;
            squares += a * a;
            left += b;
            left_squares += b * b;
        }
        const auto count = static_cast<double>(y.size());
        before += squares / count - sum * sum / (count * count);
        after += left_squares / count - left * left / (count * count);
    }
    return 1.0 - after / before;
}

std::vector<CompoundRegion> regions_of(const Image& image, const ControlField& field,
                                       std::vector<std::vector<double>> weights) {
    const std::vector<std::vector<double>> colours = regional_means(image, field).regions;
    std::vector<CompoundRegion> regions(colours.size());
    for (const std::uint8_t label : field.labels) ++regions[label].pixels;
    for (size_t k = 0; k < regions.size(); ++k) {
        regions[k].share = static_cast<double>(regions[k].pixels) / static_cast<double>(field.labels.size());
        regions[k].colour = colours[k];
        regions[k].weights = std::move(weights[k]);
    }
    return regions;
}

}  // namespace

FitOptions CompoundOptions::local_defaults() {
    FitOptions local;
    local.model = ModelKind::ma3d;
    local.order = 5;
    return local;
}

CompoundModel fit_compound(Device& device, const Image& image, const CompoundOptions& options) {
    check_picture(image);
    auto start = std::chrono::steady_clock::now();
    const auto lap = [&](std::string_view stage) {
        const auto now = std::chrono::steady_clock::now();
        if (options.progress) options.progress(stage, std::chrono::duration<double>(now - start).count());
        start = now;
        stop_if_asked();
    };
    std::optional<Stage> stage(std::in_place, "control field");
    Clustering clustering = control_of(image, options);
    const ControlField& field = clustering.field;
    lap("control field");

    stage.emplace("conditional mean");
    MeanWeights weights = options.borders == Borders::conditional ? fit_conditional_mean(image, field)
                                                                  : regional_means(image, field);
    Image mean = conditional_mean(device.impl(), weights, field);
    mean.set_space(image.space());
    mean.set_names(image.names());
    CompoundModel model;
    model.size = image.size();
    model.planes = image.planes();
    model.space = image.space();
    model.names = image.names();
    model.plane_spaces = image.plane_spaces();
    model.borders = options.borders;
    model.mean = weights.mean;
    model.control = field;
    if (options.tile) {
        model.control = control_tile(device, field, mean, *options.tile);
        model.periodic = true;
    }
    model.explained = take_away(image, mean);
    model.regions = regions_of(image, field, std::move(weights.regions));
    lap("conditional mean");

    stage.emplace("regions");
    RegionalFit regional = fit_regions(device, image, mean, field, options.local, options.averages);
    for (size_t k = 0; k < model.regions.size(); ++k)
        model.regions[k].residual = std::move(regional.residuals[k]);
    lap("regions");
    model.provenance.software = "btfield " BTFIELD_VERSION;
    model.provenance.picture_bytes = static_cast<std::uint64_t>(image.values().size()) *
                                     static_cast<std::uint64_t>(bytes_per_value(model.provenance.type));
    if (!clustering.reason.empty()) model.provenance.reasons.push_back(clustering.reason);
    model.provenance.reasons.insert(model.provenance.reasons.end(), regional.reasons.begin(),
                                    regional.reasons.end());
    return model;
}

}  // namespace btfield

#include "host/cli/fit_verdict.hpp"

#include <algorithm>
#include <cmath>

#include "btfield/criteria.hpp"
#include "btfield/synthesis.hpp"
#include "host/cli/report.hpp"

namespace btfield::cli {
namespace {

constexpr int largest_judged = 512;
/// Two halves of one picture differ by as much.
constexpr double noticeable_lag_error = 0.06;

std::string percent(double share) {
    return number_text(std::round(1000.0 * share) / 10.0) + " %";
}

}  // namespace

FitVerdict judge(Device& device, const Image& picture, const TextureModel& model) {
    const Size size{std::min(picture.height(), largest_judged), std::min(picture.width(), largest_judged)};
    const Image part =
        picture.crop((picture.height() - size.height) / 2, (picture.width() - size.width) / 2, size);
    const Image texture = Synthesiser(device, model, size).synthesise(0);
    return {compare(part, texture).lag_covariance_error, structure_distance(part, texture)};
}

std::string verdict_text(const FitVerdict& verdict, const TextureModel& model, const std::string& picture) {
    const bool marginals = !model.marginals.empty();
    std::string text = std::string("It keeps ") + (model.planes == 1 ? "mean" : "means and colours") +
                       (marginals ? ", histograms" : "") + ", and correlations of pixels to " +
                       percent(verdict.lag_covariance_error) + " of the variance";
    if (verdict.lag_covariance_error > noticeable_lag_error)
        text +=
            ": --order 8 or --model 3d-msar may come nearer, --model auto --order auto --levels auto "
            "tries them all, in two to four times the time";
    text += ".\n";
    if (verdict.loses_shapes())
        text += "It loses shapes: structure distance " + number_text(verdict.structure_distance) +
                ", where 0.07 hardly shows. 'btfield compound fit " + picture +
                " -o MODEL.btfm' keeps them, in tens of kilobytes; 'btfield roll " + picture +
                " -o IMAGE --size 1024' lays the picture's own patches.\n";
    return text;
}

}  // namespace btfield::cli

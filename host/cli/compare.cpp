#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <memory>
#include <utility>
#include <vector>

#include "btfield/criteria.hpp"
#include "btfield/curves.hpp"
#include "btfield/image_io.hpp"
#include "host/base/file_output.hpp"
#include "host/cli/command.hpp"
#include "host/cli/command_text.hpp"
#include "host/cli/curve_plot.hpp"
#include "host/cli/options.hpp"
#include "host/cli/output_names.hpp"
#include "host/cli/picture_options.hpp"
#include "host/cli/report.hpp"
#include "host/cli/run_files.hpp"

namespace btfield::cli {
namespace {

struct CompareArguments {
    std::string reference, plot;
    std::vector<std::string> others;
    ReadOptions reading;
    bool overwrite = false, json = false;
};

/// One picture held against the reference.
struct Judgement {
    std::string name;
    Comparison comparison;
    std::vector<double> quantile_errors;
    double structure = 0.0;
    StatisticCurves curves;
};

Judgement judge(const CompareArguments& options, const Image& reference, const std::string& path) {
    const Image image = read_told(path, options.reading).image;
    warn_of_unlike_spaces(options.reference, reference, path, image);
    return {path, compare(reference, image), quantile_errors(reference, image),
            structure_distance(reference, image), statistic_curves(reference, image)};
}

Json pairs_json(const std::vector<std::array<double, 2>>& values) {
    Json list = Json::array();
    for (const auto& [a, b] : values) list.push_back(Json::array({number(a), number(b)}));
    return list;
}

Json judgement_json(const std::string& reference, const Judgement& of) {
    Json planes = Json::array();
    for (std::size_t i = 0; i < of.comparison.planes.size(); ++i) {
        const Comparison::Plane& plane = of.comparison.planes[i];
        const StatisticCurves::Plane& curves = of.curves.planes[i];
        Json entry;
        entry["mean"] = Json::array({number(plane.mean[0]), number(plane.mean[1])});
        entry["std"] = Json::array({number(plane.std[0]), number(plane.std[1])});
        entry["std_ratio"] = number(plane.std_ratio);
        entry["quantile_error"] = number(of.quantile_errors[i]);
        entry["covariance"] = pairs_json(curves.covariance);
        entry["spectrum"] = pairs_json(curves.spectrum);
        entry["histogram"] = {{"edges", curves.edges}, {"shares", pairs_json(curves.histogram)}};
        planes.push_back(std::move(entry));
    }
    Json lags = Json::array();
    for (const auto& [row, column] : of.curves.lags) lags.push_back(Json::array({row, column}));
    Json object;
    object["pictures"] = Json::array({reference, of.name});
    object["planes"] = std::move(planes);
    object["lag_covariance_error"] = number(of.comparison.lag_covariance_error);
    object["spectral_covariance_error"] = number(of.comparison.spectral_covariance_error);
    object["structure_distance"] = number(of.structure);
    object["lags"] = std::move(lags);
    object["frequencies"] = of.curves.frequencies;
    return object;
}

/// Correlations of both along rows and columns, mean over the planes that vary.
std::string lag_table(const StatisticCurves& curves) {
    std::vector<std::vector<std::string>> rows{
        {"pixels apart", "along rows A", "along rows B", "along columns A", "along columns B"}};
    const auto mean = [&](Offset lag, std::size_t which) {
        const auto s = static_cast<std::size_t>(std::find(curves.lags.begin(), curves.lags.end(), lag) -
                                                curves.lags.begin());
        double sum = 0.0;
        int count = 0;
        for (const StatisticCurves::Plane& plane : curves.planes) {
            const double own = plane.covariance[s][which] / plane.covariance.front()[which];
            if (!std::isfinite(own)) continue;
            sum += own;
            ++count;
        }
        return sum / count;
    };
    for (const auto& [row, column] : curves.lags) {
        if (row != 0 || column == 0 || (column & (column - 1)) != 0) continue;
        rows.push_back({std::to_string(column), number_text(mean({0, column}, 0)),
                        number_text(mean({0, column}, 1)), number_text(mean({column, 0}, 0)),
                        number_text(mean({column, 0}, 1))});
    }
    return rows.size() > 1 ? "correlation of pixels, mean over the planes\n" + table(rows, "r") : "";
}

std::string judgement_text(const Judgement& of) {
    std::vector<std::vector<std::string>> rows{
        {"plane", "mean A", "mean B", "std A", "std B", "std B/A", "quantile error"}};
    for (std::size_t i = 0; i < of.comparison.planes.size(); ++i) {
        const Comparison::Plane& plane = of.comparison.planes[i];
        rows.push_back({std::to_string(i), number_text(plane.mean[0]), number_text(plane.mean[1]),
                        number_text(plane.std[0]), number_text(plane.std[1]), number_text(plane.std_ratio),
                        number_text(of.quantile_errors[i])});
    }
    return table(rows, "r") + lag_table(of.curves) + "lag covariance error " +
           number_text(of.comparison.lag_covariance_error) + ", spectral covariance error " +
           number_text(of.comparison.spectral_covariance_error) +
           " of A's; quantile errors in A's standard deviations\nstructure distance " +
           number_text(of.structure) + " of A's standard deviations: how far the patches of both are apart\n";
}

/// Of several pictures, a row each.
std::string summary_text(const std::string& reference, const std::vector<Judgement>& judgements) {
    std::vector<std::vector<std::string>> rows{
        {"picture", "std B/A", "lag covariance", "spectral covariance", "quantiles", "structure"}};
    const auto mean = [](const auto& values, auto value) {
        double sum = 0.0;
        int count = 0;
        for (const auto& each : values) {
            if (!std::isfinite(value(each))) continue;
            sum += value(each);
            ++count;
        }
        return number_text(sum / count);
    };
    for (const Judgement& of : judgements)
        rows.push_back(
            {of.name, mean(of.comparison.planes, [](const auto& plane) { return plane.std_ratio; }),
             number_text(of.comparison.lag_covariance_error),
             number_text(of.comparison.spectral_covariance_error),
             mean(of.quantile_errors, [](double error) { return error; }), number_text(of.structure)});
    return "errors against " + reference + ", means over the planes\n" + table(rows, "lrrrrr");
}

void check_plot(const CompareArguments& options) {
    if (options.plot.empty()) return;
    RunFiles files(options.overwrite, options.json);
    files.reads(options.reference);
    for (const std::string& other : options.others) files.reads(other);
    files.writes_text(options.plot);
    const std::string extension = lower_extension(options.plot);
    if (extension != ".svg" && extension != ".html" && extension != ".htm")
        throw UsageError("--plot: '" + options.plot + "' ends neither in .svg nor in .html");
    detail::check_output(options.plot, "write '" + options.plot + "'");
}

void write_plot(const CompareArguments& options, const std::vector<Judgement>& judgements) {
    if (options.plot.empty()) return;
    std::vector<PlottedPair> pairs;
    pairs.reserve(judgements.size());
    for (const Judgement& of : judgements) pairs.push_back({{options.reference, of.name}, of.curves});
    const bool svg = lower_extension(options.plot) == ".svg";
    detail::write_file(options.plot, svg ? curves_svg(pairs) : curves_page(pairs),
                       "write '" + options.plot + "'");
}

void run(const CompareArguments& options) {
    check_plot(options);
    const Image reference = read_told(options.reference, options.reading).image;
    std::vector<Judgement> judgements;
    judgements.reserve(options.others.size());
    for (const std::string& path : options.others) judgements.push_back(judge(options, reference, path));
    write_plot(options, judgements);
    Json objects = Json::array();
    for (const Judgement& of : judgements) objects.push_back(judgement_json(options.reference, of));
    std::string text = judgements.size() == 1 ? judgement_text(judgements.front())
                                              : summary_text(options.reference, judgements);
    if (!options.plot.empty()) text += "wrote " + options.plot + "\n";
    emit_answers(options.json, objects, "comparisons", text);
}

}  // namespace

void add_compare(CLI::App& app, Action& action) {
    CLI::App* command =
        app.add_subcommand("compare", "hold the statistics of pictures against those of another");
    const auto options = std::make_shared<CompareArguments>();
    command->add_option("A", options->reference, "reference picture")->required()->type_name("");
    command->add_option("B", options->others, "pictures to judge; their sizes may differ")
        ->required()
        ->type_name("");
    command
        ->add_option("--plot", options->plot,
                     "draw covariances by lag, spectra and histograms of both; ends in .svg or .html")
        ->type_name("FILE");
    add_reading(*command, options->reading);
    add_overwrite(*command, options->overwrite);
    add_json(*command, options->json);
    set_guide(*command, {.usual = {{"btfield compare cork.png cork-4x.png"}},
                         .more = {{"btfield compare cork.png cork-4x.png --plot statistics.html"},
                                  {"btfield compare cork.png textures/*.png", "a row each"}}});
    command->callback([options, &action] { action = [options] { run(*options); }; });
}

}  // namespace btfield::cli

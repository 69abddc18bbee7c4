#include <memory>

#include "btfield/criteria.hpp"
#include "btfield/image_io.hpp"
#include "host/cli/command.hpp"
#include "host/cli/command_text.hpp"
#include "host/cli/options.hpp"
#include "host/cli/picture_options.hpp"
#include "host/cli/report.hpp"

namespace btfield::cli {
namespace {

struct CompareArguments {
    std::string a, b;
    ReadOptions reading;
    bool json = false;
};

void report_json(const Comparison& comparison, const std::vector<double>& quantile_errors, double structure) {
    Json planes = Json::array();
    for (std::size_t i = 0; i < comparison.planes.size(); ++i) {
        const Comparison::Plane& plane = comparison.planes[i];
        Json entry;
        entry["mean"] = Json::array({number(plane.mean[0]), number(plane.mean[1])});
        entry["std"] = Json::array({number(plane.std[0]), number(plane.std[1])});
        entry["std_ratio"] = number(plane.std_ratio);
        entry["quantile_error"] = number(quantile_errors[i]);
        planes.push_back(std::move(entry));
    }
    Json object;
    object["planes"] = std::move(planes);
    object["lag_covariance_error"] = number(comparison.lag_covariance_error);
    object["spectral_covariance_error"] = number(comparison.spectral_covariance_error);
    object["structure_distance"] = number(structure);
    emit_json(object);
}

void report_text(const Comparison& comparison, const std::vector<double>& quantile_errors, double structure) {
    std::vector<std::vector<std::string>> rows{
        {"plane", "mean A", "mean B", "std A", "std B", "std B/A", "quantile error"}};
    for (std::size_t i = 0; i < comparison.planes.size(); ++i) {
        const Comparison::Plane& plane = comparison.planes[i];
        rows.push_back({std::to_string(i), number_text(plane.mean[0]), number_text(plane.mean[1]),
                        number_text(plane.std[0]), number_text(plane.std[1]), number_text(plane.std_ratio),
                        number_text(quantile_errors[i])});
    }
    emit_text(table(rows, "r") + "lag covariance error " + number_text(comparison.lag_covariance_error) +
              ", spectral covariance error " + number_text(comparison.spectral_covariance_error) +
              " of A's; quantile errors in A's standard deviations\nstructure distance " +
              number_text(structure) +
              " of A's standard deviations: how far the patches of both are apart\n");
}

void run(const CompareArguments& options) {
    const Image a = read_told(options.a, options.reading).image;
    const Image b = read_told(options.b, options.reading).image;
    warn_of_unlike_spaces(options.a, a, options.b, b);
    const Comparison comparison = compare(a, b);
    const std::vector<double> errors = quantile_errors(a, b);
    const double structure = structure_distance(a, b);
    if (options.json) {
        report_json(comparison, errors, structure);
    } else {
        report_text(comparison, errors, structure);
    }
}

}  // namespace

void add_compare(CLI::App& app, Action& action) {
    CLI::App* command =
        app.add_subcommand("compare", "hold the statistics of a picture against those of another");
    const auto options = std::make_shared<CompareArguments>();
    command->add_option("A", options->a, "reference picture")->required()->type_name("");
    command->add_option("B", options->b, "picture to judge; its size may differ")->required()->type_name("");
    add_reading(*command, options->reading);
    add_json(*command, options->json);
    set_guide(*command, {{{"btfield compare cork.png cork-4x.png"}}});
    command->callback([options, &action] { action = [options] { run(*options); }; });
}

}  // namespace btfield::cli

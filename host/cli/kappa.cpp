#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "btfield/criteria.hpp"
#include "btfield/image_io.hpp"
#include "host/cli/command.hpp"
#include "host/cli/command_text.hpp"
#include "host/cli/options.hpp"
#include "host/cli/picture_options.hpp"
#include "host/cli/report.hpp"

namespace btfield::cli {
namespace {

struct KappaArguments {
    std::vector<std::string> images;
    double cmax = 256.0;
    std::optional<double> white;
    ReadOptions reading;
    bool json = false;
};

struct Judged {
    std::string image;
    bool hdr = false;
    Kappa kappa;
    int planes = 0;
};

const char* verdict(const Kappa& kappa) {
    return kappa.two_dimensional() ? "2d" : "3d";
}

Judged judge(const std::string& path, const KappaArguments& options) {
    const Picture picture = read_told(path, options.reading);
    Judged result;
    result.image = path;
    result.hdr = is_hdr(picture);
    result.planes = picture.image.planes();
    result.kappa = kappa(picture.image, options.cmax, white_level(picture, options.white));
    return result;
}

void report_json(const std::vector<Judged>& judged) {
    Json images = Json::array();
    for (const Judged& one : judged) {
        const auto n = static_cast<std::size_t>(one.planes);
        Json covariance = Json::array();
        for (std::size_t i = 0; i < n; ++i) {
            Json row = Json::array();
            for (std::size_t j = 0; j < n; ++j) row.push_back(number(one.kappa.covariance[n * i + j]));
            covariance.push_back(std::move(row));
        }
        Json entry;
        entry["image"] = one.image;
        entry["kappa"] = number(one.kappa.kappa);
        entry["cmax"] = number(one.kappa.cmax);
        entry["white"] = number(one.kappa.white);
        entry["hdr"] = one.hdr;
        entry["verdict"] = verdict(one.kappa);
        entry["white_at_threshold"] = number(one.kappa.white_at_threshold);
        entry["covariance"] = std::move(covariance);
        images.push_back(std::move(entry));
    }
    Json object;
    object["images"] = std::move(images);
    emit_json(object);
}

void report_text(const std::vector<Judged>& judged) {
    std::string text;
    for (const Judged& one : judged) {
        text += one.image + ": kappa(" + number_text(one.kappa.cmax) + ") = " + number_text(one.kappa.kappa) +
                ", verdict " + verdict(one.kappa) + " (threshold " + number_text(Kappa::threshold) + ")\n";
        if (one.planes == 1) text += "  of one plane, 2d and 3d models are the same\n";
        if (one.hdr)
            text += "  white level " + number_text(one.kappa.white) +
                    "; the verdict is 3d for white levels below " +
                    number_text(one.kappa.white_at_threshold) + ", 2d from there on\n";
        const auto n = static_cast<std::size_t>(one.planes);
        std::vector<std::vector<std::string>> rows{{"  covariance"}};
        for (std::size_t j = 0; j < n; ++j) rows[0].push_back("plane " + std::to_string(j));
        for (std::size_t i = 0; i < n; ++i) {
            rows.push_back({"  plane " + std::to_string(i)});
            for (std::size_t j = 0; j < n; ++j)
                rows.back().push_back(number_text(one.kappa.covariance[n * i + j]));
        }
        text += table(rows, "lr");
    }
    emit_text(text);
}

void run(const KappaArguments& options) {
    std::vector<Judged> judged;
    judged.reserve(options.images.size());
    for (const std::string& path : options.images) judged.push_back(judge(path, options));
    if (options.json) {
        report_json(judged);
    } else {
        report_text(judged);
    }
}

}  // namespace

void add_kappa(CLI::App& app, Action& action) {
    CLI::App* command =
        app.add_subcommand("kappa", "tell whether 2D models suffice for the colours of pictures");
    const auto options = std::make_shared<KappaArguments>();
    command->add_option("IMAGE", options->images, "pictures")->required()->type_name("");
    add_positive(*command, "--cmax", options->cmax, "largest value of a plane, c in kappa(c) (default: 256)");
    add_white(*command, options->white);
    add_reading(*command, options->reading);
    add_json(*command, options->json);
    set_guide(*command,
              {.usual = {{"btfield kappa cork.png bark.png"}},
               .more = {{"btfield kappa material.exr --white 12.5"}},
               .notes = {"kappa = det(spectral covariance) / c^n in units where white is c; 2D models on "
                         "decorrelated planes suffice when it is at most 3."}});
    command->callback([options, &action] { action = [options] { run(*options); }; });
}

}  // namespace btfield::cli

#include "btfield/fit.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <numbers>
#include <string>
#include <utility>

#include "btfield/error.hpp"
#include "btfield/image_io.hpp"
#include "btfield/pyramid.hpp"
#include "host/examination.hpp"
#include "host/lag_products.hpp"
#include "host/least_squares.hpp"
#include "host/level_gains.hpp"
#include "host/spectral_density.hpp"

namespace btfield {
namespace {

using Eigen::MatrixXd;
using std::size_t;

/// Adds the time that passes between stages to the caller's report.
class Stopwatch {
  public:
    explicit Stopwatch(const FitOptions& options) : report_(options.progress), start_(Clock::now()) {}
    void lap(std::string_view stage) {
        const Clock::time_point now = Clock::now();
        if (report_) report_(stage, std::chrono::duration<double>(now - start_).count());
        start_ = Clock::now();
    }

  private:
    using Clock = std::chrono::steady_clock;
    const std::function<void(std::string_view, double)>& report_;
    Clock::time_point start_;
};

std::string text_of(Size size) {
    return std::to_string(size.width) + " x " + std::to_string(size.height);
}

/// Rows × columns that the support spans, the centre included.
Size extent(const std::vector<Offset>& offsets) {
    const Offset box = difference_box(offsets);
    return {box.row + 1, box.column + 1};
}

/// A level can be fitted when the support fits into it and when it has more pixels than an equation has
/// unknowns.
bool supports(Size level, const std::vector<Offset>& offsets, int planes) {
    const Size needed = extent(offsets);
    return level.height >= needed.height && level.width >= needed.width &&
           area(level) > offsets.size() * static_cast<size_t>(planes);
}

/// A level determines its model well when it has some twenty pixels to each unknown of an equation.
bool determines(Size level, const std::vector<Offset>& offsets, int planes) {
    return supports(level, offsets, planes) &&
           area(level) >= 20 * offsets.size() * static_cast<size_t>(planes);
}

std::vector<Offset> support_of(const FitOptions& options) {
    if (options.neighbourhood == NeighbourhoodKind::custom) return options.offsets;
    return neighbourhood(options.order, options.neighbourhood);
}

void check_levels(const std::vector<Size>& sizes, const std::vector<Offset>& offsets, int planes) {
    size_t fit = 0;
    while (fit < sizes.size() && supports(sizes[fit], offsets, planes)) ++fit;
    if (fit == sizes.size()) return;
    const Size needed = extent(offsets);
    throw InputError(
        "fit " + std::to_string(sizes.size()) + " levels to a picture of " + text_of(sizes.front()),
        "level " + std::to_string(fit + 1) + " has " + text_of(sizes[fit]) +
            " pixels, too few for a support of " + std::to_string(offsets.size()) + " offsets that spans " +
            text_of(needed),
        fit == 0 ? std::string("use a lower order or a larger picture")
                 : "use at most " + std::to_string(fit) + (fit == 1 ? " level" : " levels") +
                       ", or a lower order");
}

void check_variation(const Image& image) {
    for (int p = 0; p < image.planes(); ++p) {
        const std::span<const float> plane = image.plane(p);
        const bool constant =
            std::all_of(plane.begin(), plane.end(), [&](float v) { return v == plane.front(); });
        if (constant) {
            throw InputError("fit a model to a picture of " + text_of(image.size()),
                             "plane " + std::to_string(p + 1) + " is constant",
                             "remove that plane or use a picture that varies");
        }
        if (!std::all_of(plane.begin(), plane.end(), [](float v) { return std::isfinite(v); })) {
            throw InputError("fit a model to a picture of " + text_of(image.size()),
                             "plane " + std::to_string(p + 1) + " holds NaN or infinite values",
                             "use finite values");
        }
    }
}

/// Whittle log-likelihood per pixel: −½ (d ln 2π + ln det Σ − 2 mean_t ln |det Λ_t| + tr(Σ⁻¹ Ê)), Ê the
/// covariance of the prediction errors on the picture's torus.
double log_likelihood(const LinearField& field, const LagCovariance& statistic, double mean_log_determinant) {
    const Eigen::LLT<MatrixXd> factor(noise_matrix(field));
    const MatrixXd lower = factor.matrixL();
    const double log_noise = 2.0 * lower.diagonal().array().log().sum();
    const double quadratic = factor.solve(residual_covariance(field, statistic)).trace();
    return -0.5 * (field.planes * std::log(2.0 * std::numbers::pi) + log_noise - 2.0 * mean_log_determinant +
                   quadratic);
}

Model estimate(const LagCovariance& statistic, const FitOptions& options,
               const std::vector<Offset>& offsets) {
    if (options.model == ModelKind::msar3d) {
        return fit_sar(statistic, options.neighbourhood, offsets, options.active, options.noise);
    }
    return fit_car(statistic, options.neighbourhood, offsets, options.active, options.noise, options.prior);
}

/// \param grids per level, side of the frequency grid that resolves its spectrum
void set_gains(TextureModel& model, const Image& image, const std::vector<int>& grids) {
    const std::vector<Offset> lags = probe_lags(image.size());
    const std::vector<double> data = covariances_at(image, lags);
    std::vector<std::vector<double>> seen;
    for (size_t k = 0; k < model.levels.size(); ++k) {
        const int depth = static_cast<int>(k);
        const LevelModel& level = model.levels[k];
        // The level's own torus, as far as that matters: beyond the grid that resolves the spectrum sums
        // change no more.
        const Size torus{std::min(level.size.height, grids[k]), std::min(level.size.width, grids[k])};
        const LagCovariance own =
            model_covariance(linear_field(level.model), torus, expansion_box(model.factor, depth, lags));
        seen.push_back(expanded_covariance(own, model.factor, depth, lags));
    }
    const std::vector<double> gains = match_gains(seen, data, model.planes);
    for (size_t k = 0; k < gains.size(); ++k) model.levels[k].gain = gains[k];
}

TextureModel fit_levels(Device& device, const Image& image, const FitOptions& options,
                        const std::vector<Offset>& offsets, const std::vector<Size>& sizes) {
    const int level_count = static_cast<int>(sizes.size());
    Stopwatch watch(options);
    std::vector<Image> coarser;
    if (level_count > 1) coarser = decompose(device, image, level_count, options.factor);
    const auto level_image = [&](size_t k) -> const Image& { return level_count > 1 ? coarser[k] : image; };
    watch.lap("pyramid");

    const Offset box = difference_box(offsets);
    std::vector<LagCovariance> statistics;
    for (size_t k = 0; k < sizes.size(); ++k) statistics.push_back(lag_covariance(level_image(k), box));
    watch.lap("lag covariances");

    TextureModel model;
    model.kind = options.model;
    model.size = image.size();
    model.planes = image.planes();
    model.space = image.space();
    model.factor = options.factor;
    model.noise = options.noise;
    model.provenance.software = "btfield " BTFIELD_VERSION;
    model.provenance.picture_bytes = static_cast<std::uint64_t>(image.values().size()) *
                                     static_cast<std::uint64_t>(bytes_per_value(model.provenance.type));
    for (size_t k = 0; k < sizes.size(); ++k) {
        LevelModel level;
        level.size = sizes[k];
        level.model = estimate(statistics[k], options, offsets);
        model.levels.push_back(std::move(level));
    }
    model.mean = plane_means(image);
    watch.lap("fit");

    std::vector<int> grids;
    for (size_t k = 0; k < sizes.size(); ++k) {
        LevelModel& level = model.levels[k];
        const LinearField& field = linear_field(level.model);
        Examination examination = examine(field, statistics[k]);
        grids.push_back(examination.grid);
        level.certificate = std::move(examination.certificate);
        level.log_likelihood = level.certificate.valid
                                   ? log_likelihood(field, statistics[k], examination.log_determinant)
                                   : std::numeric_limits<double>::quiet_NaN();
    }
    watch.lap("certificate");
    if (options.gains == GainMode::match && is_valid(model)) set_gains(model, image, grids);
    watch.lap("gains");
    return model;
}

}  // namespace

std::string_view name(GainMode mode) {
    return mode == GainMode::match ? "match" : "none";
}

int default_levels(Size size, int factor) {
    constexpr int most = 5, coarsest = 32;
    if (factor < 2) return 1;
    int levels = 1;
    for (int side = std::min(size.height, size.width) / factor; levels < most && side >= coarsest;
         side /= factor) {
        ++levels;
    }
    return levels;
}

TextureModel fit(Device& device, const Image& image, const FitOptions& options) {
    if (image.planes() < 1 || area(image.size()) == 0) {
        throw InputError("fit a model", "the picture is empty", "give a picture with at least one pixel");
    }
    if (options.levels < 0) {
        throw InputError("fit " + std::to_string(options.levels) + " levels", "there is at least one level",
                         "use 1 or more, or 0 for the default of the picture's size");
    }
    const std::vector<Offset> offsets = support_of(options);
    const bool free = options.levels == 0;
    const int most = free ? default_levels(image.size(), options.factor) : options.levels;
    std::vector<Size> sizes = pyramid_sizes(image.size(), most, options.factor);
    while (free && sizes.size() > 1 && !determines(sizes.back(), offsets, image.planes())) sizes.pop_back();
    check_levels(sizes, offsets, image.planes());
    check_variation(image);

    TextureModel model = fit_levels(device, image, options, offsets, sizes);
    if (free && options.model == ModelKind::car3d) {
        while (!is_valid(model) && sizes.size() > 1) {
            sizes.pop_back();
            TextureModel fewer = fit_levels(device, image, options, offsets, sizes);
            if (is_valid(fewer)) return fewer;
        }
    }
    return model;
}

}  // namespace btfield

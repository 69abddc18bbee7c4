#include "btfield/fit.hpp"

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <map>
#include <mutex>
#include <optional>
#include <string>
#include <utility>

#include "btfield/error.hpp"
#include "btfield/image_io.hpp"
#include "btfield/pyramid.hpp"
#include "host/analysis/expansion.hpp"
#include "host/analysis/lag_products.hpp"
#include "host/analysis/marginal_moments.hpp"
#include "host/base/parallel.hpp"
#include "host/base/stop.hpp"
#include "host/base/text.hpp"
#include "host/base/work_part.hpp"
#include "host/fit/analysed_picture.hpp"
#include "host/fit/correlated_support.hpp"
#include "host/fit/fit_names.hpp"
#include "host/fit/level_fit.hpp"
#include "host/fit/level_gains.hpp"
#include "host/fit/selection.hpp"
#include "host/spectrum/spectral_density.hpp"

namespace btfield {

using namespace detail;

namespace {

using std::size_t;

/// Of what is left of a choice, a fit's: how many there will be depends on what is found.
constexpr double share_of_choice = 0.12;

/// Adds up the time that passes in each stage, for the caller's report.
class Stopwatch {
  public:
    explicit Stopwatch(const FitOptions& options) : report_(options.progress), start_(Clock::now()) {}
    void lap(std::string_view stage) { report(stage, split()); }
    /// Seconds since the last lap or split.
    double split() {
        const Clock::time_point before = std::exchange(start_, Clock::now());
        return std::chrono::duration<double>(start_ - before).count();
    }
    void report(std::string_view stage, double seconds) {
        stop_if_asked();
        if (report_) report_(stage, seconds);
    }

  private:
    using Clock = std::chrono::steady_clock;
    const std::function<void(std::string_view, double)>& report_;
    Clock::time_point start_;
};

/// Rows × columns that the support spans, the centre included.
Size extent(const std::vector<Offset>& offsets) {
    const Offset box = difference_box(offsets);
    return {box.row + 1, box.column + 1};
}

size_t pixels_of_levels(Size size, int levels, int factor) {
    size_t pixels = 0;
    for (const Size level : pyramid_sizes(size, levels, factor)) pixels += area(level);
    return pixels;
}

/// What a support asks of a level.
struct Demand {
    Size extent;
    size_t offsets = 0;
    size_t unknowns = 0;  ///< of an equation
};

/// A level can be fitted when the support fits into it and when it has more pixels than an equation has
/// unknowns.
bool supports(Size level, const Demand& demand) {
    return level.height >= demand.extent.height && level.width >= demand.extent.width &&
           area(level) > demand.unknowns;
}

/// A level determines its model well when it has some twenty pixels to each unknown of an equation.
bool determines(Size level, const Demand& demand) {
    return supports(level, demand) && area(level) >= 20 * demand.unknowns;
}

void check_levels(const std::vector<Size>& sizes, const Demand& demand) {
    size_t fit = 0;
    while (fit < sizes.size() && supports(sizes[fit], demand)) ++fit;
    if (fit == sizes.size()) return;
    throw InputError("fit " + counted(sizes.size(), "level") + " to a picture of " + text_of(sizes.front()),
                     "level " + std::to_string(fit + 1) + " has " + text_of(sizes[fit]) +
                         " pixels, too few for a support of " + counted(demand.offsets, "offset") +
                         " that spans " + text_of(demand.extent),
                     fit == 0 ? std::string("use a lower order or a larger picture")
                              : "use at most " + counted(fit, "level") + ", or a lower order");
}

void check_finite(const Image& image) {
    if (image.planes() < 1 || area(image.size()) == 0) {
        throw InputError("fit a model", "the picture is empty", "give a picture with at least one pixel");
    }
    for (int p = 0; p < image.planes(); ++p) {
        const std::span<const float> plane = image.plane(p);
        if (!std::all_of(plane.begin(), plane.end(), [](float v) { return std::isfinite(v); })) {
            throw InputError("fit a model to a picture of " + text_of(image.size()),
                             "plane " + std::to_string(p + 1) + " holds NaN or infinite values",
                             "use finite values");
        }
    }
}

/// Covariances of the modelled planes as they show in the picture's planes: mapped planes count with the
/// deviation that their marginals give them, then the basis is undone.
std::vector<double> in_picture(const TextureModel& model, std::vector<double> covariances) {
    if (model.basis.planes == 0) return covariances;
    if (!model.marginals.empty()) {
        std::vector<double> deviations;
        for (const Marginal& marginal : model.marginals) {
            const auto knots = static_cast<int>(marginal.values.size());
            deviations.push_back(std::sqrt(mapped_moments(marginal, hat_moments(knots, 1.0)).variance));
        }
        const size_t r = deviations.size();
        for (size_t n = 0; n < covariances.size(); ++n)
            covariances[n] *= deviations[n / r % r] * deviations[n % r];
    }
    return turned_back(model.basis, covariances);
}

/// Lag covariances of each level's field, as far as probe lags of the picture see them.
/// \param grids per level, side of the frequency grid that resolves its spectrum
std::vector<LagCovariance> level_fields(const TextureModel& model, const std::vector<int>& grids) {
    const std::vector<Offset> lags = probe_lags(model.size);
    std::vector<LagCovariance> fields(model.levels.size());
    for_each_block(static_cast<int>(fields.size()), [&](int depth) {
        const auto k = static_cast<size_t>(depth);
        const LevelModel& level = model.levels[k];
        // The level's own torus, as far as that matters: beyond the grid that resolves the spectrum sums
        // change no more.
        const Size torus{std::min(level.size.height, grids[k]), std::min(level.size.width, grids[k])};
        fields[k] =
            level_covariance(level, torus, expansion_box(model.factor, depth, lags), model.factor, depth);
    });
    return fields;
}

/// \param fields of model's levels
void set_gains(TextureModel& model, AnalysedPicture& picture, const std::vector<LagCovariance>& fields) {
    const std::vector<Offset> lags = probe_lags(model.size);
    std::vector<std::vector<double>> seen;
    for (size_t k = 0; k < fields.size(); ++k) {
        seen.push_back(
            in_picture(model, expanded_covariance(fields[k], model.factor, static_cast<int>(k), lags)));
    }
    const std::vector<double> gains =
        match_gains(seen, in_picture(model, picture.probe_covariances()), model.planes);
    for (size_t k = 0; k < gains.size(); ++k) model.levels[k].gain = gains[k];
}

/// See TextureModel::whitening.
/// \param fields of model's levels
void set_whitening(TextureModel& model, const std::vector<LagCovariance>& fields) {
    const std::array<Offset, 1> zero = {Offset{}};
    const int r = model.basis.rank;
    Eigen::MatrixXd sum = Eigen::MatrixXd::Zero(r, r);
    for (size_t k = 0; k < fields.size(); ++k) {
        const std::vector<double> seen =
            expanded_covariance(fields[k], model.factor, static_cast<int>(k), zero);
        const double gain = model.levels[k].gain;
        sum += gain * gain * Eigen::Map<const Eigen::MatrixXd>(seen.data(), r, r);
    }
    const Eigen::MatrixXd whitening = inverse_symmetric_root(0.5 * (sum + sum.transpose()));
    model.whitening.assign(whitening.data(), whitening.data() + whitening.size());
}

}  // namespace

std::string_view name(GainMode mode) {
    return word_of(mode);
}

std::string_view name(MarginalMode mode) {
    return word_of(mode);
}

std::string_view name(EstimatorChoice choice) {
    return word_of(choice);
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

class [[gnu::visibility("hidden")]] Analysis::Impl {
  public:
    Impl(Device & device, Image image) : device_(&device), image_(std::move(image)) {
        check_finite(image_);
    }

    [[nodiscard]] const Image& image() const {
        return image_;
    }

    /// Settles what the options leave to be chosen, then fits.
    /// \param box lags that other fits to come will ask for
    [[nodiscard]] TextureModel fit(const FitOptions& options, Offset box) {
        if (!leaves_choices(options)) return fit(options, FitDepth::complete, box);
        std::optional<Stage> choosing(std::in_place, "choice");
        const Choices choices = choose(options, {&image_,
                                                 [&](const FitOptions& settled) -> AnalysedPicture& {
                                                     return picture(planes_of(settled));
                                                 },
                                                 [&](const FitOptions& settled, FitDepth depth) {
                                                     WorkPart part(share_of_choice * (1.0 - work_counted()));
                                                     TextureModel model = fit(settled, depth, box);
                                                     part.done(1.0);
                                                     return model;
                                                 }});
        choosing.reset();
        TextureModel model = fit(choices.options, FitDepth::complete, box);
        model.provenance.reasons.insert(model.provenance.reasons.begin(), choices.reasons.begin(),
                                        choices.reasons.end());
        return model;
    }

    /// \param options leave nothing to be chosen
    [[nodiscard]] TextureModel fit(const FitOptions& options, FitDepth depth, Offset box) {
        if (options.levels < 0) {
            throw InputError("fit " + counted(options.levels, "level"), "there is at least one level",
                             "use 1 or more, or 0 for the default of the picture's size");
        }
        const Support support = support_of(options);
        const Offset own = difference_box(support.offsets);
        box = {std::max(box.row, own.row), std::max(box.column, own.column)};
        Stopwatch watch(options);
        const AnalysedPlanes kind = planes_of(options);
        AnalysedPicture& planes = told_picture(kind);
        watch.lap("planes");

        const int equation_planes = is_2d(options.model) ? 1 : planes.image().planes();
        const bool free = options.levels == 0;
        const int most = free ? default_levels(image_.size(), options.factor) : options.levels;
        std::vector<Size> sizes = pyramid_sizes(image_.size(), most, options.factor);
        const size_t offsets = offset_count(support, options);
        const Demand demand{extent(support.offsets), offsets, offsets * static_cast<size_t>(equation_planes)};
        while (free && sizes.size() > 1 && !determines(sizes.back(), demand)) sizes.pop_back();
        check_levels(sizes, demand);

        TextureModel model =
            fit_levels(planes, kind, options, support, box, static_cast<int>(sizes.size()), depth, watch);
        if (free && family(options.model) == Family::car) {
            while (!is_valid(model) && sizes.size() > 1) {
                sizes.pop_back();
                TextureModel fewer = fit_levels(planes, kind, options, support, box,
                                                static_cast<int>(sizes.size()), depth, watch);
                if (is_valid(fewer)) return fewer;
            }
        }
        return model;
    }

  private:
    [[nodiscard]] static AnalysedPlanes planes_of(const FitOptions& options) {
        if (options.marginals == MarginalMode::match) return AnalysedPlanes::gaussian;
        return is_2d(options.model) ? AnalysedPlanes::klt : AnalysedPlanes::picture;
    }

    AnalysedPicture& told_picture(AnalysedPlanes kind) {
        const Stage stage("planes");
        return picture(kind);
    }
    AnalysedPicture& picture(AnalysedPlanes kind) {
        const std::lock_guard lock(mutex_);
        const auto found = pictures_.find(kind);
        if (found != pictures_.end()) return found->second;
        if (kind == AnalysedPlanes::picture) {
            varying_ = varying_planes(image_);
            return pictures_
                .try_emplace(kind, *device_, varying_.planes == 0 ? image_ : to_eigenplanes(varying_, image_))
                .first->second;
        }
        if (basis_.planes == 0) {
            const WorkPart part(0.4);
            basis_ = spectral_basis(image_);
        }
        Image eigenplanes = to_eigenplanes(basis_, image_);
        if (kind == AnalysedPlanes::gaussian) {
            const WorkPart part(0.5);
            GaussianPlanes gaussian = gaussianise(eigenplanes);
            marginals_ = std::move(gaussian.marginals);
            eigenplanes = std::move(gaussian.planes);
        }
        return pictures_.try_emplace(kind, *device_, std::move(eigenplanes)).first->second;
    }

    TextureModel fit_levels(AnalysedPicture & planes, AnalysedPlanes kind, const FitOptions& options,
                            const Support& support, Offset box, int count, FitDepth depth, Stopwatch& watch) {
        TextureModel model;
        model.kind = options.model;
        model.size = image_.size();
        model.planes = image_.planes();
        model.space = image_.space();
        model.names = image_.names();
        model.plane_spaces = image_.plane_spaces();
        model.factor = options.factor;
        model.noise = options.noise;
        model.provenance.software = "btfield " BTFIELD_VERSION;
        model.provenance.picture_bytes = static_cast<std::uint64_t>(image_.values().size()) *
                                         static_cast<std::uint64_t>(bytes_per_value(model.provenance.type));
        model.basis = kind == AnalysedPlanes::picture ? varying_ : basis_;
        if (kind == AnalysedPlanes::gaussian) model.marginals = marginals_;
        model.mean = model.basis.planes == 0 ? plane_means(image_) : model.basis.mean;

        std::optional<Stage> stage(std::in_place, "pyramid");
        static_cast<void>(planes.level(options.factor, count, 0));
        watch.lap("pyramid");
        struct Timed {
            FittedLevel level;
            double statistic = 0.0, fit = 0.0;
        };
        std::vector<Timed> fits(static_cast<size_t>(count));
        stage.emplace("lag covariances");
        const double all = static_cast<double>(pixels_of_levels(image_.size(), count, options.factor));
        for (int k = 0; k < count; ++k) {
            AnalysedLevel& level = planes.level(options.factor, count, k);
            WorkPart part(static_cast<double>(area(level.image().size())) / all);
            static_cast<void>(level.statistic(box));
            fits[static_cast<size_t>(k)].statistic = watch.split();
            part.done(1.0);
        }
        stage.emplace("fit");
        for_each_part(count, [&](int k) {
            Timed& own = fits[static_cast<size_t>(k)];
            Stopwatch alone(options);
            own.level = fit_level(planes.level(options.factor, count, k), options, support);
            own.fit = alone.split();
        });
        const double together = watch.split();
        double apart = 0.0;
        for (const Timed& own : fits) apart += own.fit;
        std::vector<int> grids;
        std::vector<double> weakest;
        for (auto& [fitted, statistic, fit] : fits) {
            watch.report("lag covariances", statistic);
            watch.report("fit", apart > 0.0 ? together * fit / apart : 0.0);
            grids.push_back(fitted.grid);
            weakest.push_back(fitted.weakest_kept);
            model.levels.push_back(std::move(fitted.level));
        }
        if (options.correlated != 0) {
            model.provenance.reasons.push_back(
                correlated_reason(options.correlated, support.kind, support.offsets, weakest));
        }
        if (depth == FitDepth::levels) return model;
        stage.emplace("gains");
        const bool gains = options.gains == GainMode::match && is_valid(model);
        std::vector<LagCovariance> fields;
        if (gains || !model.marginals.empty()) fields = level_fields(model, grids);
        if (gains) set_gains(model, planes, fields);
        if (!model.marginals.empty()) set_whitening(model, fields);
        watch.lap("gains");
        return model;
    }

    Device* device_;
    Image image_;
    std::mutex mutex_;  ///< of what follows
    SpectralBasis basis_, varying_;
    std::vector<Marginal> marginals_;
    std::map<AnalysedPlanes, AnalysedPicture> pictures_;
};

Analysis::Analysis(Device& device, Image image) : impl_(std::make_unique<Impl>(device, std::move(image))) {}
Analysis::~Analysis() = default;
Analysis::Analysis(Analysis&&) noexcept = default;
Analysis& Analysis::operator=(Analysis&&) noexcept = default;
const Image& Analysis::image() const {
    return impl_->image();
}
TextureModel Analysis::fit(const FitOptions& options) {
    return impl_->fit(options, {});
}
std::vector<TextureModel> Analysis::fit_all(std::span<const FitOptions> options) {
    Offset box;
    for (const FitOptions& each : options) {
        if (leaves_choices(each)) continue;
        const Offset own = difference_box(support_of(each).offsets);
        box = {std::max(box.row, own.row), std::max(box.column, own.column)};
    }
    std::vector<TextureModel> models(options.size());
    std::optional<Stage> together;
    if (options.size() > 1) together.emplace("fit");
    for_each_part(static_cast<int>(options.size()), [&](int k) {
        const auto place = static_cast<size_t>(k);
        models[place] = impl_->fit(options[place], box);
    });
    return models;
}

TextureModel fit(Device& device, const Image& image, const FitOptions& options) {
    return Analysis(device, image).fit(options);
}

}  // namespace btfield

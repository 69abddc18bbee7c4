#include <algorithm>
#include <cmath>
#include <cstring>
#include <functional>
#include <numeric>
#include <optional>
#include <string>
#include <utility>

#include "btfield/btf_model.hpp"
#include "btfield/error.hpp"
#include "btfield/height.hpp"
#include "btfield/material.hpp"
#include "btfield/relief.hpp"
#include "btfield/synthesis.hpp"
#include "host/base/limits.hpp"
#include "host/base/text.hpp"
#include "host/btf/btf_measured.hpp"
#include "host/btf/btf_score.hpp"
#include "host/btf/btf_tables.hpp"
#include "host/btf/joint_planes.hpp"
#include "host/btf/surface_field.hpp"
#include "host/btf/views_part.hpp"
#include "host/cl/device_impl.hpp"

namespace btfield {

using namespace detail;

namespace {

constexpr const char* asked_fit = "fit a BTF";
/// Lights below which stereo tells too little to trust.
constexpr std::size_t least_stereo_lights = 6;
/// Side of the part of the pictures in which the relief's scale is sought, views that are looked at, planes.
constexpr int scale_side = 96, scale_planes = 16;
constexpr std::size_t scale_views = 27;

/// Pairs that the fit is shown, by view, and the others.
struct Shares {
    std::vector<std::vector<int>> lights;  ///< [view]
    std::vector<BtfPair> left_out;
};

Shares share_out(const BtfSet& set, const BtfLeaveOut& leave_out) {
    Shares shares;
    shares.lights.resize(set.views().size());
    for (const BtfPair& pair : set.pictures()) {
        if (is_left_out(pair, leave_out))
            shares.left_out.push_back(pair);
        else
            shares.lights[static_cast<std::size_t>(pair.view)].push_back(pair.light);
    }
    return shares;
}

void check_options(const BtfSet& set, const BtfFitOptions& options) {
    if (options.planes < 1 || options.planes > 60)
        throw InputError(asked_fit, counted(options.planes, "plane") + " were asked for", "give 1 to 60");
    check_leave_out(options.leave_out);
    if (options.surface != SurfaceKind::field && std::min(set.size().height, set.size().width) < 16)
        throw InputError(asked_fit, "pictures have " + text_of(set.size()) + " pixels",
                         "the roller and regions need sides of 16 and more; use a random field");
    if (!(std::isfinite(options.table_error) && options.table_error >= 0.0))
        throw InputError(asked_fit, "the error of the tables is not a number from 0 on",
                         "give a share, as 0.2");
    if (options.scale && !(std::isfinite(*options.scale) && *options.scale >= 0.0))
        throw InputError(asked_fit, "the factor on the relief is not a number from 0 on",
                         "give a factor, 1 for heights in pixels");
    const Image& height = options.height;
    if (height.planes() > 0 && (height.planes() != 1 || height.size() != set.size()))
        throw InputError(asked_fit,
                         "the height has " + text_of(height.size()) + " pixels and " +
                             counted(height.planes(), "plane") + ", pictures have " + text_of(set.size()),
                         "give a grey height of the pictures' size");
    if (!std::ranges::all_of(height.values(), [](float value) { return std::isfinite(value); }))
        throw InputError(asked_fit, "the height has a value that is not a finite number", "repair it");
}

void centre(Image& height) {
    const auto values = height.values();
    const double mean =
        std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
    for (float& value : values) value = static_cast<float>(static_cast<double>(value) - mean);
}

struct Relieved {
    Image height;
    std::string from;
    bool scaled = true;  ///< whether its unit is sure
};

class Fitting {
  public:
    Fitting(Device& device, const BtfSet& set, const BtfFitOptions& options)
        : device_(&device), set_(&set), options_(&options), shares_(share_out(set, options.leave_out)) {}
    [[nodiscard]] BtfFit run();

  private:
    void tell(std::string_view stage, double share) const {
        if (options_->progress) options_->progress(stage, share);
    }
    [[nodiscard]] int kept_rank() const { return 2 * options_->planes + 16; }
    void check_memory() const;
    [[nodiscard]] Relieved relief();
    [[nodiscard]] Relieved stereo();
    [[nodiscard]] ReducedView read_view(std::size_t view) const;
    [[nodiscard]] std::vector<JointView> read_views(ViewsPart& part);
    [[nodiscard]] double found_scale(const Image& height, const std::vector<JointView>& views) const;
    [[nodiscard]] Image look(const BtfFit& fit) const;

    Device* device_;
    const BtfSet* set_;
    const BtfFitOptions* options_;
    Shares shares_;
    std::vector<std::string> remarks_;
    std::size_t resumed_ = 0;
};

/// Before anything is read.
void Fitting::check_memory() const {
    const std::size_t pixels = area(set_->size()), colours = static_cast<std::size_t>(set_->planes());
    double kept = 0.0, reading = 0.0;
    std::size_t views = 0;
    for (const std::vector<int>& lights : shares_.lights) {
        const std::size_t rows = lights.size() * colours;
        if (rows == 0) continue;
        ++views;
        reading = std::max(reading, reduction_bytes(rows, pixels, kept_rank()));
        kept += reduced_bytes(rows, pixels, kept_rank());
    }
    const double work = std::max(reading, joint_planes_bytes(pixels, views, options_->planes, kept_rank()));
    const double limit = device_->impl().memory_limit();
    const bool in_file = !options_->part.empty();
    if (work + (in_file ? 0.0 : kept) <= limit) return;
    const std::string found = in_file ? counted(views, "view") + " of " + text_of(set_->size()) +
                                            " pixels, read one at a time, take " + bytes_text(work)
                                      : counted(views, "view") + " of " + text_of(set_->size()) +
                                            " pixels as " + counted(kept_rank(), "plane") + " take " +
                                            bytes_text(kept) + ", and work on them " + bytes_text(work);
    throw InputError(asked_fit, found + ", where " + bytes_text(limit) + " may be used",
                     std::string(in_file || work > limit ? "" : "keep views in a part, ") +
                         "crop the pictures, leave out views by a stride, ask for fewer planes, or allow "
                         "more memory");
}

Relieved Fitting::relief() {
    Relieved result;
    if (options_->height.planes() > 0)
        result = {options_->height, "given", true};
    else if (set_->description().height.planes() > 0)
        result = {set_->description().height, "set", true};
    else
        result = stereo();
    centre(result.height);
    return result;
}

/// From the view nearest to straight above.
Relieved Fitting::stereo() {
    const auto& views = set_->views();
    const auto lower = [](const BtfDirection& a, const BtfDirection& b) { return a.theta < b.theta; };
    const auto top = static_cast<std::size_t>(std::ranges::min_element(views, lower) - views.begin());
    const std::vector<int>& lights = shares_.lights[top];
    Relieved level{Image(set_->size(), 1), "level", true};
    const std::string without = ": no relief is modelled; give a height";
    if (views[top].theta > 1e-3) {
        remarks_.push_back("no view is from straight above" + without);
        return level;
    }
    if (lights.size() < least_stereo_lights) {
        remarks_.push_back("the view from above has " + counted(lights.size(), "light") + without);
        return level;
    }
    std::vector<Image> pictures(lights.size());
    std::vector<std::array<double, 3>> directions;
    for (std::size_t i = 0; i < lights.size(); ++i) {
        pictures[i] = set_->picture(static_cast<int>(top), lights[i]);
        directions.push_back(set_->light(static_cast<int>(top), lights[i]).vector());
    }
    ReliefOptions how;
    how.coding = LightCoding::linear;
    how.ignore_mask = true;
    how.progress = [&](std::string_view, double share) { tell("relief", share); };
    try {
        const Relief found = fit_relief(*device_, pictures, directions, how);
        IntegrationOptions integration;
        integration.edges = options_->periodic ? SurfaceEdges::periodic : SurfaceEdges::mirror;
        integration.flattening = options_->periodic ? Flattening::none : Flattening::plane;
        integration.measured = true;
        return {integrate(*device_, slopes_of_normals(found.normals).slopes, integration), "stereo", false};
    } catch (const InputError& error) {
        remarks_.push_back("lights of the view from above tell no relief, as " + error.found() + without);
        return level;
    }
}

ReducedView Fitting::read_view(std::size_t view) const {
    const std::vector<int>& lights = shares_.lights[view];
    return reduce_view(static_cast<int>(lights.size()), set_->planes(), area(set_->size()), kept_rank(),
                       [&](int picture, std::span<float> to) {
                           const Image read = set_->picture(static_cast<int>(view),
                                                            lights[static_cast<std::size_t>(picture)]);
                           std::ranges::copy(read.values(), to.begin());
                       });
}

std::vector<JointView> Fitting::read_views(ViewsPart& part) {
    std::vector<JointView> views;
    const std::size_t all = set_->views().size();
    for (std::size_t v = 0; v < all; ++v) {
        const std::size_t lights = shares_.lights[v].size();
        if (lights == 0) continue;
        std::optional<ReducedView> reduced = part.find(v, lights * static_cast<std::size_t>(set_->planes()));
        if (reduced) {
            resumed_ += lights;
        } else {
            tell("pictures", static_cast<double>(v) / static_cast<double>(all));
            reduced = part.kept(v, read_view(v));
        }
        if (reduced->rank() > 0)
            views.push_back({static_cast<int>(v), set_->views()[v].vector(), std::move(*reduced)});
    }
    tell("pictures", 1.0);
    if (views.empty())
        throw InputError(asked_fit, "no picture has any detail", "check the pictures and how they are coded");
    return views;
}

double Fitting::found_scale(const Image& height, const std::vector<JointView>& views) const {
    const Size size = set_->size(), part{std::min(size.height, scale_side), std::min(size.width, scale_side)};
    const int row = (size.height - part.height) / 2, column = (size.width - part.width) / 2;
    std::vector<JointView> some;
    const std::size_t stride = (views.size() + scale_views - 1) / scale_views;
    for (std::size_t v = 0; v < views.size(); v += stride)
        some.push_back(
            {views[v].index, views[v].direction, windowed(views[v].reduced, size, row, column, part)});
    const Image window = height.crop(row, column, part);
    JointOptions how;
    how.planes = std::min(options_->planes, scale_planes);
    how.periodic = options_->periodic && part == size;
    how.passes = 1;
    how.steps = 4;
    constexpr double asked = 15.0;
    double tried = 0.0;
    const auto left = [&](double factor) {
        Image scaled = window;
        for (float& value : scaled.values()) value *= static_cast<float>(factor);
        const RelievedSurface surface(device_->impl(), scaled);
        const double unexplained = fit_joint_planes(surface, some, how).unexplained;
        tell("scale", std::min(++tried / asked, 1.0));
        return unexplained;
    };
    // There are other minima: look everywhere first.
    double best = 0.0, least = left(0.0);
    const auto look = [&](double factor) {
        const double found = left(factor);
        if (found < least) {
            least = found;
            best = factor;
        }
    };
    for (int i = 1; i <= 8; ++i) look(0.25 * i);
    for (double step = 0.125; step > 0.03; step *= 0.5) {
        const double middle = best;
        if (middle > step) look(middle - step);
        look(middle + step);
    }
    return best;
}

/// Under the light nearest to straight above, as the planes have it.
Image Fitting::look(const BtfFit& fit) const {
    const auto lower = [](const BtfDirection& a, const BtfDirection& b) { return a.theta < b.theta; };
    return BtfSynthesiser(*device_, fit.model, fit.surface)
        .picture({}, *std::ranges::min_element(fit.model.lights, lower));
}

BtfFitOptions sampled() {
    BtfFitOptions options;
    options.surface = SurfaceKind::roll;
    return options;
}

BtfFit Fitting::run() {
    check_memory();
    ViewsPart part(options_->part, *set_, options_->leave_out, kept_rank());
    Relieved found = relief();
    tell("relief", 1.0);
    const std::vector<JointView> views = read_views(part);
    BtfFit fit;
    describe(fit.model, *set_);
    fit.model.relief = found.from;
    const bool level = !height_varies(found.height);
    if (options_->scale)
        fit.model.scale_factor = *options_->scale;
    else if (!level && (options_->find_scale || !found.scaled))
        fit.model.scale_factor = found_scale(found.height, views);
    for (float& value : found.height.values()) value *= static_cast<float>(fit.model.scale_factor);

    JointOptions how;
    how.planes = options_->planes;
    how.periodic = options_->periodic;
    how.progress = [&](double share) { tell("planes", share); };
    const RelievedSurface relieved(device_->impl(), found.height);
    const JointPlanes planes = fit_joint_planes(relieved, views, how);
    fit.model.unexplained = planes.unexplained;
    fill_tables(fit.model, *set_, shares_.lights, views, planes, options_->table_error * planes.unexplained,
                [&](double share) { tell("tables", share); });

    const int kept = static_cast<int>(planes.planes.cols());
    if (kept < options_->planes)
        remarks_.push_back("no view has pictures for more than " + counted(kept, "plane") + " of the " +
                           std::to_string(options_->planes));
    fit.surface = Image(set_->size(), kept + 1);
    std::ranges::copy(found.height.values(), fit.surface.plane(0).begin());
    for (int k = 0; k < kept; ++k) {
        const auto to = fit.surface.plane(k + 1);
        for (std::size_t p = 0; p < to.size(); ++p)
            to[p] = static_cast<float>(planes.planes(static_cast<Eigen::Index>(p), k));
    }
    tell("field", 0.0);
    if (options_->surface == SurfaceKind::compound) {
        // Nothing of the surface's model is needed for that.
        fit.model.surface = fit_surface(*device_, fit.surface, {}, sampled());
        fit.model.surface = fit_surface(*device_, fit.surface, look(fit), *options_);
    } else {
        fit.model.surface = fit_surface(*device_, fit.surface, {}, *options_);
    }
    tell("field", 1.0);
    check(fit.model);
    if (!shares_.left_out.empty()) fit.score = score(*device_, *set_, fit, shares_.left_out);
    fit.remarks = std::move(remarks_);
    fit.resumed = resumed_;
    return fit;
}

}  // namespace

FitOptions BtfFitOptions::field_defaults() {
    FitOptions field;
    field.model = ModelKind::car3d;
    field.order = 3;
    return field;
}

BtfFitOptions::BtfFitOptions() : field(field_defaults()) {}

BtfFit fit_btf(Device& device, const BtfSet& set, const BtfFitOptions& options) {
    check_options(set, options);
    return Fitting(device, set, options).run();
}

}  // namespace btfield

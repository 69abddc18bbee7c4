#include "btfield/compound.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>
#include <utility>

#include "btfield/error.hpp"
#include "btfield/image_io.hpp"
#include "host/base/text.hpp"
#include "host/compound/compound_names.hpp"
#include "host/model/model_check.hpp"

namespace btfield {

using namespace detail;

namespace {

using std::size_t;

[[noreturn]] void refuse_compound(const std::string& found) {
    throw InputError("use this compound model", found, "fit the model again");
}

void check_numbers(const std::vector<double>& values, size_t count, const std::string& what) {
    if (values.size() != count)
        refuse_compound(what + " has " + counted(values.size(), "number") + " instead of " +
                        std::to_string(count));
    // What textures are made with: float32.
    constexpr double largest = std::numeric_limits<float>::max();
    if (!std::ranges::all_of(values, [](double v) { return std::abs(v) <= largest; }))
        refuse_compound(what + " is beyond the range of float32");
}

void check_region(const CompoundModel& model, const CompoundRegion& region, const std::string& where) {
    const auto d = static_cast<size_t>(model.planes);
    const auto filters = static_cast<size_t>(model.borders == Borders::conditional ? context_filters : 1);
    check_numbers(region.colour, d, where + "its colour");
    check_numbers(region.weights, filters * d, where + "its context");
    if (!std::isfinite(region.contrast) || region.contrast < 0.0)
        refuse_compound(where + "its contrast is not a finite number >= 0");
    if (!(region.structure >= 0.0 && region.structure <= 1.0))
        refuse_compound(where + "its structure is not from 0 to 1");
    if (!(region.share >= 0.0 && region.share <= 1.0))
        refuse_compound(where + "its share is not from 0 to 1");
    if (region.residual.planes != model.planes)
        refuse_compound(where + "its residual has " + counted(region.residual.planes, "plane") +
                        " instead of " + std::to_string(model.planes));
    if (region.residual.factor != model.regions.front().residual.factor)
        refuse_compound(where + "its pyramid has factor " + std::to_string(region.residual.factor) +
                        " instead of " + std::to_string(model.regions.front().residual.factor));
    const std::vector<Marginal>& marginals = region.residual.marginals;
    for (const Marginal& marginal : marginals)
        if (marginal.values.size() != marginals.front().values.size())
            refuse_compound(where + "its marginals have unlike numbers of knots");
    try {
        check(region.residual);
    } catch (const InputError& error) {
        refuse_compound(where + error.found());
    }
}

std::uint8_t eight_bits(double value) {
    return static_cast<std::uint8_t>(std::lround(255.0 * std::clamp(value, 0.0, 1.0)));
}

}  // namespace

std::string_view name(Borders borders) {
    return word_of(borders);
}

std::string_view name(AveragesEstimator estimator) {
    return word_of(estimator);
}

std::size_t parameter_count(const CompoundModel& model) {
    size_t count = model.mean.size();
    for (const CompoundRegion& region : model.regions)
        count += region.colour.size() + region.weights.size() + 2 + parameter_count(region.residual);
    return count;
}

bool is_valid(const CompoundModel& model) {
    return std::ranges::all_of(model.regions,
                               [](const CompoundRegion& region) { return is_valid(region.residual); });
}

std::vector<PaletteColour> palette(const CompoundModel& model) {
    std::vector<PaletteColour> colours;
    std::set<PaletteColour> taken;
    for (const CompoundRegion& region : model.regions) {
        PaletteColour colour{};
        for (size_t p = 0; p < 3; ++p) colour[p] = eight_bits(region.colour[model.planes >= 3 ? p : 0]);
        // The next one that is free: neighbours in brightness differ by at least one step.
        while (!taken.insert(colour).second)
            for (std::uint8_t& value : colour) value = static_cast<std::uint8_t>(value + 1);
        colours.push_back(colour);
    }
    return colours;
}

void check(const CompoundModel& model) {
    if (model.planes < 1) refuse_compound("it has " + counted(model.planes, "plane"));
    if (model.regions.empty()) refuse_compound("it has no region");
    constexpr int largest_side = 16384;  // the roller's
    if (std::min(model.size.height, model.size.width) < 1 ||
        std::max({model.size.height, model.size.width, model.control.size.height, model.control.size.width}) >
            largest_side)
        refuse_compound("its picture is " + text_of(model.size) + " pixels");
    try {
        check(model.control);
    } catch (const InputError& error) {
        refuse_compound(error.found());
    }
    if (model.control.regions != static_cast<int>(model.regions.size()))
        refuse_compound("its control field has " + counted(model.control.regions, "region") + ", and " +
                        std::to_string(model.regions.size()) + " have models");
    if (std::min(model.control.size.height, model.control.size.width) < 16)
        refuse_compound("its control field is " + text_of(model.control.size) +
                        ", and the roller needs 16 pixels");
    check_numbers(model.mean, static_cast<size_t>(model.planes), "its mean");
    const std::vector<PlaneLimits>& limits = model.provenance.limits;
    if (!limits.empty() && limits.size() != model.mean.size())
        refuse_compound("it has limits of " + counted(limits.size(), "plane") + " of " +
                        std::to_string(model.planes));
    if (!model.names.empty() && model.names.size() != model.mean.size())
        refuse_compound("it has " + std::to_string(model.names.size()) + " names for " +
                        std::to_string(model.planes) + " planes");
    if (const std::string defect = defect_of(model.plane_spaces, model.space, model.planes); !defect.empty())
        refuse_compound(defect);
    if (const std::string defect = defect_of(model.provenance.maps, model.planes); !defect.empty())
        refuse_compound(defect);
    if (!std::isfinite(model.explained)) refuse_compound("its explained share is not finite");
    for (size_t k = 0; k < model.regions.size(); ++k)
        check_region(model, model.regions[k], "region " + std::to_string(k) + ": ");
}

}  // namespace btfield

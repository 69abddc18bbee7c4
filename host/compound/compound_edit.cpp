#include <cmath>
#include <string>
#include <utility>

#include "btfield/compound.hpp"
#include "btfield/error.hpp"
#include "host/base/text.hpp"

namespace btfield {

using namespace detail;

namespace {

using std::size_t;

CompoundRegion& region_of(CompoundModel& model, int region, const std::string& asked) {
    if (region < 0 || static_cast<size_t>(region) >= model.regions.size())
        throw InputError(asked, "there is no region " + std::to_string(region),
                         "give one from 0 to " + std::to_string(model.regions.size() - 1));
    return model.regions[static_cast<size_t>(region)];
}

std::string edit_of(int region) {
    return "edit region " + std::to_string(region);
}

void check_planes(size_t model, size_t other, const std::string& asked, const std::string& what) {
    if (model == other) return;
    throw InputError(asked, what + " has " + counted(other, "plane") + ", the model " + std::to_string(model),
                     "give one with as many");
}

void check_factor(const CompoundRegion& region, const TextureModel& residual, const std::string& asked) {
    if (region.residual.factor == residual.factor) return;
    throw InputError(asked,
                     "the other pyramid has factor " + std::to_string(residual.factor) + ", this one " +
                         std::to_string(region.residual.factor),
                     "fit both with the same --factor");
}

}  // namespace

void recolour(CompoundModel& model, int region, std::span<const double> colour) {
    const std::string asked = edit_of(region);
    CompoundRegion& own = region_of(model, region, asked);
    check_planes(own.colour.size(), colour.size(), asked, "the colour");
    const size_t d = colour.size();
    // The label smoothed at σ = 1: the change has the softness of a picture's own edges.
    const size_t filter = own.weights.size() / d > 1 ? 1 : 0;
    for (size_t p = 0; p < d; ++p) {
        if (!std::isfinite(colour[p]))
            throw InputError(asked, "the colour is not finite", "give finite numbers");
        own.weights[filter * d + p] += colour[p] - own.colour[p];
        own.colour[p] = colour[p];
    }
}

void scale_contrast(CompoundModel& model, int region, double factor) {
    const std::string asked = edit_of(region);
    CompoundRegion& own = region_of(model, region, asked);
    if (!std::isfinite(factor) || factor < 0.0)
        throw InputError(asked, "the contrast is not a finite number >= 0", "give one, such as 1.5");
    own.contrast *= factor;
}

void transplant(CompoundModel& model, int region, const CompoundModel& other, int from) {
    const std::string asked = edit_of(region);
    CompoundRegion& own = region_of(model, region, asked);
    if (from < 0 || static_cast<size_t>(from) >= other.regions.size())
        throw InputError(asked, "the other model has no region " + std::to_string(from),
                         "give one from 0 to " + std::to_string(other.regions.size() - 1));
    const CompoundRegion& source = other.regions[static_cast<size_t>(from)];
    check_planes(own.colour.size(), source.colour.size(), asked, "the other model");
    check_factor(own, source.residual, asked);
    const CompoundRegion copy = source;  // `other` may be `model`
    recolour(model, region, copy.colour);
    own.residual = copy.residual;
    own.contrast = copy.contrast;
    own.structure = copy.structure;
}

void transplant(CompoundModel& model, int region, const TextureModel& other) {
    const std::string asked = edit_of(region);
    CompoundRegion& own = region_of(model, region, asked);
    check_planes(own.colour.size(), static_cast<size_t>(other.planes), asked, "the other model");
    check_factor(own, other, asked);
    check(other);
    recolour(model, region, other.mean);
    own.residual = other;
    // The residual's mean is the colour.
    own.residual.mean.assign(other.mean.size(), 0.0);
    own.residual.basis.mean.assign(other.basis.mean.size(), 0.0);
    own.contrast = 1.0;
    own.structure = 0.0;
}

}  // namespace btfield

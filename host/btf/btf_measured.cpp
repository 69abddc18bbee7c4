#include "host/btf/btf_measured.hpp"

#include <cmath>

#include "btfield/error.hpp"
#include "host/btf/btf_names.hpp"
#include "host/btf/direction_grid.hpp"

namespace btfield {

std::string_view name(BtfMethod method) {
    return detail::word_of(method);
}

BtfMethod btf_method(std::string_view name) {
    return detail::value_of<BtfMethod>(name);
}

std::string_view name(BtfMatch match) {
    return detail::word_of(match);
}

namespace detail {
namespace {

constexpr std::size_t most_directions = 65536;

void check_directions(const std::vector<BtfDirection>& directions, const std::string& what) {
    if (directions.empty() || directions.size() > most_directions)
        refuse_model("it has no " + what + ", or too many");
    for (const BtfDirection& d : directions)
        if (!std::isfinite(d.phi) || !(d.theta >= 0.0) || !(d.theta <= radians(89.0)))
            refuse_model("one of its " + what + " is " + text_of(d) + ", not above the surface");
}

}  // namespace

void describe(BtfMeasured& model, const BtfSet& set) {
    const BtfDescription& what = set.description();
    model.size = what.size;
    model.colours = what.planes;
    model.space = what.space;
    model.names = what.names;
    model.white = what.white;
    model.views = what.views;
    model.lights = what.lights;
    model.pictures = set.pictures().size();
    model.picture_bytes = model.pictures * area(what.size) * static_cast<std::uint64_t>(what.planes);
    model.file_bytes = what.bytes;
}

bool is_left_out(const BtfPair& pair, const BtfLeaveOut& leave_out) {
    const auto is_last = [](int index, int every) { return every > 0 && index % every == every - 1; };
    return is_last(pair.view + pair.light, leave_out.pairs) || is_last(pair.view, leave_out.views) ||
           is_last(pair.light, leave_out.lights);
}

void check_leave_out(const BtfLeaveOut& leave_out) {
    for (const int every : {leave_out.pairs, leave_out.views, leave_out.lights})
        if (every < 0 || every == 1)
            throw InputError("fit a BTF", "every picture would be left out",
                             "leave out every second or fewer");
}

void refuse_model(const std::string& found) {
    throw InputError("use a BTF model", found, "use one that btfield fitted");
}

std::size_t place_of(const BtfMeasured& model, const BtfPair& pair) {
    return static_cast<std::size_t>(pair.view) * model.lights.size() + static_cast<std::size_t>(pair.light);
}

void check_measured(const BtfMeasured& model) {
    if (model.size.height < 1 || model.size.width < 1) refuse_model("its pictures have no pixels");
    if (model.colours < 1 || model.colours > most_btf_colours)
        refuse_model("its pictures have no planes, or too many");
    check_directions(model.views, "views");
    check_directions(model.lights, "lights");
    if (!model.true_lights.empty()) check_directions(model.true_lights, "true lights");
    if (!model.true_lights.empty() && model.true_lights.size() != model.pairs.size())
        refuse_model("it has true lights, but not one for each pair");
    if (model.pairs.empty() || model.pairs.size() > most_btf_pairs ||
        model.views.size() * model.lights.size() > most_possible_btf_pairs)
        refuse_model("it has no pair, or too many");
    for (const BtfPair& pair : model.pairs)
        if (pair.view < 0 || pair.light < 0 || pair.view >= static_cast<int>(model.views.size()) ||
            pair.light >= static_cast<int>(model.lights.size()))
            refuse_model("a pair has a view or a light that it does not list");
    for (std::size_t i = 1; i < model.pairs.size(); ++i)
        if (place_of(model, model.pairs[i - 1]) >= place_of(model, model.pairs[i]))
            refuse_model("its pairs are not in order, view by view");
    if (!(std::isfinite(model.white) && model.white > 0.0)) refuse_model("its white is not above 0");
}

}  // namespace detail
}  // namespace btfield

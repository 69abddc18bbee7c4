#include "host/btf/direction_grid.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <map>
#include <optional>
#include <utility>

#include "btfield/error.hpp"
#include "host/base/text.hpp"

namespace btfield::detail {
namespace {

using std::size_t;

/// Degrees by which names may round an angle.
constexpr double rounding = 0.51;
/// Degrees by which light is moved out of the viewer's way at most.
constexpr double farthest_shift = 16.0;

double turn_between(double a, double b) {
    double turn = std::fmod(std::abs(a - b), 2.0 * std::numbers::pi);
    return std::min(turn, 2.0 * std::numbers::pi - turn);
}

/// The direction of a table that this one is, within what names round; −1: none.
int place_in(const std::vector<BtfDirection>& table, const BtfDirection& direction) {
    for (size_t i = 0; i < table.size(); ++i) {
        if (std::abs(table[i].theta - direction.theta) > radians(rounding)) continue;
        if (table[i].theta < radians(rounding) ||
            turn_between(table[i].phi, direction.phi) <= radians(rounding))
            return static_cast<int>(i);
    }
    return -1;
}

/// Directions in the order of their rings.
bool ring_less(const BtfDirection& a, const BtfDirection& b) {
    return std::pair(a.theta, a.phi) < std::pair(b.theta, b.phi);
}

void check_above(const std::vector<MeasuredPair>& pairs, const std::string& asked) {
    for (const MeasuredPair& pair : pairs)
        for (const BtfDirection& d : {pair.view, pair.light})
            if (!std::isfinite(d.phi) || !(d.theta >= 0.0) || !(d.theta < radians(90.0)))
                throw InputError(asked, pair.what + " has the direction " + text_of(d),
                                 "directions are above the surface: theta from 0, below 90 degrees");
}

/// The table that all views and most lights are of; nothing where there is none.
std::optional<std::vector<BtfDirection>> table_of(const std::vector<MeasuredPair>& pairs) {
    for (auto table : {btf_directions_81(), btf_directions_151()}) {
        size_t lights = 0;
        bool all = true;
        for (const MeasuredPair& pair : pairs) {
            all = all && place_in(table, pair.view) >= 0;
            lights += place_in(table, pair.light) >= 0 ? 1 : 0;
        }
        if (all && 2 * lights >= pairs.size()) return table;
    }
    return std::nullopt;
}

/// Names and floats say an angle in several ways: a thousandth of a degree is none.
constexpr double same = 1e-3;

/// Distinct directions in order.
std::vector<BtfDirection> distinct(std::vector<BtfDirection> all) {
    std::ranges::sort(all, ring_less);
    all.erase(std::unique(all.begin(), all.end()), all.end());
    std::vector<BtfDirection> result;
    for (const BtfDirection& d : all) {
        bool there = false;
        for (auto r = result.rbegin(); r != result.rend() && r->theta > d.theta - radians(same); ++r)
            there = there || angle_between(*r, d) < radians(same);
        if (!there) result.push_back(d);
    }
    return result;
}

int nearest(const std::vector<BtfDirection>& among, const BtfDirection& direction) {
    const auto at = std::ranges::min_element(
        among, {}, [&](const BtfDirection& d) { return angle_between(d, direction); });
    return static_cast<int>(at - among.begin());
}

/// Places of directions in a list that has them.
class Places {
  public:
    explicit Places(const std::vector<BtfDirection>& list) : list_(list) {
        for (size_t i = 0; i < list.size(); ++i) known_[{list[i].theta, list[i].phi}] = i;
    }
    size_t operator()(const BtfDirection& d) {
        const auto [at, fresh] = known_.try_emplace({d.theta, d.phi}, 0);
        if (fresh) at->second = static_cast<size_t>(nearest(list_, d));
        return at->second;
    }

  private:
    const std::vector<BtfDirection>& list_;
    std::map<std::pair<double, double>, size_t> known_;
};

[[noreturn]] void refuse_twice(const MeasuredPair& one, const MeasuredPair& other, const std::string& asked) {
    throw InputError(asked, one.what + " and " + other.what + " have the same directions",
                     "keep one of them");
}

/// Directions as the table has them, and which of the pairs' lights are elsewhere.
std::vector<size_t> put_on(const std::vector<BtfDirection>& table, std::vector<MeasuredPair>& pairs) {
    std::vector<size_t> moved;
    for (size_t i = 0; i < pairs.size(); ++i) {
        pairs[i].view = table[static_cast<size_t>(place_in(table, pairs[i].view))];
        const int light = place_in(table, pairs[i].light);
        if (light >= 0)
            pairs[i].light = table[static_cast<size_t>(light)];
        else
            moved.push_back(i);
    }
    return moved;
}

}  // namespace

std::string text_of(const BtfDirection& direction) {
    char text[80];
    std::snprintf(text, sizeof text, "theta %.6g, phi %.6g", degrees(direction.theta),
                  degrees(direction.phi));
    return text;
}

BtfDirection normalised(BtfDirection direction) {
    constexpr double turn = 2.0 * std::numbers::pi;
    direction.phi = std::fmod(direction.phi, turn);
    if (direction.phi < 0.0) direction.phi += turn;
    // Just below a turn, as floats have it, is none.
    if (direction.phi > turn - 1e-6 || direction.theta == 0.0) direction.phi = 0.0;
    return direction;
}

std::vector<int> arrange(const std::vector<MeasuredPair>& given, const std::string& asked,
                         BtfDescription& description) {
    check_above(given, asked);
    std::vector<MeasuredPair> pairs = given;
    for (MeasuredPair& pair : pairs) {
        pair.view = normalised(pair.view);
        pair.light = normalised(pair.light);
    }
    const std::optional<std::vector<BtfDirection>> table = table_of(pairs);
    std::vector<size_t> moved;
    if (table) moved = put_on(*table, pairs);
    std::vector<BtfDirection> views, lights, targets;
    for (const MeasuredPair& pair : pairs) {
        views.push_back(pair.view);
        lights.push_back(pair.light);
    }
    std::vector<std::uint8_t> is_moved(pairs.size(), 0);
    for (const size_t i : moved) {
        // Light is moved where it would stand in the viewer's way: the free place is that of the view.
        BtfDirection target = (*table)[static_cast<size_t>(nearest(*table, pairs[i].light))];
        if (angle_between(pairs[i].view, pairs[i].light) < radians(farthest_shift)) target = pairs[i].view;
        if (angle_between(target, pairs[i].light) > radians(farthest_shift)) continue;
        is_moved[i] = 1;
        lights[i] = target;
    }
    description.views = distinct(views);
    description.lights = distinct(lights);
    const size_t width = description.lights.size();
    std::vector<int> picture_of(description.views.size() * width, -1);
    description.true_lights.clear();
    for (size_t v = 0; v < description.views.size(); ++v)
        description.true_lights.insert(description.true_lights.end(), description.lights.begin(),
                                       description.lights.end());
    Places view_place(description.views), light_place(description.lights);
    // Those at their own place first: a moved one takes what is left.
    for (const int round : {0, 1})
        for (size_t i = 0; i < pairs.size(); ++i) {
            if (is_moved[i] != round) continue;
            const size_t at = view_place(views[i]) * width + light_place(lights[i]);
            if (picture_of[at] >= 0)
                refuse_twice(pairs[static_cast<size_t>(picture_of[at])], pairs[i], asked);
            picture_of[at] = static_cast<int>(i);
            description.true_lights[at] = pairs[i].light;
        }
    description.present.assign(picture_of.size(), 0);
    for (size_t i = 0; i < picture_of.size(); ++i) description.present[i] = picture_of[i] >= 0 ? 1 : 0;
    const auto count = std::count(is_moved.begin(), is_moved.end(), 1);
    if (count > 0)
        description.remarks.push_back(
            "the light of " + counted(count, "picture") +
            " was moved out of the viewer's way and counts with its true direction");
    if (table)
        for (const auto& [is, what] :
             {std::pair(description.views.size(), "views"), std::pair(width, "lights")})
            // Far fewer are meant.
            if (is < table->size() && 2 * is > table->size())
                description.remarks.push_back(std::to_string(is) + " of the " +
                                              std::to_string(table->size()) + " " + what + " are there");
    return picture_of;
}

void check_shown(const BtfDirection& direction, const char* what, const std::string& asked) {
    if (std::isfinite(direction.phi) && direction.theta >= 0.0 && direction.theta <= radians(89.0)) return;
    throw InputError(asked, std::string("the ") + what + " is " + text_of(direction),
                     "directions are above the surface: theta from 0 to 89 degrees");
}

}  // namespace btfield::detail

#include "host/experiment/angles.hpp"

#include <array>
#include <cmath>
#include <cstdio>
#include <numbers>

namespace btfield::detail {

double in_degrees(double radians) {
    return radians * 180.0 / std::numbers::pi;
}

double from_degrees(double degrees) {
    return degrees * std::numbers::pi / 180.0;
}

BtfDirection within_a_turn(BtfDirection direction) {
    constexpr double turn = 2.0 * std::numbers::pi;
    if (direction.theta == 0.0) return {};
    direction.phi = std::fmod(direction.phi, turn);
    if (direction.phi < 0.0) direction.phi += turn;
    if (direction.phi >= turn) direction.phi = 0.0;  // the sum was rounded
    return direction;
}

std::string angles_text(const BtfDirection& direction) {
    const BtfDirection at = within_a_turn(direction);
    const auto tidy = [](double value) { return std::round(in_degrees(value) * 1e4) / 1e4; };
    std::array<char, 64> text{};
    // What lies a hair before a full turn is none.
    const double phi = tidy(at.phi);
    std::snprintf(text.data(), text.size(), "%.7g,%.7g", tidy(at.theta), phi >= 360.0 ? 0.0 : phi);
    return text.data();
}

}  // namespace btfield::detail

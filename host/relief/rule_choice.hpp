#pragma once

// Which coding pictures have, and which rule tells lights best that it was not shown (theory 19.4).

#include <string>
#include <vector>

#include "host/relief/light_stack.hpp"
#include "host/relief/pixel_fit.hpp"

namespace btfield::detail {

struct ChosenCoding {
    LightCoding coding = LightCoding::linear;
    std::vector<std::string> remarks;
};

/// The one that is asked for, with a remark where another one is likelier.
[[nodiscard]] ChosenCoding choose_coding(const LightStack& stack, std::span<const LightDirection> lights,
                                         const ReliefOptions& options);

struct ChosenRule {
    PixelRule rule;
    double left_out_error = 0.0, least_squares = 0.0;
};

/// The one that is asked for, or the best; and how well it does.
[[nodiscard]] ChosenRule choose_rule(DeviceImpl& device, const LightStack& stack,
                                     std::span<const LightDirection> lights, const LightDecoder& decoder,
                                     const ReliefOptions& options);

/// Lights are left out in so many parts, each k-th of them, to judge a rule.
inline constexpr int parts_of_lights = 4;
/// Whether this light is in a part; the last one stands for all where lights are many.
[[nodiscard]] constexpr bool is_left_out(int light, int part = parts_of_lights - 1) {
    return light % parts_of_lights == part;
}
[[nodiscard]] std::vector<LightDirection> lights_kept(std::span<const LightDirection> lights,
                                                      int part = parts_of_lights - 1);
/// Of [light][plane][pixel], the lights that are kept.
[[nodiscard]] std::vector<float> values_kept(std::span<const float> stack, int lights, std::size_t of_light,
                                             int part = parts_of_lights - 1);

}  // namespace btfield::detail

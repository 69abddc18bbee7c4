#include "btfield/relief.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>
#include <string>
#include <vector>

#include "btfield/error.hpp"
#include "host/base/parallel.hpp"
#include "host/base/stop.hpp"
#include "host/base/text.hpp"
#include "host/relief/light_directions.hpp"
#include "host/relief/light_stack.hpp"
#include "host/relief/pixel_fit.hpp"
#include "host/relief/rule_choice.hpp"

namespace btfield {

using namespace detail;

namespace {

using std::size_t;

/// Part of the memory that may be planned with that pictures may take; their strips take as much again on
/// the device.
constexpr double share_of_pictures = 0.4;
void check_options(const ReliefOptions& options, size_t lights) {
    const std::string asked = "fit a relief";
    if (!(options.low >= 0.0 && options.low < options.high && options.high <= 1.0))
        throw InputError(
            asked, "ranks go from " + std::to_string(options.low) + " to " + std::to_string(options.high),
            "give two parts from 0 to 1, the lower first");
    if (options.roughness && !(*options.roughness > 0.0 && *options.roughness <= 1.0))
        throw InputError(asked, "the roughness is " + std::to_string(*options.roughness),
                         "give one above 0, at most 1");
    if (!(options.gamma > 0.0) || !std::isfinite(options.gamma))
        throw InputError(asked, "gamma is " + std::to_string(options.gamma), "give a number above 0");
    if (lights > static_cast<size_t>(most_lights))
        throw InputError(asked, "there are " + std::to_string(lights) + " lights",
                         "give " + std::to_string(most_lights) + " at most");
}

/// Counts over all values.
struct Counts {
    double values = 0.0, dark = 0.0, saturated = 0.0;
};

/// Pixels of a strip.
struct Strip {
    size_t first = 0, pixels = 0;
};

/// Calls work(begin, end) for parts of a strip, on all cores.
template <class Work>
void for_each_part(const Strip& strip, const Work& work) {
    constexpr size_t pixels_of_part = 4096;
    const auto parts = static_cast<int>((strip.pixels + pixels_of_part - 1) / pixels_of_part);
    for_each_block(parts, [&](int part) {
        const size_t begin = static_cast<size_t>(part) * pixels_of_part;
        work(begin, std::min(strip.pixels, begin + pixels_of_part));
    });
}

/// Whole numbers, so that their sums are the same in any order.
void count(const Strip& strip, const LightStack& stack, const PixelFits& fits, Counts& counts) {
    std::uint64_t pixels = 0, dark = 0, saturated = 0;
    for (size_t i = 0; i < strip.pixels; ++i)
        if (stack.covers(strip.first + i)) {
            ++pixels;
            dark += static_cast<std::uint64_t>(fits.counts[i]);
            saturated += static_cast<std::uint64_t>(fits.counts[strip.pixels + i]);
        }
    counts.values += static_cast<double>(pixels) * stack.lights() * stack.planes();
    counts.dark += static_cast<double>(dark);
    counts.saturated += static_cast<double>(saturated);
}

void keep_fits(const Strip& strip, const LightStack& stack, const PixelFits& fits, Relief& result) {
    for_each_part(strip, [&](size_t begin, size_t end) {
        for (size_t i = begin; i < end; ++i) {
            const size_t to = strip.first + i;
            if (!stack.covers(to)) {
                result.normals.plane(2)[to] = 1.0F;
                continue;
            }
            const float x = fits.fits[i], y = fits.fits[strip.pixels + i],
                        z = fits.fits[2 * strip.pixels + i];
            const float length = std::sqrt(x * x + y * y + z * z);
            const bool lit = length > 1e-20F;
            result.normals.plane(0)[to] = lit ? x / length : 0.0F;
            result.normals.plane(1)[to] = lit ? y / length : 0.0F;
            result.normals.plane(2)[to] = lit ? z / length : 1.0F;
            for (int p = 0; p < stack.planes(); ++p)
                result.albedo.plane(p)[to] =
                    lit ? fits.albedo[static_cast<size_t>(p) * strip.pixels + i] : 0.0F;
            result.residual.plane(0)[to] = fits.residual[i];
        }
    });
}

/// Error of each pixel under the lights that a fit to the others did not see.
/// \param values  [light][plane][pixel]
void keep_left_out(DeviceImpl& device, const Strip& strip, const std::vector<float>& values,
                   const LightStack& stack, std::span<const LightDirection> lights, const PixelRule& rule,
                   Image& map) {
    const auto planes = static_cast<size_t>(stack.planes());
    const PixelFits fits = fit_pixels(device, values_kept(values, stack.lights(), planes * strip.pixels),
                                      strip.pixels, stack.planes(), lights_kept(lights), rule);
    for_each_part(strip, [&](size_t begin, size_t end) {
        for (size_t i = begin; i < end; ++i) {
            if (!stack.covers(strip.first + i)) continue;
            std::array<double, fit_planes> fit{};
            for (size_t x = 0; x < fit.size(); ++x)
                fit[x] = static_cast<double>(fits.fits[x * strip.pixels + i]);
            double error = 0.0, all = 0.0;
            for (size_t k = 0; k < lights.size(); ++k) {
                if (!is_left_out(static_cast<int>(k))) continue;
                double value = 0.0;
                for (size_t p = 0; p < planes; ++p)
                    value += std::abs(static_cast<double>(values[(k * planes + p) * strip.pixels + i]));
                value /= static_cast<double>(planes);
                error += std::abs(value - modelled_value(fit, lights[k], rule.roughness));
                all += value;
            }
            map.plane(0)[strip.first + i] = all > 0.0 ? static_cast<float>(error / all) : 0.0F;
        }
    });
}

double median_inside(const Image& map, const LightStack& stack) {
    std::vector<float> values;
    for (size_t i = 0; i < map.values().size(); ++i)
        if (stack.covers(i)) values.push_back(map.values()[i]);
    const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
    std::nth_element(values.begin(), middle, values.end());
    return static_cast<double>(*middle);
}

/// Without branches, so that compilers make vectors of it.
bool all_finite(std::span<const float> values) {
    std::uint32_t found = 0;
    for (const float value : values) {
        const std::uint32_t exponent = std::bit_cast<std::uint32_t>(value) & 0x7f800000U;
        found |= static_cast<std::uint32_t>(exponent == 0x7f800000U);
    }
    return found == 0;
}

Relief fit_stack(Device& device, const LightStack& stack, std::span<const LightDirection> lights,
                 const ReliefOptions& options, bool maps) {
    const auto tell = [&](std::string_view stage, double share) {
        if (options.progress) options.progress(stage, share);
    };
    const ChosenCoding coding = choose_coding(stack, lights, options);
    const LightDecoder decoder(coding.coding, options.gamma, stack.integers());
    const ChosenRule chosen = choose_rule(device.impl(), stack, lights, decoder, options);
    tell("rule", 0.0);
    Relief result;
    result.normals = Image(stack.size(), 3);
    result.albedo = Image(stack.size(), stack.planes(), ColourSpace::linear);
    result.residual = Image(stack.size(), 1);
    if (maps) result.left_out = Image(stack.size(), 1);
    Counts counts;
    Strip strip;
    std::vector<float> values;
    for (int row = 0; row < stack.size().height; row += stack.rows_of_strip()) {
        stop_if_asked();
        const int rows = std::min(stack.rows_of_strip(), stack.size().height - row);
        const auto width = static_cast<size_t>(stack.size().width);
        strip.first = static_cast<size_t>(row) * width;
        strip.pixels = static_cast<size_t>(rows) * width;
        const PixelFits fits =
            fit_pixels(device.impl(), stack.strip(row, rows, decoder), lights, chosen.rule);
        keep_fits(strip, stack, fits, result);
        count(strip, stack, fits, counts);
        if (maps) {
            stack.rows(row, rows, decoder, values);
            keep_left_out(device.impl(), strip, values, stack, lights, chosen.rule, result.left_out);
        }
        tell("fit", static_cast<double>(row + rows) / stack.size().height);
    }
    result.inside = stack.inside();
    result.rule = chosen.rule.rule;
    result.roughness = result.rule == LightRule::lobe ? chosen.rule.roughness : 0.0;
    result.coding = coding.coding;
    result.lights = stack.lights();
    result.median_residual = median_inside(result.residual, stack);
    result.left_out_error = chosen.left_out_error;
    result.left_out_least_squares = chosen.least_squares;
    result.shadowed = counts.dark / counts.values;
    result.saturated = counts.saturated / counts.values;
    result.type = stack.type();
    result.remarks = coding.remarks;
    return result;
}

}  // namespace

Relief fit_relief(Device& device, const LightSet& lights, const ReliefOptions& options, bool maps) {
    check_options(options, lights.lights.size());
    std::vector<LightDirection> directions;
    for (const LightPicture& light : lights.lights) directions.push_back(light.direction);
    check_directions(directions, "fit a relief");
    if (maps && directions.size() < 6)
        throw InputError("map errors under lights that are left out",
                         "there are " + counted(directions.size(), "light"), "give six or more");
    if (options.progress) options.progress("read", 0.0);
    const LightStack stack(lights, options, share_of_pictures * device.impl().memory_limit(),
                           device.impl().tuning().stack_values);
    // What 8 bits of a BTF mean is known.
    ReliefOptions taken = options;
    const bool known = lights.layout == "btf" && options.coding == LightCoding::automatic &&
                       stack.type() == PixelType::uint8;
    if (known) taken.coding = LightCoding::srgb;
    Relief result = fit_stack(device, stack, directions, taken, maps);
    if (known) result.remarks.clear();
    return result;
}

Relief fit_relief(Device& device, std::span<const Image> pictures,
                  std::span<const std::array<double, 3>> directions, const ReliefOptions& options) {
    check_options(options, pictures.size());
    const std::string asked = "fit a relief";
    if (pictures.size() != directions.size())
        throw InputError(asked,
                         "there are " + counted(pictures.size(), "picture") + " and " +
                             counted(directions.size(), "light"),
                         "give one for each");
    std::vector<LightDirection> lights(directions.begin(), directions.end());
    for (LightDirection& d : lights) {
        const double length = std::hypot(d[0], d[1], d[2]);
        if (!(length > 0.0) || !std::isfinite(length) || !(d[2] > 0.0))
            throw InputError(asked, "a direction has no length or is behind the surface",
                             "give vectors to the light, z above 0");
        for (double& x : d) x /= length;
    }
    check_directions(lights, asked);
    for_each_block(static_cast<int>(pictures.size()), [&](int k) {
        if (!all_finite(pictures[static_cast<size_t>(k)].values()))
            throw InputError(asked, "a value is not a finite number", "repair the picture");
    });
    ReliefOptions linear = options;
    linear.coding = LightCoding::linear;
    const LightStack stack(pictures, linear, device.impl().tuning().stack_values);
    return fit_stack(device, stack, lights, linear, false);
}

}  // namespace btfield

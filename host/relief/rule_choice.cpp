#include "host/relief/rule_choice.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <tuple>
#include <utility>

#include "host/relief/light_directions.hpp"

namespace btfield::detail {
namespace {

using std::size_t;

/// Pixels that are judged at most.
constexpr size_t judged_pixels = 500;
/// With fewer lights no lobe is tried: there are too few for more unknowns.
constexpr int many_lights = 20;
/// With fewer lights none can be left out.
constexpr int lights_to_judge = 6;
/// What is more general is taken unless it is worse by more than this than a case of it.
constexpr double worth_a_case = 1.05;

double median(std::vector<double>& values) {
    if (values.empty()) return std::numeric_limits<double>::quiet_NaN();
    const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
    std::nth_element(values.begin(), middle, values.end());
    return *middle;
}

/// Value that 9 of 10 do not exceed.
double bright_value(std::vector<float> values) {
    const auto at = values.begin() + static_cast<std::ptrdiff_t>((values.size() - 1) * 9 / 10);
    std::nth_element(values.begin(), at, values.end());
    return static_cast<double>(*at);
}

/// Decoded samples, [light][pixel] of grey, of pixels that any light reaches.
struct Samples {
    size_t pixels = 0;
    int lights = 0;
    std::vector<float> values;  ///< below 0 where saturated
    std::vector<double> bright;

    [[nodiscard]] float at(int light, size_t pixel) const {
        return values[static_cast<size_t>(light) * pixels + pixel];
    }
};

Samples samples_of(const LightStack& stack, const LightDecoder& decoder) {
    const size_t all = stack.sampled().size();
    std::vector<float> grey(static_cast<size_t>(stack.lights()) * all);
    for (int k = 0; k < stack.lights(); ++k)
        for (size_t i = 0; i < all; ++i) {
            float sum = 0.0F;
            bool saturated = false;
            for (int p = 0; p < stack.planes(); ++p) {
                const float value = decoder(
                    stack.samples()[static_cast<size_t>(k * stack.planes() + p) * all + i], stack.gain(k, p));
                saturated = saturated || value < 0.0F;
                sum += std::abs(value);
            }
            sum /= static_cast<float>(stack.planes());
            grey[static_cast<size_t>(k) * all + i] = saturated ? -sum : sum;
        }
    std::vector<double> bright(all);
    double most = 0.0;
    for (size_t i = 0; i < all; ++i) {
        std::vector<float> column;
        column.reserve(static_cast<size_t>(stack.lights()));
        for (int k = 0; k < stack.lights(); ++k)
            column.push_back(std::abs(grey[static_cast<size_t>(k) * all + i]));
        bright[i] = bright_value(std::move(column));
        most = std::max(most, bright[i]);
    }
    std::vector<size_t> taken;
    for (size_t i = 0; i < all && taken.size() < judged_pixels; ++i)
        if (bright[i] > 0.02 * most) taken.push_back(i);
    Samples result{taken.size(), stack.lights(), {}, {}};
    for (const size_t i : taken) result.bright.push_back(bright[i]);
    for (int k = 0; k < stack.lights(); ++k)
        for (const size_t i : taken) result.values.push_back(grey[static_cast<size_t>(k) * all + i]);
    return result;
}

/// What least squares leave, over what is bright: median over values.
double left_by_least_squares(const LightStack& stack, std::span<const LightDirection> lights,
                             LightCoding coding) {
    const Samples samples = samples_of(stack, LightDecoder(coding, 1.0, stack.integers()));
    const std::vector<LightDirection> rows = pseudo_inverse(lights);
    std::vector<double> errors;
    for (size_t i = 0; i < samples.pixels; ++i) {
        LightDirection b{};
        for (size_t k = 0; k < rows.size(); ++k)
            for (size_t x = 0; x < 3; ++x)
                b[x] += rows[k][x] * std::abs(static_cast<double>(samples.at(static_cast<int>(k), i)));
        for (size_t k = 0; k < rows.size(); ++k) {
            const double value = std::abs(static_cast<double>(samples.at(static_cast<int>(k), i)));
            const double model = b[0] * lights[k][0] + b[1] * lights[k][1] + b[2] * lights[k][2];
            errors.push_back(std::abs(value - model) / samples.bright[i]);
        }
    }
    return median(errors);
}

std::string percent(double share) {
    return std::to_string(static_cast<int>(std::lround(1000.0 * share)) / 10) + "." +
           std::to_string(static_cast<int>(std::lround(1000.0 * share)) % 10) + " %";
}

/// How well rules tell lights that they were not shown.
class Judge {
  public:
    Judge(DeviceImpl& device, Samples samples, std::span<const LightDirection> lights)
        : device_(device), samples_(std::move(samples)), lights_(lights) {}

    [[nodiscard]] bool can() const { return samples_.lights >= lights_to_judge && samples_.pixels > 0; }
    [[nodiscard]] bool few() const { return samples_.lights < many_lights; }

    /// Median of what is missed, over what is bright. Of few lights all are left out, a quarter at a time:
    /// one quarter would be one to four of them.
    [[nodiscard]] double operator()(const PixelRule& rule) const {
        if (!can()) return std::numeric_limits<double>::quiet_NaN();
        std::vector<double> errors;
        for (int part = few() ? 0 : parts_of_lights - 1; part < parts_of_lights; ++part)
            leave_out(part, rule, errors);
        return median(errors);
    }

  private:
    void leave_out(int part, const PixelRule& rule, std::vector<double>& errors) const {
        const std::vector<LightDirection> kept = lights_kept(lights_, part);
        if (!tell_normals(kept)) return;
        const size_t pixels = samples_.pixels;
        const PixelFits fits = fit_pixels(
            device_, values_kept(samples_.values, samples_.lights, pixels, part), pixels, 1, kept, rule);
        for (size_t i = 0; i < pixels; ++i) {
            std::array<double, fit_planes> fit{};
            for (size_t x = 0; x < fit.size(); ++x) fit[x] = static_cast<double>(fits.fits[x * pixels + i]);
            for (int k = part; k < samples_.lights; k += parts_of_lights)
                if (const auto value = static_cast<double>(samples_.at(k, i)); value >= 0.0)
                    errors.push_back(std::abs(value - modelled_value(fit, lights_[static_cast<size_t>(k)],
                                                                     rule.roughness)) /
                                     samples_.bright[i]);
        }
    }

    DeviceImpl& device_;
    Samples samples_;
    std::span<const LightDirection> lights_;
};

using JudgedRule = std::pair<PixelRule, double>;

JudgedRule best_lobe(const Judge& judge, const ReliefOptions& options) {
    JudgedRule best{{LightRule::lobe, 0.0, 1.0, options.roughness.value_or(0.5)}, 0.0};
    best.second = judge(best.first);
    if (!options.roughness && judge.can())
        for (const double roughness : {0.3, 0.8}) {
            const PixelRule other{LightRule::lobe, 0.0, 1.0, roughness};
            if (const double error = judge(other); error < best.second) best = {other, error};
        }
    return best;
}

void choose_best(const Judge& judge, const ReliefOptions& options, ChosenRule& result) {
    result.rule.rule = LightRule::huber;
    result.left_out_error = judge(result.rule);
    if (!judge.can()) return;
    PixelRule ambient = result.rule;
    ambient.rule = LightRule::amb;
    const double error = judge(ambient);
    if (error < result.left_out_error || (judge.few() && error < worth_a_case * result.left_out_error)) {
        result.rule = ambient;
        result.left_out_error = error;
    }
    if (!judge.few())
        if (const auto [lobe, of_lobe] = best_lobe(judge, options);
            of_lobe < worth_a_case * result.left_out_error) {
            result.rule = lobe;
            result.left_out_error = of_lobe;
        }
    const bool resists_shadow = judge.few() && result.rule.rule == LightRule::amb;
    if ((resists_shadow ? worth_a_case : 1.0) * result.least_squares < result.left_out_error) {
        result.rule.rule = LightRule::ls;
        result.left_out_error = result.least_squares;
    }
}

}  // namespace

std::vector<LightDirection> lights_kept(std::span<const LightDirection> lights, int part) {
    std::vector<LightDirection> kept;
    for (size_t k = 0; k < lights.size(); ++k)
        if (!is_left_out(static_cast<int>(k), part)) kept.push_back(lights[k]);
    return kept;
}

std::vector<float> values_kept(std::span<const float> stack, int lights, size_t of_light, int left_out) {
    std::vector<float> kept;
    for (int k = 0; k < lights; ++k) {
        const auto part = stack.subspan(static_cast<size_t>(k) * of_light, of_light);
        if (!is_left_out(k, left_out)) kept.insert(kept.end(), part.begin(), part.end());
    }
    return kept;
}

ChosenCoding choose_coding(const LightStack& stack, std::span<const LightDirection> lights,
                           const ReliefOptions& options) {
    ChosenCoding result{options.coding, {}};
    if (options.coding == LightCoding::automatic) result.coding = LightCoding::linear;
    if (!stack.integers() || options.coding == LightCoding::gamma) return result;
    const double linear = left_by_least_squares(stack, lights, LightCoding::linear);
    const double srgb = left_by_least_squares(stack, lights, LightCoding::srgb);
    const LightCoding likelier = srgb < linear ? LightCoding::srgb : LightCoding::linear;
    const std::string figures = "least squares leave " + percent(linear) +
                                " of what is bright of linear values, " + percent(srgb) +
                                " of sRGB-encoded ones";
    if (options.coding == LightCoding::automatic) {
        result.coding = likelier;
        // What 16 bits hold is linear, unless somebody encoded it: say so.
        if (likelier == LightCoding::srgb && stack.type() == PixelType::uint16)
            result.remarks.push_back("16-bit values are taken as sRGB-encoded: " + figures);
    } else if (likelier != options.coding) {
        result.remarks.push_back("values look " +
                                 std::string(likelier == LightCoding::srgb ? "sRGB-encoded" : "linear") +
                                 ", other than stated: " + figures);
    }
    return result;
}

ChosenRule choose_rule(DeviceImpl& device, const LightStack& stack, std::span<const LightDirection> lights,
                       const LightDecoder& decoder, const ReliefOptions& options) {
    const Judge judge(device, samples_of(stack, decoder), lights);
    ChosenRule result;
    result.least_squares = judge({LightRule::ls});
    result.rule = {options.rule, options.low, options.high, options.roughness.value_or(0.5), judge.few()};
    if (options.rule == LightRule::automatic)
        choose_best(judge, options, result);
    else if (options.rule == LightRule::lobe)
        std::tie(result.rule, result.left_out_error) = best_lobe(judge, options);
    else
        result.left_out_error = judge(result.rule);
    return result;
}

}  // namespace btfield::detail

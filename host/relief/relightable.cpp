#include "btfield/relightable.hpp"

#include <algorithm>
#include <cmath>
#include <span>

#include "btfield/error.hpp"
#include "host/base/decompositions.hpp"
#include "host/base/parallel.hpp"
#include "host/base/srgb_curve.hpp"
#include "host/base/stop.hpp"
#include "host/base/text.hpp"
#include "host/relief/light_directions.hpp"
#include "host/relief/light_stack.hpp"
#include "host/relief/rule_choice.hpp"

namespace btfield {

using namespace detail;

namespace {

using std::size_t;

constexpr size_t terms = 6;
using Terms = std::array<double, terms>;

Terms terms_of(const LightDirection& light) {
    const auto [x, y, z] = light;
    return {1.0, x, y, x * x, x * y, y * y};
}

/// From linear light to what a screen takes.
class ScreenCoding {
  public:
    explicit ScreenCoding(double white) : scale_(static_cast<float>(last / white)) {
        table_.resize(static_cast<size_t>(last) + 1);
        for (size_t i = 0; i < table_.size(); ++i) {
            table_[i] = static_cast<float>(srgb_encoded(static_cast<double>(i) / last));
        }
    }
    [[nodiscard]] float operator()(float linear) const {
        const float at = std::min(std::abs(linear) * scale_, static_cast<float>(last));
        return table_[static_cast<size_t>(std::lround(at))];
    }

  private:
    static constexpr double last = 65535.0;
    float scale_;
    std::vector<float> table_;
};

/// What values under the lights are multiplied with, [term][light]: least squares, the least coefficients
/// where lights tell no more.
std::vector<std::vector<float>> solver_of(std::span<const LightDirection> lights,
                                          std::vector<std::string>& remarks) {
    const auto count = static_cast<Eigen::Index>(lights.size());
    Eigen::MatrixXd a(count, static_cast<Eigen::Index>(terms));
    for (Eigen::Index k = 0; k < count; ++k) {
        const Terms row = terms_of(lights[static_cast<size_t>(k)]);
        for (size_t t = 0; t < terms; ++t) a(k, static_cast<Eigen::Index>(t)) = row[t];
    }
    constexpr double negligible = 0.01;
    Eigen::MatrixXcd moments(static_cast<Eigen::Index>(terms), static_cast<Eigen::Index>(terms));
    for (Eigen::Index t = 0; t < moments.rows(); ++t)
        for (Eigen::Index u = 0; u < moments.cols(); ++u)
            moments(t, u) = a.col(t).dot(a.col(u)) / static_cast<double>(count);
    if (std::sqrt(smallest_singular_value(moments)) < negligible)
        remarks.emplace_back(
            "lights lie on a ring or a line: what is shown under others between them is a guess");
    std::vector<std::vector<float>> solver(terms, std::vector<float>(lights.size()));
    for (Eigen::Index k = 0; k < count; ++k) {
        const Eigen::VectorXd x = least_norm_solution(a, Eigen::VectorXd::Unit(count, k), negligible);
        for (size_t t = 0; t < terms; ++t)
            solver[t][static_cast<size_t>(k)] = static_cast<float>(x[static_cast<Eigen::Index>(t)]);
    }
    return solver;
}

double white_of(const LightStack& stack, const LightDecoder& decoder, bool intensities) {
    if (stack.integers() && !intensities) return 1.0;
    std::vector<float> values = stack.samples();
    const size_t each = stack.sampled().size();
    for (size_t i = 0; i < values.size(); ++i) {
        const auto plane = static_cast<int>(i / each);
        values[i] = std::abs(decoder(values[i], stack.gain(plane / stack.planes(), plane % stack.planes())));
    }
    const auto at = values.begin() + static_cast<std::ptrdiff_t>((values.size() - 1) * 999 / 1000);
    std::nth_element(values.begin(), at, values.end());
    return *at > 0.0F ? static_cast<double>(*at) : 1.0;
}

/// ShownRows of all pictures at once.
struct ShownRows {
    size_t first = 0, pixels = 0;
    std::vector<float> values;  ///< [light][plane][pixel], as a screen takes them
};

/// Puts the coefficients of some pixels in their places.
/// \returns the sum of squares of what is left
double fit_part(const ShownRows& rows, size_t begin, size_t end, int plane,
                const std::vector<std::vector<float>>& solver, std::span<const LightDirection> lights,
                LightPolynomial& result) {
    const auto planes = static_cast<size_t>(result.planes);
    const size_t count = end - begin;
    std::array<std::vector<float>, terms> sums;
    for (std::vector<float>& sum : sums) sum.assign(count, 0.0F);
    const auto values = [&](size_t k) {
        return rows.values.data() + (k * planes + static_cast<size_t>(plane)) * rows.pixels + begin;
    };
    for (size_t k = 0; k < lights.size(); ++k)
        for (size_t t = 0; t < terms; ++t) {
            const float weight = solver[t][k];
            float* const sum = sums[t].data();
            const float* const of = values(k);
            for (size_t i = 0; i < count; ++i) sum[i] += weight * of[i];
        }
    double left = 0.0;
    std::vector<float> rest(count);
    for (size_t k = 0; k < lights.size(); ++k) {
        std::copy_n(values(k), count, rest.begin());
        const Terms row = terms_of(lights[k]);
        for (size_t t = 0; t < terms; ++t) {
            const auto weight = static_cast<float>(row[t]);
            for (size_t i = 0; i < count; ++i) rest[i] -= weight * sums[t][i];
        }
        for (const float value : rest) left += static_cast<double>(value) * static_cast<double>(value);
    }
    for (size_t t = 0; t < terms; ++t)
        std::ranges::copy(sums[t], result.coefficients.plane(static_cast<int>(t) * result.planes + plane)
                                       .subspan(rows.first + begin, count)
                                       .begin());
    return left;
}

/// \returns the sum of squares of what is left
double fit_rows(const ShownRows& rows, const std::vector<std::vector<float>>& solver,
                std::span<const LightDirection> lights, LightPolynomial& result) {
    constexpr size_t pixels_of_part = 4096;
    const auto parts = static_cast<int>((rows.pixels + pixels_of_part - 1) / pixels_of_part);
    std::vector<double> left(static_cast<size_t>(parts), 0.0);
    for_each_block(parts, [&](int part) {
        const size_t begin = static_cast<size_t>(part) * pixels_of_part;
        const size_t end = std::min(rows.pixels, begin + pixels_of_part);
        for (int p = 0; p < result.planes; ++p)
            left[static_cast<size_t>(part)] += fit_part(rows, begin, end, p, solver, lights, result);
    });
    double all = 0.0;
    for (const double each : left) all += each;
    return all;
}

}  // namespace

LightPolynomial fit_light_polynomial(Device& device, const LightSet& lights, const ReliefOptions& options) {
    std::vector<LightDirection> directions;
    for (const LightPicture& light : lights.lights) directions.push_back(light.direction);
    const std::string asked = "fit a polynomial of the light";
    check_directions(directions, asked);
    if (directions.size() < terms)
        throw InputError(asked, "there are " + counted(directions.size(), "light"), "give six or more");
    constexpr double share_of_pictures = 0.4;
    const LightStack stack(lights, options, share_of_pictures * device.impl().memory_limit(),
                           device.impl().tuning().stack_values);
    ReliefOptions taken = options;
    if (lights.layout == "btf" && options.coding == LightCoding::automatic &&
        stack.type() == PixelType::uint8)
        taken.coding = LightCoding::srgb;
    const LightDecoder decoder(choose_coding(stack, directions, taken).coding, options.gamma,
                               stack.integers());
    LightPolynomial result;
    result.planes = stack.planes();
    result.coefficients = Image(stack.size(), static_cast<int>(terms) * stack.planes());
    result.white = white_of(stack, decoder, std::ranges::any_of(lights.lights, [](const LightPicture& each) {
                                return !each.intensity.empty();
                            }));
    const std::vector<std::vector<float>> solver = solver_of(directions, result.remarks);
    const ScreenCoding coding(result.white);
    ShownRows rows;
    double left = 0.0;
    for (int row = 0; row < stack.size().height; row += stack.rows_of_strip()) {
        stop_if_asked();
        const int count = std::min(stack.rows_of_strip(), stack.size().height - row);
        const auto width = static_cast<size_t>(stack.size().width);
        rows.first = static_cast<size_t>(row) * width;
        rows.pixels = static_cast<size_t>(count) * width;
        stack.rows(row, count, decoder, rows.values);
        for_each_block(stack.lights(), [&](int k) {
            const size_t of_light = static_cast<size_t>(stack.planes()) * rows.pixels;
            for (float& value : std::span(rows.values).subspan(static_cast<size_t>(k) * of_light, of_light))
                value = coding(value);
        });
        left += fit_rows(rows, solver, directions, result);
        if (options.progress) options.progress("fit", static_cast<double>(row + count) / stack.size().height);
    }
    const double values =
        static_cast<double>(area(stack.size())) * stack.planes() * static_cast<double>(directions.size());
    result.error = std::sqrt(left / values);
    return result;
}

Image relight(const LightPolynomial& polynomial, const std::array<double, 3>& light) {
    const double length = std::hypot(light[0], light[1], light[2]);
    if (!(light[2] > 0.0) || !std::isfinite(length))
        throw InputError("relight a polynomial", "the light is behind the surface", "give z above 0");
    const Terms row = terms_of({light[0] / length, light[1] / length, light[2] / length});
    Image image(polynomial.coefficients.size(), polynomial.planes,
                polynomial.planes == 3 ? ColourSpace::srgb : ColourSpace::unspecified);
    for (size_t t = 0; t < terms; ++t)
        for (int p = 0; p < polynomial.planes; ++p) {
            const auto from = polynomial.coefficients.plane(static_cast<int>(t) * polynomial.planes + p);
            const auto weight = static_cast<float>(row[t]);
            for (size_t i = 0; i < from.size(); ++i) image.plane(p)[i] += weight * from[i];
        }
    return image;
}

RelightablePlanes relightable_planes(const LightPolynomial& polynomial) {
    if (polynomial.planes != 1 && polynomial.planes != 3)
        throw InputError("put a polynomial of the light into pictures",
                         "its pictures have " + counted(polynomial.planes, "plane"),
                         "give pictures of one plane or three");
    RelightablePlanes result;
    for (size_t t = 0; t < terms; ++t) {
        Image& picture = result.pictures.emplace_back(polynomial.coefficients.size(), 3, ColourSpace::srgb);
        for (int p = 0; p < 3; ++p) {
            const auto from = polynomial.coefficients.plane(static_cast<int>(t) * polynomial.planes +
                                                            std::min(p, polynomial.planes - 1));
            std::vector<float> sorted(from.begin(), from.end());
            const size_t cut = sorted.size() / 2000;
            const auto low = sorted.begin() + static_cast<std::ptrdiff_t>(cut);
            const auto high = sorted.end() - 1 - static_cast<std::ptrdiff_t>(cut);
            std::nth_element(sorted.begin(), low, sorted.end());
            const auto least = static_cast<double>(*low);
            std::nth_element(sorted.begin(), high, sorted.end());
            const double scale = std::max(static_cast<double>(*high) - least, 1.0 / 255.0);
            for (size_t i = 0; i < from.size(); ++i)
                picture.plane(p)[i] =
                    static_cast<float>(std::clamp((static_cast<double>(from[i]) - least) / scale, 0.0, 1.0));
            result.scale.push_back(scale);
            result.bias.push_back(-least / scale);
        }
    }
    return result;
}

}  // namespace btfield

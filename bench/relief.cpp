// Relief: normals of 96 pictures, and heights of their slopes.
#include "btfield/relief.hpp"

#include <cmath>
#include <cstdint>
#include <memory>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include "bench/cases.hpp"
#include "bench/peers/relief.hpp"
#include "bench/report.hpp"
#include "btfield/height.hpp"

namespace btfield::bench {
namespace {

using std::size_t;

constexpr int light_count = 96;
constexpr Size stack_size{1024, 1024};
constexpr int tile = 256;
constexpr Size height_size{2048, 2048};

/// Any number in [0, 1) for a place: noise that costs nothing.
double scattered(std::uint32_t at) {
    at = (at ^ (at >> 16U)) * 0x7feb352dU;
    at = (at ^ (at >> 15U)) * 0x846ca68bU;
    return (at ^ (at >> 16U)) / 4294967296.0;
}

/// Hills that repeat, glossy, with a tenth of the values in cast shadow and noise of some percent.
struct Stack {
    std::vector<std::array<double, 3>> lights;
    std::vector<Image> pictures;

    Stack() {
        for (int k = 0; k < light_count; ++k) {
            const double theta =
                (15.0 + 50.0 * ((k * 7) % light_count) / light_count) / 180.0 * std::numbers::pi;
            const double phi = 2.0 * std::numbers::pi * k * 0.381966;
            lights.push_back(
                {std::sin(theta) * std::cos(phi), std::sin(theta) * std::sin(phi), std::cos(theta)});
        }
        for (int k = 0; k < light_count; ++k) pictures.push_back(under(k));
    }

    [[nodiscard]] Image under(int light) const {
        const std::array<double, 3>& l = lights[static_cast<size_t>(light)];
        const double half = std::hypot(l[0], l[1], l[2] + 1.0), turn = 2.0 * std::numbers::pi / tile;
        Image image(stack_size, 1, ColourSpace::linear);
        for (int r = 0; r < tile; ++r)
            for (int c = 0; c < tile; ++c) {
                const double p = 0.6 * std::cos(3 * turn * c + turn * r), q = 0.5 * std::sin(5 * turn * r);
                const double length = std::sqrt(1.0 + p * p + q * q);
                const double shade = std::max(0.0, (l[2] - p * l[0] + q * l[1]) / length);
                const double cosine = ((l[2] + 1.0) - p * l[0] + q * l[1]) / (length * half);
                const double root = 0.09 / (cosine * cosine * (0.09 - 1.0) + 1.0);
                const auto at = static_cast<std::uint32_t>((light * tile + r) * tile + c);
                const double lit = scattered(at) < 0.1 ? 0.0 : 0.5 * shade + 0.3 * root * root;
                const auto value =
                    static_cast<float>((lit + 0.02) * (0.96 + 0.08 * scattered(at + 0x40000000U)));
                for (int y = r; y < stack_size.height; y += tile)
                    for (int x = c; x < stack_size.width; x += tile) image.at(0, y, x) = value;
            }
        return image;
    }
};

std::shared_ptr<const Stack> stack() {
    static const auto kept = std::make_shared<const Stack>();
    return kept;
}

/// All values are read once, and what is found is written.
Work work_of_stack() {
    const auto pixels = static_cast<double>(area(stack_size));
    return {.items = pixels, .bytes = (light_count + 5.0) * pixels * sizeof(float)};
}

void add_rule(const std::string& name, LightRule rule) {
    add(name, [rule] {
        const auto lit = stack();
        ReliefOptions options;
        options.rule = rule;
        return std::pair(
            work_of_stack(), std::function<void()>([lit, options] {
                benchmark::DoNotOptimize(fit_relief(device(), lit->pictures, lit->lights, options));
            }));
    });
}

void check_peer(const Stack& lit, LightRule rule, const peer::PixelNormals& there) {
    ReliefOptions options;
    options.rule = rule;
    const Relief here = fit_relief(device(), lit.pictures, lit.lights, options);
    // Weights of Huber depend on medians, which are rounded here.
    const double tolerance = rule == LightRule::ls ? 1e-5 : 0.02;
    double sum = 0.0;
    for (size_t i = 0; i < there.normals.values().size(); ++i)
        sum += std::abs(static_cast<double>(here.normals.values()[i] - there.normals.values()[i]));
    must_agree(sum / static_cast<double>(there.normals.values().size()), 0.0, tolerance, "normals");
}

void add_peer(const std::string& name, LightRule rule) {
    add(name + peer_suffix, [rule] {
        const auto lit = stack();
        const auto fit = [lit, rule] {
            return rule == LightRule::ls ? peer::least_squares(lit->pictures, lit->lights)
                                         : peer::huber(lit->pictures, lit->lights);
        };
        check_peer(*lit, rule, fit());
        return std::pair(work_of_stack(), std::function<void()>([fit] { benchmark::DoNotOptimize(fit()); }));
    });
}

Image slopes() {
    Image height(height_size, 1);
    for (int r = 0; r < height.height(); ++r)
        for (int c = 0; c < height.width(); ++c)
            height.at(0, r, c) =
                static_cast<float>(5.0 * std::sin(2.0 * std::numbers::pi * (3 * c + r) / 2048.0) +
                                   scattered(static_cast<std::uint32_t>(r * height.width() + c)));
    return slopes_of_height(height, SurfaceEdges::periodic);
}

Work work_of_height() {
    const auto pixels = static_cast<double>(area(height_size));
    return {.items = pixels, .bytes = 3.0 * pixels * sizeof(float)};
}

void add_integration(const std::string& name, SurfaceEdges edges) {
    add(name, [edges] {
        const auto given = std::make_shared<Image>(slopes());
        IntegrationOptions options;
        options.edges = edges;
        return std::pair(work_of_height(), std::function<void()>([given, options] {
                             benchmark::DoNotOptimize(integrate(device(), *given, options));
                         }));
    });
}

void check_integration(const Image& given, const Image& there) {
    IntegrationOptions options;
    options.edges = SurfaceEdges::periodic;
    const Image here = integrate(device(), given, options);
    // Heights up to 6, through transforms of float32 in which long waves are amplified.
    for (size_t i = 0; i < here.values().size(); i += 97)
        must_agree(here.values()[i], there.values()[i], 0.01, "heights");
}

}  // namespace

void add_relief() {
    const std::string of = ", 96 lights 1024";
    add_rule("relief ls" + of, LightRule::ls);
    add_peer("relief ls" + of, LightRule::ls);
    add_rule("relief ranks" + of, LightRule::ranks);
    add_rule("relief huber" + of, LightRule::huber);
    add_peer("relief huber" + of, LightRule::huber);
    add_rule("relief amb" + of, LightRule::amb);
    add_rule("relief lobe" + of, LightRule::lobe);
    add_rule("relief auto" + of, LightRule::automatic);
    const std::string name = "relief height of slopes 2048, ";
    add_integration(name + "periodic", SurfaceEdges::periodic);
    add(name + "periodic" + peer_suffix, [] {
        const auto given = std::make_shared<Image>(slopes());
        const auto integrator = std::make_shared<peer::Integrator>(height_size);
        check_integration(*given, (*integrator)(*given));
        return std::pair(work_of_height(), std::function<void()>([given, integrator] {
                             benchmark::DoNotOptimize((*integrator)(*given));
                         }));
    });
    add_integration(name + "mirrored", SurfaceEdges::mirror);
}

}  // namespace btfield::bench

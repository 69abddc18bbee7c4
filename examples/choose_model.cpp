// Fits several models to one picture and tells them apart: choose_model PICTURE [MODEL…]
//
// One Analysis serves all fits: planes, pyramid and lag covariances are computed once. Without names all ten
// models are fitted. Prints per model whether every level is certified, the estimators that the levels took,
// the numbers that it stores, how many times less that is than the pixels, and how far the covariances that
// it promises are from the picture's.
#include <cmath>
#include <cstddef>
#include <cstdio>
#include <string>
#include <utility>
#include <vector>

#include "btfield/error.hpp"
#include "btfield/fit.hpp"
#include "btfield/image_io.hpp"
#include "btfield/lag_covariance.hpp"
#include "btfield/theory.hpp"

namespace {

/// "ls", or "ml ls ls" where levels differ, finest first.
std::string estimators(const btfield::TextureModel& model) {
    std::string text;
    for (const btfield::LevelModel& level : model.levels)
        text += (text.empty() ? "" : " ") + std::string(name(level.estimator));
    return text;
}

/// Mean |C_ii(s) of the model − C_ii(s) of the picture| / C_ii(0) of the picture, textures averaged over
/// seeds.
/// \param picture  its covariances at probe_lags(), the first of which is 0
double covariance_error(const btfield::TextureModel& model, const std::vector<double>& picture) {
    const std::vector<double> promised =
        theoretical_covariance(model, model.size, btfield::probe_lags(model.size));
    const auto d = static_cast<std::size_t>(model.planes);
    double sum = 0.0;
    std::size_t terms = 0;
    for (std::size_t lag = 0; lag < picture.size(); lag += d * d) {
        for (std::size_t i = 0; i < d * d; i += d + 1, ++terms) {  // the diagonal
            if (picture[i] > 0.0) sum += std::abs(promised[lag + i] - picture[lag + i]) / picture[i];
        }
    }
    return sum / static_cast<double>(terms);
}

void report(btfield::Analysis& analysis, btfield::ModelKind kind, const std::vector<double>& picture,
            btfield::PixelType type) {
    const std::string label{name(kind)};
    btfield::FitOptions options;
    options.model = kind;
    try {
        const btfield::TextureModel model = analysis.fit(options);
        const bool certified = is_valid(model);
        const auto bytes = static_cast<double>(analysis.image().values().size()) * bytes_per_value(type);
        const auto numbers = parameter_count(model);
        std::printf("%-8s %-9s %-16s %8zu %9.0f", label.c_str(), certified ? "certified" : "invalid",
                    estimators(model).c_str(), numbers,
                    bytes / (sizeof(double) * static_cast<double>(numbers)));
        if (certified) std::printf("  %.4f", covariance_error(model, picture));
        std::printf("\n");
    } catch (const btfield::InputError& error) {
        // A model that this picture cannot have: the others are not affected.
        std::printf("%-8s %s\n", label.c_str(), error.what());
    }
}

}  // namespace

int main(int count, char** arguments) {
    if (count < 2) {
        std::fprintf(stderr, "usage: choose_model PICTURE [MODEL...]\n");
        return 2;
    }
    try {
        std::vector<btfield::ModelKind> kinds;
        for (int i = 2; i < count; ++i) kinds.push_back(btfield::model_kind(arguments[i]));
        if (kinds.empty()) kinds.assign(btfield::model_kinds().begin(), btfield::model_kinds().end());

        btfield::Picture picture = btfield::read_picture(arguments[1]);
        const std::vector<double> covariances =
            covariances_at(picture.image, btfield::probe_lags(picture.image.size()));
        btfield::Device device;
        btfield::Analysis analysis(device, std::move(picture.image));
        std::printf("model    levels    estimators       numbers  x smaller  covariances off by\n");
        for (const btfield::ModelKind kind : kinds) report(analysis, kind, covariances, picture.type);
        return 0;
    } catch (const btfield::Error& error) {
        std::fprintf(stderr, "%s\n", error.what());
        return 1;
    }
}

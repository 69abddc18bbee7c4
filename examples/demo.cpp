// The whole road on one picture, with the time of every stage: demo PICTURE OUTPUT_FOLDER
//
// Fits the picture, grows a texture of twice its width and height, and writes the model, the texture, and a
// picture that shows original and texture side by side.
#include <algorithm>
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <string>

#include "btfield/criteria.hpp"
#include "btfield/error.hpp"
#include "btfield/fit.hpp"
#include "btfield/image_io.hpp"
#include "btfield/model_file.hpp"
#include "btfield/synthesis.hpp"

namespace {

class Stopwatch {
  public:
    /// Seconds since the last call or construction.
    double lap() {
        const auto now = std::chrono::steady_clock::now();
        const double seconds = std::chrono::duration<double>(now - start_).count();
        start_ = now;
        return seconds;
    }

  private:
    std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

void tell(const std::string& stage, double seconds) {
    std::printf("  %-26s %9.1f ms\n", stage.c_str(), 1e3 * seconds);
    std::fflush(stdout);
}

void paste(const btfield::Image& source, btfield::Image& target, int column) {
    for (int p = 0; p < target.planes(); ++p)
        for (int r = 0; r < source.height(); ++r)
            for (int c = 0; c < source.width(); ++c) target.at(p, r, column + c) = source.at(p, r, c);
}

/// Left the original, right the texture, on white; tops aligned.
btfield::Image side_by_side(const btfield::Image& original, const btfield::Image& texture) {
    const int gap = 16;
    btfield::Image both(
        {std::max(original.height(), texture.height()), original.width() + gap + texture.width()},
        original.planes(), original.space());
    std::ranges::fill(both.values(), 1.0F);
    paste(original, both, 0);
    paste(texture, both, original.width() + gap);
    return both;
}

void run(const std::filesystem::path& source, const std::filesystem::path& folder) {
    const std::string stem = source.stem().string();
    std::filesystem::create_directories(folder);
    Stopwatch total;
    Stopwatch watch;

    btfield::Device device;
    std::printf("Device: %s, %d compute units, kernels on %d lanes.\n", device.info().name.c_str(),
                device.info().compute_units, device.vector_width());
    tell("open device", watch.lap());

    const btfield::Picture picture = btfield::read_picture(source);
    const btfield::Image& original = picture.image;
    std::printf("Picture: %s, %d x %d pixels, %d planes.\n", source.c_str(), original.width(),
                original.height(), original.planes());
    tell("read", watch.lap());

    btfield::FitOptions options;
    options.progress = [](std::string_view stage, double seconds) { tell(std::string(stage), seconds); };
    std::printf("Fit: %s, order %d.\n", std::string(name(options.model)).c_str(), options.order);
    btfield::TextureModel model = btfield::fit(device, original, options);
    model.provenance.source = source.filename().string();
    model.provenance.type = picture.type;
    model.provenance.picture_bytes =
        original.values().size() * static_cast<std::size_t>(btfield::bytes_per_value(picture.type));
    tell("whole fit", watch.lap());

    const std::filesystem::path model_path = folder / (stem + ".json");
    btfield::write_model(model_path, model);
    const btfield::TextureModel loaded = btfield::read_model(model_path);
    std::printf("Model: %zu levels, %zu numbers for %zu pixel values, in %s.\n", model.levels.size(),
                btfield::parameter_count(model), original.values().size(), model_path.c_str());
    tell("write and read model", watch.lap());

    const btfield::Size size{2 * original.height(), 2 * original.width()};
    std::printf("Texture: %d x %d pixels, twice the width and height, 4 times the area of the picture.\n",
                size.width, size.height);
    btfield::Synthesiser synthesiser(device, loaded, size);
    tell("kernels, plans, factors", watch.lap());
    const std::uint64_t seed = 1;
    const btfield::Image texture = synthesiser.synthesise(seed);
    tell("synthesise", watch.lap());
    [[maybe_unused]] const btfield::Image again = synthesiser.synthesise(seed + 1);
    tell("synthesise another seed", watch.lap());

    const btfield::Comparison likeness = btfield::compare(original, texture);
    std::printf("Likeness: mean lag-covariance error %.4f; standard deviation, texture / picture:",
                likeness.lag_covariance_error);
    for (const auto& plane : likeness.planes) std::printf(" %.3f", plane.std_ratio);
    std::printf(".\n");
    tell("compare", watch.lap());

    const std::filesystem::path texture_path = folder / (stem + "-4x.png");
    const std::filesystem::path both_path = folder / (stem + "-side-by-side.png");
    btfield::write_picture(texture_path, texture, picture.type);
    btfield::write_picture(both_path, side_by_side(original, texture), picture.type);
    tell("write pictures", watch.lap());
    tell("total", total.lap());
    std::printf("Wrote %s (texture alone) and\n      %s (picture left, texture right).\n",
                texture_path.c_str(), both_path.c_str());
}

}  // namespace

int main(int count, char** arguments) {
    if (count != 3) {
        std::fprintf(stderr, "usage: demo PICTURE OUTPUT_FOLDER\n");
        return 2;
    }
    try {
        run(arguments[1], arguments[2]);
        return 0;
    } catch (const btfield::DeviceError& error) {
        std::fprintf(stderr, "%s\n", error.what());
        return 3;
    } catch (const std::exception& error) {
        std::fprintf(stderr, "%s\n", error.what());
        return 1;
    }
}

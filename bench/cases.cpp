#include "bench/cases.hpp"

#include <cmath>
#include <memory>
#include <stdexcept>
#include <string>

#include "btfield/image_io.hpp"

namespace btfield::bench {

void add_all() {
    add_ceiling();
    add_noise();
    add_fft();
    add_spectral_factors();
    add_spectral_root();
    add_pyramid();
    add_plane_restorer();
    add_lag_covariance();
    add_fit();
    add_models();
    add_convolution();
    add_causal_recursion();
    add_synthesis();
    add_experiment();
    add_memd();
    add_roller();
    add_compound();
    add_relief();
    add_btf();
    add_png();
}

namespace {

std::unique_ptr<Device>& shared_device() {
    static std::unique_ptr<Device> device;
    return device;
}

}  // namespace

Device& device() {
    auto& opened = shared_device();
    if (!opened) opened = std::make_unique<Device>();
    return *opened;
}

void close_device() {
    shared_device().reset();
}

Image picture(Size size) {
    static const Image cork = read_picture(BTFIELD_TEST_DATA "/cork.png").image;
    Image result(size, cork.planes(), cork.space());
    for (int p = 0; p < cork.planes(); ++p)
        for (int r = 0; r < size.height; ++r)
            for (int c = 0; c < size.width; ++c)
                result.at(p, r, c) = cork.at(p, r % cork.height(), c % cork.width());
    return result;
}

TextureModel model(int order, int levels) {
    FitOptions options;
    options.marginals = MarginalMode::none;  // as the peers
    options.order = order;
    options.levels = levels;
    return fit(device(), picture({512, 512}), options);
}

void must_agree(double a, double b, double tolerance, const char* what) {
    if (!(std::abs(a - b) <= tolerance))
        throw std::runtime_error(std::string(what) + ": " + std::to_string(a) + " here, " +
                                 std::to_string(b) + " from the peer");
}

}  // namespace btfield::bench

#include "bench/peers/fft.hpp"

#include <algorithm>

#include "bench/peers/fftw.hpp"
#include "bench/peers/parallel.hpp"

namespace btfield::peer {

Plan::Plan(Size size, int planes, Direction direction, int plan_threads) {
    static const int initialised = fftwf_init_threads();
    (void)initialised;
    fftwf_plan_with_nthreads(plan_threads);
    const std::size_t half = spectrum_size(size);
    auto spectrum = allocate<fftwf_complex>(half * static_cast<std::size_t>(planes));
    auto image = allocate<float>(area(size) * static_cast<std::size_t>(planes));
    const int sides[] = {size.height, size.width};
    const auto spectrum_step = static_cast<int>(half), image_step = static_cast<int>(area(size));
    plan_ = direction == Direction::inverse
                ? fftwf_plan_many_dft_c2r(2, sides, planes, spectrum.get(), nullptr, 1, spectrum_step,
                                          image.get(), nullptr, 1, image_step, FFTW_MEASURE)
                : fftwf_plan_many_dft_r2c(2, sides, planes, image.get(), nullptr, 1, image_step,
                                          spectrum.get(), nullptr, 1, spectrum_step, FFTW_MEASURE);
}

class Fft::Impl {
  public:
    Impl(Size size, int planes)
        : inverse_(size, planes, Plan::Direction::inverse, threads),
          forward_(size, planes, Plan::Direction::forward, threads),
          spectrum_(allocate<fftwf_complex>(spectrum_size(size) * static_cast<std::size_t>(planes))),
          image_(allocate<float>(area(size) * static_cast<std::size_t>(planes))) {
        std::fill_n(&spectrum_[0][0], 2 * spectrum_size(size) * static_cast<std::size_t>(planes), 0.0F);
        std::fill_n(image_.get(), area(size) * static_cast<std::size_t>(planes), 0.0F);
    }
    void inverse() { inverse_.inverse(spectrum_.get(), image_.get()); }
    void forward() { forward_.forward(image_.get(), spectrum_.get()); }

  private:
    Plan inverse_, forward_;
    Buffer<fftwf_complex> spectrum_;
    Buffer<float> image_;
};

Fft::Fft(Size size, int planes) : impl_(std::make_unique<Impl>(size, planes)) {}
Fft::~Fft() = default;
void Fft::inverse() {
    impl_->inverse();
}
void Fft::forward() {
    impl_->forward();
}

}  // namespace btfield::peer

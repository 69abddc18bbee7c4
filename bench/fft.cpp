#include <memory>
#include <string>
#include <vector>

#include "bench/cases.hpp"
#include "bench/peers/fft.hpp"
#include "bench/report.hpp"
#include "host/cl/device_impl.hpp"

namespace btfield::bench {

using namespace detail;

namespace {

struct State {
    Spectrum spectrum;
    Buffer images;
};

/// Spectra read and images written, or the other way round; a transposition between passes is the back end's
/// own.
Work work(Size size, int planes) {
    const double values = static_cast<double>(area(size)) * planes;
    return {.items = values, .bytes = 2 * values * sizeof(float)};
}

void add_case(const std::string& name, FftBackend backend, bool inverse, Size size, int planes) {
    add(name, [=] {
        DeviceImpl& impl = device().impl();
        const std::size_t bytes = spectrum_floats(size, planes) * sizeof(float);
        const std::vector<float> zero(
            std::max(spectrum_floats(size, planes), area(size) * static_cast<std::size_t>(planes)));
        auto state = std::make_shared<State>(
            State{{impl.buffer(bytes), impl.buffer(bytes)},
                  impl.buffer(area(size) * static_cast<std::size_t>(planes) * sizeof(float))});
        impl.write(state->spectrum.re, zero.data(), bytes);
        impl.write(state->spectrum.im, zero.data(), bytes);
        impl.write(state->images, zero.data(), state->images.bytes());
        Fft& fft = impl.ffts().plan(impl, size, backend);
        return std::pair(work(size, planes), std::function<void()>([&impl, &fft, inverse, state, planes] {
                             if (inverse)
                                 fft.inverse(impl, state->spectrum, state->images, planes);
                             else
                                 fft.forward(impl, state->images, state->spectrum, planes);
                             impl.finish();
                         }));
    });
}

}  // namespace

void add_fft() {
    const Size size{512, 512};
    const int planes = 3;
    for (const bool inverse : {true, false}) {
        const std::string name = std::string("fft ") + (inverse ? "c2r" : "r2c") + ", 3 planes of 512";
        add_case(name + " (lanes)", FftBackend::lanes, inverse, size, planes);
        add_case(name + " (clFFT)", FftBackend::clfft, inverse, size, planes);
        for (const char* backend : {" (lanes)", " (clFFT)"})
            add(name + backend + peer_suffix, [=] {
                auto fft = std::make_shared<peer::Fft>(size, planes);
                return std::pair(work(size, planes),
                                 std::function<void()>([=] { inverse ? fft->inverse() : fft->forward(); }));
            });
    }
}

}  // namespace btfield::bench

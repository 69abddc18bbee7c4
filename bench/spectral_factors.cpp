// The spectral solve of a fitted level at 512 x 512: drawn together with its noise, and alone on a given
// spectrum.
#include <array>
#include <cstdint>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "bench/cases.hpp"
#include "bench/peers/fftw.hpp"
#include "bench/peers/parallel.hpp"
#include "bench/peers/spectral_factors.hpp"
#include "bench/report.hpp"
#include "host/synthesis/spectral_factors.hpp"

namespace btfield::bench {

using namespace detail;

namespace {

constexpr Size size{512, 512};
constexpr int order = 3;

/// Half spectra of all planes, written once; `traffic` spectra are moved in all.
Work work(const LinearField& field, double traffic) {
    const double values = static_cast<double>(area(size)) * field.planes;
    return {.items = values, .bytes = traffic * values * sizeof(float)};
}

void add_case(const std::string& name, bool draw, double budget) {
    add(name, [=] {
        struct State {
            TextureModel fitted;
            std::unique_ptr<SpectralFactors> factors;
            Spectrum spectrum;
            Buffer keys;
        };
        DeviceImpl& impl = device().impl();
        auto state = std::make_shared<State>();
        state->fitted = model(order, 1);
        const LinearField& field = linear_field(state->fitted.levels.front().models.front());
        state->factors = std::make_unique<SpectralFactors>(impl, std::vector<SpectralForm>{field}, size, 1.0,
                                                           state->fitted.mean, budget);
        state->factors->store(impl);
        const std::vector<float> zero(spectrum_floats(size, field.planes));
        state->spectrum = {impl.upload(zero), impl.upload(zero)};
        state->keys = impl.upload(std::vector<std::array<std::uint32_t, 2>>{{1, 0}});
        return std::pair(work(field, draw ? 1 : 2), std::function<void()>([&impl, state, draw] {
                             if (draw)
                                 state->factors->draw(impl, state->spectrum, state->keys, 1, 0);
                             else
                                 state->factors->filter(impl, state->spectrum, 1);
                             impl.finish();
                         }));
    });
}

}  // namespace

void add_spectral_factors() {
    const double unlimited = std::numeric_limits<double>::max();
    const std::string name = "noise and solve 512 rgb order 3";
    for (const char* stored : {", stored factors", ", factors on the fly"}) {
        add_case(name + stored, true, stored[2] == 's' ? unlimited : 0);
        add(name + stored + peer_suffix, [] {
            const TextureModel fitted = model(order, 1);
            const LinearField& field = linear_field(fitted.levels.front().models.front());
            auto factors = std::make_shared<peer::SpectralFactors>(field, size, 1.0);
            const std::shared_ptr<fftwf_complex[]> spectrum = peer::allocate<fftwf_complex>(
                peer::spectrum_size(size) * static_cast<std::size_t>(field.planes));
            return std::pair(work(field, 1), std::function<void()>([factors, spectrum] {
                                 peer::parallel([&](int t) {
                                     peer::NoiseSource source(static_cast<std::uint64_t>(t));
                                     factors->draw(source, peer::share(factors->blocks(), t),
                                                   peer::share(factors->blocks(), t + 1), spectrum.get());
                                 });
                             }));
        });
    }
    add_case("solve alone 512 rgb order 3, stored factors", false, unlimited);
    add_case("solve alone 512 rgb order 3, factors on the fly", false, 0);
}

}  // namespace btfield::bench

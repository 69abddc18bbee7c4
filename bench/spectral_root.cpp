// Factors of the Markov random fields from given matrices, one per frequency of a 512 x 512 half spectrum.
#include <cmath>
#include <complex>
#include <memory>
#include <random>
#include <string>
#include <vector>

#include "bench/cases.hpp"
#include "bench/peers/spectral_root.hpp"
#include "bench/report.hpp"
#include "host/cl/device_impl.hpp"

namespace btfield::bench {

using namespace detail;

namespace {

using Complex = std::complex<float>;

constexpr Size size{512, 512};

/// Hermitian, diagonally dominant (entries aside are below sqrt 2): [i][j][matrix] and [matrix][i][j].
struct Matrices {
    std::size_t d, count;
    std::vector<float> re, im, root;
    std::vector<Complex> rows;

    explicit Matrices(int planes)
        : d(static_cast<std::size_t>(planes)),
          count(spectrum_floats(size, 1)),
          re(d * d * count),
          im(d * d * count),
          root(d * d),
          rows(d * d * count) {
        std::mt19937 generator(1);
        std::uniform_real_distribution<float> uniform(-1.0F, 1.0F);
        for (std::size_t i = 0; i < d; ++i) {
            root[i * d + i] = 1.0F;
            for (std::size_t j = 0; j <= i; ++j)
                for (std::size_t n = 0; n < count; ++n) {
                    const float x = uniform(generator), y = uniform(generator);
                    const Complex value = i == j ? Complex(1.5F * static_cast<float>(d) + x) : Complex(x, y);
                    set(i, j, n, value);
                    set(j, i, n, std::conj(value));
                }
        }
    }
    void set(std::size_t i, std::size_t j, std::size_t n, Complex value) {
        re[(i * d + j) * count + n] = value.real();
        im[(i * d + j) * count + n] = value.imag();
        rows[(n * d + i) * d + j] = value;
    }
    [[nodiscard]] Work work() const {
        const auto entries = static_cast<double>(d * d * count);
        return {.items = static_cast<double>(count), .bytes = 4.0 * entries * sizeof(float)};
    }
};

struct OnDevice {
    Buffer re, im, root, out_re, out_im;
    explicit OnDevice(const Matrices& m) {
        DeviceImpl& impl = device().impl();
        re = impl.upload(m.re), im = impl.upload(m.im), root = impl.upload(m.root);
        out_re = impl.buffer(m.re.size() * sizeof(float)), out_im = impl.buffer(m.re.size() * sizeof(float));
    }
    void run(const char* name, int factor, const Matrices& m) const {
        DeviceImpl& impl = device().impl();
        BuildParameters parameters = impl.lanes();
        parameters.set("BTFIELD_PLANES", static_cast<int>(m.d)).set("BTFIELD_FACTOR", factor);
        impl.launch(impl.kernel("spectral_root", name, parameters),
                    {m.count / static_cast<std::size_t>(impl.vector_width())},
                    m.d <= 4 ? Grain::fine : Grain::coarse, re, im, root, out_re, out_im,
                    static_cast<int>(m.count));
        impl.finish();
    }
};

void add_kernel(const std::string& name, const char* kernel, int factor, int planes) {
    add(name, [=] {
        const auto m = std::make_shared<Matrices>(planes);
        const auto state = std::make_shared<OnDevice>(*m);
        return std::pair(m->work(), std::function<void()>([=] { state->run(kernel, factor, *m); }));
    });
}

void check_peer(const Matrices& m, const std::vector<Complex>& factors) {
    const OnDevice state(m);
    state.run("hermitian_root_factors", 1, m);
    std::vector<float> re(m.re.size());
    device().impl().read(state.out_re, re.data(), re.size() * sizeof(float));
    for (std::size_t n = 0; n < m.count; ++n)
        for (std::size_t e = 0; e < m.d * m.d; ++e)
            must_agree(static_cast<double>(re[e * m.count + n]),
                       static_cast<double>(factors[n * m.d * m.d + e].real()), 1e-4, "MMRF factor");
}

}  // namespace

void add_spectral_root() {
    for (const int planes : {1, 3, 6}) {
        const std::string suffix = " 512, " + std::to_string(planes) + (planes == 1 ? " plane" : " planes");
        add_kernel("mmrf factors" + suffix, "hermitian_root_factors", 1, planes);
        add("mmrf factors" + suffix + peer_suffix, [planes] {
            const auto m = std::make_shared<Matrices>(planes);
            const auto factors = std::make_shared<std::vector<Complex>>(m->rows.size());
            peer::mmrf_factors(planes, m->rows, m->root, *factors);
            check_peer(*m, *factors);
            return std::pair(m->work(), std::function<void()>(
                                            [=] { peer::mmrf_factors(planes, m->rows, m->root, *factors); }));
        });
        add_kernel("pmrf factors" + suffix, "hermitian_root_factors", 2, planes);
        add_kernel("general solves" + suffix, "general_solves", 1, planes);
    }
}

}  // namespace btfield::bench

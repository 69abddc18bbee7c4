#include "host/synthesis/plane_restorer.hpp"

#include <memory>
#include <utility>
#include <vector>

#include "bench/cases.hpp"
#include "bench/peers/plane_restorer.hpp"
#include "bench/report.hpp"

namespace btfield::bench {

using namespace detail;

namespace {

constexpr Size size{512, 512};

/// The cork picture on its way in and out.
struct State {
    Image picture;
    SpectralBasis basis;
    GaussianPlanes gaussian;
    State() : picture(bench::picture(size)), basis(spectral_basis(picture)) {
        gaussian = gaussianise(to_eigenplanes(basis, picture));
    }
};

/// Reads and writes each plane once.
Work work(const Image& image) {
    const auto values = static_cast<double>(image.values().size());
    return {.items = values, .bytes = 2.0 * values * sizeof(float)};
}

struct PeerTables {
    std::vector<float> tables, basis, mean;
    explicit PeerTables(const State& state)
        : basis(state.basis.matrix.begin(), state.basis.matrix.end()),
          mean(state.basis.mean.begin(), state.basis.mean.end()) {
        for (const Marginal& marginal : state.gaussian.marginals)
            for (std::size_t k = 0; k < marginal.values.size(); ++k) {
                const double next =
                    k + 1 < marginal.values.size() ? marginal.values[k + 1] : marginal.values[k];
                tables.push_back(static_cast<float>(marginal.values[k]));
                tables.push_back(static_cast<float>(next - marginal.values[k]));
            }
    }
    void restore(Image& planes) const { peer::restore(planes, tables, default_knots, basis, mean); }
};

DevicePlanes upload(const Image& image) {
    return {device().impl().upload(image.values()), image.size(), image.size(), image.planes()};
}

void check_peer(const State& state) {
    Image there = state.gaussian.planes;
    PeerTables(state).restore(there);
    PlaneRestorer restorer(device().impl(), state.basis, state.gaussian.marginals);
    const DevicePlanes restored = restorer.restore(upload(state.gaussian.planes));
    Image here(size, restored.planes);
    device().impl().read(restored.values, here.values().data(), here.values().size_bytes());
    // Rounding of 31 steps and of a place among 32 knots, values up to 1.
    for (std::size_t k = 0; k < here.values().size(); ++k)
        must_agree(here.values()[k], there.values()[k], 100 * 6e-8, "planes");
}

}  // namespace

void add_plane_restorer() {
    const std::string name = "planes, marginals and KLT undone, 512 rgb";
    add(name, [] {
        struct OnDevice {
            State state;
            PlaneRestorer restorer{device().impl(), state.basis, state.gaussian.marginals};
            DevicePlanes planes = upload(state.gaussian.planes);
        };
        const auto on_device = std::make_shared<OnDevice>();
        return std::pair(work(on_device->state.picture), std::function<void()>([on_device] {
                             on_device->planes = on_device->restorer.restore(std::move(on_device->planes));
                             device().impl().finish();
                         }));
    });
    add(name + peer_suffix, [] {
        const auto state = std::make_shared<State>();
        check_peer(*state);
        const auto tables = std::make_shared<PeerTables>(*state);
        const auto image = std::make_shared<Image>(state->gaussian.planes);
        return std::pair(work(*image), std::function<void()>([tables, image] { tables->restore(*image); }));
    });
    add("gaussianise 800 rgb, KLT included", [] {
        const auto image = std::make_shared<Image>(picture({800, 800}));
        return std::pair(
            work(*image), std::function<void()>([image] {
                benchmark::DoNotOptimize(gaussianise(to_eigenplanes(spectral_basis(*image), *image)));
            }));
    });
}

}  // namespace btfield::bench

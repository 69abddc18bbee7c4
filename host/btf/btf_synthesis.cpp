#include <algorithm>
#include <cmath>
#include <numeric>
#include <string>
#include <utility>

#include "btfield/btf_model.hpp"
#include "btfield/error.hpp"
#include "btfield/height.hpp"
#include "btfield/material.hpp"
#include "btfield/synthesis.hpp"
#include "host/base/eigen.hpp"
#include "host/base/parallel.hpp"
#include "host/base/text.hpp"
#include "host/btf/direction_grid.hpp"
#include "host/btf/direction_table.hpp"
#include "host/btf/surface_view.hpp"

namespace btfield {

using namespace detail;

namespace detail {

struct GrownSurface {
    Image surface;
    bool tileable = true;
};

}  // namespace detail

namespace {

/// Planes T with mean 0 and covariance 1 over the surface, as those have that the weights were fitted to:
/// without it, how bright a piece is would depend on the stones that happen to lie in it.
void standardise(Image& surface) {
    const int planes = surface.planes() - 1;
    const auto count = static_cast<double>(area(surface.size()));
    if (count < 4.0 * planes) return;  // too few pixels to tell
    for (int k = 1; k <= planes; ++k) {
        const auto plane = surface.plane(k);
        const double mean =
            std::accumulate(plane.begin(), plane.end(), 0.0, [](double sum, float v) { return sum + v; }) /
            count;
        for (float& value : plane) value = static_cast<float>(value - mean);
    }
    Eigen::MatrixXd covariance(planes, planes);
    for_each_block(planes, [&](int i) {
        const auto a = surface.plane(i + 1);
        for (int j = 0; j <= i; ++j) {
            const auto b = surface.plane(j + 1);
            double sum = 0.0;
            for (std::size_t p = 0; p < a.size(); ++p)
                sum += static_cast<double>(a[p]) * static_cast<double>(b[p]);
            covariance(i, j) = covariance(j, i) = sum / count;
        }
    });
    const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(covariance);
    if (!(solver.eigenvalues()[0] > 1e-3)) return;  // a piece too small for its planes
    const Eigen::VectorXd scale = solver.eigenvalues().cwiseSqrt().cwiseInverse();
    const Eigen::MatrixXd& axes = solver.eigenvectors();
    const Eigen::MatrixXd root = axes * scale.asDiagonal() * axes.transpose();
    const Image before = surface;
    for_each_block(planes, [&](int i) {
        const auto to = surface.plane(i + 1);
        std::ranges::fill(to, 0.0F);
        for (int j = 0; j < planes; ++j) {
            const auto factor = static_cast<float>(root(i, j));
            const auto from = before.plane(j + 1);
            for (std::size_t p = 0; p < to.size(); ++p) to[p] += factor * from[p];
        }
    });
}

GrownSurface grow(Device& device, const BtfModel& model, Size size, std::uint64_t seed, bool allow_invalid) {
    check(model);
    SynthesisOptions options;
    options.allow_invalid = allow_invalid;
    Synthesiser synthesiser(device, model.surface, size, options);
    GrownSurface grown{synthesiser.synthesise(seed), synthesiser.tileable()};
    // The height with its gains.
    const std::vector<Image> maps =
        split_maps(device, model.surface.provenance.maps, grown.surface,
                   grown.tileable ? SurfaceEdges::periodic : SurfaceEdges::mirror);
    std::ranges::copy(maps.front().values(), grown.surface.plane(0).begin());
    standardise(grown.surface);
    return grown;
}

void check_direction(const BtfDirection& direction, const char* what) {
    if (std::isfinite(direction.phi) && direction.theta >= 0.0 && direction.theta <= radians(89.0)) return;
    throw InputError("show a BTF", std::string("the ") + what + " is " + text_of(direction),
                     "directions are above the surface: theta from 0 to 89 degrees");
}

}  // namespace

class BtfSynthesiser::Impl {
  public:
    Impl(Device& device, const BtfModel& model, GrownSurface grown)
        : model_(model),
          grown_(std::move(grown)),
          table_(model_),
          view_(device.impl(), grown_.surface, model.colours) {}

    [[nodiscard]] Image picture(const BtfDirection& view, const BtfDirection& light) const {
        check_direction(view, "view");
        check_direction(light, "light");
        Image image = view_.picture(view.vector(), table_.weights(view, light));
        image.set_space(model_.space);
        image.set_names(model_.names);
        return image;
    }
    [[nodiscard]] const GrownSurface& grown() const { return grown_; }

  private:
    BtfModel model_;
    GrownSurface grown_;
    DirectionTable table_;
    SurfaceView view_;
};

BtfSynthesiser::BtfSynthesiser(Device& device, const BtfModel& model, Size size, std::uint64_t seed,
                               bool allow_invalid)
    : impl_(std::make_unique<Impl>(device, model, grow(device, model, size, seed, allow_invalid))) {}

BtfSynthesiser::BtfSynthesiser(Device& device, const BtfModel& model, const Image& surface) {
    check(model);
    if (surface.planes() != model.planes() + 1)
        throw InputError("show a BTF", "the surface has " + counted(surface.planes(), "plane"),
                         "give the height and the " + counted(model.planes(), "plane") + " of the model");
    impl_ = std::make_unique<Impl>(device, model, GrownSurface{surface, true});
}

BtfSynthesiser::~BtfSynthesiser() = default;
BtfSynthesiser::BtfSynthesiser(BtfSynthesiser&&) noexcept = default;
BtfSynthesiser& BtfSynthesiser::operator=(BtfSynthesiser&&) noexcept = default;

Image BtfSynthesiser::picture(const BtfDirection& view, const BtfDirection& light) const {
    return impl_->picture(view, light);
}

Size BtfSynthesiser::size() const {
    return impl_->grown().surface.size();
}

bool BtfSynthesiser::tileable() const {
    return impl_->grown().tileable;
}

const Image& BtfSynthesiser::surface() const {
    return impl_->grown().surface;
}

}  // namespace btfield

#pragma once
// Stands in for btfield/memd.hpp and Analysis until they are merged.
#include <algorithm>
#include <array>
#include <cmath>
#include <string_view>
#include <vector>

#include "btfield/device.hpp"
#include "btfield/error.hpp"
#include "btfield/fit.hpp"
#include "btfield/image.hpp"

namespace btfield {
enum class Metric { max, l1, l2 };
inline std::string_view name(Metric m) { return m == Metric::max ? "max" : m == Metric::l1 ? "l1" : "l2"; }
inline Metric metric(std::string_view text) {
    for (const Metric m : {Metric::max, Metric::l1, Metric::l2})
        if (name(m) == text) return m;
    throw InputError("read a metric", "no metric", "use max, l1 or l2");
}
enum class MarginalMode { match, none };
inline std::string_view name(MarginalMode mode) { return mode == MarginalMode::match ? "match" : "none"; }
inline std::string_view name(EstimatorChoice choice) {
    return choice == EstimatorChoice::automatic ? "auto" : "ls";
}
struct MemdOptions {
    Metric metric = Metric::max;
    std::array<double, 2> white{1.0, 1.0};
};
struct Memd {
    double memd = 0.0, memd_star = 0.0;
};
class MemdReference {
  public:
    MemdReference(Device&, Image a, const MemdOptions&) : a_(std::move(a)) {}
    Memd operator()(const Image& b) {
        std::vector<char> taken(area(b.size()));
        double sum = 0.0;
        for (std::size_t i = 0; i < area(a_.size()); ++i) {
            float best = INFINITY;
            std::size_t at = 0;
            for (std::size_t j = 0; j < taken.size(); ++j) {
                if (taken[j]) continue;
                float e = 0.0F;
                for (int p = 0; p < b.planes(); ++p) e = std::max(e, std::abs(a_.plane(p)[i] - b.plane(p)[j]));
                if (e < best) best = e, at = j;
            }
            if (std::isinf(best)) break;
            taken[at] = 1;
            sum += 255.0 * static_cast<double>(best);
        }
        Memd r;
        r.memd = sum / static_cast<double>(std::min(area(a_.size()), area(b.size())));
        r.memd_star = r.memd / 2.55;
        return r;
    }
  private:
    Image a_;
};
inline double kappa(const Image&, double) { return 1.0; }
inline std::vector<ModelKind> model_kinds() { return {ModelKind::car3d, ModelKind::msar3d}; }
class Analysis {
  public:
    Analysis(Device& device, Image image) : device_(device), image_(std::move(image)) {}
    const Image& image() const { return image_; }
    TextureModel fit(const FitOptions& options) { return btfield::fit(device_, image_, options); }
  private:
    Device& device_;
    Image image_;
};
}  // namespace btfield

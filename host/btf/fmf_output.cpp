#include "host/btf/fmf_output.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <numbers>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "btfield/error.hpp"
#include "host/base/dense.hpp"
#include "host/base/file_output.hpp"
#include "host/base/half.hpp"
#include "host/btf/byte_file.hpp"
#include "host/btf/direction_grid.hpp"
#include "host/btf/picture_factors.hpp"
#include "host/pictures/colour.hpp"

namespace btfield::detail {
namespace {

using Eigen::Index;
using std::size_t;

/// FMF12 alone is known to all public readers; it has a place for a height map, which may be empty.
constexpr std::string_view signature = "!FMF12FCER";
constexpr std::uint32_t meta_version = 4;

void put_count(ByteWriter& to, size_t count) {
    to.value(static_cast<std::uint32_t>(count));
}

std::vector<std::string> channels_of(const BtfDescription& set) {
    if (set.planes == 3) return {"R", "G", "B"};
    std::vector<std::string> names = set.names;
    names.resize(static_cast<size_t>(set.planes));
    return names;
}

/// What was measured how is not known of a set; pixels per millimetre are 1 then, as in Bonn's own programs.
void put_meta(ByteWriter& to, const BtfDescription& set) {
    const std::vector<std::string> channels = channels_of(set);
    constexpr size_t fixed = 2 * 4 + 3 * 80 + 4 * 4 + 3 * 4;
    size_t size = fixed;
    for (const std::string& name : channels) size += 4 + name.size();
    put_count(to, size);
    to.value(meta_version);
    to.text(std::string(size_t{3} * 80, '\0'));
    for (int i = 0; i < 4; ++i) to.value(1.0F);  // of the resolution, and scales of colours
    to.value(std::uint32_t{set.light_cosine ? 1U : 0U});
    put_count(to, 0);  // XML
    put_count(to, channels.size());
    for (const std::string& name : channels) {
        put_count(to, name.size());
        to.text(name);
    }
}

/// Phi in [−π, π).
void put_direction(ByteWriter& to, const BtfDirection& direction) {
    to.value(static_cast<float>(direction.theta));
    to.value(static_cast<float>(std::remainder(direction.phi, 2.0 * std::numbers::pi)));
}

void put_sampling(ByteWriter& to, const BtfSet& set) {
    const auto views = static_cast<int>(set.views().size()), lights = static_cast<int>(set.lights().size());
    put_count(to, set.views().size());
    for (int v = 0; v < views; ++v) {
        put_direction(to, set.views()[static_cast<size_t>(v)]);
        std::vector<BtfDirection> own;
        for (int l = 0; l < lights; ++l)
            if (set.has(v, l)) own.push_back(set.light(v, l));
        put_count(to, own.size());
        for (const BtfDirection& light : own) put_direction(to, light);
    }
}

/// Values as they are stored, and as they will be read.
class StoredValues {
  public:
    StoredValues(PixelType type, std::string asked)
        : half_(type == PixelType::half), asked_(std::move(asked)) {}
    [[nodiscard]] size_t bytes_per_value() const { return half_ ? sizeof(std::uint16_t) : sizeof(float); }

    /// \param values  become what a reader gets
    void put(ByteWriter& to, std::span<double> values) const {
        std::string bytes(values.size() * bytes_per_value(), '\0');
        for (size_t i = 0; i < values.size(); ++i) {
            const auto single = static_cast<float>(values[i]);
            const std::uint16_t narrow = half_of_float(single);
            const float stored = half_ ? float_of_half(narrow) : single;
            if (!std::isfinite(stored))
                throw InputError(asked_, "a factor is " + std::to_string(values[i]), "write type float");
            std::memcpy(bytes.data() + i * bytes_per_value(),
                        half_ ? static_cast<const void*>(&narrow) : &single, bytes_per_value());
            values[i] = static_cast<double>(stored);
        }
        to.text(bytes);
    }
    /// A matrix, some rows at a time.
    void put(ByteWriter& to, RowMajorMatrix& matrix) const {
        constexpr Index rows_at_once = 4096;
        for (Index row = 0; row < matrix.rows(); row += rows_at_once) {
            const Index count = std::min(rows_at_once, matrix.rows() - row);
            put(to, {matrix.data() + row * matrix.cols(), static_cast<size_t>(count * matrix.cols())});
        }
    }

  private:
    bool half_;
    std::string asked_;
};

/// [a b]ᵀ [a b]
RowMajorMatrix moments(const RowMajorMatrix& a, const RowMajorMatrix& b) {
    RowMajorMatrix both(a.rows(), a.cols() + b.cols());
    both << a, b;
    const RowMajorMatrix across = both.transpose();
    RowMajorMatrix sum = RowMajorMatrix::Zero(both.cols(), both.cols());
    add_product(across, both, sum);
    return sum;
}

void put_height(ByteWriter& to, const Image& height, const StoredValues& halves) {
    to.value(std::uint8_t{2});  // a height map follows
    put_count(to, 0);           // values are no logarithms
    if (height.planes() != 1) {
        put_count(to, 0);
        put_count(to, 0);
        return;
    }
    put_count(to, static_cast<size_t>(height.size().width));
    put_count(to, static_cast<size_t>(height.size().height));
    std::vector<double> values(height.values().begin(), height.values().end());
    halves.put(to, values);
}

Image as_rgb(Image image, double white) {
    if (image.space() != ColourSpace::xyz) return image;
    for (float& value : image.values()) value /= static_cast<float>(white);
    convert(image, ColourSpace::linear);
    return image;
}

}  // namespace

FmfReport write_fmf(const std::filesystem::path& path, const BtfSet& set, PixelType type, int components,
                    const std::function<void(std::uint64_t)>& next) {
    const std::string asked = "write '" + path.string() + "'";
    FileOutput output(path, asked);
    FmfReport report;
    report.components = static_cast<int>(
        std::min<std::uint64_t>(static_cast<std::uint64_t>(components), most_components(set)));
    const double white = set.white();
    PictureFactors factors = factor_pictures(
        set, report.components, [&](Image image) { return as_rgb(std::move(image), white); }, next);

    ByteWriter to(output.descriptor(), asked);
    to.text(signature);
    put_meta(to, set.description());
    put_sampling(to, set);
    put_count(to, static_cast<size_t>(set.size().width));
    put_count(to, static_cast<size_t>(set.size().height));
    put_count(to, 0);  // rotations
    put_height(to, set.description().height, StoredValues(PixelType::half, asked));
    const StoredValues stored(type, asked);
    const auto n = static_cast<size_t>(report.components);
    put_count(to, n);
    to.value(static_cast<std::uint8_t>(stored.bytes_per_value()));
    put_count(to, n);
    put_count(to, static_cast<size_t>(factors.rows.rows()));
    put_count(to, static_cast<size_t>(factors.pixels.rows()));
    stored.put(to, factors.singular);
    // U Vᵀ − u vᵀ = (U − u) Vᵀ + u (V − v)ᵀ, u and v being what a reader gets.
    RowMajorMatrix lost = factors.rows;
    stored.put(to, factors.rows);
    lost -= factors.rows;
    const RowMajorMatrix of_rows = moments(lost, factors.rows);
    lost = factors.pixels;
    stored.put(to, factors.pixels);
    factors.rows.resize(0, 0);
    const RowMajorMatrix of_pixels = moments(lost, lost - factors.pixels);
    const double rounding = std::max(of_rows.cwiseProduct(of_pixels).sum(), 0.0);
    report.relative_error =
        factors.energy > 0.0 ? std::sqrt((factors.left + rounding) / factors.energy) : 0.0;
    output.commit();
    return report;
}

}  // namespace btfield::detail

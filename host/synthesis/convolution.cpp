#include "host/synthesis/convolution.hpp"

#include <algorithm>
#include <string>

#include "btfield/error.hpp"
#include "host/base/eigen.hpp"
#include "host/spectrum/spectral_form.hpp"
#include "host/synthesis/independent_planes.hpp"
#include "host/synthesis/spectral_factors.hpp"

namespace btfield::detail {
namespace {

using std::size_t;

}  // namespace

int nearest_shift(int s, int n) {
    int rest = s % n;
    if (rest < 0) rest += n;
    return rest > n / 2 ? rest - n : rest;
}

Convolution::Convolution(DeviceImpl& device, const LinearField& field, Size lattice, double scale,
                         const std::vector<double>& mean, Reads reads)
    : planes_(0),
      blocks_(0),
      rows_(1),
      offsets_count_(static_cast<int>(field.offsets.size())),
      lattice_(lattice) {
    const std::vector<LinearField> parts = independent_planes(field);
    planes_ = parts.front().planes;
    blocks_ = static_cast<int>(parts.size());
    // As many sums as vector registers hold beside their operands.
    rows_ = planes_ <= 2 ? 8 : planes_ <= 4 ? 4 : planes_ <= 8 ? 2 : 1;

    std::vector<float> coefficients;
    for (const LinearField& part : parts) {
        // The root that the transfer function takes, so that both make the same pictures.
        const Eigen::MatrixXd root = scale * symmetric_root(noise_matrix(part));
        for (size_t s = 0; s < part.offsets.size(); ++s) {
            const Eigen::Map<const RowMajorMatrix> a(
                part.coefficients.data() + static_cast<std::ptrdiff_t>(s) * planes_ * planes_, planes_,
                planes_);
            const RowMajorMatrix product = a * root;
            for (Eigen::Index e = 0; e < product.size(); ++e)
                coefficients.push_back(static_cast<float>(product.data()[e]));
        }
    }
    std::vector<std::array<int, 2>> offsets;
    for (const Offset s : field.offsets) {
        const int row = nearest_shift(s.row, lattice.height), column = nearest_shift(s.column, lattice.width);
        offsets.push_back({row, column});
        reach_[0] = std::max(reach_[0], -row);
        reach_[1] = std::max(reach_[1], row);
        reach_[2] = std::max(reach_[2], -column);
        reach_[3] = std::max(reach_[3], column);
    }
    coefficients_ = device.upload(coefficients);
    offsets_ = device.upload(offsets);
    mean_ = device.upload(std::vector<float>(mean.begin(), mean.end()));

    const size_t available = device.local_memory();
    // A lower tile where the widest does not fit; of direct reads the height is nobody's concern.
    const bool wanted = reads == Reads::tiles || (reads == Reads::automatic && device.tuning().local_tiles);
    while (wanted && rows_ > 1 && tile_bytes(device) > available) rows_ /= 2;
    const bool fit = tile_bytes(device) <= available;
    if (reads == Reads::tiles && !fit) {
        throw DeviceError("convolve with tiles on device '" + device.info().name + "'",
                          "a tile takes " + std::to_string(tile_bytes(device)) +
                              " bytes of local memory where " + std::to_string(available) + " exist",
                          "read the noise directly");
    }
    tiles_ = reads == Reads::tiles || (reads == Reads::automatic && device.tuning().local_tiles && fit);
}

size_t Convolution::tile_bytes(const DeviceImpl& device) const {
    const int tile_rows = rows_ + reach_[0] + reach_[1];
    const auto height = static_cast<size_t>(tile_rows);
    const size_t width = device.largest_group(Grain::fine) * static_cast<size_t>(device.vector_width()) +
                         static_cast<size_t>(reach_[2] + reach_[3]);
    return sizeof(float) * static_cast<size_t>(planes_) * height * width;
}

void Convolution::draw(DeviceImpl& device, const Buffer& images, const Buffer& keys, int batch,
                       int level) const {
    const int planes = planes_ * blocks_;
    const Buffer noise = device.buffer(sizeof(float) * area(lattice_) * static_cast<size_t>(planes) *
                                       static_cast<size_t>(batch));
    draw_normal_field(device, noise, keys, lattice_, planes, batch, level);
    filter(device, noise, images, batch);
}

void Convolution::filter(DeviceImpl& device, const Buffer& noise, const Buffer& images, int batch) const {
    BuildParameters parameters = device.lanes();
    parameters.set("BTFIELD_PLANES", planes_)
        .set("BTFIELD_ROWS", rows_)
        .set("BTFIELD_LOCAL_TILE", tiles_ ? 1 : 0);
    const auto lanes = static_cast<size_t>(device.vector_width());
    const auto rows = static_cast<size_t>(rows_);
    const Range range{(static_cast<size_t>(lattice_.width) + lanes - 1) / lanes,
                      (static_cast<size_t>(lattice_.height) + rows - 1) / rows,
                      static_cast<size_t>(batch) * static_cast<size_t>(blocks_)};
    device.launch(device.kernel("convolution", "convolve", parameters), range, Grain::fine, noise, images,
                  coefficients_, offsets_, offsets_count_, mean_, lattice_.height, lattice_.width, blocks_,
                  reach_, LocalMemory{tiles_ ? tile_bytes(device) : sizeof(float)});
}

}  // namespace btfield::detail

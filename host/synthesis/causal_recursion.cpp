#include "host/synthesis/causal_recursion.hpp"

#include <algorithm>
#include <string>

#include "btfield/error.hpp"
#include "host/base/text.hpp"
#include "host/synthesis/independent_planes.hpp"
#include "host/synthesis/spectral_factors.hpp"

namespace btfield::detail {
namespace {

using std::size_t;

/// Rows and columns of an offset; the window of a work-item grows with them.
constexpr int longest_offset = 16;

/// Steps between two moves of the window.
constexpr int chunk = 32;

void require_stable(const LinearField& field) {
    const RecursionStability stability = recursion_stability(field);
    if (!stability.stable)
        throw InputError("raster recursion of a causal model", stability.explanation,
                         "use --method torus, another order or more levels");
    for (const Offset s : field.offsets) {
        if (std::max({-s.row, s.column, -s.column}) > longest_offset)
            throw InputError("raster recursion of a causal model",
                             "the offset " + text_of(s) + " is longer than " + std::to_string(longest_offset),
                             "use --method torus");
    }
}

void check_parts(const std::vector<LinearField>& parts) {
    for (const LinearField& part : parts) require_stable(part);
}

RecursionMargins margins_of(const std::vector<LinearField>& parts) {
    RecursionMargins result;
    for (const LinearField& part : parts) {
        const RecursionMargins own = recursion_margins(part);
        result.top = std::max(result.top, own.top);
        result.left = std::max(result.left, own.left);
        result.right = std::max(result.right, own.right);
        result.missing = std::max(result.missing, own.missing);
    }
    return result;
}

int divided_up(int a, int b) {
    return (a + b - 1) / b;
}

}  // namespace

void check_recursion(const LinearField& field) {
    check_parts(independent_planes(field));
}

CausalRecursion::CausalRecursion(DeviceImpl& device, const LinearField& field, Size size, double scale,
                                 const std::vector<double>& mean, Schedule schedule)
    : offsets_count_(static_cast<int>(field.offsets.size())), size_(size), schedule_(schedule) {
    const std::vector<LinearField> parts = independent_planes(field);
    check_parts(parts);
    planes_ = parts.front().planes;
    blocks_ = static_cast<int>(parts.size());
    margins_ = margins_of(parts);
    domain_ = {size.height + margins_.top, size.width + margins_.left + margins_.right};

    // A row is so far behind that what it reads in the rows above was made a step earlier; one step more lets
    // that reach the cache before it is read across lanes.
    int needed = 0;
    for (const Offset s : field.offsets) {
        reach_ = std::max(reach_, -s.row);
        if (s.row < 0) needed = std::max(needed, divided_up(std::max(s.column, 0) + 1, -s.row));
    }
    lag_ = needed + 1;
    for (const Offset s : field.offsets) back_ = std::max(back_, -s.row * lag_ - s.column);

    std::vector<float> coefficients;
    for (const LinearField& part : parts) {
        for (const double a : part.coefficients) coefficients.push_back(static_cast<float>(a));
        const Eigen::MatrixXd root = scale * noise_root(part);
        for (int i = 0; i < planes_; ++i)
            for (int j = 0; j < planes_; ++j) coefficients.push_back(static_cast<float>(root(i, j)));
    }
    const int column = reach_ + device.vector_width(), step = planes_ * column;
    std::vector<int> displacements;
    for (const Offset s : field.offsets)
        displacements.push_back((s.column + s.row * lag_) * step + reach_ + s.row);
    coefficients_ = device.upload(coefficients);
    displacements_ = device.upload(displacements);
    mean_ = device.upload(std::vector<float>(mean.begin(), mean.end()));
}

void CausalRecursion::run(DeviceImpl& device, const Buffer& field, int batch) const {
    BuildParameters parameters = device.lanes();
    parameters.set("BTFIELD_PLANES", planes_)
        .set("BTFIELD_LAG", lag_)
        .set("BTFIELD_REACH", reach_)
        .set("BTFIELD_BACK", back_)
        .set("BTFIELD_CHUNK", chunk);
    const Kernel kernel = device.kernel("causal_recursion", "causal_recursion", parameters);
    const int items = batch * blocks_, lanes = device.vector_width();
    const auto launch = [&](int groups, int wave, int lowest, int part) {
        device.launch(kernel, {static_cast<size_t>(items), static_cast<size_t>(groups)}, Grain::serial, field,
                      coefficients_, displacements_, offsets_count_, domain_.height, domain_.width, blocks_,
                      items, wave, lowest, part);
    };
    const Tuning& tuning = device.tuning();
    const int units = device.info().compute_units;
    const bool busy = tuning.whole_fields > 0 && items >= tuning.whole_fields * units;
    if (schedule_ == Schedule::whole || (schedule_ == Schedule::automatic && busy)) {
        launch(1, -1, 0, 0);
        return;
    }
    // A part needs the group above to be one part ahead: it is at least as long as a group is skewed.
    const int steps = domain_.width + (lanes - 1) * lag_;
    const int wanted =
        tuning.row_parts > 0 ? divided_up(steps, tuning.row_parts * units) : tuning.row_part_steps;
    const int part = std::max(lanes * lag_, wanted);
    const int parts = divided_up(steps, part), groups = divided_up(domain_.height, lanes);
    for (int wave = 0; wave <= 2 * (groups - 1) + parts - 1; ++wave) {
        const int lowest = std::max(0, divided_up(wave - parts + 1, 2));
        const int highest = std::min(groups - 1, wave / 2);
        if (lowest <= highest) launch(highest - lowest + 1, wave, lowest, part);
    }
}

void CausalRecursion::draw(DeviceImpl& device, const Buffer& images, const Buffer& keys, int batch,
                           int level) const {
    const int planes = planes_ * blocks_;
    const auto count = static_cast<size_t>(planes) * static_cast<size_t>(batch);
    const Buffer field = device.buffer(sizeof(float) * area(domain_) * count);
    draw_normal_field(device, field, keys, domain_, planes, batch, level);
    run(device, field, batch);
    const int lanes = device.vector_width();
    device.launch(
        device.kernel("causal_recursion", "crop_field",
                      device.lanes()
                          .set("BTFIELD_PLANES", 1)
                          .set("BTFIELD_LAG", 1)
                          .set("BTFIELD_REACH", 0)
                          .set("BTFIELD_BACK", 1)
                          .set("BTFIELD_CHUNK", 1)),
        {static_cast<size_t>(divided_up(size_.width, lanes)), static_cast<size_t>(size_.height), count},
        Grain::fine, field, images, mean_, planes, domain_.height, domain_.width, margins_.top, margins_.left,
        size_.height, size_.width);
}

}  // namespace btfield::detail

#include "host/compound/label_lattice.hpp"

#include <cstddef>

namespace btfield::detail {

std::vector<std::uint8_t> coarse_labels(const ControlField& field, int step) {
    std::vector<std::uint8_t> labels;
    for (int r = 0; r < field.size.height; r += step)
        for (int c = 0; c < field.size.width; c += step)
            labels.push_back(
                field.labels[static_cast<std::size_t>(r) * static_cast<std::size_t>(field.size.width) +
                             static_cast<std::size_t>(c)]);
    return labels;
}

ControlField on_lattice(const ControlField& field, Size lattice) {
    ControlField result{lattice, field.regions, {}};
    result.labels.reserve(area(lattice));
    for (int r = 0; r < lattice.height; ++r) {
        const auto row =
            static_cast<std::size_t>(r % field.size.height) * static_cast<std::size_t>(field.size.width);
        for (int c = 0; c < lattice.width; ++c)
            result.labels.push_back(field.labels[row + static_cast<std::size_t>(c % field.size.width)]);
    }
    return result;
}

}  // namespace btfield::detail

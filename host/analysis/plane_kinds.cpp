#include "host/analysis/plane_kinds.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <map>
#include <numeric>
#include <string>

#include "host/pictures/channels.hpp"

namespace btfield::detail {

std::vector<int> plane_kinds(const Image& image) {
    std::vector<int> kinds(static_cast<std::size_t>(image.planes()), 0);
    if (image.space() != ColourSpace::unspecified) return kinds;
    std::iota(kinds.begin(), kinds.end(), 0);
    std::map<std::string, int> first;
    for (std::size_t p = 0; p < image.names().size(); ++p) {
        const std::string kind = kind_of_name(image.names()[p]);
        if (!kind.empty()) kinds[p] = first.try_emplace(kind, kinds[p]).first->second;
    }
    return kinds;
}

std::vector<double> kind_deviations(const Image& image, std::span<const double> variances) {
    const std::vector<int> kinds = plane_kinds(image);
    if (std::ranges::all_of(kinds, [&](int kind) { return kind == kinds.front(); })) return {};
    std::vector<double> deviations;
    for (const int kind : kinds) {
        double sum = 0.0;
        int count = 0;
        for (std::size_t p = 0; p < kinds.size(); ++p) {
            if (kinds[p] != kind || !(variances[p] > 0.0)) continue;
            sum += variances[p];
            ++count;
        }
        deviations.push_back(count > 0 ? std::sqrt(sum / count) : 1.0);
    }
    return deviations;
}

std::vector<double> scaled_matrix(const SpectralBasis& basis) {
    std::vector<double> matrix = basis.matrix;
    for (std::size_t e = 0; e < matrix.size() && !basis.scale.empty(); ++e)
        matrix[e] *= basis.scale[e % basis.scale.size()];
    return matrix;
}

}  // namespace btfield::detail

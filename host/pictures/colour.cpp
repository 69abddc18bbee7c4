#include "host/pictures/colour.hpp"

#include <algorithm>
#include <cstddef>

#include "host/base/text.hpp"

namespace btfield::detail {
namespace {

constexpr Matrix3 bradford{0.8951, 0.2664, -0.1614, -0.7502, 1.7135, 0.0367, 0.0389, -0.0685, 1.0296};

std::array<double, 3> times(const Matrix3& matrix, const std::array<double, 3>& v) {
    std::array<double, 3> result{};
    for (std::size_t i = 0; i < 3; ++i)
        result[i] = matrix[3 * i] * v[0] + matrix[3 * i + 1] * v[1] + matrix[3 * i + 2] * v[2];
    return result;
}

std::array<double, 3> xyz_of_white(double x, double y) {
    return {x / y, 1.0, (1.0 - x - y) / y};
}

}  // namespace

Matrix3 product(const Matrix3& a, const Matrix3& b) {
    Matrix3 result{};
    for (std::size_t i = 0; i < 3; ++i)
        for (std::size_t j = 0; j < 3; ++j)
            for (std::size_t k = 0; k < 3; ++k) result[3 * i + j] += a[3 * i + k] * b[3 * k + j];
    return result;
}

std::optional<Matrix3> inverse(const Matrix3& m) {
    const auto minor = [&](std::size_t i, std::size_t j) {
        const std::size_t a = (i + 1) % 3, b = (i + 2) % 3, c = (j + 1) % 3, d = (j + 2) % 3;
        return m[3 * a + c] * m[3 * b + d] - m[3 * a + d] * m[3 * b + c];
    };
    const double determinant = m[0] * minor(0, 0) + m[1] * minor(0, 1) + m[2] * minor(0, 2);
    if (!(std::abs(determinant) > 1e-12) || !std::isfinite(determinant)) return std::nullopt;
    Matrix3 result{};
    for (std::size_t i = 0; i < 3; ++i)
        for (std::size_t j = 0; j < 3; ++j) result[3 * j + i] = minor(i, j) / determinant;
    return result;
}

std::optional<Matrix3> xyz_from(const Chromaticities& primaries) {
    if (!std::ranges::all_of(primaries, [](double v) { return std::isfinite(v); })) return std::nullopt;
    if (!(primaries[7] > 1e-6)) return std::nullopt;
    Matrix3 directions{};
    for (std::size_t i = 0; i < 3; ++i) {
        const double x = primaries[2 * i], y = primaries[2 * i + 1];
        directions[i] = x;
        directions[3 + i] = y;
        directions[6 + i] = 1.0 - x - y;
    }
    const std::optional<Matrix3> back = inverse(directions);
    if (!back) return std::nullopt;
    const std::array<double, 3> strength = times(*back, xyz_of_white(primaries[6], primaries[7]));
    for (std::size_t i = 0; i < 9; ++i) directions[i] *= strength[i % 3];
    if (!inverse(directions)) return std::nullopt;
    return directions;
}

Matrix3 adaptation(std::array<double, 2> from, std::array<double, 2> to) {
    const std::array<double, 3> old_cones = times(bradford, xyz_of_white(from[0], from[1]));
    const std::array<double, 3> new_cones = times(bradford, xyz_of_white(to[0], to[1]));
    Matrix3 scale{};
    for (std::size_t i = 0; i < 3; ++i) scale[4 * i] = new_cones[i] / old_cones[i];
    return product(inverse(bradford).value(), product(scale, bradford));
}

std::optional<Matrix3> rec709_from(const Chromaticities& primaries) {
    const std::optional<Matrix3> xyz = xyz_from(primaries);
    if (!xyz) return std::nullopt;
    const Matrix3 adapted = adaptation({primaries[6], primaries[7]}, {rec709[6], rec709[7]});
    return product(inverse(xyz_from(rec709).value()).value(), product(adapted, *xyz));
}

bool same_primaries(const Chromaticities& a, const Chromaticities& b, double tolerance) {
    return std::equal(a.begin(), a.end(), b.begin(),
                      [&](double x, double y) { return std::abs(x - y) < tolerance; });
}

void transform(Image& image, const Matrix3& matrix) {
    const auto a = image.plane(0), b = image.plane(1), c = image.plane(2);
    for (std::size_t i = 0; i < a.size(); ++i) {
        const std::array<double, 3> value = times(matrix, {a[i], b[i], c[i]});
        a[i] = static_cast<float>(value[0]);
        b[i] = static_cast<float>(value[1]);
        c[i] = static_cast<float>(value[2]);
    }
}

void encode_srgb(Image& image) {
    for (float& value : image.values()) value = static_cast<float>(srgb_encoded(value));
}

void decode_srgb(Image& image) {
    for (float& value : image.values()) value = static_cast<float>(srgb_decoded(value));
}

std::string defect_of(std::span<const ColourSpace> spaces, int planes) {
    if (!spaces.empty() && spaces.size() != static_cast<std::size_t>(std::max(planes, 0)))
        return counted(spaces.size(), "colour space") + " for " + counted(planes, "plane");
    std::size_t row = 0;
    for (std::size_t p = 0; p <= spaces.size(); ++p) {
        const bool xyz = p < spaces.size() && spaces[p] == ColourSpace::xyz;
        if (!xyz && row % 3 != 0) return "xyz of " + counted(row, "plane") + " in a row";
        row = xyz ? row + 1 : 0;
    }
    return {};
}

std::vector<ColourSpace> spaces_of(std::span<const ColourSpace> spaces, std::span<const int> planes) {
    std::vector<ColourSpace> result;
    for (const int p : planes)
        result.push_back(p >= 0 && static_cast<std::size_t>(p) < spaces.size()
                             ? spaces[static_cast<std::size_t>(p)]
                             : ColourSpace::unspecified);
    for (std::size_t p = 0; p < result.size(); ++p) {
        if (result[p] != ColourSpace::xyz) continue;
        const bool row = p + 2 < result.size() && result[p + 1] == ColourSpace::xyz &&
                         result[p + 2] == ColourSpace::xyz && planes[p + 1] == planes[p] + 1 &&
                         planes[p + 2] == planes[p] + 2;
        if (row)
            p += 2;
        else
            result[p] = ColourSpace::unspecified;
    }
    return result;
}

void convert_planes(Image& image, ColourSpace to) {
    std::vector<ColourSpace> spaces = image.plane_spaces();
    for (std::size_t p = 0; p < spaces.size();) {
        const std::size_t count = spaces[p] == ColourSpace::xyz ? 3 : 1;
        const bool other = spaces[p] != to && spaces[p] != ColourSpace::unspecified;
        if (other && (count == 3 || to != ColourSpace::xyz)) {
            Image some(image.size(), static_cast<int>(count), spaces[p]);
            for (std::size_t i = 0; i < count; ++i)
                std::ranges::copy(image.plane(static_cast<int>(p + i)),
                                  some.plane(static_cast<int>(i)).begin());
            convert(some, to);
            for (std::size_t i = 0; i < count; ++i) {
                std::ranges::copy(some.plane(static_cast<int>(i)),
                                  image.plane(static_cast<int>(p + i)).begin());
                spaces[p + i] = to;
            }
        }
        p += count;
    }
    image.set_plane_spaces(spaces);
}

void convert(Image& image, ColourSpace to) {
    if (image.space() == to) return;
    if (image.space() == ColourSpace::srgb) decode_srgb(image);
    if (image.space() == ColourSpace::xyz) transform(image, inverse(xyz_from(rec709).value()).value());
    if (to == ColourSpace::srgb) encode_srgb(image);
    if (to == ColourSpace::xyz) transform(image, xyz_from(rec709).value());
    image.set_space(to);
}

}  // namespace btfield::detail

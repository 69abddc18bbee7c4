#include "btfield/height.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include "btfield/error.hpp"
#include "host/base/parallel.hpp"
#include "host/base/stop.hpp"
#include "host/base/text.hpp"
#include "host/cl/device_impl.hpp"
#include "host/relief/fourier_basis.hpp"

namespace btfield {

using namespace detail;

namespace {

using std::size_t;

/// Slope of 86 degrees.
constexpr float steepest = 14.3F;
/// Rows that are computed together.
constexpr int rows_of_block = 64;

/// Calls work(row) for all rows of a lattice, on all cores.
template <class Work>
void for_each_row(Size size, const Work& work) {
    for_each_block((size.height + rows_of_block - 1) / rows_of_block, [&](int block) {
        const int end = std::min(size.height, (block + 1) * rows_of_block);
        for (int row = block * rows_of_block; row < end; ++row) work(row);
    });
}

void expect_planes(const Image& image, int planes, const std::string& asked, const std::string& what) {
    if (image.planes() != planes)
        throw InputError(asked, "it has " + counted(image.planes(), "plane"),
                         "give " + what + ", which have " + std::to_string(planes));
}

void expect_finite(const Image& image, const std::string& asked) {
    if (!std::ranges::all_of(image.values(), [](float value) { return std::isfinite(value); }))
        throw InputError(asked, "a value is not a finite number", "repair the picture");
}

/// Half the differences of one row: f of the pixel before, and of that behind.
struct Neighbours {
    int before, after;
};
Neighbours neighbours(int i, int n, SurfaceEdges edges) {
    if (edges == SurfaceEdges::periodic) return {i == 0 ? n - 1 : i - 1, i == n - 1 ? 0 : i + 1};
    return {std::max(i - 1, 0), std::min(i + 1, n - 1)};
}

/// Place of a pixel on the cycle of its axis (kernels/relief/height.cl).
int place(int i, int n, bool mirror) {
    if (!mirror) return i;
    return i % 2 == 1 ? n - 1 - i / 2 : i / 2;
}

/// Everything that least squares in frequency need.
struct LeastSquares {
    Size size;
    bool mirror = false;
    double weight = 0.0;  ///< of the coarse height
    double low = 0.0;     ///< λ at which waves are halved
};

/// λ of a wave along one axis, of 4 pixels at least.
double lambda_of(double wavelength) {
    const double s = std::sin(2.0 * std::numbers::pi / wavelength);
    return s * s;
}

Image by_transform(DeviceImpl& device, const Image& slopes, const Image* coarse, const LeastSquares& how) {
    const Size size = how.size;
    const auto lanes = static_cast<size_t>(device.vector_width());
    const auto pitch = static_cast<size_t>(spectrum_pitch(size.height));
    const auto floats = [](const std::vector<double>& values, size_t count) {
        std::vector<float> result(values.begin(), values.end());
        result.resize(count, 1.0F);
        return result;
    };
    const Buffer across =
        device.upload(floats(difference_spectrum(size.width, how.mirror), static_cast<size_t>(size.width)));
    std::vector<double> half = difference_spectrum(size.height, how.mirror);
    half.resize(static_cast<size_t>(size.height) / 2 + 1);
    const Buffer down = device.upload(floats(half, pitch));
    BuildParameters parameters = device.lanes();
    parameters.set("BTFIELD_MIRROR", how.mirror);
    const auto kernel = [&](const char* name) { return device.kernel("height", name, parameters); };

    const Buffer given = device.upload(slopes.values());
    const Buffer base = coarse != nullptr ? device.upload(coarse->values()) : device.buffer(sizeof(float));
    Buffer image = device.buffer(sizeof(float) * area(size));
    const Range pixels{(static_cast<size_t>(size.width) + lanes - 1) / lanes,
                       static_cast<size_t>(size.height)};
    device.launch(kernel("adjoint_slopes"), pixels, Grain::fine, given, base, static_cast<float>(how.weight),
                  image, size.height, size.width);
    const size_t bytes = sizeof(float) * spectrum_floats(size, 1);
    Spectrum spectrum{device.buffer(bytes), device.buffer(bytes)};
    Fft& fft = device.ffts().plan(device, size, device.options().fft);
    fft.forward(device, image, spectrum, 1);
    device.launch(kernel("divide_spectrum"), {pitch / lanes, static_cast<size_t>(size.width)}, Grain::fine,
                  spectrum.re, spectrum.im, across, down, static_cast<float>(how.weight),
                  static_cast<float>(how.low), static_cast<float>(1.0 / static_cast<double>(area(size))),
                  static_cast<int>(pitch));
    fft.inverse(device, spectrum, image, 1);
    Image height(size, 1);
    if (how.mirror) {
        Buffer ordered = device.buffer(sizeof(float) * area(size));
        device.launch(kernel("take_back"), pixels, Grain::fine, image, ordered, size.height, size.width);
        device.read(ordered, height.values().data(), height.values().size_bytes());
    } else {
        device.read(image, height.values().data(), height.values().size_bytes());
    }
    return height;
}

/// The same in float64 on the host, for sides that have no fast transform.
Image by_bases(const Image& slopes, const Image* coarse, const LeastSquares& how) {
    const Size size = how.size;
    const auto width = static_cast<size_t>(size.width);
    const auto at = [&](int plane, int r, int c) {
        const auto inside = [&](int i, int n) { return i >= 0 && i < n; };
        const auto around = [&](int i, int n) { return how.mirror ? std::clamp(i, 0, n - 1) : (i + n) % n; };
        const bool beyond = !inside(r, size.height) || !inside(c, size.width);
        const auto value =
            static_cast<double>(slopes.at(plane, around(r, size.height), around(c, size.width)));
        return beyond && how.mirror ? -value : value;
    };
    std::vector<double> values(area(size));
    for_each_row(size, [&](int r) {
        for (int c = 0; c < size.width; ++c) {
            double value = -0.5 * ((at(0, r, c + 1) - at(0, r, c - 1)) + (at(1, r + 1, c) - at(1, r - 1, c)));
            if (coarse != nullptr) value += how.weight * static_cast<double>(coarse->at(0, r, c));
            values[static_cast<size_t>(place(r, size.height, how.mirror)) * width +
                   static_cast<size_t>(place(c, size.width, how.mirror))] = value;
        }
    });
    stop_if_asked();
    divide_by_bases(values, size, difference_spectrum(size.width, how.mirror),
                    difference_spectrum(size.height, how.mirror), how.weight, how.low);
    Image height(size, 1);
    for_each_row(size, [&](int r) {
        for (int c = 0; c < size.width; ++c)
            height.at(0, r, c) =
                static_cast<float>(values[static_cast<size_t>(place(r, size.height, how.mirror)) * width +
                                          static_cast<size_t>(place(c, size.width, how.mirror))]);
    });
    return height;
}

/// Takes the mean of each plane away.
Image without_means(Image image) {
    for (int p = 0; p < image.planes(); ++p) {
        double sum = 0.0;
        for (const float value : image.plane(p)) sum += static_cast<double>(value);
        const auto mean = static_cast<float>(sum / static_cast<double>(area(image.size())));
        for (float& value : image.plane(p)) value -= mean;
    }
    return image;
}

/// Takes a + b x + c y away where that is closest; its parts are orthogonal about the middle.
void level(Image& height) {
    const double middle_row = (height.height() - 1) / 2.0, middle_column = (height.width() - 1) / 2.0;
    double sum = 0.0, along = 0.0, down = 0.0, xx = 0.0, yy = 0.0;
    for (int r = 0; r < height.height(); ++r)
        for (int c = 0; c < height.width(); ++c) {
            const auto value = static_cast<double>(height.at(0, r, c));
            const double x = c - middle_column, y = r - middle_row;
            sum += value;
            along += value * x;
            down += value * y;
            xx += x * x;
            yy += y * y;
        }
    const double mean = sum / static_cast<double>(area(height.size()));
    const double a = xx > 0.0 ? along / xx : 0.0, b = yy > 0.0 ? down / yy : 0.0;
    for_each_row(height.size(), [&](int r) {
        for (int c = 0; c < height.width(); ++c)
            height.at(0, r, c) -= static_cast<float>(mean + a * (c - middle_column) + b * (r - middle_row));
    });
}

/// Pixel i, of any sign, of a line of n that is mirrored or wraps.
int along_line(int i, int n, bool mirror) {
    const int period = mirror ? 2 * n : n;
    i %= period;
    if (i < 0) i += period;
    return i < n ? i : period - 1 - i;
}

/// How many taps a filter of alternation has, and how many lie on each side.
constexpr int reach = 16;
using Taps = std::array<float, 2 * reach + 1>;

/// sin³²(ω/2) where it alternates, else cos³²(ω/2).
Taps power_taps(bool alternates) {
    Taps taps{};
    double binomial = 1.0;
    for (int k = 0; k <= 2 * reach; ++k) {
        const double sign = alternates && (k + reach) % 2 == 1 ? -1.0 : 1.0;
        taps[static_cast<size_t>(k)] = static_cast<float>(sign * std::ldexp(binomial, -2 * reach));
        binomial *= static_cast<double>(2 * reach - k) / (k + 1);
    }
    return taps;
}

Image filtered(const Image& image, const Taps& taps, bool mirror, bool along_rows) {
    const int lines = along_rows ? image.height() : image.width();
    const int length = along_rows ? image.width() : image.height();
    Image result(image.size(), 1);
    for_each_block((lines + rows_of_block - 1) / rows_of_block, [&](int block) {
        std::vector<float> line(static_cast<size_t>(length) + taps.size() - 1);
        for (int at = block * rows_of_block; at < std::min(lines, (block + 1) * rows_of_block); ++at) {
            auto to = line.begin();
            for (int i = -reach; i < length + reach; ++i) {
                const int from = along_line(i, length, mirror);
                *to++ = along_rows ? image.at(0, at, from) : image.at(0, from, at);
            }
            for (int i = 0; i < length; ++i) {
                float sum = 0.0F;
                for (size_t k = 0; k < taps.size(); ++k) sum += taps[k] * line[static_cast<size_t>(i) + k];
                (along_rows ? result.at(0, at, i) : result.at(0, i, at)) = sum;
            }
        }
    });
    return result;
}

/// Takes away what nearly alternates from pixel to pixel along one axis or both, and is else nearly constant:
/// sin³²(ω_x/2) (sin³² + cos³²)(ω_y/2) + cos³²(ω_x/2) sin³²(ω_y/2) of each wave.
void take_alternation_out(Image& height, bool mirror) {
    const Taps sines = power_taps(true), cosines = power_taps(false);
    Taps both{};
    std::ranges::transform(sines, cosines, both.begin(), std::plus());
    const Image across = filtered(filtered(height, sines, mirror, true), both, mirror, false);
    const Image down = filtered(filtered(height, cosines, mirror, true), sines, mirror, false);
    for (size_t i = 0; i < height.values().size(); ++i)
        height.values()[i] -= across.values()[i] + down.values()[i];
}

void check_integration(const Image& slopes, const IntegrationOptions& options) {
    const std::string asked = "integrate slopes";
    expect_planes(slopes, 2, asked, "slopes");
    expect_finite(slopes, asked);
    if (!options.coarse) return;
    const Image& coarse = options.coarse->height;
    expect_planes(coarse, 1, asked + " with a coarse height", "a height of one plane, not colours");
    expect_finite(coarse, asked + " with a coarse height");
    if (coarse.size() != slopes.size())
        throw InputError(asked + " with a coarse height",
                         "they are " + text_of(slopes.size()) + " and " + text_of(coarse.size()) + " pixels",
                         "give a height of the same size");
    if (!(options.coarse->wavelength >= 4.0) || !std::isfinite(options.coarse->wavelength))
        throw InputError(
            asked + " with a coarse height",
            "it is to count for waves longer than " + std::to_string(options.coarse->wavelength) + " pixels",
            "give 4 pixels or more");
}

}  // namespace

SlopeField slopes_of_normals(const Image& normals) {
    expect_planes(normals, 3, "take slopes of normals", "normals");
    SlopeField result{Image(normals.size(), 2), 0};
    std::vector<std::uintmax_t> cut(static_cast<size_t>(normals.height()), 0);
    for_each_row(normals.size(), [&](int r) {
        for (int c = 0; c < normals.width(); ++c) {
            const float x = normals.at(0, r, c), y = normals.at(1, r, c), z = normals.at(2, r, c);
            const float flat = std::hypot(x, y);
            float scale = 1.0F / z;
            if (flat == 0.0F && z == 0.0F) continue;  // no normal: level
            if (!(z * steepest >= flat)) {
                scale = flat > 0.0F ? steepest / flat : 0.0F;
                ++cut[static_cast<size_t>(r)];
            }
            result.slopes.at(0, r, c) = -x * scale;
            result.slopes.at(1, r, c) = y * scale;
        }
    });
    for (const std::uintmax_t of_row : cut) result.cut += of_row;
    return result;
}

Image slopes_of_height(const Image& height, SurfaceEdges edges) {
    expect_planes(height, 1, "take slopes of a height", "a height");
    Image slopes(height.size(), 2);
    for_each_row(height.size(), [&](int r) {
        const Neighbours rows = neighbours(r, height.height(), edges);
        for (int c = 0; c < height.width(); ++c) {
            const Neighbours columns = neighbours(c, height.width(), edges);
            slopes.at(0, r, c) = 0.5F * (height.at(0, r, columns.after) - height.at(0, r, columns.before));
            slopes.at(1, r, c) = 0.5F * (height.at(0, rows.after, c) - height.at(0, rows.before, c));
        }
    });
    return slopes;
}

Image normals_of_slopes(const Image& slopes) {
    expect_planes(slopes, 2, "take normals of slopes", "slopes");
    Image normals(slopes.size(), 3);
    for_each_row(slopes.size(), [&](int r) {
        for (int c = 0; c < slopes.width(); ++c) {
            const float p = slopes.at(0, r, c), q = slopes.at(1, r, c);
            const float z = 1.0F / std::sqrt(1.0F + p * p + q * q);
            normals.at(0, r, c) = -p * z;
            normals.at(1, r, c) = q * z;
            normals.at(2, r, c) = z;
        }
    });
    return normals;
}

Image integrate(Device& device, const Image& slopes, const IntegrationOptions& options) {
    check_integration(slopes, options);
    stop_if_asked();
    const Size size = slopes.size();
    LeastSquares how{size, options.edges == SurfaceEdges::mirror, 0.0, 0.0};
    const Image* coarse = options.coarse ? &options.coarse->height : nullptr;
    if (coarse != nullptr) how.weight = lambda_of(options.coarse->wavelength);
    const bool low = options.flattening == Flattening::low;
    if (low) how.low = lambda_of(std::max(4.0, static_cast<double>(std::min(size.height, size.width))));
    // Between mirrors a slope of all of it would be a wave of every length: it is told by the means.
    const Image centred = low ? without_means(slopes) : Image();
    const Image& given = low ? centred : slopes;
    const bool fast = next_fft_size(size.height) == size.height && next_fft_size(size.width) == size.width;
    Image height = fast ? by_transform(device.impl(), given, coarse, how) : by_bases(given, coarse, how);
    if (options.measured) take_alternation_out(height, how.mirror);
    if (options.flattening != Flattening::none && how.mirror) level(height);
    return without_means(std::move(height));
}

double height_scale(const Image& slopes, const Image& height, SurfaceEdges edges) {
    const std::string asked = "scale a height by slopes";
    expect_planes(slopes, 2, asked, "slopes");
    if (slopes.size() != height.size())
        throw InputError(asked,
                         "they are " + text_of(slopes.size()) + " and " + text_of(height.size()) + " pixels",
                         "give a height of the same size");
    const Image own = slopes_of_height(height, edges);
    double product = 0.0, square = 0.0;
    for (size_t i = 0; i < own.values().size(); ++i) {
        const auto value = static_cast<double>(own.values()[i]);
        product += value * static_cast<double>(slopes.values()[i]);
        square += value * value;
    }
    return square > 0.0 ? product / square : 0.0;
}

namespace {

/// Whether floats are normals in [0, 1], as whole numbers are: whose lengths are closer to 1?
bool coded_like_whole_numbers(const Image& image) {
    double as_they_are = 0.0, decoded = 0.0;
    for (size_t i = 0; i < area(image.size()); ++i) {
        double own = 0.0, other = 0.0;
        for (int p = 0; p < 3; ++p) {
            const auto value = static_cast<double>(image.plane(p)[i]);
            own += value * value;
            other += (2.0 * value - 1.0) * (2.0 * value - 1.0);
        }
        as_they_are += std::abs(std::sqrt(own) - 1.0);
        decoded += std::abs(std::sqrt(other) - 1.0);
    }
    return decoded < as_they_are;
}

}  // namespace

Image decode_normals(const Picture& picture, NormalConvention convention) {
    const std::string asked = "read a normal map";
    expect_planes(picture.image, 3, asked, "normals as colours");
    const Image& image = picture.image;
    const bool floats = picture.type == PixelType::half || picture.type == PixelType::float32;
    const bool coded = !floats || coded_like_whole_numbers(image);
    const float turn = convention == NormalConvention::directx ? -1.0F : 1.0F;
    Image normals(image.size(), 3);
    for_each_row(image.size(), [&](int r) {
        for (int c = 0; c < image.width(); ++c) {
            std::array<float, 3> n{};
            for (int p = 0; p < 3; ++p) {
                const float value = image.at(p, r, c);
                n[static_cast<size_t>(p)] = coded ? 2.0F * value - 1.0F : value;
            }
            n[1] *= turn;
            const float length = std::sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
            for (int p = 0; p < 3; ++p)
                normals.at(p, r, c) = length > 0.0F ? n[static_cast<size_t>(p)] / length : float(p == 2);
        }
    });
    if (std::ranges::none_of(normals.plane(2), [](float z) { return z > 0.0F; }))
        throw InputError(asked, "no normal points to the viewer", "give a map of tangent-space normals");
    return normals;
}

Image encode_normals(const Image& normals, NormalConvention convention) {
    expect_planes(normals, 3, "write a normal map", "normals");
    Image image(normals.size(), 3);
    for (int p = 0; p < 3; ++p) {
        const float half = p == 1 && convention == NormalConvention::directx ? -0.5F : 0.5F;
        std::ranges::transform(normals.plane(p), image.plane(p).begin(),
                               [half](float value) { return 0.5F + half * value; });
    }
    return image;
}

double encoded_height_scale(const Image& height) {
    double above = 0.0, below = 0.0;
    for (const float value : height.values()) {
        above = std::max(above, static_cast<double>(value));
        below = std::max(below, -static_cast<double>(value));
    }
    const double scale = std::max(above / (1.0 - mid_grey), below / mid_grey);
    return scale > 0.0 ? scale : 1.0;
}

Image encode_height(const Image& height, double scale) {
    expect_planes(height, 1, "write a height map", "a height");
    if (!(scale > 0.0) || !std::isfinite(scale))
        throw InputError("write a height map",
                         "black and white are to be " + std::to_string(scale) + " pixels apart",
                         "give a number above 0");
    Image image(height.size(), 1);
    std::ranges::transform(height.values(), image.values().begin(), [scale](float value) {
        return static_cast<float>(std::clamp(mid_grey + static_cast<double>(value) / scale, 0.0, 1.0));
    });
    return image;
}

}  // namespace btfield

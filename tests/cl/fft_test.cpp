#include "host/cl/fft.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <complex>
#include <limits>
#include <numbers>
#include <optional>

#include "btfield/error.hpp"
#include "tests/device_cases.hpp"
#include "tests/reference/fourier.hpp"
#include "tests/reference/noise.hpp"

namespace btfield {

using namespace detail;

namespace {

using Complex = std::complex<double>;

constexpr float nan_value = std::numeric_limits<float>::quiet_NaN();

/// Largest error of one value of an unnormalised transform of `input_norm` = ‖input‖₂.
///
/// Gaussian rounding errors of relative size u in each of log2 N halvings give √(log2 N)·u·‖input‖ in every
/// output (Gentleman and Sande 1966), at worst log2 N times. Odd radices do their work in one stage of up to
/// 13 terms, and the real transforms add one step: 4 more stages. The factor 2 is for the largest of many
/// values.
double bound(Size size, double input_norm) {
    return 2.0 * test::unit_roundoff * (4.0 + std::log2(static_cast<double>(area(size)))) * input_norm;
}

std::size_t at(Size size, int plane, int kx, int ky) {
    return (static_cast<std::size_t>(plane) * static_cast<std::size_t>(size.width) +
            static_cast<std::size_t>(kx)) *
               static_cast<std::size_t>(spectrum_pitch(size.height)) +
           static_cast<std::size_t>(ky);
}

double norm(std::span<const float> values) {
    double sum = 0.0;
    for (const float v : values) sum += static_cast<double>(v) * static_cast<double>(v);
    return std::sqrt(sum);
}

/// What is asked for must be written wholly: results start as not-a-numbers.
Spectrum nan_spectrum(Device& device, Size size, int planes) {
    const std::vector<float> nans(spectrum_floats(size, planes), nan_value);
    return {device.impl().upload(nans), device.impl().upload(nans)};
}

/// White Hermitian spectra, padding undefined: as synthesis hands them over.
struct HalfSpectra {
    std::vector<float> re, im;
    std::vector<std::vector<Complex>> whole;

    HalfSpectra(Size size, int planes)
        : re(spectrum_floats(size, planes), nan_value), im(spectrum_floats(size, planes), nan_value) {
        for (int p = 0; p < planes; ++p) {
            std::vector<Complex> plane(area(size));
            for (int kx = 0; kx < size.width; ++kx)
                for (int ky = 0; ky <= size.height / 2; ++ky) {
                    const Complex z = reference::spectral_noise(11, 0, p, size, kx, ky);
                    const std::size_t i = at(size, p, kx, ky);
                    re[i] = static_cast<float>(z.real());
                    im[i] = static_cast<float>(z.imag());
                    const auto place = [&](int x, int y) {
                        return static_cast<std::size_t>(x * size.height + y);
                    };
                    const Complex rounded(static_cast<double>(re[i]), static_cast<double>(im[i]));
                    plane[place((size.width - kx) % size.width, (size.height - ky) % size.height)] =
                        std::conj(rounded);
                    plane[place(kx, ky)] = rounded;
                }
            whole.push_back(std::move(plane));
        }
    }
};

/// Forward and inverse against the definition, and one after the other.
void check(Device& device, FftBackend backend, Size size, int planes) {
    SCOPED_TRACE(test::text(size) + ", " + std::to_string(planes) + " planes, vector width " +
                 std::to_string(device.vector_width()));
    Fft& fft = device.impl().ffts().plan(device.impl(), size, backend);

    const Image image = test::random_image(size, planes);
    const Buffer in = device.impl().upload(image.values());
    Spectrum spectrum = nan_spectrum(device, size, planes);
    fft.forward(device.impl(), in, spectrum, planes);
    const auto re = test::read_all<float>(device, spectrum.re),
               im = test::read_all<float>(device, spectrum.im);
    for (int p = 0; p < planes; ++p) {
        const std::vector<Complex> expected = reference::forward(image.plane(p), size);
        const double most = bound(size, norm(image.plane(p)));
        for (int kx = 0; kx < size.width; ++kx)
            for (int ky = 0; ky <= size.height / 2; ++ky) {
                const std::size_t i = at(size, p, kx, ky);
                const Complex found(static_cast<double>(re[i]), static_cast<double>(im[i]));
                ASSERT_LE(std::abs(found - expected[static_cast<std::size_t>(kx * size.height + ky)]), most)
                    << "forward, plane " << p << ", kx " << kx << ", ky " << ky;
            }
    }

    Buffer out =
        device.impl().upload(std::vector<float>(area(size) * static_cast<std::size_t>(planes), nan_value));
    fft.inverse(device.impl(), spectrum, out, planes);
    std::vector<float> back = test::read_all<float>(device, out);
    const double count = static_cast<double>(area(size));
    for (int p = 0; p < planes; ++p) {
        // ‖Y‖ = √N ‖y‖, and both ways add their errors: the first one's √N per value, summed over N values
        // like noise.
        const double most = 2.0 * bound(size, norm(image.plane(p)) * std::sqrt(count));
        for (std::size_t i = 0; i < area(size); ++i)
            ASSERT_LE(std::abs(static_cast<double>(back[static_cast<std::size_t>(p) * area(size) + i]) -
                               count * static_cast<double>(image.plane(p)[i])),
                      most)
                << "inverse of forward, plane " << p << ", pixel " << i;
    }

    const HalfSpectra drawn(size, planes);
    Spectrum noise{device.impl().upload(drawn.re), device.impl().upload(drawn.im)};
    fft.inverse(device.impl(), noise, out, planes);
    back = test::read_all<float>(device, out);
    for (int p = 0; p < planes; ++p) {
        const std::vector<Complex>& whole = drawn.whole[static_cast<std::size_t>(p)];
        const std::vector<Complex> expected = reference::inverse(whole, size);
        double squares = 0.0;
        for (const Complex z : whole) squares += std::norm(z);
        const double most = bound(size, std::sqrt(squares));
        for (std::size_t i = 0; i < area(size); ++i) {
            ASSERT_LE(std::abs(expected[i].imag()), most) << "the spectrum is not Hermitian";
            ASSERT_LE(std::abs(static_cast<double>(back[static_cast<std::size_t>(p) * area(size) + i]) -
                               expected[i].real()),
                      most)
                << "inverse, plane " << p << ", pixel " << i;
        }
    }
}

/// Correlation against its definition, on the torus.
void check_correlation(Device& device, FftBackend backend, Size size, Size patch, int planes) {
    SCOPED_TRACE(test::text(size) + ", patches of " + test::text(patch) + ", " + std::to_string(planes) +
                 " planes, vector width " + std::to_string(device.vector_width()));
    constexpr int patches = 3;
    DeviceImpl& impl = device.impl();
    Fft& fft = impl.ffts().plan(impl, size, backend);
    const Image sample = test::random_image(size, planes);
    const Image pieces = test::random_image(patch, patches * planes, 0.0F, 2);
    const Buffer pixels = impl.upload(sample.values()), known = impl.upload(pieces.values());
    Spectrum spectrum = nan_spectrum(device, size, planes);
    fft.forward(impl, pixels, spectrum, planes);
    std::vector<double> expected, most;
    for (int b = 0; b < patches; ++b) {
        double squares = 0.0;
        for (int p = 0; p < planes; ++p) squares += std::pow(norm(pieces.plane(b * planes + p)), 2);
        // Three transforms one after the other, of which the last sums N values of the size of the product.
        most.push_back(
            3.0 * bound(size, static_cast<double>(area(size)) * norm(sample.values()) * std::sqrt(squares)));
        for (int row = 0; row < size.height; ++row)
            for (int column = 0; column < size.width; ++column) {
                double sum = 0.0;
                for (int p = 0; p < planes; ++p)
                    for (int r = 0; r < patch.height; ++r)
                        for (int c = 0; c < patch.width; ++c)
                            sum += static_cast<double>(pieces.at(b * planes + p, r, c)) *
                                   static_cast<double>(
                                       sample.at(p, (row + r) % size.height, (column + c) % size.width));
                expected.push_back(static_cast<double>(area(size)) * sum);
            }
    }
    // All scores, and those of patches that do not go around.
    for (const Size inside : {size, Size{size.height - patch.height + 1, size.width - patch.width + 1}}) {
        Buffer scores = impl.upload(std::vector<float>(area(size) * patches, nan_value));
        fft.correlate(impl, known, patch, patches, planes, spectrum, inside, scores);
        const std::vector<float> found = test::read_all<float>(device, scores);
        for (int b = 0; b < patches; ++b)
            for (int row = 0; row < inside.height; ++row)
                for (int column = 0; column < inside.width; ++column) {
                    const std::size_t i =
                        (static_cast<std::size_t>(b) * static_cast<std::size_t>(size.height) +
                         static_cast<std::size_t>(row)) *
                            static_cast<std::size_t>(size.width) +
                        static_cast<std::size_t>(column);
                    ASSERT_LE(std::abs(static_cast<double>(found[i]) - expected[i]),
                              most[static_cast<std::size_t>(b)])
                        << "patch " << b << ", row " << row << ", column " << column << " of "
                        << test::text(inside);
                }
    }
}

/// All pairs of the lengths: kernels see one length each, edges depend on both.
void check_pairs(Device& device, std::span<const int> lengths) {
    for (const int height : lengths)
        for (const int width : lengths) {
            check(device, FftBackend::lanes, {height, width}, 2);
            if (testing::Test::HasFatalFailure()) return;
        }
}

class FftSmall : public testing::TestWithParam<int> {
  protected:
    Device device_ = test::device_of_width(GetParam());
};
INSTANTIATE_TEST_SUITE_P(Widths, FftSmall, testing::ValuesIn(test::vector_widths),
                         testing::PrintToStringParamName());

TEST_P(FftSmall, LanesOfShortSides) {
    constexpr int lengths[] = {1, 8, 15};
    check_pairs(device_, lengths);
}

TEST_P(FftSmall, CorrelatesPatches) {
    check_correlation(device_, FftBackend::lanes, {8, 15}, {3, 5}, 2);
    check_correlation(device_, FftBackend::lanes, {16, 8}, {2, 1}, 1);  // most of it zeros
}

class FftWidths : public FftSmall {};
INSTANTIATE_TEST_SUITE_P(Widths, FftWidths, testing::ValuesIn(test::vector_widths),
                         testing::PrintToStringParamName());

TEST_P(FftWidths, LanesOfEveryLength) {
    // Every radix, alone and with others; fewer and more values than lanes; odd and even sides.
    constexpr int lengths[] = {1, 2, 3, 4, 5, 6, 7, 8, 11, 12, 13, 16, 26, 32, 45, 52, 55, 64};
    for (std::size_t i = 0; i < std::size(lengths); ++i) {
        const int one = lengths[i], other = lengths[(i + 7) % std::size(lengths)];
        check(device_, FftBackend::lanes, {one, other}, 2);
        if (HasFatalFailure()) return;
    }
}

TEST_P(FftWidths, LanesOfLongSides) {
    // Two stages of 8 at once: alone, first, and after others.
    for (const Size size : {Size{512, 3}, Size{2, 576}, Size{4096, 2}}) {
        check(device_, FftBackend::lanes, size, 1);
        if (HasFatalFailure()) return;
    }
}

TEST_P(FftWidths, CorrelatesPatchesOfAnySize) {
    check_correlation(device_, FftBackend::lanes, {33, 26}, {33, 26}, 1);
    check_correlation(device_, FftBackend::lanes, {26, 45}, {1, 7}, 3);
    check_correlation(device_, FftBackend::lanes, {64, 40}, {20, 1}, 4);
    check_correlation(device_, FftBackend::lanes, {16, 52}, {11, 37}, 8);
    check_correlation(device_, FftBackend::lanes, {64, 40}, {8, 5}, 2);
    check_correlation(device_, FftBackend::lanes, {64, 40}, {9, 6}, 2);
    check_correlation(device_, FftBackend::lanes, {72, 80}, {3, 10}, 1);
    check_correlation(device_, FftBackend::lanes, {128, 192}, {32, 49}, 2);  // one side within a quarter
    check_correlation(device_, FftBackend::lanes, {512, 64}, {96, 9}, 1);
}

TEST(Fft, ClFftCorrelates) {
    Device device;
    check_correlation(device, FftBackend::clfft, {26, 45}, {9, 13}, 3);
    check_correlation(device, FftBackend::clfft, {16, 16}, {16, 16}, 1);
}

TEST(Fft, ClFftFollowsTheDefinition) {
    Device device;
    check(device, FftBackend::clfft, {16, 16}, 3);
    check(device, FftBackend::clfft, {26, 45}, 1);
}

TEST(FftLong, LanesOfEveryPairOfLengths) {
    Device device;
    constexpr int lengths[] = {2, 3, 4, 5, 7, 11, 13, 16, 26, 45, 77, 96, 121};
    check_pairs(device, lengths);
}

TEST(FftLong, ClFftOfOtherLengths) {
    Device device;
    for (const Size size : {Size{7, 121}, Size{64, 96}}) check(device, FftBackend::clfft, size, 2);
}

/// exp(−√−1 2πkr/n), r < n
std::vector<Complex> waves(int k, int n) {
    std::vector<Complex> values;
    for (long long r = 0; r < n; ++r)
        values.push_back(std::polar(1.0, -2.0 * std::numbers::pi * static_cast<double>(k * r % n) / n));
    return values;
}

TEST(FftLong, LanesOfLargeSides) {
    Device device;
    for (const Size size : {Size{1024, 20}, Size{20, 1024}, Size{1001, 18}, Size{16384, 8}, Size{8, 16384}}) {
        SCOPED_TRACE(test::text(size));
        const Image image = test::random_image(size, 1);
        Fft& fft = device.impl().ffts().plan(device.impl(), size, FftBackend::lanes);
        Spectrum spectrum = nan_spectrum(device, size, 1);
        Buffer pixels = device.impl().upload(image.values());
        fft.forward(device.impl(), pixels, spectrum, 1);
        const auto re = test::read_all<float>(device, spectrum.re),
                   im = test::read_all<float>(device, spectrum.im);
        const double most = bound(size, norm(image.values()));
        std::mt19937 generator(5);
        for (int sample = 0; sample < 100; ++sample) {
            // The definition at single frequencies.
            const int kx = static_cast<int>(generator() % static_cast<unsigned>(size.width));
            const int ky = static_cast<int>(generator() % static_cast<unsigned>(size.height / 2 + 1));
            const std::vector<Complex> rows = waves(ky, size.height), columns = waves(kx, size.width);
            Complex expected = 0.0;
            for (int row = 0; row < size.height; ++row) {
                Complex sum = 0.0;
                for (int column = 0; column < size.width; ++column)
                    sum += static_cast<double>(image.at(0, row, column)) *
                           columns[static_cast<std::size_t>(column)];
                expected += sum * rows[static_cast<std::size_t>(row)];
            }
            const std::size_t i = at(size, 0, kx, ky);
            const Complex found(static_cast<double>(re[i]), static_cast<double>(im[i]));
            ASSERT_LE(std::abs(found - expected), most) << "kx " << kx << ", ky " << ky;
        }
        fft.inverse(device.impl(), spectrum, pixels, 1);
        const auto back = test::read_all<float>(device, pixels);
        const double count = static_cast<double>(area(size));
        for (std::size_t i = 0; i < back.size(); ++i)
            ASSERT_LE(std::abs(static_cast<double>(back[i]) - count * static_cast<double>(image.values()[i])),
                      2.0 * std::sqrt(count) * most)
                << "pixel " << i;
    }
}

TEST(Fft, BatchesOfAnySizeAgree) {
    Device device;
    const Size size{16, 26};
    const Image image = test::random_image(size, 5);
    Fft& fft = device.impl().ffts().plan(device.impl(), size, FftBackend::lanes);
    const auto spectra = [&](std::span<const float> values, int planes) {
        const Buffer in = device.impl().upload(values);
        const std::vector<float> zeros(spectrum_floats(size, planes));
        Spectrum spectrum{device.impl().upload(zeros), device.impl().upload(zeros)};
        fft.forward(device.impl(), in, spectrum, planes);
        return test::read_all<float>(device, spectrum.re);
    };
    const std::vector<float> together = spectra(image.values(), 5);
    for (int p = 0; p < 5; ++p) {
        const std::vector<float> alone = spectra(image.plane(p), 1);
        for (int kx = 0; kx < size.width; ++kx)
            for (int ky = 0; ky <= size.height / 2; ++ky)
                ASSERT_EQ(alone[at(size, 0, kx, ky)], together[at(size, p, kx, ky)]) << "plane " << p;
    }
}

/// In place and beside, to the bit.
void check_in_place(Device& device, Size size, int planes, const std::vector<float>& re,
                    const std::vector<float>& im) {
    SCOPED_TRACE(test::text(size) + ", vector width " + std::to_string(device.vector_width()));
    DeviceImpl& impl = device.impl();
    Fft& fft = impl.ffts().plan(impl, size, FftBackend::lanes);
    const PackedSpectrum packed{size};
    const std::size_t half = packed.imaginary(), count = static_cast<std::size_t>(planes) * area(size);
    std::vector<float> together(packed.bytes(planes) / sizeof(float), nan_value);
    for (std::size_t p = 0; p < static_cast<std::size_t>(planes); ++p) {
        const auto place = together.begin() + static_cast<std::ptrdiff_t>(p * packed.stride());
        std::copy_n(re.begin() + static_cast<std::ptrdiff_t>(p * half), half, place);
        std::copy_n(im.begin() + static_cast<std::ptrdiff_t>(p * half), half,
                    place + static_cast<std::ptrdiff_t>(half));
    }
    Buffer memory = impl.upload(together);
    ASSERT_TRUE(fft.takes_packed());
    fft.inverse_packed(impl, memory, 0, memory, planes);
    Spectrum apart{impl.upload(re), impl.upload(im)};
    Buffer images = impl.buffer(sizeof(float) * count);
    fft.inverse(impl, apart, images, planes);
    const auto found = test::read_all<float>(device, memory),
               expected = test::read_all<float>(device, images);
    for (std::size_t i = 0; i < count; ++i) ASSERT_EQ(found[i], expected[i]) << "value " << i;
}

TEST_P(FftSmall, InPlace) {
    for (const Size size : {Size{1, 1}, Size{6, 5}, Size{13, 4}}) {
        const HalfSpectra spectra(size, 3);
        check_in_place(device_, size, 3, spectra.re, spectra.im);
    }
}

TEST(Fft, InPlaceByGroupsOfPlanes) {
    Device device;
    const Size size{1000, 1024};
    constexpr int planes = 5;
    Fft& fft = device.impl().ffts().plan(device.impl(), size, FftBackend::lanes);
    ASSERT_LT(fft.packed_scratch_bytes(planes), fft.scratch_bytes(planes));
    std::vector<float> re(spectrum_floats(size, planes)), im(re.size());
    for (std::size_t i = 0; i < re.size(); ++i) {
        re[i] = std::sin(static_cast<float>(i));
        im[i] = std::cos(0.7F * static_cast<float>(i));
    }
    check_in_place(device, size, planes, re, im);
}

bool is_fft_size(int n) {
    for (int p = 2; p <= n; ++p)
        while (n % p == 0) {
            if (p > fft_largest_prime) return false;
            n /= p;
        }
    return n == 1;
}

TEST(Fft, NextSizeIsTheSmallestTransformable) {
    for (int n = 1; n <= 2000; ++n) {
        const int next = next_fft_size(n);
        ASSERT_GE(next, n);
        ASSERT_TRUE(is_fft_size(next)) << next;
        for (int between = n; between < next; ++between) ASSERT_FALSE(is_fft_size(between)) << between;
    }
    EXPECT_EQ(next_fft_size(17), 18);
    EXPECT_EQ(next_fft_size(512), 512);
    EXPECT_EQ(next_fft_size(0), 1);
    EXPECT_EQ(next_fft_size(-5), 1);
}

TEST(Fft, PitchesHoldTheHalfSpectrumOfEveryVectorWidth) {
    for (int height = 1; height < 100; ++height) {
        EXPECT_GT(spectrum_pitch(height), height / 2);
        EXPECT_LE(spectrum_pitch(height), height / 2 + 16);
        for (const int width : test::vector_widths) EXPECT_EQ(spectrum_pitch(height) % width, 0);
    }
    EXPECT_EQ(spectrum_floats({33, 20}, 3), 3U * 20U * 32U);
}

TEST(Fft, RefusesOtherSides) {
    Device device;
    FftPlans& plans = device.impl().ffts();
    for (const FftBackend backend : {FftBackend::lanes, FftBackend::clfft, FftBackend::automatic})
        for (const Size size :
             {Size{17, 16}, Size{16, 17}, Size{16, 34}, Size{0, 16}, Size{16, 0}, Size{-4, 16}}) {
            SCOPED_TRACE(test::text(size));
            try {
                plans.plan(device.impl(), size, backend);
                ADD_FAILURE() << "it was planned";
            } catch (const DeviceError& error) {
                const std::string text = error.what();
                EXPECT_NE(text.find(std::to_string(size.width) + "x" + std::to_string(size.height)),
                          std::string::npos)
                    << text;
            }
        }
}

TEST(Fft, PlansAreKeptAndBackEndsResolved) {
    Device device;
    FftPlans& plans = device.impl().ffts();
    Fft& lanes = plans.plan(device.impl(), {16, 26}, FftBackend::lanes);
    EXPECT_EQ(&lanes, &plans.plan(device.impl(), {16, 26}, FftBackend::lanes));
    EXPECT_NE(&lanes, &plans.plan(device.impl(), {26, 16}, FftBackend::lanes));
    EXPECT_NE(&lanes, &plans.plan(device.impl(), {16, 26}, FftBackend::clfft));
    const FftBackend automatic = FftPlans::resolve(device.impl(), {16, 26}, FftBackend::automatic);
    EXPECT_EQ(automatic, device.info().type == DeviceType::cpu ? FftBackend::lanes : FftBackend::clfft);
    EXPECT_EQ(FftPlans::resolve(device.impl(), {16, 26}, FftBackend::clfft), FftBackend::clfft);
    for (const Size small : {Size{1, 64}, Size{64, 3}})  // clFFT has none
        EXPECT_EQ(FftPlans::resolve(device.impl(), small, FftBackend::clfft), FftBackend::lanes);
    EXPECT_GE(lanes.scratch_bytes(2), lanes.scratch_bytes(1));
    EXPECT_GT(lanes.scratch_bytes(1), 0U);
}

}  // namespace
}  // namespace btfield

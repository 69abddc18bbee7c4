// kernels/synthesis/noise.cl and kernels/base/philox.clh.

#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <fstream>
#include <limits>
#include <numbers>
#include <sstream>
#include <stdexcept>

#include "host/synthesis/spectral_factors.hpp"
#include "tests/device_cases.hpp"
#include "tests/places.hpp"
#include "tests/reference/noise.hpp"

namespace btfield {

using namespace detail;

namespace {

using Words = std::array<std::uint32_t, 4>;

/// Lines of tests/data/known_answers.txt, which says what they are.
struct PhiloxAnswer {
    Words counter;
    std::array<std::uint32_t, 2> key;
    Words words;
};
struct NormalAnswer {
    std::uint64_t seed;
    int level, plane, row, column;
    std::uint32_t bits;
};
struct KnownAnswers {
    std::vector<PhiloxAnswer> philox;
    std::vector<NormalAnswer> normals;
};

KnownAnswers read_known_answers() {
    const std::string path = test::data_folder() + "/known_answers.txt";
    std::ifstream file(path);
    KnownAnswers answers;
    std::string line;
    while (std::getline(file, line)) {
        std::istringstream words(line.substr(0, line.find('#')));
        std::string kind;
        if (!(words >> kind)) continue;
        if (kind == "philox") {
            PhiloxAnswer& v = answers.philox.emplace_back();
            words >> std::hex;
            for (std::uint32_t& word : v.counter) words >> word;
            for (std::uint32_t& word : v.key) words >> word;
            for (std::uint32_t& word : v.words) words >> word;
        } else if (kind == "normal") {
            NormalAnswer& v = answers.normals.emplace_back();
            words >> std::hex >> v.seed >> std::dec >> v.level >> v.plane >> v.row >> v.column >> std::hex >>
                v.bits;
        } else {
            words.setstate(std::ios::failbit);
        }
        std::string rest;
        if (words.fail() || words >> rest) throw std::runtime_error(path + ": cannot read: " + line);
    }
    if (answers.philox.empty() || answers.normals.empty()) throw std::runtime_error(path + " lacks answers");
    return answers;
}

const KnownAnswers& known_answers() {
    static const KnownAnswers answers = read_known_answers();
    return answers;
}

/// [texture · planes + plane][row][column]
std::vector<float> noise(Device& device, Size size, int planes, const std::vector<std::uint64_t>& seeds,
                         int level) {
    const std::size_t count = area(size) * static_cast<std::size_t>(planes) * seeds.size();
    // Not a number wherever the kernel does not write, and beyond the end.
    std::vector<float> values(count + 64, std::numeric_limits<float>::quiet_NaN());
    const Buffer images = device.impl().upload(values), keys = test::upload_seeds(device, seeds);
    draw_normal_field(device.impl(), images, keys, size, planes, static_cast<int>(seeds.size()), level);
    values = test::read_all<float>(device, images);
    for (std::size_t i = count; i < values.size(); ++i)
        EXPECT_TRUE(std::isnan(values[i])) << "written beyond the end: " << i - count;
    values.resize(count);
    return values;
}

bool same_bits(std::span<const float> a, std::span<const float> b) {
    return a.size() == b.size() && std::equal(a.begin(), a.end(), b.begin(), [](float x, float y) {
               return std::bit_cast<std::uint32_t>(x) == std::bit_cast<std::uint32_t>(y);
           });
}

/// How far a float32 draw may be from the float64 one of this radius r = √x.
///
/// The kernel says: relative error of ln u below 4e-7 / √… as part of r, of sine and cosine 2e-7; with the
/// two products' roundings 8e-7 r. Besides, u = (k + ½)·2^−31 is rounded twice, by 2^−24 u each at most: x =
/// −2 ln u moves by 2^−22, and r by |Δx|/(√x + √x') <= 2^−22/r; where r itself is tiny, by √|Δx| = 2^−11.
double bound(double radius) {
    return 8e-7 * radius + std::min(0x1p-22 / radius, 0x1p-11);
}

class NoiseSmall : public testing::TestWithParam<int> {
  protected:
    Device device_ = test::device_of_width(GetParam());
};

INSTANTIATE_TEST_SUITE_P(Widths, NoiseSmall, testing::ValuesIn(test::vector_widths),
                         testing::PrintToStringParamName());

class NoiseWidths : public NoiseSmall {};

INSTANTIATE_TEST_SUITE_P(Widths, NoiseWidths, testing::ValuesIn(test::vector_widths),
                         testing::PrintToStringParamName());

TEST_P(NoiseSmall, PhiloxGivesThePublishedWords) {
    constexpr std::size_t count = 48;
    DeviceImpl& impl = device_.impl();
    for (const PhiloxAnswer& v : known_answers().philox) {
        EXPECT_EQ(reference::philox4x32_10(v.counter, v.key), v.words);
        // Every third lane has the published counter, the others have neighbours of it: lanes must not mix.
        std::vector<std::uint32_t> counters(4 * count);
        const auto counter_of = [&](std::size_t i) {
            Words counter = v.counter;
            counter[i % 4] += i % 3 == 0 ? 0 : static_cast<std::uint32_t>(i);
            return counter;
        };
        for (std::size_t i = 0; i < count; ++i)
            for (std::size_t w = 0; w < 4; ++w) counters[w * count + i] = counter_of(i)[w];
        const Buffer in = impl.upload(counters), out = impl.buffer(sizeof(std::uint32_t) * 4 * count);
        impl.launch(impl.kernel("noise", "philox_block", impl.lanes()),
                    {count / static_cast<std::size_t>(device_.vector_width())}, Grain::fine, out, in,
                    v.key[0], v.key[1], static_cast<int>(count));
        const auto words = test::read_all<std::uint32_t>(device_, out);
        for (std::size_t i = 0; i < count; ++i)
            EXPECT_EQ((Words{words[i], words[count + i], words[2 * count + i], words[3 * count + i]}),
                      i % 3 == 0 ? v.words : reference::philox4x32_10(counter_of(i), v.key))
                << "lane " << i;
    }
}

TEST_P(NoiseSmall, FieldsFollowTheReference) {
    const std::vector<std::uint64_t> seeds{1, 0xfedcba9876543210};
    constexpr int planes = 3, level = 2;
    for (const Size size : test::lattice_sizes) {
        SCOPED_TRACE(test::text(size));
        const std::vector<float> values = noise(device_, size, planes, seeds, level);
        std::size_t i = 0;
        for (const std::uint64_t seed : seeds)
            for (int p = 0; p < planes; ++p)
                for (int row = 0; row < size.height; ++row)
                    for (int column = 0; column < size.width; ++column, ++i) {
                        const reference::Draw draw = reference::spatial_noise(seed, level, p, row, column);
                        ASSERT_LE(std::abs(static_cast<double>(values[i]) - draw.value), bound(draw.radius))
                            << "seed " << seed << ", plane " << p << ", row " << row << ", column " << column;
                    }
    }
}

TEST_P(NoiseWidths, BitsAreThoseOfOneLane) {
    Device one = test::device_of_width(1);
    for (const Size size : test::lattice_sizes) {
        SCOPED_TRACE(test::text(size));
        EXPECT_TRUE(same_bits(noise(device_, size, 2, {7, 8}, 1), noise(one, size, 2, {7, 8}, 1)));
    }
}

TEST(NoiseWorkGroups, BitsDoNotDependOnThem) {
    struct Case {
        int width, local;
    };
    const Size size{5, 331};
    Device native;
    const std::vector<float> expected = noise(native, size, 2, {3}, 0);
    for (const Case c : {Case{1, 64}, Case{4, 3}, Case{0, 1}, Case{0, 7}, Case{0, 1 << 30}}) {
        SCOPED_TRACE("vector width " + std::to_string(c.width) + ", work-group size " +
                     std::to_string(c.local));
        DeviceOptions options;
        options.vector_width = c.width;
        options.work_group_size = c.local;
        Device device({}, options);
        EXPECT_TRUE(same_bits(noise(device, size, 2, {3}, 0), expected));
    }
}

TEST_P(NoiseSmall, BatchesAndPlanesAreIndependentOfEachOther) {
    const Size size{6, 70};
    const std::vector<std::uint64_t> seeds{5, std::uint64_t{5} << 32, 6, 0};
    const std::vector<float> all = noise(device_, size, 4, seeds, 3);
    for (std::size_t s = 0; s < seeds.size(); ++s)
        for (const int planes : {1, 3, 4}) {
            const std::vector<float> alone = noise(device_, size, planes, {seeds[s]}, 3);
            EXPECT_TRUE(same_bits(alone, std::span(all).subspan(s * 4 * area(size), alone.size())))
                << "seed " << seeds[s] << ", planes " << planes;
        }
    // A pixel keeps its value when the lattice grows.
    const Size larger{9, 131};
    const std::vector<float> grown = noise(device_, larger, 1, {5}, 3);
    for (std::size_t row = 0; row < 6; ++row)
        EXPECT_TRUE(same_bits(std::span(all).subspan(row * 70, 70), std::span(grown).subspan(row * 131, 70)));
}

TEST_P(NoiseSmall, TexturesOfASeedStayWhatTheyAre) {
    for (const NormalAnswer& v : known_answers().normals) {
        const std::vector<float> field =
            noise(device_, {v.row + 1, v.column + 1}, v.plane + 1, {v.seed}, v.level);
        EXPECT_EQ(std::bit_cast<std::uint32_t>(field.back()), v.bits)
            << std::hex << v.seed << std::dec << ", level " << v.level << ", plane " << v.plane << ", row "
            << v.row << ", column " << v.column;
        const reference::Draw draw = reference::spatial_noise(v.seed, v.level, v.plane, v.row, v.column);
        EXPECT_LE(std::abs(static_cast<double>(std::bit_cast<float>(v.bits)) - draw.value),
                  bound(draw.radius));
    }
}

TEST_P(NoiseSmall, EverythingInTheCounterMatters) {
    const Size size{8, 64};
    const std::vector<float> base = noise(device_, size, 1, {1}, 0);
    const auto shared_values = [&](const std::vector<float>& other) {
        std::size_t same = 0;
        for (std::size_t i = 0; i < base.size(); ++i) same += base[i] == other[i] ? 1 : 0;
        return same;
    };
    // Equal floats by chance: about one in 2^23.
    EXPECT_LE(shared_values(noise(device_, size, 1, {2}, 0)), 1U);
    EXPECT_LE(shared_values(noise(device_, size, 1, {1 + (std::uint64_t{1} << 32)}, 0)), 1U);
    EXPECT_LE(shared_values(noise(device_, size, 1, {1}, 1)), 1U);
    const std::vector<float> planes = noise(device_, size, 2, {1}, 0);
    EXPECT_LE(shared_values({planes.begin() + static_cast<std::ptrdiff_t>(area(size)), planes.end()}), 1U);
    std::vector<float> sorted = base;
    std::sort(sorted.begin(), sorted.end());
    EXPECT_GE(std::unique(sorted.begin(), sorted.end()) - sorted.begin(), 511);
}

/// Ten million draws with fixed seeds. Every statistic is compared with its standard error under independence
/// and normality; 4.5 of them are exceeded by chance once in 150 000.
class NoiseStatistics : public testing::Test {
  protected:
    static constexpr Size size{2000, 1000};
    static constexpr int planes = 5;
    static constexpr double n = 2000.0 * 1000.0 * planes;
    static constexpr double sigmas = 4.5;

    /// Mean of products a(i)·b(i + shift) and of (a² − 1)(b² − 1)/2, over all places where both exist, times
    /// √places: both have standard error 1.
    static std::pair<double, double> correlations(const std::vector<float>& a, const std::vector<float>& b,
                                                  int plane, int row, int column) {
        double products = 0.0, squares = 0.0, places = 0.0;
        for (int p = 0; p < planes - plane; ++p)
            for (int r = std::max(0, -row); r < size.height - std::max(0, row); ++r) {
                const auto line = [&](int q, int s) {
                    return (static_cast<std::size_t>(q) * size.height + static_cast<std::size_t>(s)) *
                           size.width;
                };
                const float* x = &a[line(p, r)];
                const float* y = &b[line(p + plane, r + row) + static_cast<std::size_t>(column)];
                for (int c = 0; c < size.width - column; ++c) {
                    const double u = static_cast<double>(x[c]), v = static_cast<double>(y[c]);
                    products += u * v;
                    squares += (u * u - 1.0) * (v * v - 1.0);
                }
                places += size.width - column;
            }
        return {products / std::sqrt(places), squares / 2.0 / std::sqrt(places)};
    }

    void SetUp() override {
        ASSERT_TRUE(std::all_of(draws_.begin(), draws_.end(), [](float x) { return std::isfinite(x); }));
    }

    Device device_;
    std::vector<float> draws_ = noise(device_, size, planes, {20240131}, 0);
};

TEST_F(NoiseStatistics, MomentsAndTails) {
    double sums[5] = {};
    for (const float draw : draws_) {
        const double x = static_cast<double>(draw);
        sums[1] += x;
        sums[2] += x * x;
        sums[3] += x * x * x;
        sums[4] += x * x * x * x;
    }
    // Moments about the known mean 0: variances of x, x², x³, x⁴ are 1, 2, 15, 96.
    EXPECT_LE(std::abs(sums[1] / n), sigmas * std::sqrt(1.0 / n));
    EXPECT_LE(std::abs(sums[2] / n - 1.0), sigmas * std::sqrt(2.0 / n));
    EXPECT_LE(std::abs(sums[3] / n), sigmas * std::sqrt(15.0 / n));
    EXPECT_LE(std::abs(sums[4] / n - 3.0), sigmas * std::sqrt(96.0 / n));
    // Skewness and excess kurtosis of the standardised sample.
    const double mean = sums[1] / n, variance = sums[2] / n - mean * mean;
    const double third = sums[3] / n - 3.0 * mean * sums[2] / n + 2.0 * mean * mean * mean;
    const double fourth = sums[4] / n - 4.0 * mean * sums[3] / n + 6.0 * mean * mean * sums[2] / n -
                          3.0 * mean * mean * mean * mean;
    EXPECT_LE(std::abs(third / std::pow(variance, 1.5)), sigmas * std::sqrt(6.0 / n));
    EXPECT_LE(std::abs(fourth / (variance * variance) - 3.0), sigmas * std::sqrt(24.0 / n));

    // P(max < 4.8) = (1 − 8e-7)^n = 4e-4; beyond 6.66 there are no 31-bit uniforms.
    const auto [low, high] = std::minmax_element(draws_.begin(), draws_.end());
    EXPECT_GT(*high, 4.8F);
    EXPECT_LT(*low, -4.8F);
    EXPECT_LT(*high, 6.67F);
    EXPECT_GT(*low, -6.67F);
    for (const double tail : {3.0, 4.0, 4.5}) {
        const double expected = n * std::erfc(tail / std::numbers::sqrt2);
        const auto found =
            std::count_if(draws_.begin(), draws_.end(), [&](float x) { return std::abs(x) > tail; });
        EXPECT_LE(std::abs(static_cast<double>(found) - expected), sigmas * std::sqrt(expected)) << tail;
    }
}

TEST_F(NoiseStatistics, KolmogorovSmirnov) {
    std::sort(draws_.begin(), draws_.end());
    double largest = 0.0;
    for (std::size_t i = 0; i < draws_.size(); ++i) {
        const double expected = 0.5 * std::erfc(-static_cast<double>(draws_[i]) / std::numbers::sqrt2);
        const double below = static_cast<double>(i) / n, above = static_cast<double>(i + 1) / n;
        largest = std::max({largest, expected - below, above - expected});
    }
    // P(√n D > 2.3) = 2 exp(−2·2.3²) = 5e-5.
    EXPECT_LE(largest, 2.3 / std::sqrt(n));
    EXPECT_GT(largest, 0.3 / std::sqrt(n));  // and no closer than chance allows: P = 1e-5
}

TEST_F(NoiseStatistics, NeighboursAreUncorrelated) {
    struct Shift {
        const char* name;
        int plane, row, column;
    };
    // 16, 32 and 48 columns on are other words of the same block: 16 shares its radius, 32 its counter.
    constexpr Shift shifts[] = {
        {"column", 0, 0, 1},   {"two columns", 0, 0, 2},
        {"partner", 0, 0, 16}, {"second pair", 0, 0, 32},
        {"both", 0, 0, 48},    {"next chunk", 0, 0, 64},
        {"row", 0, 1, 0},      {"two rows", 0, 2, 0},
        {"diagonal", 0, 1, 1}, {"other diagonal", 0, -1, 1},
        {"plane", 1, 0, 0},    {"plane and row", 1, 1, 0},
    };
    for (const Shift& shift : shifts) {
        const auto [products, squares] = correlations(draws_, draws_, shift.plane, shift.row, shift.column);
        EXPECT_LE(std::abs(products), sigmas) << shift.name;
        EXPECT_LE(std::abs(squares), sigmas) << "squares, " << shift.name;
    }
}

TEST_F(NoiseStatistics, LevelsAndSeedsAreUncorrelated) {
    struct Other {
        const char* name;
        std::uint64_t seed;
        int level;
    };
    constexpr Other others[] = {{"level", 20240131, 1},
                                {"seed", 20240132, 0},
                                {"upper half of the seed", 20240131 + (std::uint64_t{1} << 32), 0}};
    for (const Other& other : others) {
        const std::vector<float> draws = noise(device_, size, planes, {other.seed}, other.level);
        const auto [products, squares] = correlations(draws_, draws, 0, 0, 0);
        EXPECT_LE(std::abs(products), sigmas) << other.name;
        EXPECT_LE(std::abs(squares), sigmas) << "squares, " << other.name;
    }
}

}  // namespace
}  // namespace btfield

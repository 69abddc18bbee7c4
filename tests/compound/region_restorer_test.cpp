// host/compound/region_restorer.cpp and kernels/compound/region_restorer.cl.

#include "host/compound/region_restorer.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "btfield/error.hpp"
#include "tests/device_cases.hpp"
#include "tests/label_cases.hpp"
#include "tests/reference/region_restorer.hpp"

namespace btfield {

using namespace detail;

namespace {

using std::size_t;

std::vector<double> random_values(size_t count, std::mt19937& generator) {
    std::normal_distribution<double> normal;
    std::vector<double> values(count);
    for (double& value : values) value = normal(generator);
    return values;
}

/// A region whose residual models `rank` of `planes` planes: 0 stands for all of them, without T.
/// \param knots of its marginals; 0: it has none, nor a W
CompoundRegion random_region(int planes, int rank, int knots, unsigned seed) {
    std::mt19937 generator(seed);
    std::uniform_real_distribution<double> uniform;
    const auto d = static_cast<size_t>(planes), r = static_cast<size_t>(rank);
    CompoundRegion region;
    region.colour = random_values(d, generator);
    region.contrast = 0.5 + uniform(generator);
    region.structure = uniform(generator);
    TextureModel& residual = region.residual;
    residual.planes = planes;
    residual.mean = random_values(d, generator);
    if (rank > 0) residual.basis = {planes, rank, random_values(r * d, generator), residual.mean};
    if (knots == 0) return region;
    residual.whitening = random_values(r * r, generator);
    for (int i = 0; i < rank; ++i) {
        Marginal& marginal = residual.marginals.emplace_back();
        double q = -0.25 * knots;
        for (int n = 0; n < knots; ++n) {
            marginal.values.push_back(q);
            q += n % 5 == 3 ? 0.0 : uniform(generator);
        }
    }
    return region;
}

/// Regions with marginals of different lengths, with T alone and with neither.
CompoundModel model_of(int planes, const std::vector<std::pair<int, int>>& ranks_and_knots, Borders borders) {
    CompoundModel model;
    model.planes = planes;
    model.borders = borders;
    unsigned seed = 1;
    for (const auto& [rank, knots] : ranks_and_knots)
        model.regions.push_back(random_region(planes, rank, knots, seed++));
    return model;
}

int rank_of(const CompoundModel& model) {
    int rank = 0;
    for (const CompoundRegion& region : model.regions)
        rank = std::max(rank, modelled_planes(region.residual));
    return rank;
}

Image restored(Device& device, const CompoundModel& model, const Image& x, const Image& mean,
               const ControlField& field, std::uint64_t seed = 0) {
    DeviceImpl& impl = device.impl();
    const DevicePlanes planes{impl.upload(x.values()), mean.size(), x.size(), x.planes()};
    DevicePlanes means{impl.upload(mean.values()), mean.size(), mean.size(), mean.planes()};
    const DevicePlanes result =
        RegionRestorer(impl, model).restore(planes, std::move(means), impl.upload(field.labels), seed);
    EXPECT_EQ(result.size, mean.size());
    EXPECT_EQ(result.lattice, mean.size());
    EXPECT_EQ(result.planes, mean.planes());
    Image image(mean.size(), mean.planes());
    impl.read(result.values, image.values().data(), image.values().size_bytes());
    return image;
}

/// How far float32 may be from the formula. W x: r products of rounded numbers. Its place among n knots
/// 7/(n − 1) apart moves with it, and by 3 roundings of up to n; the slope there is at most 1 a knot here,
/// and q, its step and their sum are rounded once each. Then r products of rounded numbers and μ, and 8
/// roundings for c, a, b and the sums and products with them.
std::vector<double> bounds(const CompoundRegion& region, const std::vector<double>& x,
                           const std::vector<double>& m) {
    constexpr double u = test::unit_roundoff;
    const TextureModel& residual = region.residual;
    const auto r = static_cast<size_t>(modelled_planes(residual));
    const std::vector<double> t = reference::turning(residual);
    std::vector<double> g = reference::whitened(residual, x), off(r, 0.0), result;
    for (size_t i = 0; i < r; ++i) {
        for (size_t j = 0; j < r && !residual.whitening.empty(); ++j)
            off[i] += (static_cast<double>(r) + 1.0) * u * std::abs(residual.whitening[i * r + j] * x[j]);
        if (residual.marginals.empty()) continue;
        const std::vector<double>& q = residual.marginals[i].values;
        const auto n = static_cast<double>(q.size());
        g[i] = reference::mapped(q, g[i]);
        off[i] = off[i] * (n - 1.0) / 7.0 + 3.0 * u * n +
                 3.0 * u * std::max(std::abs(q.front()), std::abs(q.back()));
    }
    for (size_t p = 0; p < m.size(); ++p) {
        const double c = std::abs(region.colour[p]);
        double carried = 0.0, largest = region.structure * (std::abs(m[p]) + c) + std::abs(residual.mean[p]);
        for (size_t i = 0; i < r; ++i) {
            carried += std::abs(t[i * m.size() + p]) * off[i];
            largest += std::abs(t[i * m.size() + p] * g[i]);
        }
        result.push_back(region.contrast * carried +
                         (static_cast<double>(r) + 10.0) * u * (region.contrast * largest + c));
    }
    return result;
}

/// \param lattice of the levels' sum: that of its transform may be larger
void expect_reference(Device& device, const CompoundModel& model, Size size, Size lattice) {
    SCOPED_TRACE(test::text(size) + ", d = " + std::to_string(model.planes));
    const Image x = test::random_image(lattice, rank_of(model), 0.0F, 2);
    const Image mean = test::random_image(size, model.planes, 0.5F, 3);
    const ControlField field = test::patchy_labels(size, static_cast<int>(model.regions.size()));
    const Image found = restored(device, model, x, mean, field);
    for (int row = 0; row < size.height; ++row)
        for (int column = 0; column < size.width; ++column) {
            const std::uint8_t label = field.labels[static_cast<size_t>(row * size.width + column)];
            const CompoundRegion& region = model.regions[label];
            std::vector<double> n, m;
            for (int i = 0; i < x.planes(); ++i) n.push_back(static_cast<double>(x.at(i, row, column)));
            for (int p = 0; p < mean.planes(); ++p) m.push_back(static_cast<double>(mean.at(p, row, column)));
            const std::vector<double> expected = reference::restored(region, n, m),
                                      bound = bounds(region, n, m);
            for (size_t p = 0; p < m.size(); ++p)
                ASSERT_LE(
                    std::abs(static_cast<double>(found.at(static_cast<int>(p), row, column)) - expected[p]),
                    bound[p])
                    << "region " << int{label} << ", plane " << p << ", row " << row << ", column " << column;
        }
}

const std::vector<std::pair<int, int>> of_three_planes{{3, 24}, {2, 5}, {0, 0}, {1, most_knots}, {2, 0}};

class RegionRestorerSmall : public testing::TestWithParam<int> {
  protected:
    Device device_ = test::device_of_width(GetParam());
};
INSTANTIATE_TEST_SUITE_P(Widths, RegionRestorerSmall, testing::ValuesIn(test::vector_widths),
                         testing::PrintToStringParamName());

TEST_P(RegionRestorerSmall, FollowsTheFormula) {
    const CompoundModel model = model_of(3, of_three_planes, Borders::conditional);
    for (const Size size : {Size{1, 1}, Size{7, 19}}) expect_reference(device_, model, size, size);
    expect_reference(device_, model, {5, 34}, {6, 35});
}

/// Planes whose restoring leaves the conditional mean as it is: what borders do to it alone.
CompoundModel passing_model(int planes, int regions, Borders borders) {
    CompoundModel model = model_of(planes, {}, borders);
    CompoundRegion region;
    region.colour.assign(static_cast<size_t>(planes), 0.0);
    region.residual.planes = planes;
    region.residual.mean.assign(static_cast<size_t>(planes), 0.0);
    model.regions.assign(static_cast<size_t>(regions), region);
    return model;
}

Image treated(Device& device, const Image& mean, const ControlField& field, std::uint64_t seed,
              Borders borders = Borders::swap) {
    return restored(device, passing_model(mean.planes(), field.regions, borders),
                    Image(mean.size(), mean.planes()), mean, field, seed);
}

/// Pixels change places exactly as they should; smoothing is 9 products with powers of 2 and as many sums.
void expect_treated(Device& device, Size size, int regions, std::uint64_t seed) {
    SCOPED_TRACE(test::text(size));
    const Image mean = test::random_image(size, 3, 2.0F, 7);
    const ControlField field = test::patchy_labels(size, regions);
    std::vector<reference::Plane> planes;
    for (int p = 0; p < 3; ++p) planes.emplace_back(mean, p);
    const Image found = treated(device, mean, field, seed);
    const std::vector<reference::Plane> expected = reference::treated_borders(planes, field, seed);
    double most = 0.0;
    for (const float value : mean.values()) most = std::max(most, std::abs(static_cast<double>(value)));
    for (int p = 0; p < 3; ++p)
        for (size_t i = 0; i < area(size); ++i)
            ASSERT_LE(
                std::abs(static_cast<double>(found.plane(p)[i]) - expected[static_cast<size_t>(p)].values[i]),
                9.0 * test::unit_roundoff * most)
                << "plane " << p << ", pixel " << i;
}

TEST_P(RegionRestorerSmall, TreatsBorders) {
    for (const Size size : {Size{1, 1}, Size{2, 5}, Size{6, 11}})
        expect_treated(device_, size, 2, 0xfedcba9876543210);
}

class RegionRestorerWidths : public RegionRestorerSmall {};
INSTANTIATE_TEST_SUITE_P(Widths, RegionRestorerWidths, testing::ValuesIn(test::vector_widths),
                         testing::PrintToStringParamName());

TEST_P(RegionRestorerWidths, EverySize) {
    for (const Size size : test::lattice_sizes) {
        expect_reference(device_, model_of(3, of_three_planes, Borders::none), size, size);
        expect_treated(device_, size, 3, 1);
    }
}

TEST(RegionRestorer, EveryNumberOfPlanesAndRank) {
    const std::vector<std::pair<int, int>> one{{1, 24}, {0, 0}, {1, fewest_knots}},
        four{{4, 32}, {2, 16}, {0, 0}}, thin{{2, 24}, {1, 24}};
    for (const auto& [planes, regions] : {std::pair{1, one}, std::pair{4, four}, std::pair{5, thin}})
        expect_reference(test::default_device(), model_of(planes, regions, Borders::none), {17, 23},
                         {17, 23});
}

TEST(RegionRestorer, StructureAndContrastOf0LeaveTheRest) {
    Device& device = test::default_device();
    CompoundModel model = model_of(3, of_three_planes, Borders::none);
    model.regions[0].contrast = model.regions[1].structure = 0.0;
    expect_reference(device, model, {17, 23}, {17, 23});
    model.regions.resize(1);
    const Image x = test::random_image({16, 16}, 3), mean = test::random_image({16, 16}, 3, 0.0F, 2);
    const Image flat = restored(device, model, x, mean, {mean.size(), 1, std::vector<std::uint8_t>(256, 0)});
    for (int p = 0; p < 3; ++p)
        for (const float value : flat.plane(p))
            EXPECT_EQ(value, static_cast<float>(model.regions[0].colour[static_cast<size_t>(p)]));
}

TEST(RegionRestorer, NaNStaysNaN) {
    const CompoundModel model = model_of(3, of_three_planes, Borders::none);
    Image x = test::random_image({9, 9}, 3);
    for (int r = 0; r < 9; ++r) x.at(0, r, 4) = std::nanf("");
    const ControlField field = test::patchy_labels({9, 9}, 5);
    const Image found = restored(test::default_device(), model, x, test::random_image({9, 9}, 3), field);
    for (int r = 0; r < 9; ++r)
        for (int c = 0; c < 9; ++c) EXPECT_EQ(std::isnan(found.at(0, r, c)), c == 4) << r << " " << c;
}

TEST(RegionRestorer, MarginalsOfARegionHaveOneNumberOfKnots) {
    CompoundModel model = model_of(3, of_three_planes, Borders::none);
    model.regions[1].residual.marginals[1].values.push_back(100.0);
    EXPECT_THROW(RegionRestorer(test::default_device().impl(), model), InputError);
}

// Treatment of borders
// ----------------------------------------------------------------------------------------------------

TEST(RegionRestorer, OnlyBordersAreTreated) {
    const Size size{48, 60};
    const CompoundModel model = model_of(3, {{3, 24}, {2, 5}, {0, 0}}, Borders::none);
    CompoundModel swapping = model;
    swapping.borders = Borders::swap;
    const ControlField field = test::patchy_labels(size, 3);
    const Image x = test::random_image(size, 3), mean = test::random_image(size, 3, 0.0F, 2);
    Device& device = test::default_device();
    const Image left = restored(device, model, x, mean, field);
    const Image found = restored(device, swapping, x, mean, field, 5);
    int inside = 0, changed = 0, borders = 0;
    for (int r = 0; r < size.height; ++r)
        for (int c = 0; c < size.width; ++c) {
            const bool border = reference::at_border(field, r, c);
            (border ? borders : inside) += 1;
            for (int p = 0; p < 3; ++p) {
                if (border)
                    changed += found.at(p, r, c) != left.at(p, r, c) ? 1 : 0;
                else
                    ASSERT_EQ(found.at(p, r, c), left.at(p, r, c)) << "row " << r << ", column " << c;
            }
        }
    EXPECT_GT(inside, 100);
    EXPECT_EQ(changed, 3 * borders);  // that a mean of nine values is one of them has probability 0
}

TEST(RegionRestorer, TreatmentsOfOneSeedAreOneForEveryWidth) {
    const Image mean = test::random_image({37, 64}, 3);
    const ControlField field = test::patchy_labels(mean.size(), 4);
    const Image first = treated(test::default_device(), mean, field, 77);
    for (const int width : test::vector_widths) {
        Device device = test::device_of_width(width);
        EXPECT_TRUE(std::ranges::equal(treated(device, mean, field, 77).values(), first.values())) << width;
    }
    for (const std::uint64_t seed : {std::uint64_t{78}, 77 + (std::uint64_t{1} << 32)})
        EXPECT_FALSE(
            std::ranges::equal(treated(test::default_device(), mean, field, seed).values(), first.values()));
}

/// A turn by itself, in place.
Image swapped(Device& device, const Image& image, const ControlField& field, std::uint64_t seed,
              std::uint32_t turn, bool across, int parity) {
    DeviceImpl& impl = device.impl();
    const Buffer planes = impl.upload(image.values()), labels = impl.upload(field.labels);
    BuildParameters parameters = impl.lanes();
    parameters.set("BTFIELD_PLANES", 3).set("BTFIELD_RANK", 3);
    const std::array<std::uint32_t, 2> words{static_cast<std::uint32_t>(seed),
                                             static_cast<std::uint32_t>(seed >> 32)};
    const int side = across ? image.width() : image.height(), other = across ? image.height() : image.width();
    impl.launch(impl.kernel("region_restorer", "swap_pixels", parameters),
                {static_cast<size_t>((side + 1) / 2), static_cast<size_t>(other)}, Grain::fine, planes,
                labels, words, turn, across ? 1 : 0, parity, image.height(), image.width());
    Image result(image.size(), 3);
    impl.read(planes, result.values().data(), result.values().size_bytes());
    return result;
}

TEST(RegionRestorer, ATurnExchangesEveryOtherPairAtBorders) {
    // Stripes of one pixel, across and along: every pair is of two regions.
    Device& device = test::default_device();
    for (const Size size : {Size{64, 64}, Size{63, 65}})
        for (const bool across : {false, true})
            for (const int parity : {0, 1}) {
                SCOPED_TRACE(test::text(size) + ", parity " + std::to_string(parity));
                ControlField field{size, 2, {}};
                for (int i = 0; i < size.height * size.width; ++i)
                    field.labels.push_back(
                        static_cast<std::uint8_t>((across ? i % size.width : i / size.width) % 2));
                Image image(size, 3);
                for (size_t i = 0; i < image.values().size(); ++i) image.values()[i] = static_cast<float>(i);
                const Image found = swapped(device, image, field, 9, 3, across, parity);
                int moved = 0;
                for (int r = 0; r < size.height; ++r)
                    for (int c = 0; c < size.width; ++c) {
                        // Back from where its value came: planes together, with the pair's other pixel.
                        const int from = static_cast<int>(found.at(0, r, c));
                        const int row = from / size.width, column = from % size.width;
                        for (int p = 1; p < 3; ++p) ASSERT_EQ(found.at(p, r, c), image.at(p, row, column));
                        if (row == r && column == c) continue;
                        ++moved;
                        ASSERT_EQ(found.at(0, row, column), image.at(0, r, c));
                        const int i = across ? c : r, j = across ? column : row;
                        const int side = across ? size.width : size.height;
                        ASSERT_EQ(across ? row : column, across ? r : c);
                        const bool begins = i % 2 == parity;
                        ASSERT_EQ(j, (begins ? i + 1 : i + side - 1) % side);
                    }
                // Half of the pixels in pairs, 5 standard deviations of a coin for each pair.
                const int side = across ? size.width : size.height, other = across ? size.height : size.width;
                const double pairs = static_cast<double>(side / 2) * other;
                EXPECT_NEAR(moved / 2.0, pairs / 2.0, 5.0 * std::sqrt(pairs) / 2.0);
            }
}

TEST(RegionRestorer, BordersKeepWhatIsTheSameOnBothSides) {
    Image mean({17, 24}, 3);
    std::ranges::fill(mean.values(), 0.7F);
    const Image found = treated(test::default_device(), mean, test::patchy_labels(mean.size(), 3), 4);
    for (const float value : found.values()) ASSERT_NEAR(value, 0.7F, 9.0 * test::unit_roundoff);
    // Of a picture without a border nothing is touched.
    const Image random = test::random_image({17, 24}, 3);
    const ControlField one{random.size(), 1, std::vector<std::uint8_t>(area(random.size()), 0)};
    EXPECT_TRUE(
        std::ranges::equal(treated(test::default_device(), random, one, 4).values(), random.values()));
}

}  // namespace
}  // namespace btfield

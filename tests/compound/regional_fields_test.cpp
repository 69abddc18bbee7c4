// host/compound/regional_fields.cpp and kernels/compound/regional_fields.cl.

#include "host/compound/regional_fields.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "btfield/pyramid.hpp"
#include "btfield/synthesis.hpp"
#include "tests/device_cases.hpp"
#include "tests/example_model.hpp"
#include "tests/label_cases.hpp"
#include "tests/linear_field_cases.hpp"
#include "tests/reference/regional_fields.hpp"

namespace btfield {

using namespace detail;

namespace {

using std::size_t;
using Models = std::vector<TextureModel>;

constexpr std::uint64_t seed = 0x123456789abcdef1;

/// Without mean and marginals, its eigenplanes the picture's planes: the levels' sum is the texture. Moving
/// averages on these offsets, autoregressive models on those of their causal half, Markov ones on their own.
TextureModel texture(ModelKind kind, int planes, int levels, const std::vector<Offset>& offsets,
                     unsigned variant) {
    TextureModel model = test::example_model(kind, planes, levels);
    std::ranges::fill(model.mean, 0.0);
    std::ranges::fill(model.basis.mean, 0.0);
    if (is_2d(kind)) {
        std::ranges::fill(model.basis.matrix, 0.0);
        for (int p = 0; p < planes; ++p) model.basis.matrix[static_cast<size_t>(p * planes + p)] = 1.0;
    }
    const Family own = family(kind);
    if (own != Family::ma && own != Family::car) return model;
    for (LevelModel& level : model.levels)
        for (Model& part : level.models) {
            std::vector<Offset> support;
            for (const Offset s : offsets)
                if (own == Family::ma || s.row < 0 || (s.row == 0 && s.column < 0)) support.push_back(s);
            LinearField field = test::random_field(support, is_2d(kind) ? 1 : planes,
                                                   own == Family::ma ? 2.0 : 0.8, true, ++variant);
            field.kind = own == Family::ma ? NeighbourhoodKind::custom : NeighbourhoodKind::causal;
            part = model_of(own, std::move(field));
        }
    return model;
}

std::vector<Offset> ball(int order) {
    std::vector<Offset> offsets = neighbourhood(order, NeighbourhoodKind::symmetric);
    offsets.push_back({});
    return offsets;
}

const std::vector<Offset> lopsided{{0, 0}, {0, 9}, {5, -40}, {-1, 3}, {11, 0}};

std::vector<const TextureModel*> pointers(const Models& models) {
    std::vector<const TextureModel*> result;
    for (const TextureModel& model : models) result.push_back(&model);
    return result;
}

/// Whole lattices, cropped where a transform is larger than its level.
Image grown(Device& device, RegionalFields& fields, const ControlField& field) {
    DeviceImpl& impl = device.impl();
    const DevicePlanes planes = fields.grow(impl.upload(field.labels), test::upload_seeds(device, {seed}));
    EXPECT_EQ(planes.size, fields.layout().lattice);
    EXPECT_EQ(planes.planes, fields.planes());
    Image lattice(planes.lattice, planes.planes);
    impl.read(planes.values, lattice.values().data(), lattice.values().size_bytes());
    return lattice.crop(0, 0, planes.size);
}

Image grown(Device& device, const Models& models, Size size, const ControlField& field) {
    RegionalFields fields(device.impl(), pointers(models), size);
    return grown(device, fields, field);
}

Size lattice_of(Device& device, const Models& models, Size size) {
    return RegionalFields(device.impl(), pointers(models), size).layout().lattice;
}

/// Levels of every region alone, as `of` makes them of a model, a level and its lattice.
template <class Make>
std::vector<reference::Plane> reference_of(const Models& models, const ControlField& field, int planes,
                                           Make&& of) {
    size_t count = 0;
    for (const TextureModel& model : models) count = std::max(count, model.levels.size());
    reference::Levels levels;
    int step = 1;
    for (const Size size : pyramid_sizes(field.size, static_cast<int>(count), models.front().factor)) {
        const size_t k = levels.size();
        const Size transform{next_fft_size(size.height), next_fft_size(size.width)};
        std::vector<std::vector<reference::Plane>> regions;
        for (const TextureModel& model : models)
            regions.push_back(k < model.levels.size() ? of(model, k, transform)
                                                      : std::vector<reference::Plane>{});
        levels.push_back(reference::selected(regions, field, size, step, static_cast<size_t>(planes)));
        step *= models.front().factor;
    }
    return reference::collapsed(levels, models.front().factor);
}

LinearField absolute(LinearField field) {
    for (double& a : field.coefficients) a = std::abs(a);
    return field;
}

/// How far float32 may be from a level of moving averages: of ηd products each the rounding of its
/// coefficient, its own and its sum's, (ηd + 2) roundings of |m| |n|, and the draw's distance, as
/// tests/synthesis/noise_test.cpp has it; here it is rounded once more.
std::vector<reference::Plane> slack_of(const TextureModel& model, size_t k, Size t) {
    std::vector<reference::Plane> planes;
    for (const Model& part : model.levels[k].models) {
        const LinearField field = absolute(linear_field(part));
        const double roundings = static_cast<double>(field.offsets.size()) * field.planes + 2.0;
        const int first = static_cast<int>(planes.size());
        std::vector<float> noise;
        for (int p = 0; p < field.planes; ++p)
            for (int r = 0; r < t.height; ++r)
                for (int c = 0; c < t.width; ++c) {
                    const reference::Draw n =
                        reference::spatial_noise(seed, static_cast<int>(k), first + p, r, c);
                    const double off = 8e-7 * n.radius + std::min(0x1p-22 / n.radius, 0x1p-11);
                    noise.push_back(static_cast<float>(off + (roundings + 1.0) * test::unit_roundoff *
                                                                 std::abs(n.value)));
                }
        const Eigen::MatrixXd root = reference::symmetric_root(reference::noise_covariance(field));
        reference::append_planes(planes, reference::moving_average(field, root.cwiseAbs(), t, noise), t,
                                 model.levels[k].gain);
    }
    return planes;
}

/// Moving averages, pixel by pixel as near as rounding leaves them. Expanding, at every level but the finest,
/// is two sums of 3 fused products at most with a weight rounded once, 8 roundings, and one addition, of
/// numbers up to the largest.
void expect_averages(Device& device, const Models& models, Size size) {
    const ControlField field =
        test::patchy_labels(lattice_of(device, models, size), static_cast<int>(models.size()));
    SCOPED_TRACE(test::text(size) + ", K = " + std::to_string(models.size()));
    const Image found = grown(device, models, size, field);
    const auto make = [](const TextureModel& model, size_t k, Size t) {
        return reference::level_texture(model, k, t, seed);
    };
    const std::vector<reference::Plane> expected = reference_of(models, field, found.planes(), make);
    const std::vector<reference::Plane> slack = reference_of(models, field, found.planes(), slack_of);
    double most = 0.0;
    size_t levels = 0;
    for (const reference::Plane& plane : expected)
        for (const double value : plane.values) most = std::max(most, std::abs(value));
    for (const TextureModel& model : models) levels = std::max(levels, model.levels.size());
    const double expansions = 9.0 * static_cast<double>(levels - 1) * test::unit_roundoff * 2.0 * most;
    for (int p = 0; p < found.planes(); ++p)
        for (size_t i = 0; i < area(found.size()); ++i)
            ASSERT_LE(
                std::abs(static_cast<double>(found.plane(p)[i]) - expected[static_cast<size_t>(p)].values[i]),
                slack[static_cast<size_t>(p)].values[i] + expansions)
                << "plane " << p << ", pixel " << i << ", label " << int{field.labels[i]};
}

/// Models of any kind. Transforms in float32 keep what synthesis promises, 1e-5 of full scale.
void expect_fields(Device& device, const Models& models, Size size) {
    const ControlField field =
        test::patchy_labels(lattice_of(device, models, size), static_cast<int>(models.size()));
    SCOPED_TRACE(test::text(size) + ", K = " + std::to_string(models.size()));
    const Image found = grown(device, models, size, field);
    const auto make = [](const TextureModel& model, size_t k, Size t) {
        return reference::level_texture(model, k, t, seed);
    };
    const std::vector<reference::Plane> expected = reference_of(models, field, found.planes(), make);
    for (int p = 0; p < found.planes(); ++p) {
        const std::vector<double>& values = expected[static_cast<size_t>(p)].values;
        const auto [low, high] = std::ranges::minmax(values);
        for (size_t i = 0; i < values.size(); ++i)
            ASSERT_LE(std::abs(static_cast<double>(found.plane(p)[i]) - values[i]), 1e-5 * (high - low))
                << "plane " << p << ", pixel " << i << ", label " << int{field.labels[i]};
    }
}

class RegionalFieldsSmall : public testing::TestWithParam<int> {
  protected:
    Device device_ = test::device_of_width(GetParam());
};
INSTANTIATE_TEST_SUITE_P(Widths, RegionalFieldsSmall, testing::ValuesIn(test::vector_widths),
                         testing::PrintToStringParamName());

TEST_P(RegionalFieldsSmall, FollowTheReference) {
    expect_averages(device_,
                    {texture(ModelKind::ma3d, 2, 1, ball(1), 1), texture(ModelKind::ma2d, 2, 2, lopsided, 5)},
                    {6, 18});
    // 16 lanes, too, find a vector whose support goes nowhere round.
    expect_fields(device_,
                  {texture(ModelKind::ma3d, 2, 1, ball(1), 1), texture(ModelKind::car3d, 2, 1, ball(1), 2)},
                  {4, 36});
}

class RegionalFieldsWidths : public RegionalFieldsSmall {};
INSTANTIATE_TEST_SUITE_P(Widths, RegionalFieldsWidths, testing::ValuesIn(test::vector_widths),
                         testing::PrintToStringParamName());

TEST_P(RegionalFieldsWidths, MovingAveragesOfEverySize) {
    // Supports of their own, longer than the smaller lattices, and levels of their own: a region without a
    // level has nothing there.
    const Models models{texture(ModelKind::ma3d, 2, 2, ball(3), 1),
                        texture(ModelKind::ma3d, 2, 3, lopsided, 4),
                        texture(ModelKind::ma2d, 2, 1, {{0, 0}, {0, 1}, {-2, -1}}, 8)};
    for (const Size size : {Size{1, 1}, Size{4, 8}, Size{17, 23}, Size{20, 64}, Size{40, 37}})
        expect_averages(device_, models, size);
    for (const Size size : {Size{1, 1}, Size{1, 66}, Size{15, 33}})
        expect_averages(device_, {models[2], texture(ModelKind::ma3d, 2, 1, lopsided, 9)}, size);
}

TEST_P(RegionalFieldsWidths, ManyPlanes) {
    // The second region models four of the five.
    expect_averages(device_,
                    {texture(ModelKind::ma3d, 5, 1, ball(2), 1), texture(ModelKind::ma2d, 4, 2, lopsided, 2)},
                    {17, 23});
}

TEST_P(RegionalFieldsWidths, AnyModels) {
    // Five regions of four kinds, of one, two and three levels; the second models two planes of three.
    const Models models{texture(ModelKind::ma3d, 3, 2, ball(3), 1),
                        texture(ModelKind::car3d, 2, 3, ball(1), 2), texture(ModelKind::mmrf2d, 3, 1, {}, 3),
                        texture(ModelKind::car2d, 3, 2, ball(2), 4),
                        texture(ModelKind::ma2d, 3, 3, lopsided, 7)};
    for (const Size size : {Size{16, 24}, Size{17, 23}}) expect_fields(device_, models, size);
}

TEST(RegionalFields, EveryNumberOfPlanes) {
    for (const int planes : {1, 3})
        expect_averages(test::default_device(),
                        {texture(ModelKind::ma3d, planes, 2, ball(3), 1),
                         texture(ModelKind::ma3d, planes, 1, lopsided, 4)},
                        {17, 37});
}

TEST(RegionalFields, PlanesThatARegionDoesNotModelAre0) {
    const Models models{texture(ModelKind::ma3d, 3, 1, ball(1), 1),
                        texture(ModelKind::ma3d, 2, 1, ball(1), 2),
                        texture(ModelKind::car3d, 1, 1, ball(1), 3)};
    const ControlField field = test::patchy_labels({16, 20}, 3);
    const Image found = grown(test::default_device(), models, field.size, field);
    ASSERT_EQ(found.planes(), 3);
    for (int p = 0; p < 3; ++p)
        for (size_t i = 0; i < field.labels.size(); ++i)
            EXPECT_EQ(found.plane(p)[i] == 0.0F, p >= 3 - field.labels[i]) << p << " " << i;
}

TEST(RegionalFields, AsManyRegionsAsThereMayBe) {
    // Kernels keep those of a vector as bits of a word.
    Models models;
    for (unsigned k = 0; k < most_regions; ++k)
        models.push_back(texture(ModelKind::ma3d, 1, 1, {{0, static_cast<int>(k) % 5}, {}}, 10 * k));
    expect_averages(test::default_device(), models, {16, 48});
}

TEST(RegionalFields, LevelsSmallerThanTheirTransforms) {
    // A factor of 17: the finest level does not suit the transforms, alone or with a coarser one.
    Models models{texture(ModelKind::ma3d, 1, 2, ball(1), 1), texture(ModelKind::car3d, 1, 2, ball(1), 2)};
    for (TextureModel& model : models) model.factor = 17;
    ASSERT_EQ(lattice_of(test::default_device(), models, {34, 30}), (Size{34, 34}));
    expect_fields(test::default_device(), models, {34, 30});
}

// Beside textures of one model
// ----------------------------------------------------------------------------------------------------

double largest(const Image& image) {
    double most = 0.0;
    for (const float value : image.values()) most = std::max(most, std::abs(static_cast<double>(value)));
    return most;
}

/// One region and no restoring: the texture, on lattices that are it and on larger ones.
void expect_texture(const TextureModel& model, NoiseDomain domain, double bound) {
    Device& device = test::default_device();
    for (const Size size : {Size{32, 48}, Size{17, 19}}) {
        SCOPED_TRACE(std::string(name(model.kind)) + ", " + test::text(size));
        Synthesiser synthesiser(device, model, size, {.noise_domain = domain, .allow_invalid = true});
        const Image expected = synthesiser.synthesise(seed);
        const Size lattice = synthesiser.lattice();
        const Image whole =
            grown(device, {model}, size, {lattice, 1, std::vector<std::uint8_t>(area(lattice), 0)});
        ASSERT_EQ(whole.size(), lattice);
        const Image found = whole.crop(0, 0, size);
        const double most = largest(expected);
        EXPECT_GT(most, 0.0);
        for (size_t i = 0; i < found.values().size(); ++i)
            ASSERT_LE(std::abs(static_cast<double>(found.values()[i] - expected.values()[i])), bound * most)
                << i;
    }
}

TEST(RegionalFields, OneRegionOfAMovingAverageIsItsTexture) {
    // The same coefficients and noise, summed up in another order: twice the roundings of ηd + 2 products,
    // whose absolute values add up to some five times the largest value; η = 13.
    for (const int planes : {1, 2})
        for (const ModelKind kind : {ModelKind::ma3d, ModelKind::ma2d})
            expect_texture(texture(kind, planes, 2, ball(4), 3), NoiseDomain::spatial,
                           2.0 * (13.0 * planes + 2.0) * 5.0 * test::unit_roundoff);
}

TEST(RegionalFields, OneRegionOfAnyOtherModelIsItsTexture) {
    // The same kernels from the same numbers; what the budget for stored factors decides is a rounding or two
    // of the factors.
    for (const ModelKind kind :
         {ModelKind::car3d, ModelKind::msar2d, ModelKind::mmrf2d, ModelKind::mmrf3d, ModelKind::pmrf3d})
        expect_texture(texture(kind, 2, 2, ball(2), 3), NoiseDomain::frequency, 8.0 * test::unit_roundoff);
}

TEST(RegionalFields, APixelIsThatOfItsRegionsTexture) {
    Device& device = test::default_device();
    const Models models{texture(ModelKind::car3d, 2, 1, ball(2), 1),
                        texture(ModelKind::ma3d, 2, 1, ball(3), 2), texture(ModelKind::pmrf3d, 2, 1, {}, 3),
                        texture(ModelKind::msar2d, 2, 1, ball(2), 4)};
    const ControlField field = test::patchy_labels({32, 36}, 4);
    const Image found = grown(device, models, field.size, field);
    for (int k = 0; k < 4; ++k) {
        const Image alone = grown(device, {models[static_cast<size_t>(k)]}, field.size,
                                  {field.size, 1, std::vector<std::uint8_t>(area(field.size), 0)});
        for (int p = 0; p < 2; ++p)
            for (size_t i = 0; i < field.labels.size(); ++i)
                if (field.labels[i] == k) {
                    EXPECT_EQ(found.plane(p)[i], alone.plane(p)[i]) << "region " << k << ", pixel " << i;
                }
    }
}

TEST(RegionalFields, LevelsAloneAddUpToAll) {
    Device& device = test::default_device();
    const Models models{texture(ModelKind::ma3d, 2, 3, ball(2), 1),
                        texture(ModelKind::car3d, 2, 2, ball(1), 2)};
    for (const Size size : {Size{24, 32}, Size{17, 23}}) {
        std::vector<const TextureModel*> regions;
        for (const TextureModel& model : models) regions.push_back(&model);
        RegionalFields fields(device.impl(), regions, size);
        const Size lattice = fields.layout().lattice;
        const Buffer labels = device.impl().upload(test::patchy_labels(lattice, 2).labels);
        const Buffer keys = device.impl().upload(std::vector<std::array<std::uint32_t, 2>>{{5U, 0U}});
        const auto values = [&](const DevicePlanes& planes) {
            EXPECT_EQ(planes.lattice, lattice);
            Image image(planes.lattice, planes.planes);
            device.impl().read(planes.values, image.values().data(), image.values().size_bytes());
            return image;
        };
        const Image all = values(fields.grow(labels, keys));
        std::vector<double> sums(all.values().size(), 0.0);
        for (size_t level = 0; level < 3; ++level) {
            const Image alone = values(fields.grow_alone(level, labels, keys));
            double most = 0.0;
            for (size_t i = 0; i < sums.size(); ++i) {
                sums[i] += static_cast<double>(alone.values()[i]);
                most = std::max(most, std::abs(static_cast<double>(alone.values()[i])));
            }
            EXPECT_GT(most, 0.0);
        }
        // Of each of two additions and of expanding, twice, some roundings of numbers up to the largest.
        for (size_t i = 0; i < sums.size(); ++i)
            ASSERT_NEAR(sums[i], static_cast<double>(all.values()[i]),
                        40.0 * test::unit_roundoff * largest(all))
                << i;
    }
}

TEST(RegionalFields, SeedsMakeOtherFields) {
    Device& device = test::default_device();
    RegionalFields fields(device.impl(), pointers({texture(ModelKind::ma3d, 1, 1, ball(1), 1)}), {16, 16});
    const ControlField field = test::patchy_labels({16, 16}, 1);
    const Image first = grown(device, fields, field), again = grown(device, fields, field);
    EXPECT_TRUE(std::ranges::equal(first.values(), again.values()));
    const DevicePlanes other =
        fields.grow(device.impl().upload(field.labels), test::upload_seeds(device, {seed + (1ULL << 32)}));
    const std::vector<float> values = test::read_all<float>(device, other.values);
    EXPECT_FALSE(std::ranges::equal(first.values(), values));
}

}  // namespace
}  // namespace btfield

// host/btf/btf_fit.cpp, btf_score.cpp, btf_synthesis.cpp and btf_model_file.cpp.

#include "btfield/btf_model.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <nlohmann/json.hpp>
#include <numbers>

#include "btfield/btf_textures.hpp"
#include "btfield/error.hpp"
#include "btfield/height.hpp"
#include "btfield/made_btf.hpp"
#include "host/btf/direction_table.hpp"
#include "tests/device_cases.hpp"
#include "tests/temporary_folder.hpp"

namespace btfield {
namespace {

constexpr Size side{40, 48};

std::vector<BtfDirection> rings() {
    std::vector<BtfDirection> result{{}};
    for (const double theta : {25.0, 50.0})
        for (int k = 0; k < 8; ++k)
            result.push_back({theta * std::numbers::pi / 180.0, 2.0 * std::numbers::pi * k / 8.0});
    return result;
}

/// Small hills of two colours.
BtfMaterial hills() {
    BtfMaterial m;
    m.height = Image(side, 1);
    m.albedo = Image(side, 3, ColourSpace::linear);
    std::uint32_t state = 5;
    const auto next = [&] {
        state = state * 1664525U + 1013904223U;
        return static_cast<double>(state >> 8) / 16777216.0;
    };
    std::vector<double> raw(area(side));
    for (double& value : raw) value = next() - 0.5;
    for (int r = 0; r < side.height; ++r)
        for (int c = 0; c < side.width; ++c) {
            double sum = 0.0;
            for (int i = -3; i <= 3; ++i)
                for (int k = -3; k <= 3; ++k)
                    sum += raw[static_cast<std::size_t>((r + i + side.height) % side.height * side.width +
                                                        (c + k + side.width) % side.width)];
            m.height.at(0, r, c) = static_cast<float>(0.4 * sum);
            for (int p = 0; p < 3; ++p)
                m.albedo.at(p, r, c) = static_cast<float>(0.4 + 0.04 * sum * (p + 1) + 0.1 * next());
        }
    m.normals = normals_of_slopes(slopes_of_height(m.height, SurfaceEdges::periodic));
    return m;
}

/// The set without its range map, perhaps, and with pictures missing.
class Veiled : public BtfSource {
  public:
    Veiled(BtfSet set, bool keep_height) : set_(std::move(set)), description_(set_.description()) {
        if (!keep_height) description_.height = Image();
    }
    [[nodiscard]] const BtfDescription& description() const override { return description_; }
    [[nodiscard]] Image picture(int view, int light) const override { return set_.picture(view, light); }
    BtfDescription& described() { return description_; }

  private:
    BtfSet set_;
    BtfDescription description_;
};

/// The set with light told in other units.
class InUnits : public BtfSource {
  public:
    InUnits(BtfSet set, float unit) : set_(std::move(set)), unit_(unit) {}
    [[nodiscard]] const BtfDescription& description() const override { return set_.description(); }
    [[nodiscard]] Image picture(int view, int light) const override {
        Image picture = set_.picture(view, light);
        for (float& value : picture.values()) value *= unit_;
        return picture;
    }

  private:
    BtfSet set_;
    float unit_;
};

double range(const Image& height) {
    const auto [low, high] = std::ranges::minmax(height.plane(0));
    return static_cast<double>(high) - static_cast<double>(low);
}

double deviation(std::span<const float> values) {
    double sum = 0.0, squares = 0.0;
    for (const float v : values) sum += static_cast<double>(v);
    const double mean = sum / static_cast<double>(values.size());
    for (const float v : values) squares += (static_cast<double>(v) - mean) * (static_cast<double>(v) - mean);
    return std::sqrt(squares / static_cast<double>(values.size()));
}

double mean_of(std::span<const float> values) {
    double sum = 0.0;
    for (const float v : values) sum += static_cast<double>(v);
    return sum / static_cast<double>(values.size());
}

class BtfModelled : public testing::Test {
  protected:
    BtfModelled() {
        MadeBtfOptions options;
        options.views = options.lights = rings();
        set_ = std::make_unique<BtfSet>(make_btf(device_, hills(), options));
    }
    [[nodiscard]] static BtfFitOptions options() {
        BtfFitOptions options;
        options.planes = 12;
        options.periodic = true;
        return options;
    }
    Device device_ = test::device_of_width(8);
    std::unique_ptr<BtfSet> set_;
};

TEST_F(BtfModelled, PicturesOfTheSurfaceAreThoseOfTheSet) {
    BtfFitOptions how = options();
    how.table_error = 0.0;
    const BtfFit fit = fit_btf(device_, *set_, how);
    EXPECT_LE(fit.model.unexplained, 0.03);
    EXPECT_EQ(fit.model.relief, "set");
    EXPECT_EQ(fit.model.scale_factor, 1.0);
    EXPECT_EQ(fit.model.pairs.size(), 17U * 17U);
    EXPECT_FALSE(fit.score.has_value());
    const BtfSynthesiser shown(device_, fit.model, fit.surface);
    for (const auto& [v, l] : {std::pair(0, 0), std::pair(3, 12), std::pair(14, 2), std::pair(16, 9)}) {
        const Image truth = set_->picture(v, l),
                    found = shown.picture(set_->views()[static_cast<std::size_t>(v)], set_->light(v, l));
        ASSERT_EQ(found.planes(), 3);
        EXPECT_EQ(found.space(), ColourSpace::linear);
        for (int c = 0; c < 3; ++c) {
            double squares = 0.0;
            for (std::size_t p = 0; p < area(side); ++p) {
                const double d =
                    static_cast<double>(found.plane(c)[p]) - static_cast<double>(truth.plane(c)[p]);
                squares += d * d;
            }
            EXPECT_LE(std::sqrt(squares / static_cast<double>(area(side))), 0.4 * deviation(truth.plane(c)))
                << v << " " << l;
            EXPECT_NEAR(mean_of(found.plane(c)), mean_of(truth.plane(c)), 0.01 * mean_of(truth.plane(c)));
        }
    }
}

TEST_F(BtfModelled, DirectionsThatItWasNotShownAreMadeUp) {
    BtfFitOptions how = options();
    how.leave_out.pairs = 7;
    const BtfFit fit = fit_btf(device_, *set_, how);
    ASSERT_TRUE(fit.score.has_value());
    EXPECT_NEAR(static_cast<double>(fit.score->pairs.size()), 17.0 * 17.0 / 7.0, 2.0);
    EXPECT_EQ(fit.model.pairs.size() + fit.score->pairs.size(), 17U * 17U);
    EXPECT_LE(fit.score->model.median, 0.35);
    EXPECT_LE(fit.score->model.median, 0.6 * fit.score->neighbours.median);
    EXPECT_LE(fit.score->neighbours.median, fit.score->nearest.median);
    EXPECT_LE(fit.score->model.mean_error, 0.02);
}

TEST_F(BtfModelled, WholeViewsAndLightsAreMadeUp) {
    BtfFitOptions how = options();
    how.leave_out.views = 6;
    how.leave_out.lights = 8;
    const BtfFit fit = fit_btf(device_, *set_, how);
    // Views 5 and 11, lights 7 and 15.
    ASSERT_TRUE(fit.score.has_value());
    EXPECT_EQ(fit.score->pairs.size(), 2U * 17U + 2U * 15U);
    for (const BtfPair& pair : fit.model.pairs) {
        EXPECT_NE(pair.view % 6, 5);
        EXPECT_NE(pair.light % 8, 7);
    }
    EXPECT_LE(fit.score->model.median, 0.4);
    EXPECT_LE(fit.score->model.median, 0.6 * fit.score->neighbours.median);
    EXPECT_LE(fit.score->model.mean_error, 0.03);
}

TEST_F(BtfModelled, MissingPicturesAreMadeUpToo) {
    const auto veiled = std::make_shared<Veiled>(*set_, true);
    veiled->described().present.assign(17 * 17, 1);
    for (const int pair : {5, 40, 100, 288}) veiled->described().present[static_cast<std::size_t>(pair)] = 0;
    // A view without any picture.
    for (int l = 0; l < 17; ++l) veiled->described().present[static_cast<std::size_t>(11 * 17 + l)] = 0;
    const BtfSet set(veiled);
    const BtfFit fit = fit_btf(device_, set, options());
    EXPECT_EQ(fit.model.pairs.size(), set.pictures().size());
    const BtfSynthesiser shown(device_, fit.model, fit.surface);
    const Image truth = set_->picture(11, 3), found = shown.picture(set_->views()[11], set_->lights()[3]);
    EXPECT_NEAR(mean_of(found.plane(1)), mean_of(truth.plane(1)), 0.05 * mean_of(truth.plane(1)));
}

TEST_F(BtfModelled, PlanesDoNotDependOnHowManyPicturesTheTopViewHas) {
    // Two pictures from above have six rows, for twelve planes.
    const auto veiled = std::make_shared<Veiled>(*set_, true);
    veiled->described().present.assign(17 * 17, 1);
    for (int l = 2; l < 17; ++l) veiled->described().present[static_cast<std::size_t>(l)] = 0;
    const BtfFit fit = fit_btf(device_, BtfSet(veiled), options());
    EXPECT_EQ(fit.model.planes(), 12);
    EXPECT_LE(fit.model.unexplained, 0.03);
    EXPECT_TRUE(fit.remarks.empty());
    // Nor can any view tell of more than it has rows.
    for (int v = 1; v < 17; ++v)
        for (int l = 2; l < 17; ++l) veiled->described().present[static_cast<std::size_t>(17 * v + l)] = 0;
    const BtfFit few = fit_btf(device_, BtfSet(veiled), options());
    EXPECT_LE(few.model.planes(), 6);
    ASSERT_EQ(few.remarks.size(), 1U);
    EXPECT_NE(few.remarks.front().find("of the 12"), std::string::npos) << few.remarks.front();
}

TEST_F(BtfModelled, WeightsOfFewPairsTellThoseOfTheOthers) {
    BtfFitOptions how = options();
    how.table_error = 0.0;
    const BtfFit all = fit_btf(device_, *set_, how);
    EXPECT_EQ(all.model.tables.kept.size(), all.model.pairs.size());
    EXPECT_EQ(all.model.table_error, 0.0);
    how.table_error = 2.0;
    const BtfFit some = fit_btf(device_, *set_, how);
    EXPECT_EQ(some.model.tables.mean.size(), all.model.tables.mean.size());
    EXPECT_LT(some.model.tables.kept.size(), all.model.pairs.size());
    EXPECT_GT(some.model.table_error, 0.0);
    EXPECT_LE(some.model.table_error, 2.0 * some.model.unexplained);
    // Those kept say what they said; the error is that of the weights that pictures are made with.
    const detail::DirectionTable of_all(all.model), of_some(some.model);
    double error = 0.0;
    for (std::size_t pair = 0; pair < all.model.pairs.size(); ++pair) {
        const BtfDirection view = all.model.views[static_cast<std::size_t>(all.model.pairs[pair].view)],
                           light = detail::light_of(all.model, pair);
        const detail::PictureWeights a = of_all.weights(view, light), b = of_some.weights(view, light);
        double off = 0.0, variance = 0.0;
        for (std::size_t i = 0; i < a.weights.size(); ++i) {
            off += (a.weights[i] - b.weights[i]) * (a.weights[i] - b.weights[i]);
            variance += a.weights[i] * a.weights[i];
        }
        error += off / variance;
    }
    error /= static_cast<double>(all.model.pairs.size());
    EXPECT_NEAR(error, some.model.table_error, 0.1 * some.model.table_error + 2e-4);  // and of 8 bits
    // Means are the pictures', whatever weights say.
    const BtfSynthesiser shown(device_, some.model, some.surface);
    for (int pair = 3; pair < 17 * 17; pair += 23) {
        const int v = pair / 17, l = pair % 17;
        const double truth = mean_of(set_->picture(v, l).plane(1));
        const Image found = shown.picture(set_->views()[static_cast<std::size_t>(v)], set_->light(v, l));
        EXPECT_NEAR(mean_of(found.plane(1)), truth, 2e-3 * truth) << v << " " << l;
    }
}

TEST_F(BtfModelled, TheReliefsScaleIsFound) {
    BtfFitOptions how = options();
    how.height = set_->description().height;
    for (float& value : how.height.values()) value *= 0.8F;
    how.find_scale = true;
    const BtfFit fit = fit_btf(device_, *set_, how);
    EXPECT_EQ(fit.model.relief, "given");
    EXPECT_NEAR(fit.model.scale_factor, 1.25, 0.15);
    how.find_scale = false;
    how.scale = 0.5;
    EXPECT_EQ(fit_btf(device_, *set_, how).model.scale_factor, 0.5);
}

TEST_F(BtfModelled, WithoutAReliefStereoTellsIt) {
    const BtfSet set(std::make_shared<Veiled>(*set_, false));
    const BtfFit fit = fit_btf(device_, set, options());
    EXPECT_EQ(fit.model.relief, "stereo");
    EXPECT_NEAR(range(fit.surface), range(set_->description().height),
                0.3 * range(set_->description().height));
    EXPECT_LE(fit.model.unexplained, 0.04);
    BtfOptions some;
    some.light_stride = 4;
    const BtfFit level = fit_btf(device_, BtfSet(std::make_shared<Veiled>(*set_, false), some), options());
    EXPECT_EQ(level.model.relief, "level");
    EXPECT_EQ(level.remarks.size(), 1U);
}

TEST_F(BtfModelled, GrownSurfacesHaveThePicturesStatistics) {
    const BtfFit fit = fit_btf(device_, *set_, options());
    const Size large{96, 128};
    const BtfSynthesiser grown(device_, fit.model, large, 3);
    EXPECT_EQ(grown.size(), large);
    EXPECT_TRUE(grown.tileable());
    for (const auto& [v, l] : {std::pair(0, 12), std::pair(5, 5), std::pair(13, 16)}) {
        const Image truth = set_->picture(v, l),
                    found = grown.picture(set_->views()[static_cast<std::size_t>(v)], set_->light(v, l));
        for (int c = 0; c < 3; ++c) {
            EXPECT_NEAR(mean_of(found.plane(c)), mean_of(truth.plane(c)), 0.03 * mean_of(truth.plane(c)));
            EXPECT_NEAR(deviation(found.plane(c)), deviation(truth.plane(c)), 0.2 * deviation(truth.plane(c)))
                << v << " " << l;
        }
        // Edges continue: steps across are no larger than steps inside.
        double across = 0.0, inside = 0.0;
        for (int r = 0; r < large.height; ++r) {
            across += std::abs(static_cast<double>(found.at(1, r, 0) - found.at(1, r, large.width - 1)));
            inside += std::abs(static_cast<double>(found.at(1, r, 60) - found.at(1, r, 59)));
        }
        EXPECT_LE(across, 1.6 * inside);
    }
    // The same for every width of vectors; another seed is another piece.
    Device other = test::device_of_width(1);
    const BtfSynthesiser again(other, fit.model, large, 3), another(device_, fit.model, large, 4);
    const BtfDirection view{0.5, 1.0}, light{0.8, 4.0};
    const Image a = grown.picture(view, light), b = again.picture(view, light),
                c = another.picture(view, light);
    std::size_t far = 0, changed = 0;
    for (std::size_t i = 0; i < a.values().size(); ++i) {
        far += std::abs(a.values()[i] - b.values()[i]) > 2e-3F;
        changed += std::abs(a.values()[i] - c.values()[i]) > 2e-3F;
    }
    EXPECT_LE(far, a.values().size() / 1000);  // rays that graze an edge
    EXPECT_GT(changed, a.values().size() / 2);
}

/// Of all pixels and colours, each about its colour's mean.
double correlation(const Image& a, const Image& b) {
    double product = 0.0, of_a = 0.0, of_b = 0.0;
    for (int c = 0; c < a.planes(); ++c) {
        const double mean_a = mean_of(a.plane(c)), mean_b = mean_of(b.plane(c));
        for (std::size_t p = 0; p < area(a.size()); ++p) {
            const double da = static_cast<double>(a.plane(c)[p]) - mean_a,
                         db = static_cast<double>(b.plane(c)[p]) - mean_b;
            product += da * db;
            of_a += da * da;
            of_b += db * db;
        }
    }
    return product / std::sqrt(of_a * of_b);
}

TEST_F(BtfModelled, PicturesUnderTwoLightsGoTogether) {
    const BtfFit fit = fit_btf(device_, *set_, options());
    const BtfSynthesiser joint(device_, fit.model, {96, 128}, 3);
    const BtfTextureSynthesiser segment(device_, fit_btf_textures(device_, *set_).model, {96, 128}, 3);
    double of_joint = 0.0, of_segment = 0.0;
    int pairs = 0;
    for (const std::size_t v : {std::size_t{0}, std::size_t{3}, std::size_t{14}})
        for (const auto& [a, b] : {std::pair(9, 11), std::pair(9, 13), std::pair(2, 12)}) {
            const double truth =
                correlation(set_->picture(static_cast<int>(v), a), set_->picture(static_cast<int>(v), b));
            const auto off = [&, view = set_->views()[v], one = set_->lights()[static_cast<std::size_t>(a)],
                              other = set_->lights()[static_cast<std::size_t>(b)]](const auto& grown) {
                return std::abs(correlation(grown.picture(view, one), grown.picture(view, other)) - truth);
            };
            of_joint += off(joint);
            of_segment += off(segment);
            ++pairs;
        }
    EXPECT_LE(of_joint / pairs, 0.05);
    // Textures of clusters have the same noise, and nothing else that would tell what is a slope.
    EXPECT_GE(of_segment, 2.0 * of_joint);
}

TEST_F(BtfModelled, FilesComeBackAsTheyWere) {
    const test::TemporaryFolder folder;
    const BtfModel model = fit_btf(device_, *set_, options()).model;
    for (const char* name : {"m.json", "m.btfm"}) {
        const auto path = folder.path() / name;
        write_btf_model(path, model);
        const BtfModel back = read_btf_model(path);
        EXPECT_EQ(back.size, model.size);
        EXPECT_EQ(back.views, model.views);
        EXPECT_EQ(back.lights, model.lights);
        EXPECT_EQ(back.pairs, model.pairs);
        EXPECT_EQ(back.tables.mean, model.tables.mean);
        EXPECT_EQ(back.tables.kept, model.tables.kept);
        EXPECT_EQ(back.table_error, model.table_error);
        EXPECT_EQ(back.tables.contrast, model.tables.contrast);
        EXPECT_EQ(back.tables.weights, model.tables.weights);
        EXPECT_EQ(back.tables.weight_units, model.tables.weight_units);
        EXPECT_EQ(back.unexplained, model.unexplained);
        EXPECT_EQ(std::get<TextureModel>(back.surface).provenance.maps.front().gains,
                  std::get<TextureModel>(model.surface).provenance.maps.front().gains);
        EXPECT_EQ(back.picture_bytes, 17U * 17U * area(side) * 3U);
        const BtfSynthesiser one(device_, model, side, 1), two(device_, back, side, 1);
        EXPECT_TRUE(std::ranges::equal(one.picture({0.3, 0.2}, {0.4, 1.0}).values(),
                                       two.picture({0.3, 0.2}, {0.4, 1.0}).values()));
    }
}

TEST_F(BtfModelled, UnitsOfPicturesDoNotMatter) {
    const test::TemporaryFolder folder;
    const BtfDirection view{0.3, 0.2}, light{0.4, 1.0};
    const Image once =
        BtfSynthesiser(device_, fit_btf(device_, *set_, options()).model, side, 1).picture(view, light);
    // Beyond halves on either side.
    for (const float unit : {0x1p24F, 0x1p-30F}) {
        const BtfModel model =
            fit_btf(device_, BtfSet(std::make_shared<InUnits>(*set_, unit)), options()).model;
        write_btf_model(folder / "m.btfm", model);
        const BtfModel back = read_btf_model(folder / "m.btfm");
        EXPECT_EQ(back.tables.mean, model.tables.mean);
        const Image again = BtfSynthesiser(device_, back, side, 1).picture(view, light);
        for (std::size_t i = 0; i < once.values().size(); ++i)
            ASSERT_NEAR(again.values()[i] / unit, once.values()[i], 0.02F) << unit;
    }
}

TEST_F(BtfModelled, DamagedFilesAreRefused) {
    const test::TemporaryFolder folder;
    const auto path = folder.path() / "m.json";
    write_btf_model(path, fit_btf(device_, *set_, options()).model);
    const nlohmann::json good = nlohmann::json::parse(test::bytes_of(path));
    const auto refused = [&](const char* pointer, const nlohmann::json& value) {
        nlohmann::json bad = good;
        bad[nlohmann::json::json_pointer(pointer)] = value;
        test::put_bytes(path, bad.dump());
        EXPECT_THROW(static_cast<void>(read_btf_model(path)), InputError) << pointer;
    };
    refused("/weights", "AAAA");
    refused("/mean", "//8=");
    refused("/pairs", "AAAA");
    refused("/pairs", "/////w==");
    refused("/kept", "AAAA");
    refused("/kept", nullptr);
    refused("/moved", good["kept"]);
    refused("/contrast", "AAAA");
    refused("/weight_units/0", -1);
    refused("/views/1", nlohmann::json::array({1.57, 0.0}));
    refused("/views/1", nlohmann::json::array({1.0}));
    refused("/colours", 1000000000);
    refused("/surface/planes", 3);
    refused("/white", 0);
    refused("/more", 1);
    nlohmann::json texture = good["surface"];
    test::put_bytes(path, texture.dump());
    EXPECT_THROW(static_cast<void>(read_btf_model(path)), InputError);
}

TEST_F(BtfModelled, WhatCannotBeMetIsRefused) {
    const auto refused = [&](auto change) {
        BtfFitOptions how = options();
        change(how);
        EXPECT_THROW(static_cast<void>(fit_btf(device_, *set_, how)), InputError);
    };
    refused([](BtfFitOptions& o) { o.planes = 0; });
    refused([](BtfFitOptions& o) { o.planes = 61; });
    refused([](BtfFitOptions& o) { o.leave_out.pairs = 1; });
    refused([](BtfFitOptions& o) { o.leave_out.views = 1; });
    refused([](BtfFitOptions& o) { o.leave_out.lights = -1; });
    refused([](BtfFitOptions& o) { o.scale = -1.0; });
    refused([](BtfFitOptions& o) { o.height = Image({8, 8}, 1); });
    refused([](BtfFitOptions& o) {
        o.height = Image(side, 1);
        o.height.at(0, 3, 3) = std::numeric_limits<float>::quiet_NaN();
    });
    refused([](BtfFitOptions& o) { o.table_error = -0.1; });
    DeviceOptions little;
    little.memory_bytes = 1 << 20;
    Device small({}, little);
    EXPECT_THROW(static_cast<void>(fit_btf(small, *set_, options())), InputError);
    const BtfFit fit = fit_btf(device_, *set_, options());
    const BtfSynthesiser shown(device_, fit.model, fit.surface);
    EXPECT_THROW(static_cast<void>(shown.picture({1.56, 0.0}, {})), InputError);
    EXPECT_THROW(static_cast<void>(shown.picture({}, {-0.1, 0.0})), InputError);
    EXPECT_THROW(BtfSynthesiser(device_, fit.model, Image(side, 2)), InputError);
}

}  // namespace
}  // namespace btfield

// host/btf/btf_textures_fit.cpp, btf_textures_synthesis.cpp, btf_textures_file.cpp, each_part.cpp,
// picture_clusters.cpp, picture_texture.cpp, textures_directions.cpp and textures_score.cpp.

#include "btfield/btf_textures.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <random>
#include <set>

#include "btfield/error.hpp"
#include "btfield/threads.hpp"
#include "tests/device_cases.hpp"
#include "tests/plane_statistics.hpp"
#include "tests/temporary_folder.hpp"

namespace btfield {
namespace {

namespace fs = std::filesystem;

constexpr Size side{32, 40};
constexpr int kinds = 4, views = 4, lights = 6;

/// Pictures of four kinds whose colours are far apart, and of each its own mean and contrast.
class KindsOfPictures : public BtfSource {
  public:
    explicit KindsOfPictures(int planes = 3, std::uint32_t salt = 0) : salt_(salt) {
        description_.format = "made";
        description_.size = side;
        description_.planes = planes;
        description_.space = planes == 3 ? ColourSpace::linear : ColourSpace::unspecified;
        for (int v = 0; v < views; ++v) description_.views.push_back({0.3 * v, v == 0 ? 0.0 : 1.0 + v});
        for (int l = 0; l < lights; ++l) description_.lights.push_back({0.2 * l, l == 0 ? 0.0 : 0.7 * l});
    }
    [[nodiscard]] static int kind(int view, int light) { return (3 * view + light) % kinds; }
    [[nodiscard]] const BtfDescription& description() const override { return description_; }
    [[nodiscard]] Image picture(int view, int light) const override {
        if (view == flat_view && light == flat_light) return flat();
        Image image(side, description_.planes, description_.space);
        const int of = kind(view, light);
        std::mt19937 engine(static_cast<unsigned>(view * 100 + light) + salt_);
        std::normal_distribution<double> normal;
        std::vector<double> white(area(side));
        for (double& value : white) value = normal(engine);
        const double contrast = 0.15 + 0.02 * ((view + 2 * light) % 5), level = 0.8 + 0.05 * light;
        for (int p = 0; p < image.planes(); ++p)
            for (int r = 0; r < side.height; ++r)
                for (int c = 0; c < side.width; ++c) {
                    const auto at = [&](int row, int column) {
                        return white[static_cast<std::size_t>((row + side.height) % side.height * side.width +
                                                              (column + side.width) % side.width)];
                    };
                    const double texture = 0.6 * at(r, c) + 0.4 * at(r, c - 1) + 0.5 * at(r - 1, c);
                    const double mean = level * (of == p || of == 3 ? 0.5 : 0.1);
                    image.at(p, r, c) = static_cast<float>(mean * std::exp(contrast * texture));
                }
        return image;
    }
    int flat_view = -1, flat_light = -1;
    float flat_value = 0.0F;

    BtfDescription& described() { return description_; }

  private:
    [[nodiscard]] Image flat() const {
        Image image(side, description_.planes, description_.space);
        std::ranges::fill(image.values(), flat_value);
        return image;
    }
    BtfDescription description_;
    std::uint32_t salt_;
};

BtfTexturesOptions quick(BtfMethod method) {
    BtfTexturesOptions options(method);
    options.clusters = kinds;
    options.field.model = ModelKind::car3d;
    options.field.order = 1;
    options.field.levels = 1;
    return options;
}

class BtfTextured : public testing::Test {
  protected:
    BtfTextured() : source_(std::make_shared<KindsOfPictures>()), set_(source_) {}
    [[nodiscard]] std::string bytes(const BtfTextures& model, const std::string& name = "x.btfm") const {
        write_btf_textures(folder_.path() / name, model);
        return test::bytes_of(folder_.path() / name);
    }
    Device device_ = test::device_of_width(8);
    std::shared_ptr<KindsOfPictures> source_;
    BtfSet set_;
    test::TemporaryFolder folder_;
};

TEST_F(BtfTextured, KindsOfPicturesAreClusters) {
    const BtfTextures model = fit_btf_textures(device_, set_, quick(BtfMethod::segment)).model;
    ASSERT_EQ(model.textures.size(), static_cast<std::size_t>(kinds));
    ASSERT_EQ(model.labels.size(), static_cast<std::size_t>(views * lights));
    std::array<int, kinds> of_label{};
    for (int k = 0; k < kinds; ++k) {
        const BtfPair& source = model.pairs[model.sources[static_cast<std::size_t>(k)]];
        of_label[static_cast<std::size_t>(k)] = KindsOfPictures::kind(source.view, source.light);
        EXPECT_EQ(model.labels[model.sources[static_cast<std::size_t>(k)]], k);
    }
    EXPECT_EQ(std::set<int>(of_label.begin(), of_label.end()).size(), static_cast<std::size_t>(kinds));
    for (std::size_t i = 0; i < model.pairs.size(); ++i)
        EXPECT_EQ(of_label[model.labels[i]],
                  KindsOfPictures::kind(model.pairs[i].view, model.pairs[i].light));
}

TEST_F(BtfTextured, DirectionsHaveTheirMeansAndContrasts) {
    for (const BtfMethod method : {BtfMethod::segment, BtfMethod::each}) {
        const BtfTextureSynthesiser grown(device_, fit_btf_textures(device_, set_, quick(method)).model,
                                          {48, 56}, 3);
        EXPECT_TRUE(grown.tileable());
        for (const BtfPair& pair : set_.pictures()) {
            const Image truth = set_.picture(pair.view, pair.light);
            const Image found = grown.picture(set_.views()[static_cast<std::size_t>(pair.view)],
                                              set_.light(pair.view, pair.light));
            EXPECT_EQ(found.size(), (Size{48, 56}));
            EXPECT_EQ(found.space(), ColourSpace::linear);
            for (int c = 0; c < 3; ++c) {
                const test::PlaneStatistics a = test::statistics_of(truth.plane(c)),
                                            b = test::statistics_of(found.plane(c));
                EXPECT_NEAR(b.mean, a.mean, 0.002 * a.mean) << pair.view << " " << pair.light;
                // Half a step of the code, and what groups of values leave.
                EXPECT_NEAR(b.deviation, a.deviation, 0.025 * a.deviation) << pair.view << " " << pair.light;
            }
            EXPECT_GE(std::ranges::min(found.values()), 0.0F);
        }
    }
}

TEST_F(BtfTextured, WithoutMatchingDirectionsOfATextureAreTheSame) {
    BtfTexturesOptions options = quick(BtfMethod::segment);
    options.match = BtfMatch::none;
    const BtfTextures model = fit_btf_textures(device_, set_, options).model;
    EXPECT_TRUE(model.means.empty());
    const BtfTextureSynthesiser grown(device_, model, side, 1);
    for (std::size_t i = 0; i < model.pairs.size(); ++i) {
        const BtfPair& pair = model.pairs[i];
        const auto view = set_.views()[static_cast<std::size_t>(pair.view)];
        const auto light = set_.light(pair.view, pair.light);
        EXPECT_TRUE(
            std::ranges::equal(grown.picture(view, light).values(), grown.texture(model.labels[i]).values()));
        EXPECT_TRUE(grown.look(view, light).mean.empty());
    }
    // A texture has the statistics of the picture that it stands for.
    const BtfPair& source = model.pairs[model.sources[0]];
    const test::PlaneStatistics a = test::statistics_of(set_.picture(source.view, source.light).plane(0)),
                                b = test::statistics_of(grown.texture(0).plane(0));
    EXPECT_NEAR(b.mean, a.mean, 0.05 * a.mean);
    EXPECT_NEAR(b.deviation, a.deviation, 0.25 * a.deviation);
}

TEST_F(BtfTextured, OthersDirectionsAreInBetween) {
    const BtfTextureSynthesiser grown(
        device_, fit_btf_textures(device_, set_, quick(BtfMethod::segment)).model, side, 1);
    const BtfTextures& model = grown.model();
    // Next to a measured one: its texture, and nearly its mean.
    BtfDirection view = set_.views()[2], light = set_.lights()[3];
    const BtfTextureLook measured = grown.look(view, light);
    EXPECT_EQ(measured.texture, model.labels[2 * lights + 3]);
    EXPECT_NEAR(measured.mean[0], static_cast<double>(model.means[3 * (2 * lights + 3)]), 1e-6);
    view.phi += 0.01;
    const BtfTextureLook near = grown.look(view, light);
    EXPECT_EQ(near.texture, measured.texture);
    EXPECT_NEAR(near.mean[0], measured.mean[0], 0.1 * measured.mean[0]);
    EXPECT_NE(near.mean[0], measured.mean[0]);
    EXPECT_THROW(static_cast<void>(grown.picture({1.57, 0.0}, {})), InputError);
    EXPECT_THROW(static_cast<void>(grown.texture(kinds)), InputError);
    EXPECT_THROW(static_cast<void>(grown.texture(-1)), InputError);
    const Image again = BtfTextureSynthesiser::dressed(grown.texture(near.texture), near);
    EXPECT_TRUE(std::ranges::equal(again.values(), grown.picture(view, light).values()));
}

TEST_F(BtfTextured, NeitherThreadsNorRunsMatter) {
    for (const BtfMethod method : {BtfMethod::segment, BtfMethod::each}) {
        const std::string first = bytes(fit_btf_textures(device_, set_, quick(method)).model);
        limit_threads(1);
        BtfTexturesOptions one = quick(method);
        one.jobs = 3;
        const std::string second = bytes(fit_btf_textures(device_, set_, one).model);
        limit_threads(0);
        EXPECT_EQ(first, second);
    }
    const BtfTextures model = fit_btf_textures(device_, set_, quick(BtfMethod::segment)).model;
    const BtfTextureSynthesiser a(device_, model, side, 5), b(device_, model, side, 5),
        c(device_, model, side, 6);
    EXPECT_TRUE(std::ranges::equal(a.texture(2).values(), b.texture(2).values()));
    EXPECT_FALSE(std::ranges::equal(a.texture(2).values(), c.texture(2).values()));
}

/// What a progress callback ends a fit with.
struct Enough {};

TEST_F(BtfTextured, AFitThatEndedEarlyGoesOn) {
    const std::string whole = bytes(fit_btf_textures(device_, set_, quick(BtfMethod::each)).model);
    BtfTexturesOptions options = quick(BtfMethod::each);
    options.part = folder_.path() / "x.part";
    std::size_t before = 0;
    for (const double share : {0.25, 0.6}) {
        options.progress = [&](std::string_view stage, double done) {
            if (stage == "textures" && done >= share) throw Enough();
        };
        EXPECT_THROW(static_cast<void>(fit_btf_textures(device_, set_, options)), Enough);
        EXPECT_GT(fs::file_size(options.part), before);
        before = fs::file_size(options.part);
    }
    // As a process leaves it that is killed while it writes.
    fs::resize_file(options.part, before - 7);
    options.progress = {};
    const BtfTexturesFit fit = fit_btf_textures(device_, set_, options);
    EXPECT_GE(fit.resumed, static_cast<std::size_t>(0.6 * views * lights) - 1);
    EXPECT_LT(fit.resumed, static_cast<std::size_t>(views * lights));
    EXPECT_EQ(bytes(fit.model), whole);
    // And when all is there, nothing is left to do.
    const BtfTexturesFit again = fit_btf_textures(device_, set_, options);
    EXPECT_EQ(again.resumed, static_cast<std::size_t>(views * lights));
    EXPECT_EQ(bytes(again.model), whole);
    // A byte that changed: what comes behind it is done again.
    std::string damaged = test::bytes_of(options.part);
    damaged[damaged.size() / 2] = static_cast<char>(damaged[damaged.size() / 2] ^ 1);
    test::put_bytes(options.part, damaged);
    EXPECT_EQ(bytes(fit_btf_textures(device_, set_, options).model), whole);
}

TEST_F(BtfTextured, PartsOfOtherFitsAreRefused) {
    BtfTexturesOptions options = quick(BtfMethod::each);
    options.part = folder_.path() / "x.part";
    static_cast<void>(fit_btf_textures(device_, set_, options));
    const std::string kept = test::bytes_of(options.part);
    const auto refused = [&](const BtfSet& set, const BtfTexturesOptions& how, const std::string& why) {
        try {
            static_cast<void>(fit_btf_textures(device_, set, how));
            ADD_FAILURE() << why;
        } catch (const InputError& error) {
            EXPECT_NE(std::string(error.what()).find(why), std::string::npos) << error.what();
        }
        EXPECT_EQ(test::bytes_of(options.part), kept);
    };
    BtfTexturesOptions other = options;
    other.field.order = 2;
    refused(set_, other, "other options");
    other = options;
    other.leave_out.pairs = 5;
    refused(set_, other, "other options");
    // The same directions, other pictures.
    refused(BtfSet(std::make_shared<KindsOfPictures>(3, 7)), options, "another set");
    BtfOptions some;
    some.light_stride = 2;
    refused(BtfSet(source_, some), options, "another set");
    test::put_bytes(options.part, "{}\nnothing");
    EXPECT_THROW(static_cast<void>(fit_btf_textures(device_, set_, options)), InputError);
    test::put_bytes(options.part, "a letter");
    EXPECT_THROW(static_cast<void>(fit_btf_textures(device_, set_, options)), InputError);
    EXPECT_EQ(test::bytes_of(options.part), "a letter");
}

TEST_F(BtfTextured, FlatAndMissingPicturesAreTaken) {
    source_->flat_view = 1;
    source_->flat_light = 2;
    for (const float value : {0.0F, 0.25F}) {
        source_->flat_value = value;
        source_->described().present.assign(views * lights, 1);
        source_->described().present[5] = source_->described().present[20] = 0;
        const BtfSet set(source_);
        for (const BtfMethod method : {BtfMethod::segment, BtfMethod::each}) {
            const BtfTextures model = fit_btf_textures(device_, set, quick(method)).model;
            EXPECT_EQ(model.pairs.size(), static_cast<std::size_t>(views * lights - 2));
            write_btf_textures(folder_.path() / "f.btfm", model);
            const BtfTextureSynthesiser grown(device_, read_btf_textures(folder_.path() / "f.btfm"), side, 1);
            const Image flat = grown.picture(set.views()[1], set.lights()[2]);
            for (const float v : flat.values()) ASSERT_NEAR(v, value, 1e-3F * value + 1e-5F);
            EXPECT_TRUE(std::ranges::all_of(grown.picture(set.views()[0], set.lights()[5]).values(),
                                            [](float v) { return std::isfinite(v); }));
        }
    }
}

TEST_F(BtfTextured, OtherPlanesThanColoursWillDo) {
    for (const int planes : {1, 5}) {
        const BtfSet set(std::make_shared<KindsOfPictures>(planes));
        const BtfTexturesFit fit = fit_btf_textures(device_, set, quick(BtfMethod::segment));
        const BtfTextureSynthesiser grown(device_, fit.model, side, 1);
        const Image found = grown.picture(set.views()[1], set.lights()[1]), truth = set.picture(1, 1);
        ASSERT_EQ(found.planes(), planes);
        EXPECT_NEAR(test::statistics_of(found.plane(planes - 1)).mean,
                    test::statistics_of(truth.plane(planes - 1)).mean,
                    0.01 * test::statistics_of(truth.plane(planes - 1)).mean);
    }
}

TEST_F(BtfTextured, FewerPicturesThanClusters) {
    BtfTexturesOptions options = quick(BtfMethod::segment);
    options.clusters = 100;
    const BtfTexturesFit fit = fit_btf_textures(device_, set_, options);
    EXPECT_EQ(fit.model.textures.size(), static_cast<std::size_t>(views * lights));
    EXPECT_EQ(fit.remarks.size(), 1U);
}

TEST_F(BtfTextured, FilesComeBackAsTheyWere) {
    for (const BtfMethod method : {BtfMethod::segment, BtfMethod::each})
        for (const ModelKind kind : {ModelKind::car3d, ModelKind::mmrf3d, ModelKind::ma2d}) {
            BtfTexturesOptions options = quick(method);
            options.field.model = kind;
            const BtfTextures model = fit_btf_textures(device_, set_, options).model;
            for (const char* name : {"m.json", "m.btfm"}) {
                const std::string first = bytes(model, name);
                const BtfTextures back = read_btf_textures(folder_.path() / name);
                EXPECT_EQ(back.method, method);
                EXPECT_EQ(back.views, model.views);
                EXPECT_EQ(back.lights, model.lights);
                EXPECT_EQ(back.pairs, model.pairs);
                EXPECT_EQ(back.labels, model.labels);
                EXPECT_EQ(back.sources, model.sources);
                EXPECT_EQ(back.means, model.means);
                EXPECT_EQ(back.contrasts, model.contrasts);
                EXPECT_EQ(back.texture_means, model.texture_means);
                for (std::size_t i = 0; i < model.textures.size(); ++i) {
                    const LinearField &a = linear_field(model.textures[i].levels[0].models[0]),
                                      &b = linear_field(back.textures[i].levels[0].models[0]);
                    EXPECT_EQ(a.coefficients, b.coefficients);
                    EXPECT_EQ(a.noise_covariance, b.noise_covariance);
                    EXPECT_EQ(model.textures[i].basis.matrix, back.textures[i].basis.matrix);
                }
                EXPECT_EQ(bytes(back, name), first);
                EXPECT_EQ(btf_method_of(folder_.path() / name), method);
                EXPECT_TRUE(std::holds_alternative<BtfTextures>(read_any_btf(folder_.path() / name)));
                EXPECT_THROW(static_cast<void>(read_btf_model(folder_.path() / name)), InputError);
            }
        }
}

TEST_F(BtfTextured, MovedLightsAndDoublesComeBack) {
    BtfTextures model = fit_btf_textures(device_, set_, quick(BtfMethod::segment)).model;
    for (const BtfPair& pair : model.pairs)
        model.true_lights.push_back(model.lights[static_cast<std::size_t>(pair.light)]);
    model.true_lights[7].phi += 0.125;
    model.textures[1].levels[0].gain += 1e-12;  // not of single precision
    const auto path = folder_.path() / "m.btfm";
    write_btf_textures(path, model);
    const BtfTextures back = read_btf_textures(path);
    EXPECT_EQ(back.true_lights, model.true_lights);
    EXPECT_EQ(back.textures[1].levels[0].gain, model.textures[1].levels[0].gain);
    EXPECT_EQ(back.textures[0].levels[0].gain, model.textures[0].levels[0].gain);
}

TEST_F(BtfTextured, DamagedFilesAreRefused) {
    const auto path = folder_.path() / "m.json";
    write_btf_textures(path, fit_btf_textures(device_, set_, quick(BtfMethod::segment)).model);
    const nlohmann::json good = nlohmann::json::parse(test::bytes_of(path));
    const auto refused = [&](const char* pointer, const nlohmann::json& value) {
        nlohmann::json bad = good;
        bad[nlohmann::json::json_pointer(pointer)] = value;
        test::put_bytes(path, bad.dump());
        EXPECT_THROW(static_cast<void>(read_btf_textures(path)), InputError) << pointer;
    };
    refused("/labels", "AAAA");
    refused("/means", "//8=");
    refused("/contrasts", "");
    refused("/sources", "//////////8=");
    refused("/texture_means", "AAA=");
    refused("/present", "AAA=");
    refused("/moved_lights", nlohmann::json::array({nlohmann::json::array({99, 0.0, 0.0})}));
    refused("/moved_lights", nlohmann::json::array({nlohmann::json::array({1, 0.0})}));
    refused("/match", "some");
    refused("/method", "joint");
    refused("/method", "other");
    refused("/colours", 1000000000);
    refused("/views", nlohmann::json::array());
    refused("/textures/textures/0/0", 3);
    refused("/textures/textures/0/0", -1);
    refused("/textures/textures/0/1", "AAAA");
    refused("/textures/textures", nlohmann::json::array());
    refused("/textures/forms/0/levels/0/models/0/coefficients", std::uint64_t{1} << 60);
    refused("/textures/forms/0/levels/0/models/0/coefficients", -5);
    refused("/textures/forms/0/planes", 1);
    refused("/textures/forms/0", 5);
    refused("/more", 1);
    EXPECT_THROW(static_cast<void>(btf_method_of(folder_.path() / "none.btfm")), InputError);
    test::put_bytes(path, good["textures"]["forms"][0].dump());
    EXPECT_THROW(static_cast<void>(read_any_btf(path)), InputError);
}

TEST_F(BtfTextured, WhatCannotBeMetIsRefused) {
    const auto refused = [&](auto change) {
        BtfTexturesOptions how = quick(BtfMethod::segment);
        change(how);
        EXPECT_THROW(static_cast<void>(fit_btf_textures(device_, set_, how)), InputError);
    };
    refused([](BtfTexturesOptions& o) { o.clusters = 0; });
    refused([](BtfTexturesOptions& o) { o.clusters = 129; });
    refused([](BtfTexturesOptions& o) { o.leave_out.pairs = 1; });
    refused([](BtfTexturesOptions& o) { o.jobs = -1; });
    refused([](BtfTexturesOptions& o) { o.method = BtfMethod::joint; });
    refused([](BtfTexturesOptions& o) {
        o.method = BtfMethod::each;
        o.part = "/nowhere/x.part";
    });
    // The message says which picture.
    BtfTexturesOptions wide = quick(BtfMethod::segment);
    wide.field.levels = 30;
    try {
        static_cast<void>(fit_btf_textures(device_, set_, wide));
        ADD_FAILURE();
    } catch (const InputError& error) {
        EXPECT_NE(std::string(error.what()).find("the picture of view (theta"), std::string::npos)
            << error.what();
    }
}

TEST_F(BtfTextured, PicturesLeftOutAreScored) {
    BtfTexturesOptions options = quick(BtfMethod::segment);
    options.leave_out.pairs = 5;
    const BtfTexturesFit fit = fit_btf_textures(device_, set_, options);
    ASSERT_TRUE(fit.score.has_value());
    EXPECT_EQ(fit.model.pairs.size() + fit.score->pairs.size(), static_cast<std::size_t>(views * lights));
    for (const BtfPair& pair : fit.score->pairs) EXPECT_EQ((pair.view + pair.light) % 5, 4);
    // Kinds change from light to light here: nothing can tell those between.
    EXPECT_GT(fit.score->model.mean_error, 0.05);
    EXPECT_GT(fit.score->nearest.mean_error, 0.05);
    EXPECT_GE(fit.score->model.std_error_95, fit.score->model.std_error);
}

}  // namespace
}  // namespace btfield

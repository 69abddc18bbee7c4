// `btfield fit` as users' scripts see it.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <numbers>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "btfield/image_io.hpp"
#include "btfield/model_file.hpp"
#include "tests/cli_cases.hpp"
#include "tests/json_text.hpp"
#include "tests/places.hpp"
#include "tests/temporary_folder.hpp"

namespace btfield {
namespace {

using nlohmann::json;
using test::btfield;
using test::Ended;
using test::expect_failure;
using test::expect_model_keys;
using test::expect_object;
using test::expect_seconds;
using test::Surroundings;
using test::TemporaryFolder;
using test::Words;

const std::string data = test::data_folder();
const std::string picture = data + "/sand.png";

TEST(CliFit, OptionsReachTheFit) {
    const TemporaryFolder folder;
    const Surroundings here{.folder = folder.path().string()};
    const json object = expect_object({"fit",
                                       data + "/grass.png",
                                       "-o",
                                       "m.json",
                                       "--model",
                                       "3d-msar",
                                       "--order",
                                       "3",
                                       "--neighbourhood",
                                       "unilateral",
                                       "--levels",
                                       "2",
                                       "--factor",
                                       "3",
                                       "--estimator",
                                       "ls",
                                       "--noise",
                                       "diagonal",
                                       "--gains",
                                       "none",
                                       "--crop",
                                       "10,20,90,60",
                                       "--device",
                                       "auto"},
                                      here);
    EXPECT_EQ(object["model"], "3d-msar");
    EXPECT_EQ(object["size"], json::array({90, 60}));
    EXPECT_EQ(object["levels"].size(), 2U);
    EXPECT_EQ(object["levels"][1]["size"], json::array({30, 20}));
    EXPECT_EQ(object["levels"][0]["offsets"], 5);  // s1, s2 <= 0, s1² + s2² <= 4
    EXPECT_EQ(object["levels"][0]["gain"], 1.0);
    EXPECT_EQ(object["levels"][1]["gain"], 1.0);
    const TextureModel model = read_model(folder / "m.json");
    EXPECT_EQ(model.noise, NoiseForm::diagonal);
    EXPECT_EQ(model.factor, 3);
    EXPECT_EQ(linear_field(model.levels[0].models.front()).kind, NeighbourhoodKind::unilateral);
    EXPECT_EQ(model.provenance.picture_bytes, 90U * 60U);
}

TEST(CliFit, SeveralPictures) {
    const TemporaryFolder folder;
    const Surroundings here{.folder = folder.path().string()};
    std::filesystem::create_directory(folder / "models");
    const Words fast{"--levels", "1", "--order", "1", "--crop", "0,0,64,64"};
    Words words{"fit", data + "/cork.png", data + "/grass.png", "-o", "models"};
    words.insert(words.end(), fast.begin(), fast.end());
    const json object = expect_object(words, here);
    ASSERT_EQ(object["fits"].size(), 2U);
    for (const json& fitted : object["fits"]) {
        expect_model_keys(fitted);
        expect_seconds(fitted, {"read", "analysis", "fit", "total"});
    }
    EXPECT_EQ(read_model(folder / "models/cork.json").planes, 3);
    EXPECT_EQ(read_model(folder / "models/grass.json").planes, 1);

    std::filesystem::remove_all(folder / "models");
    std::filesystem::create_directory(folder / "models");
    words[2] = "absent.png";  // the first picture alone could be fitted
    expect_failure(words, 1, "absent.png", here);
    words[2] = data + "/../data/cork.png";
    expect_failure(words, 2, "cork.json", here);
    EXPECT_TRUE(std::filesystem::is_empty(folder / "models"));
}

TEST(CliFit, ModelsThatDoNotCertify) {
    const TemporaryFolder folder;
    const Surroundings here{.folder = folder.path().string()};
    // Least squares on a symmetric support does not certify on real pictures: theory 7.3.
    const Words words{"fit",
                      data + "/grass.png",
                      "-o",
                      "m.json",
                      "--model",
                      "3d-msar",
                      "--neighbourhood",
                      "symmetric",
                      "--order",
                      "1",
                      "--levels",
                      "1",
                      "--crop",
                      "0,0,64,64",
                      "--estimator",
                      "ls",
                      "--json"};
    const Ended fitted = btfield(words, here);
    EXPECT_EQ(fitted.code, 0) << fitted.err;
    EXPECT_EQ(fitted.err.rfind("btfield: warning: ", 0), 0U) << fitted.err;
    EXPECT_EQ(std::count(fitted.err.begin(), fitted.err.end(), '\n'), 1) << fitted.err;
    EXPECT_NE(fitted.err.find("--allow-invalid"), std::string::npos) << fitted.err;
    const json object = test::parsed(fitted.out);
    EXPECT_EQ(object["levels"][0]["certificate"]["valid"], false);
    EXPECT_TRUE(object["levels"][0]["log_likelihood"].is_null());

    EXPECT_EQ(btfield({"info", "m.json"}, here).code, 0);
    expect_failure({"synth", "m.json", "-o", "t.png"}, 1, "--allow-invalid", here);
    EXPECT_EQ(folder.names(), Words{"m.json"});
    const Ended insisted = btfield({"synth", "m.json", "-o", "t.exr", "--allow-invalid"}, here);
    EXPECT_EQ(insisted.code, 0) << insisted.err;
    EXPECT_EQ(insisted.err.rfind("btfield: warning: ", 0), 0U) << insisted.err;
    EXPECT_TRUE(std::filesystem::exists(folder / "t.exr"));
}

TEST(CliFit, CorrelatedNeighbourhood) {
    const TemporaryFolder folder;
    const Surroundings here{.folder = folder.path().string()};
    const Ended fitted = btfield({"fit", picture, "-o", "m.json", "--crop", "0,0,128,128", "--neighbourhood",
                                  "correlated:7", "--levels", "2", "--json"},
                                 here);
    ASSERT_EQ(fitted.code, 0) << fitted.err;
    const json object = test::parsed(fitted.out);
    for (const json& level : object["levels"]) {
        EXPECT_EQ(level["offsets"], 7);
        EXPECT_EQ(level["neighbourhood"], "custom");
    }
    EXPECT_EQ(object["reasons"].size(), 1U);
    EXPECT_EQ(read_model(folder / "m.json").levels.size(), 2U);
}

TEST(CliFit, WrongWords) {
    const TemporaryFolder folder;
    const Surroundings here{.folder = folder.path().string()};
    const std::vector<std::pair<Words, std::string>> all{
        {{"--order", "automatic"}, "--order: 'automatic' is neither"},
        {{"--order", "0"}, "--order"},
        {{"--levels", "0"}, "--levels"},
        {{"--levels", "31"}, "--levels"},
        {{"--model", "car"}, "--model: 'car' is none of 2d-car|"},
        {{"--model", "compound"}, "is no random field: 'btfield compound fit' learns"},
        {{"--model", "roll"}, "is no random field: 'btfield roll' lays"},
        {{"--neighbourhood", "custom"}, "--neighbourhood: 'custom' is none of causal|"},
        {{"--neighbourhood", "correlated"}, "correlated:N"},
        {{"--neighbourhood", "correlated:"}, "such as correlated:12"},
        {{"--neighbourhood", "correlated:0"}, "from 1 to 44"},
        {{"--neighbourhood", "correlated:45"}, "from 1 to 44"},
        {{"--neighbourhood", "correlated:4x"}, "from 1 to 44"},
    };
    for (const auto& [words, part] : all) {
        Words whole{"fit", picture, "-o", "m.json"};
        whole.insert(whole.end(), words.begin(), words.end());
        const Ended ended = btfield(whole, here);
        EXPECT_EQ(ended.code, 2) << ended.err;
        EXPECT_NE(ended.err.find(part), std::string::npos) << ended.err;
        EXPECT_EQ(std::ranges::count(ended.err, '\n'), 1) << ended.err;
    }
    // Known words that do not go together.
    for (const auto& [words, part] : std::vector<std::pair<Words, std::string>>{
             {{"--neighbourhood", "correlated:4", "--order", "auto"}, "take the place of an order"},
             {{"--neighbourhood", "correlated:5", "--model", "3d-mmrf"}, "even number"},
             {{"--neighbourhood", "correlated:23"}, "22 causal offsets"}}) {
        Words whole{"fit", picture, "-o", "m.json"};
        whole.insert(whole.end(), words.begin(), words.end());
        const Ended ended = btfield(whole, here);
        EXPECT_EQ(ended.code, 1) << ended.err;
        EXPECT_NE(ended.err.find(part), std::string::npos) << ended.err;
    }
    EXPECT_TRUE(folder.names().empty());
}

TEST(CliFit, ErrorsNameThePicture) {
    const TemporaryFolder folder;
    const Surroundings here{.folder = folder.path().string()};
    expect_failure({"fit", data + "/cork.png", data + "/sand.png", "-o", "m/", "--planes", "A"}, 1,
                   "cork.png", here);
    // Its alpha is the same everywhere.
    expect_failure({"fit", picture, "-o", "m.json", "--planes", "A"}, 1, "sand.png': find the spectral basis",
                   here);
}

TEST(CliFit, FoldersAreMade) {
    const TemporaryFolder folder;
    const Surroundings here{.folder = folder.path().string()};
    const std::string grass = data + "/grass.png";
    const Words quick{"--levels", "1", "--order", "1", "--crop", "0,0,64,64"};
    const auto fit = [&](Words words) {
        words.insert(words.begin(), "fit");
        words.insert(words.end(), quick.begin(), quick.end());
        return btfield(words, here);
    };
    EXPECT_EQ(fit({grass, "-o", "a/b/"}).code, 0);
    EXPECT_TRUE(std::filesystem::exists(folder / "a/b/grass.json"));
    EXPECT_EQ(fit({grass, picture, "-o", "models"}).code, 0);
    EXPECT_TRUE(std::filesystem::exists(folder / "models/sand.json"));
    EXPECT_EQ(fit({grass, picture, "-o", "models.json"}).code, 2);
    EXPECT_EQ(fit({grass, "-o", "models/grass.json/"}).code, 1);
    // What fails leaves no folder behind, and takes none away that was there.
    EXPECT_EQ(fit({"nothing.png", "-o", "c/d/"}).code, 1);
    EXPECT_EQ(fit({"nothing.png", "-o", "a/e/"}).code, 1);
    EXPECT_EQ(folder.names(), (Words{"a", "models"}));
    EXPECT_FALSE(std::filesystem::exists(folder / "a/e"));
}

TEST(CliFit, BeginsWithSentences) {
    const TemporaryFolder folder;
    const Surroundings here{.folder = folder.path().string()};
    const Ended shapes = btfield({"fit", data + "/bark.png", "-o", "m.json"}, here);
    EXPECT_EQ(shapes.code, 0) << shapes.err;
    EXPECT_NE(shapes.out.find("\nIt keeps means, colours, histograms, and correlations of pixels to "),
              std::string::npos)
        << shapes.out;
    EXPECT_NE(shapes.out.find("\nIt loses shapes: structure distance 0."), std::string::npos) << shapes.out;
    EXPECT_LT(shapes.out.find("It loses"), shapes.out.find("certificate"));  // figures follow
    const std::string proposal = "'btfield compound fit' of the same picture keeps more of them, in up to ";
    const std::size_t at = shapes.out.find(proposal);
    ASSERT_NE(at, std::string::npos) << shapes.out;
    const double most = std::stod(shapes.out.substr(at + proposal.size())) * 1e3;  // kB
    ASSERT_EQ(btfield({"compound", "fit", data + "/bark.png", "-o", "c.btfm"}, here).code, 0);
    const auto bytes = static_cast<double>(std::filesystem::file_size(folder / "c.btfm"));
    EXPECT_LT(bytes, most);
    EXPECT_GT(bytes, 0.4 * most);
    // What was asked for is not proposed again.
    // A texture of a random field has no shapes to lose.
    ASSERT_EQ(btfield({"fit", data + "/cork.png", "-o", "cork.json", "--json"}, here).code, 0);
    ASSERT_EQ(btfield({"synth", "cork.json", "-o", "grain.png"}, here).code, 0);
    const Ended grain = btfield({"fit", "grain.png", "-o", "g.json"}, here);
    EXPECT_NE(grain.out.find("It keeps means, colours, histograms, and"), std::string::npos) << grain.out;
    EXPECT_EQ(grain.out.find("It loses"), std::string::npos) << grain.out;
    // Grey has no colours, as one plane, as three alike, and as maps.
    const Image grey = read_picture(data + "/grass.png", Crop{0, 0, 96, 96}).image;
    Image three(grey.size(), 3, ColourSpace::srgb), two(grey.size(), 2);
    for (int p = 0; p < 3; ++p) std::ranges::copy(grey.plane(0), three.plane(p).begin());
    for (int p = 0; p < 2; ++p) std::ranges::copy(grey.plane(0), two.plane(p).begin());
    for (float& v : two.plane(1)) v *= v;
    write_picture(folder / "three.png", three);
    write_picture(folder / "two.tif", two);
    for (const char* grey_file : {"three.png", "two.tif"}) {
        const Ended means = btfield({"fit", grey_file, "-o", "g.json"}, here);
        EXPECT_NE(means.out.find("It keeps means, histograms"), std::string::npos) << means.out << means.err;
        const Ended regions = btfield({"compound", "fit", grey_file, "-o", "g.json", "--regions", "2"}, here);
        EXPECT_NE(regions.out.find("It keeps the means of 2 regions"), std::string::npos)
            << regions.out << regions.err;
    }
    const Ended plain = btfield({"fit", "grain.png", "-o", "g.json", "--marginals", "none"}, here);
    EXPECT_NE(plain.out.find("It keeps means, colours, and correlations"), std::string::npos) << plain.out;
}

TEST(CliFit, LossesAreGraded) {
    const TemporaryFolder folder;
    const Surroundings here{.folder = folder.path().string()};
    // Long waves with a little grain, which one level sees little of.
    std::mt19937 generator(5);
    Image hills({128, 128}, 1);
    for (int r = 0; r < 128; ++r)
        for (int c = 0; c < 128; ++c) {
            double sum = 0.0;
            for (int k = 1; k <= 3; ++k)
                sum += std::cos(2.0 * std::numbers::pi * (k * r + (4 - k) * c) / 128.0 + 1.7 * k * k);
            hills.at(0, r, c) = static_cast<float>(
                0.5 + 0.1 * sum + 1e-2 * (static_cast<double>(generator()) / 4294967295.0 - 0.5));
        }
    WriteOptions floats;
    floats.type = PixelType::float32;
    write_picture(folder / "hills.tif", hills, floats);
    const auto told = [&](Words more) {
        more.insert(more.begin(), {"fit", "hills.tif", "-o", "m.json"});
        const Ended ended = btfield(more, here);
        EXPECT_EQ(ended.code, 0) << ended.err;
        return ended.out;
    };
    const Words raw{"--levels", "1", "--gains", "none", "--marginals", "none"};
    const std::string worst = told(raw);
    EXPECT_NE(worst.find("It keeps mean.\nIt loses correlations: those of pixels are off by "),
              std::string::npos)
        << worst;
    EXPECT_NE(worst.find("\nIt loses contrast: textures have "), std::string::npos) << worst;
    EXPECT_NE(
        worst.find(" % of the deviation of the picture: --levels 3, --order 8 or --model 3d-msar may come"),
        std::string::npos)
        << worst;
    // What was asked for is not proposed again.
    Words more = raw;
    more.insert(more.end(), {"--order", "8", "--model", "3d-msar"});
    const std::string again = told(more);
    EXPECT_EQ(again.find("--order 8"), std::string::npos) << again;
    EXPECT_EQ(again.find("--model 3d-msar"), std::string::npos) << again;
    // By default no deviation is lost.
    const std::string best = told({});
    EXPECT_NE(best.find("It keeps mean, histograms, and correlations of pixels to "), std::string::npos)
        << best;
    EXPECT_EQ(best.find("deviation"), std::string::npos) << best;
}

TEST(CliFit, UnevenLightIsToldAndTakenOut) {
    const TemporaryFolder folder;
    const Surroundings here{.folder = folder.path().string()};
    Image image = read_picture(data + "/cork.png", Crop{0, 0, 192, 192}).image;
    for (int p = 0; p < 3; ++p)
        for (int r = 0; r < 192; ++r)
            for (int c = 0; c < 192; ++c)
                image.at(p, r, c) *= 0.9F + 0.2F * static_cast<float>(c) / 192.0F;  // of encoded values
    write_picture(folder / "uneven.png", image);
    const auto fitted = [&](const char* model, Words words) {
        words.insert(words.begin(), {"fit", "uneven.png", "-o", model});
        const Ended ended = btfield(words, here);
        EXPECT_EQ(ended.code, 0) << ended.err;
        return ended;
    };
    const Ended told = fitted("m.json", {"--json"});
    EXPECT_NE(told.err.find("'uneven.png': light is uneven"), std::string::npos) << told.err;
    EXPECT_NE(told.err.find("--flatten plane takes it out"), std::string::npos) << told.err;
    const Ended flat = fitted("f.json", {"--flatten", "low"});
    EXPECT_EQ(flat.err, "");
    EXPECT_NE(flat.out.find(", score "), std::string::npos) << flat.out;
    const std::string info = btfield({"info", "f.json"}, here).out;
    EXPECT_NE(info.find("flattened (--flatten low)"), std::string::npos) << info;
    EXPECT_EQ(btfield({"info", "m.json"}, here).out.find("flattened"), std::string::npos);
    ASSERT_EQ(
        btfield({"compound", "fit", "uneven.png", "-o", "c.btfm", "--flatten", "plane", "--regions", "2"},
                here)
            .code,
        0);
    EXPECT_NE(btfield({"info", "c.btfm", "--json"}, here).out.find("flattened (--flatten plane)"),
              std::string::npos);
}

}  // namespace
}  // namespace btfield

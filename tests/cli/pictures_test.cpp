// Pictures on their way through commands: colours, types, names, parts, and what is told of them.

#include <OpenImageIO/imageio.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "btfield/image_io.hpp"
#include "btfield/model_file.hpp"
#include "host/pictures/colour.hpp"
#include "tests/cli_cases.hpp"
#include "tests/picture_bytes.hpp"
#include "tests/picture_files.hpp"
#include "tests/places.hpp"
#include "tests/temporary_folder.hpp"

namespace btfield {
namespace {

using nlohmann::json;
using test::btfield;
using test::Ended;
using test::expect_failure;
using test::Surroundings;
using test::TemporaryFolder;
using test::Words;
using test::write_foreign;

const std::filesystem::path data{test::data_folder()};

class CliPictures : public testing::Test {
  protected:
    Ended run(Words words) { return btfield(std::move(words), here_); }
    json object(Words words) {
        words.emplace_back("--json");
        const Ended ended = run(words);
        EXPECT_EQ(ended.code, 0) << test::text_of(words) << '\n' << ended.err;
        err_ = ended.err;
        return ended.code == 0 ? json::parse(ended.out) : json::object();
    }
    /// Cork in linear light under these channel names.
    void put_exr(const std::string& name, const Words& names, const std::vector<float>& scale = {},
                 OIIO::TypeDesc type = OIIO::TypeDesc::FLOAT, const std::vector<float>& chromaticities = {}) {
        const Image cork = read_picture(data / "cork.png", Crop{0, 0, 48, 40}).image;
        OIIO::ImageSpec spec(48, 40, static_cast<int>(names.size()), type);
        spec.channelnames = names;
        spec.alpha_channel = -1;
        spec.z_channel = -1;
        if (!chromaticities.empty())
            spec.attribute("chromaticities", OIIO::TypeDesc(OIIO::TypeDesc::FLOAT, 8), chromaticities.data());
        std::vector<float> values;
        for (std::size_t i = 0; i < area(cork.size()); ++i)
            for (std::size_t c = 0; c < names.size(); ++c)
                values.push_back((scale.empty() ? 1.0F : scale[c]) *
                                 static_cast<float>(detail::srgb_decoded(static_cast<double>(cork.plane(
                                     static_cast<int>(c % 3))[(i + 7 * (c / 3)) % area(cork.size())]))));
        write_foreign(folder_ / name, spec, values);
    }
    OIIO::ImageSpec spec_of(const std::string& name) {
        const auto input = OIIO::ImageInput::open((folder_ / name).string());
        EXPECT_TRUE(input);
        return input ? input->spec() : OIIO::ImageSpec();
    }
    static double mean(const Image& image) {
        double sum = 0.0;
        for (const float v : image.values()) sum += static_cast<double>(v);
        return sum / static_cast<double>(image.values().size());
    }

    TemporaryFolder folder_;
    const Surroundings here_{.folder = folder_.path().string()};
    std::string err_;
};

TEST_F(CliPictures, LinearLightIsEncodedForScreensAndSrgbMadeLinear) {
    put_exr("a.exr", {"R", "G", "B"});
    object({"fit", "a.exr", "-o", "a.json"});
    Image light = read_picture(folder_ / "a.exr").image;
    for (const char* file : {"o.jpg", "o.ppm", "o.png", "o.hdr", "o.exr", "o.tif"}) {
        object({"synth", "a.json", "-o", file});
        Image texture = read_picture(folder_ / file).image;
        const bool screen =
            std::string(file) != "o.hdr" && std::string(file) != "o.exr" && std::string(file) != "o.tif";
        EXPECT_EQ(texture.space(), screen ? ColourSpace::srgb : ColourSpace::linear) << file;
        detail::convert(texture, ColourSpace::linear);
        EXPECT_NEAR(mean(texture) / mean(light), 1.0, 0.05) << file;
    }
    object({"fit", (data / "cork.png").string(), "-o", "cork.json", "--crop", "0,0,64,64"});
    object({"synth", "cork.json", "-o", "cork.exr"});
    EXPECT_EQ(spec_of("cork.exr").format, OIIO::TypeDesc::HALF);
    Image cork = read_picture(data / "cork.png", Crop{0, 0, 64, 64}).image;
    const double encoded = mean(cork);
    detail::convert(cork, ColourSpace::linear);
    EXPECT_NEAR(mean(read_picture(folder_ / "cork.exr").image) / mean(cork), 1.0, 0.05);
    // Numbers as they are, and the file says so.
    object({"synth", "cork.json", "-o", "kept.exr", "--keep-values"});
    const Image kept = read_picture(folder_ / "kept.exr").image;
    EXPECT_EQ(kept.space(), ColourSpace::srgb);
    EXPECT_NEAR(mean(kept) / encoded, 1.0, 0.05);
}

TEST_F(CliPictures, ColoursBesideDataAreEncodedAndTold) {
    put_exr("a.exr", {"R", "G", "B", "Z"});
    EXPECT_EQ(object({"fit", "a.exr", "-o", "a.json"})["plane_colour_spaces"],
              json({"linear", "linear", "linear", "unspecified"}));
    object({"synth", "a.json", "-o", "o.tif", "--type", "uint16"});
    EXPECT_NE(err_.find("planes 0, 1 and 2 were encoded as sRGB"), std::string::npos) << err_;
    object({"synth", "a.json", "-o", "o.exr"});
    EXPECT_EQ(err_, "");
    const Image screen = read_picture(folder_ / "o.tif").image, light = read_picture(folder_ / "o.exr").image;
    for (std::size_t i = 0; i < area(light.size()); ++i) {
        const double value = std::clamp(static_cast<double>(light.plane(1)[i]), 0.0, 1.0);
        ASSERT_NEAR(screen.plane(1)[i], detail::srgb_encoded(value), 1e-4);
    }
    EXPECT_NE(run({"info", "a.json"}).out.find("linear in planes 0, 1, 2"), std::string::npos);
    // What edits, rolls and compound models make of it knows it too.
    object({"roll", "a.exr", "-o", "r.tif", "--type", "uint16", "--size", "32"});
    EXPECT_NE(err_.find("encoded as sRGB"), std::string::npos) << err_;
    EXPECT_EQ(object({"compound", "fit", "a.exr", "-o", "c.json", "--regions", "2", "--levels",
                      "1"})["plane_colour_spaces"],
              json({"linear", "linear", "linear", "unspecified"}));
    object({"synth", "c.json", "-o", "c.tif", "--type", "uint16"});
    EXPECT_NE(err_.find("encoded as sRGB"), std::string::npos) << err_;
}

TEST_F(CliPictures, GreyOfMapsStaysAsItIs) {
    const std::filesystem::path grass = data / "grass.png";
    std::filesystem::copy_file(grass, folder_ / "lawn.png");
    std::filesystem::copy_file(grass, folder_ / "lawn_height.png");
    const double encoded = mean(read_picture(grass).image);
    const auto grown = [&](const std::string& name) {
        object({"fit", name + ".png", "-o", name + ".json", "--levels", "1", "--order", "1"});
        object({"synth", name + ".json", "-o", name + ".exr"});
        return mean(read_picture(folder_ / (name + ".exr")).image);
    };
    EXPECT_LT(grown("lawn"), 0.8 * encoded);
    EXPECT_NE(err_.find("grey was made linear light"), std::string::npos) << err_;
    EXPECT_NE(err_.find("--keep-values"), std::string::npos) << err_;
    EXPECT_NEAR(grown("lawn_height") / encoded, 1.0, 0.05);
    EXPECT_EQ(err_, "");
    object({"synth", "lawn.json", "-o", "kept.exr", "--keep-values"});
    EXPECT_NEAR(mean(read_picture(folder_ / "kept.exr").image) / encoded, 1.0, 0.05);
    EXPECT_EQ(err_, "");
}

TEST_F(CliPictures, TypesFollowThePictureUnlessAskedFor) {
    put_exr("a.exr", {"height"});
    object({"fit", "a.exr", "-o", "a.json"});
    const auto type = [&](const char* file, const Words& more = {}) {
        Words words{"synth", "a.json", "-o", file};
        words.insert(words.end(), more.begin(), more.end());
        object(words);
        return read_picture(folder_ / file).type;
    };
    EXPECT_EQ(type("o.exr"), PixelType::float32);
    EXPECT_EQ(type("o.exr", {"--type", "half"}), PixelType::half);
    EXPECT_EQ(type("o.tif"), PixelType::float32);
    EXPECT_EQ(type("o.tif", {"--type", "uint16"}), PixelType::uint16);
    EXPECT_EQ(type("o.png", {"--type", "uint8"}), PixelType::uint8);
    object({"roll", "a.exr", "-o", "r.exr", "--size", "32x32", "--type", "half"});
    EXPECT_EQ(read_picture(folder_ / "r.exr").type, PixelType::half);
    expect_failure({"synth", "a.json", "-o", "o.jpg", "--type", "float"}, 1, "JPEG cannot hold float", here_);
    expect_failure({"synth", "a.json", "-o", "o.exr", "--type", "double"}, 2,
                   "'double' is none of uint8|uint16|half|float", here_);
}

TEST_F(CliPictures, LossOfDetailIsToldInOneWarning) {
    put_exr("a.exr", {"height"}, {0.01F});
    OIIO::ImageSpec spec(48, 40, 1, OIIO::TypeDesc::FLOAT);
    spec.channelnames = {"height"};
    const Image small = read_picture(folder_ / "a.exr").image;
    std::vector<float> values(small.values().begin(), small.values().end());
    for (float& v : values) v += 1000.0F;
    write_foreign(folder_ / "high.exr", spec, values);
    object({"fit", "high.exr", "-o", "high.json"});
    object({"synth", "high.json", "-o", "o.exr"});
    EXPECT_EQ(err_, "");
    object({"synth", "high.json", "-o", "o-.exr", "--count", "3", "--type", "half"});
    EXPECT_EQ(std::count(err_.begin(), err_.end(), '\n'), 1) << err_;
    EXPECT_NE(err_.find("loses detail: type half"), std::string::npos) << err_;
    EXPECT_NE(err_.find("and 2 more"), std::string::npos) << err_;
}

TEST_F(CliPictures, PlanesThatAreCutOffAreTold) {
    // A height in its own unit: in a PNG little of it is left.
    put_exr("a.exr", {"height"}, {0.01F});
    OIIO::ImageSpec spec(48, 40, 1, OIIO::TypeDesc::FLOAT);
    spec.channelnames = {"height"};
    const Image small = read_picture(folder_ / "a.exr").image;
    std::vector<float> values(small.values().begin(), small.values().end());
    for (float& v : values) v += 1000.0F;
    write_foreign(folder_ / "high.exr", spec, values);
    object({"fit", "high.exr", "-o", "high.json"});
    object({"synth", "high.json", "-o", "o.png"});
    EXPECT_NE(err_.find("100 % of plane 0 lie outside of [0, 1]"), std::string::npos) << err_;
    object({"synth", "high.json", "-o", "o.tif", "--type", "float"});
    EXPECT_EQ(err_, "");
    // Few lights that are brighter than white are what they are in the picture.
    for (std::size_t i = 0; i < values.size(); ++i) values[i] = i % 100 == 0 ? 1.5F : values[i] - 999.6F;
    write_foreign(folder_ / "bright.exr", spec, values);
    object({"fit", "bright.exr", "-o", "bright.json"});
    object({"synth", "bright.json", "-o", "b.png"});
    EXPECT_EQ(err_.find("cut off"), std::string::npos) << err_;
}

TEST_F(CliPictures, NamesGoFromChannelsToModelToChannels) {
    put_exr("waves.exr", {"1000nm", "400nm", "560nm", "720nm"});
    const json fitted = object({"fit", "waves.exr", "-o", "w.btfm"});
    const json names{"400nm", "560nm", "720nm", "1000nm"};
    EXPECT_EQ(fitted["names"], names);
    EXPECT_EQ(object({"info", "w.btfm"})["names"], names);
    EXPECT_NE(run({"info", "w.btfm"}).out.find("planes 400nm, 560nm, 720nm, 1000nm\n"), std::string::npos);
    object({"synth", "w.btfm", "-o", "w.exr"});
    const auto written = spec_of("w.exr").channelnames;
    EXPECT_EQ(std::vector<std::string>(written.begin(), written.end()),
              (Words{"1000nm", "400nm", "560nm", "720nm"}));
    // TIFF has no channel names: they stand in its description, and come back.
    object({"synth", "w.btfm", "-o", "w.tif"});
    EXPECT_EQ(read_picture(folder_ / "w.tif").image.names(), (Words{"400nm", "560nm", "720nm", "1000nm"}));
    object({"roll", "waves.exr", "-o", "r.exr", "--size", "32x32"});
    EXPECT_EQ(read_picture(folder_ / "r.exr").image.names(), (Words{"400nm", "560nm", "720nm", "1000nm"}));
    // Heights beside colours: viewers show the colours.
    put_exr("z.exr", {"R", "G", "B", "Z"});
    object({"compound", "fit", "z.exr", "-o", "z.json", "--regions", "2"});
    EXPECT_EQ(object({"info", "z.json"})["names"], json({"R", "G", "B", "Z"}));
    object({"synth", "z.json", "-o", "zo.exr"});
    EXPECT_EQ(read_picture(folder_ / "zo.exr").image.names(), (Words{"R", "G", "B", "Z"}));
    // Words are colours, and stay words.
    put_exr("words.exr", {"red", "green", "blue"});
    EXPECT_EQ(object({"fit", "words.exr", "-o", "n.json"})["colour_space"], "linear");
}

TEST_F(CliPictures, ModelsOfPlainPicturesSayNothingOfNamesAndPrimaries) {
    object({"fit", (data / "cork.png").string(), "-o", "cork.json", "--crop", "0,0,64,64"});
    const std::string text = test::bytes_of(folder_ / "cork.json");
    EXPECT_EQ(text.find("names"), std::string::npos);
    EXPECT_EQ(text.find("chromaticities"), std::string::npos);
    put_exr("waves.exr", {"400nm", "560nm"});
    object({"fit", "waves.exr", "-o", "w.json"});
    EXPECT_NE(test::bytes_of(folder_ / "w.json").find("\"names\""), std::string::npos);
}

TEST_F(CliPictures, PlanesAreChosenByEveryReader) {
    put_exr("l.exr", {"A", "B", "G", "R", "spec.A", "spec.B", "spec.G", "spec.R"});
    EXPECT_EQ(object({"fit", "l.exr", "-o", "m.json"})["planes"], 6);
    const json spec = object({"fit", "l.exr", "-o", "m.json", "--planes", "spec"});
    EXPECT_EQ(spec["names"], json({"spec.R", "spec.G", "spec.B"}));
    EXPECT_EQ(spec["colour_space"], "linear");
    EXPECT_EQ(object({"kappa", "l.exr", "--planes", "R,G"})["images"][0]["covariance"].size(), 2U);
    EXPECT_EQ(object({"compare", "l.exr", "l.exr", "--planes", "R"})["planes"].size(), 1U);
    object({"memd", "l.exr", "l.exr", "--planes", "R,G,B"});
    object({"roll", "l.exr", "-o", "r.exr", "--size", "32x32", "--planes", "spec.G"});
    EXPECT_EQ(read_picture(folder_ / "r.exr").image.names(), (Words{"spec.G"}));
    expect_failure({"fit", "l.exr", "-o", "n.json", "--planes", "depth"}, 1, "it has no plane 'depth'",
                   here_);
}

TEST_F(CliPictures, PartsAreAskedFor) {
    std::vector<OIIO::ImageSpec> specs;
    for (const char* name : {"normals", "albedo"}) {
        OIIO::ImageSpec spec(24, 20, 3, OIIO::TypeDesc::HALF);
        spec.attribute("oiio:subimagename", name);
        specs.push_back(spec);
    }
    const std::string path = (folder_ / "parts.exr").string();
    const auto output = OIIO::ImageOutput::create(path);
    ASSERT_TRUE(output && output->open(path, 2, specs.data()));
    std::vector<float> values;
    for (int i = 0; i < 24 * 20 * 3; ++i) values.push_back(static_cast<float>(i * 37 % 101) / 101.0F);
    ASSERT_TRUE(output->write_image(OIIO::TypeDesc::FLOAT, values.data()));
    for (float& v : values) v *= 0.5F;
    ASSERT_TRUE(output->open(path, specs[1], OIIO::ImageOutput::AppendSubimage) &&
                output->write_image(OIIO::TypeDesc::FLOAT, values.data()));
    ASSERT_TRUE(output->close());
    expect_failure({"fit", "parts.exr", "-o", "m.json"}, 1,
                   "it holds several pictures: 0 'normals' (24x20, 3 channels), 1 'albedo'", here_);
    EXPECT_FALSE(std::filesystem::exists(folder_ / "m.json"));
    const double half = object({"kappa", "parts.exr", "--part", "albedo"})["images"][0]["covariance"][0][0];
    const double whole = object({"kappa", "parts.exr", "--part", "0"})["images"][0]["covariance"][0][0];
    EXPECT_NEAR(whole / half, 4.0, 0.05);
    expect_failure({"kappa", "parts.exr", "--part", "depth"}, 1, "it has no part 'depth'", here_);
    expect_failure({"kappa", (data / "cork.png").string(), "--part", "1"}, 1, "it has no part '1'", here_);
}

TEST_F(CliPictures, PrimariesAreToldAndComeBack) {
    const std::vector<float> acescg{0.713F, 0.293F, 0.165F, 0.830F, 0.128F, 0.044F, 0.32168F, 0.33767F};
    put_exr("a.exr", {"R", "G", "B"}, {}, OIIO::TypeDesc::FLOAT, acescg);
    object({"fit", "a.exr", "-o", "a.btfm"});
    EXPECT_EQ(std::count(err_.begin(), err_.end(), '\n'), 1) << err_;
    EXPECT_NE(err_.find("primaries"), std::string::npos);
    object({"synth", "a.btfm", "-o", "o.exr"});
    ASSERT_TRUE(read_picture(folder_ / "o.exr").chromaticities);
    EXPECT_NEAR((*read_picture(folder_ / "o.exr").chromaticities)[0], 0.713, 1e-5);
    // What the file holds is what the source held.
    const ReadOptions kept{{}, {}, {}, true};
    const double before = mean(read_picture(folder_ / "a.exr", kept).image),
                 after = mean(read_picture(folder_ / "o.exr", kept).image);
    EXPECT_NEAR(after / before, 1.0, 0.05);
    // Without conversion, the same twice over.
    object({"fit", "a.exr", "-o", "k.json", "--keep-values"});
    EXPECT_EQ(err_, "");
    object({"synth", "k.json", "-o", "k.exr"});
    EXPECT_TRUE(read_picture(folder_ / "k.exr").chromaticities);
    EXPECT_NEAR(mean(read_picture(folder_ / "k.exr", kept).image) / before, 1.0, 0.05);
}

TEST_F(CliPictures, XyzIsConvertedWithAWord) {
    object({"fit", (data / "cork-xyz.exr").string(), "-o", "x.json"});
    Image cork = read_picture(data / "cork.png", Crop{0, 0, 128, 128}).image;
    detail::convert(cork, ColourSpace::linear);
    for (const char* file : {"x.png", "x.hdr"}) {
        object({"synth", "x.json", "-o", file});
        EXPECT_NE(err_.find("XYZ"), std::string::npos) << file;
        Image texture = read_picture(folder_ / file).image;
        detail::convert(texture, ColourSpace::linear);
        EXPECT_NEAR(mean(texture) / mean(cork), 1.0, 0.05) << file;
    }
    object({"synth", "x.json", "-o", "x.exr"});
    EXPECT_EQ(err_, "");
    EXPECT_EQ(read_picture(folder_ / "x.exr").image.space(), ColourSpace::xyz);
}

TEST_F(CliPictures, TransparencyIsToldByAll) {
    OIIO::ImageSpec spec(24, 20, 4, OIIO::TypeDesc::UINT8);
    spec.attribute("oiio:UnassociatedAlpha", 1);
    std::vector<unsigned char> values;
    for (int i = 0; i < 24 * 20 * 4; ++i)
        values.push_back(static_cast<unsigned char>(i % 4 == 3 && i > 100 ? 255 : i * 91 % 251));
    write_foreign(folder_ / "t.png", spec, values);
    for (const Words& words :
         {Words{"fit", "t.png", "-o", "m.json", "--levels", "1", "--order", "1"}, Words{"kappa", "t.png"},
          Words{"roll", "t.png", "-o", "r.png", "--size", "24x24"},
          Words{"compound", "fit", "t.png", "-o", "c.json", "--regions", "1"}}) {
        object(words);
        EXPECT_NE(err_.find("partly transparent"), std::string::npos) << test::text_of(words);
        EXPECT_EQ(std::count(err_.begin(), err_.end(), '\n'), 1) << err_;
    }
    object({"compare", "t.png", "t.png"});
    EXPECT_EQ(std::count(err_.begin(), err_.end(), '\n'), 2) << err_;
}

TEST_F(CliPictures, NamesOfFilesAndPlanesAreTextInModels) {
    put_exr("a\xff.exr", {"caf\xe9"});
    for (const char* model : {"m.json", "m.btfm"}) {
        object({"fit", "a\xff.exr", "-o", model});
        const json info = object({"info", model});
        EXPECT_EQ(info["source"], "a\xef\xbf\xbd.exr");
        EXPECT_EQ(info["names"], json({"caf\xef\xbf\xbd"}));
        EXPECT_TRUE(json::accept(model[2] == 'j' ? test::bytes_of(folder_ / model) : "{}"));
    }
}

TEST_F(CliPictures, WebpAndHeicAreRead) {
    const Image cork = read_picture(data / "cork.png", Crop{0, 0, 64, 48}).image;
    OIIO::ImageSpec spec(64, 48, 3, OIIO::TypeDesc::UINT8);
    std::vector<float> values;
    for (std::size_t i = 0; i < area(cork.size()); ++i)
        for (int p = 0; p < 3; ++p) values.push_back(cork.plane(p)[i]);
    for (const char* file : {"a.webp", "a.heic"}) {
        spec.attribute("compression", std::string(file) == "a.webp" ? "lossless" : "heic:100");
        write_foreign(folder_ / file, spec, values);
        const Picture picture = read_picture(folder_ / file);
        ASSERT_EQ(picture.image.size(), cork.size()) << file;
        EXPECT_EQ(picture.image.space(), ColourSpace::srgb);
        EXPECT_NEAR(mean(picture.image), mean(cork), 0.02) << file;
        EXPECT_EQ(object({"fit", file, "-o", "m.json"})["size"], json({64, 48}));
    }
}

}  // namespace
}  // namespace btfield

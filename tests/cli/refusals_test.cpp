// What the command line refuses: one line that says why, the exit code, and no output left.

#include <gtest/gtest.h>

#include <filesystem>
#include <limits>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "btfield/image_io.hpp"
#include "btfield/model_file.hpp"
#include "tests/cli_cases.hpp"
#include "tests/example_model.hpp"
#include "tests/json_text.hpp"
#include "tests/picture_files.hpp"
#include "tests/places.hpp"
#include "tests/run_program.hpp"
#include "tests/temporary_folder.hpp"

namespace btfield {
namespace {

using nlohmann::json;
using test::btfield;
using test::bytes_of;
using test::Ended;
using test::expect_failure;
using test::put_bytes;
using test::put_model;
using test::Surroundings;
using test::TemporaryFolder;
using test::Words;

const std::string data = test::data_folder();

TEST(CliRefusals, BadPictures) {
    const TemporaryFolder folder;
    const Surroundings here{.folder = folder.path().string()};
    const std::string png = bytes_of(data + "/cork.png");
    put_bytes(folder / "truncated.png", png.substr(0, png.size() / 2));
    put_bytes(folder / "text.png", "This is not a picture.\n");
    put_bytes(folder / "empty.png", "");
    std::vector<float> values(768, 0.25F);  // 16 x 16, 3 channels
    values[100] = std::numeric_limits<float>::quiet_NaN();
    test::write_foreign(folder / "nan.exr", OIIO::ImageSpec(16, 16, 3, OIIO::TypeDesc::FLOAT), values);
    const Words before = folder.names();
    for (const char* name : {"truncated.png", "text.png", "empty.png", "nan.exr", "absent.png", "."}) {
        expect_failure({"fit", name, "-o", "m.json"}, 1, name, here);
    }
    expect_failure({"compare", data + "/cork.png", "truncated.png"}, 1, "truncated.png", here);
    expect_failure({"fit", data + "/cork.png", "-o", "m.json", "--crop", "500,500,20,20"}, 1, "cork.png",
                   here);
    EXPECT_EQ(folder.names(), before);
}

TEST(CliRefusals, PicturesWithoutAModel) {
    const TemporaryFolder folder;
    const Surroundings here{.folder = folder.path().string()};
    const Image constant({32, 32}, 1);
    write_picture(folder / "constant.png", constant);
    expect_failure({"fit", "constant.png", "-o", "m.json"}, 1, "all its pixels are equal", here);
    expect_failure({"compare", "constant.png", "constant.png"}, 1, "constant", here);
    expect_failure({"fit", data + "/cork.png", "-o", "m.json", "--crop", "0,0,16,16", "--levels", "4"}, 1,
                   "levels", here);
    expect_failure({"fit", data + "/cork.png", "-o", "m.json", "--neighbourhood", "symmetric"}, 1, "causal",
                   here);
    expect_failure({"compare", data + "/cork.png", data + "/grass.png"}, 1, "planes", here);
    EXPECT_EQ(folder.names(), Words{"constant.png"});
}

TEST(CliRefusals, BadModels) {
    const TemporaryFolder folder;
    const Surroundings here{.folder = folder.path().string()};
    put_model(folder / "good.btfm");
    const std::string text = to_json(test::example_model());
    json value = test::parsed(text);
    value["levels"][0]["models"][0]["coefficients"].erase(0);
    put_bytes(folder / "count.json", value.dump());
    value = test::parsed(text);
    value["version"] = {2, 0};
    put_bytes(folder / "newer.json", value.dump());
    put_bytes(folder / "empty.json", "");
    put_bytes(folder / "half.json", text.substr(0, text.size() / 2));
    const std::string cbor = bytes_of(folder / "good.btfm");
    put_bytes(folder / "half.btfm", cbor.substr(0, cbor.size() / 2));
    std::filesystem::remove(folder / "good.btfm");
    const Words before = folder.names();
    for (const char* name :
         {"empty.json", "count.json", "newer.json", "half.json", "half.btfm", "absent.json", "."}) {
        expect_failure({"synth", name, "-o", "t.png"}, 1, name, here);
    }
    expect_failure({"info", "count.json"}, 1, "15 coefficients instead of 16", here);
    expect_failure({"info", "newer.json"}, 1, "newer btfield", here);
    // Numbers that no texture can have are the model's fault, whichever they are.
    for (const char* key : {"coefficients", "noise_covariance"}) {
        json huge = test::parsed(text);
        json& numbers = huge["levels"][0]["models"][0][key];
        numbers[0] = 1e308;
        put_bytes(folder / "count.json", huge.dump());
        const Ended ended = btfield({"synth", "count.json", "-o", "t.tif"}, here);
        EXPECT_EQ(ended.code, 1) << key;
        EXPECT_EQ(ended.err.find("pixels"), std::string::npos) << ended.err;
        EXPECT_NE(ended.err.find("fit"), std::string::npos) << ended.err;
    }
    json mean = test::parsed(text);
    mean["mean"][0] = 1e308;
    put_bytes(folder / "count.json", mean.dump());
    expect_failure({"synth", "count.json", "-o", "t.tif"}, 1, "the model's numbers are out of range", here);
    expect_failure({"synth", data + "/cork.png", "-o", "t.png"}, 1, "cork.png", here);
    EXPECT_EQ(folder.names(), before);
}

TEST(CliRefusals, UnwritableOutputs) {
    const TemporaryFolder folder;
    const Surroundings here{.folder = folder.path().string()};
    put_model(folder / "m.json");
    std::filesystem::create_directories(folder / "folder" / "m.png");
    std::filesystem::copy_file(data + "/sand.png", folder / "sand.png");
    const std::string sand = bytes_of(folder / "sand.png");
    const Words before = folder.names();
    expect_failure({"fit", "sand.png", "-o", "absent/m.json"}, 1, "absent", here);
    expect_failure({"fit", "sand.png", "-o", "m.json/m.json"}, 1, "m.json", here);
    expect_failure({"fit", "sand.png", "-o", "sand.png"}, 1, "that is the picture", here);
    expect_failure({"fit", "sand.png", "-o", "new.png"}, 1, "name of a picture", here);
    expect_failure({"synth", "m.json", "-o", "absent/t.png"}, 1, "absent", here);
    expect_failure({"synth", "m.json", "-o", "folder"}, 1, "folder/m.png", here);
    expect_failure({"synth", "m.json", "-o", "t.bogus"}, 1, ".bogus", here);
    expect_failure({"synth", "m.json", "-o", "t"}, 1, "'t'", here);
    EXPECT_EQ(folder.names(), before);
    EXPECT_EQ(bytes_of(folder / "sand.png"), sand);
}

TEST(CliRefusals, FullDisks) {
    const TemporaryFolder folder;
    Surroundings here{.folder = folder.path().string()};
    put_model(folder / "m.json");
    const Words fit{"fit", data + "/sand.png", "-o", "new.json", "--levels", "2", "--order", "2"};
    const Words synth{"synth", "m.json", "-o", "t.png", "--size", "64x64"};
    // Once without a limit: kernels that are built and kept must not be what meets it.
    ASSERT_EQ(btfield(fit, here).code, 0);
    ASSERT_EQ(btfield(synth, here).code, 0);
    std::filesystem::remove(folder / "new.json");
    put_bytes(folder / "t.png", "an old picture");

    here.file_limit = 2000;
    expect_failure(fit, 1, "new.json", here);
    expect_failure(synth, 1, "t.png", here);
    EXPECT_EQ(folder.names(), (Words{"m.json", "t.png"}));
    EXPECT_EQ(bytes_of(folder / "t.png"), "an old picture");

    here.file_limit = RLIM_INFINITY;
    std::filesystem::remove(folder / "t.png");
    std::filesystem::create_symlink("/dev/full", folder / "full.png");
    expect_failure({"synth", "m.json", "-o", "full.png", "--size", "64x64"}, 1, "full.png", here);
    EXPECT_EQ(folder.names(), (Words{"full.png", "m.json"}));
}

TEST(CliRefusals, UnknownDevices) {
    const TemporaryFolder folder;
    const Surroundings here{.folder = folder.path().string()};
    put_model(folder / "m.json");
    expect_failure({"synth", "m.json", "-o", "t.png", "--device", "abacus"}, 3, "abacus", here);
    expect_failure({"fit", data + "/cork.png", "-o", "n.json", "--device", "9:9"}, 3, "9:9", here);
    EXPECT_EQ(folder.names(), Words{"m.json"});
}

TEST(CliRefusals, SizesBeyondTheDevice) {
    const TemporaryFolder folder;
    const Surroundings here{.folder = folder.path().string()};
    put_model(folder / "m.json");
    // More than the library takes is the request's fault, more than the device has is the device's.
    expect_failure({"synth", "m.json", "-o", "t.exr", "--size", "2147483647x2147483647"}, 1, "2147483647",
                   here);
    expect_failure({"synth", "m.json", "-o", "t.exr", "--size", "1x2147483647"}, 1, "2147483647", here);
    expect_failure({"synth", "m.json", "-o", "t.exr", "--size", "16x20000"}, 1, "above 16384 pixels", here);
    const Ended little = btfield({"synth", "m.json", "-o", "t.exr", "--memory", "1"}, here);
    EXPECT_EQ(little.code, 3);
    EXPECT_NE(little.err.find("1 byte may be used"), std::string::npos) << little.err;
    EXPECT_NE(little.err.find("(--memory)"), std::string::npos) << little.err;
    EXPECT_EQ(little.err.find("0x0"), std::string::npos) << little.err;
    EXPECT_EQ(little.err.find("in one piece"), std::string::npos) << little.err;
    EXPECT_EQ(little.err.find("1 planes"), std::string::npos) << little.err;
    expect_failure({"synth", "m.json", "-o", "t.exr", "--size", "1000000x1000000", "--method", "raster"}, 3,
                   "a size up to", here);
    EXPECT_EQ(folder.names(), Words{"m.json"});
}

TEST(CliRefusals, SidesThatAFormatCannotHoldBeforeAnythingGrows) {
    const TemporaryFolder folder;
    const Surroundings here{.folder = folder.path().string()};
    TextureModel model = test::example_model(ModelKind::car3d, 1, 1);
    put_model(folder / "m.json", model);
    const Words before = folder.names();
    // Without a device: nothing is grown.
    const Words grow{"synth", "m.json", "--method", "raster", "--size", "65501x300000", "--device", "none"};
    for (const char* output : {"t.jpg", "t.JPEG"}) {
        Words words = grow;
        words.insert(words.end(), {"-o", output});
        expect_failure(words, 1, "JPEG holds sides up to 65500 pixels", here);
    }
    expect_failure({"synth", "m.json", "--method", "raster", "--size", "16x1048576", "-o", "t.png"}, 1,
                   "PNG holds sides up to 1000000 pixels", here);
    expect_failure({"roll", data + "/bark.png", "--size", "16384x70000", "-o", "t.jpg"}, 1,
                   "JPEG holds sides up to 65500 pixels", here);
    EXPECT_EQ(folder.names(), before);
}

TEST(CliRefusals, FewAddressesAreTold) {
    const TemporaryFolder folder;
    put_model(folder / "m.json");
    const std::string line = "ulimit -v 120000; exec '" + test::command_path() + "' synth m.json -o t.png";
    const Ended ended = test::run_program({"/bin/sh", "-c", line}, {.folder = folder.path().string()});
    EXPECT_NE(ended.code, 0);
    EXPECT_NE(ended.err.find("ulimit -v"), std::string::npos) << ended.err;
}

}  // namespace
}  // namespace btfield

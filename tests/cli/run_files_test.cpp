// Nothing that a run reads, nor the picture that a model was fitted to, is written over; standard output has
// room for one thing.

#include <gtest/gtest.h>

#include <filesystem>
#include <string>

#include "btfield/model_file.hpp"
#include "tests/cli_cases.hpp"
#include "tests/json_text.hpp"
#include "tests/places.hpp"
#include "tests/temporary_folder.hpp"

namespace btfield {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using test::btfield;
using test::bytes_of;
using test::Ended;
using test::expect_failure;
using test::put_bytes;
using test::run_program;
using test::Surroundings;
using test::TemporaryFolder;
using test::Words;

const std::string data = test::data_folder();

/// A folder with the picture wood.png, also as a link, a hard link and below another folder, and a model that
/// was fitted to it.
class CliRunFiles : public testing::Test {
  protected:
    CliRunFiles() {
        fs::copy_file(data + "/sand.png", folder_ / "wood.png");
        fs::create_symlink("wood.png", folder_ / "link.png");
        fs::create_hard_link(folder_ / "wood.png", folder_ / "hard.png");
        fs::create_symlink(".", folder_ / "round");
        fs::create_directories(folder_ / "pictures");
        fs::create_directories(folder_ / "models");
        fs::copy_file(folder_ / "wood.png", folder_ / "pictures/wood.png");
        TextureModel model = test::example_model(ModelKind::car3d, 3, 2);
        model.provenance.source = "wood.png";
        test::put_model(folder_ / "wood.json", model);
        test::put_model(folder_ / "models/wood.json", model);
        model.provenance.source = "w-1.png";
        test::put_model(folder_ / "numbered.json", model);
        fs::copy_file(folder_ / "wood.png", folder_ / "w-1.png");
        before_ = bytes_of(folder_ / "wood.png");
    }
    void unchanged() const {
        for (const char* name : {"wood.png", "w-1.png", "pictures/wood.png"})
            EXPECT_EQ(bytes_of(folder_ / name), before_) << name;
    }
    void refused(const Words& words, int code, const std::string& part) const {
        expect_failure(words, code, part, here_);
        unchanged();
    }

    TemporaryFolder folder_;
    Surroundings here_{.folder = folder_.path().string()};
    std::string before_;
};

TEST_F(CliRunFiles, TexturesDoNotReplaceTheSource) {
    for (const char* output : {".", "wood.png", "./round/wood.png", "link.png", "hard.png"})
        refused({"synth", "wood.json", "-o", output, "--size", "8x8"}, 1, "'wood.json' was fitted");
    refused({"synth", "models/wood.json", "-o", "pictures", "--size", "8x8"}, 1, "--overwrite");
    refused({"synth", "numbered.json", "-o", "w.png", "--count", "3", "--size", "8x8"}, 1, "w-1.png");
    refused({"synth", "numbered.json", "wood.json", "-o", ".", "--size", "8x8"}, 1, "wood.png");
    EXPECT_FALSE(fs::exists(folder_ / "w-0.png"));
    EXPECT_EQ(btfield({"synth", "models/wood.json", "-o", "models", "--size", "8x8"}, here_).code, 0);
    // A texture that has the picture's name is not the picture: the same command works twice.
    fs::create_directory(folder_ / "textures");
    TextureModel sized = read_model(folder_ / "models/wood.json");
    sized.provenance.file_bytes = fs::file_size(folder_ / "wood.png");
    test::put_model(folder_ / "models/wood.json", sized);
    for (int run = 0; run < 2; ++run)
        EXPECT_EQ(btfield({"synth", "models/wood.json", "-o", "textures", "--size", "8x8"}, here_).code, 0);
    refused({"synth", "models/wood.json", "-o", "pictures", "--size", "8x8"}, 1, "--overwrite");
    EXPECT_EQ(btfield({"synth", "wood.json", "-o", "wood.png", "--size", "8x8", "--overwrite"}, here_).code,
              0);
    EXPECT_NE(bytes_of(folder_ / "wood.png"), before_);
}

TEST_F(CliRunFiles, PicturesThatAreReadStay) {
    for (const char* map : {"wood.png", "w-1.png", "round/wood.png", "hard.png", "link.png"})
        refused({"memd", "wood.png", "w-1.png", "--map", map}, 1, "the run reads it");
    for (const char* output : {"wood.png", "hard.png", "round/link.png"})
        refused({"roll", "wood.png", "-o", output, "--tile"}, 1, "one of the pictures to be rolled");
    refused({"roll", "w-1.png", "-o", "w.png", "--tiles", "2", "--size", "64x64"}, 1, "w-1.png");
    refused({"compound", "fit", "wood.png", "-o", "m.json", "--save-labels", "hard.png"}, 1,
            "that is the picture");
}

TEST_F(CliRunFiles, ModelsNeverReplacePictures) {
    for (const char* magic :
         {"\x89PNG\r\n\x1a\n", "\xff\xd8\xff\xe0", "P6 1 1 255 ", "#?RADIANCE\n", "GIF89a", "....ftypheic"}) {
        put_bytes(folder_ / "model.json", magic);
        for (const Words& words : {Words{"fit", "wood.png", "-o", "model.json"},
                                   Words{"fit", "wood.png", "-o", "model.json", "--overwrite"},
                                   Words{"compound", "fit", "wood.png", "-o", "model.json"}})
            refused(words, 1, "a picture is there");
        EXPECT_EQ(bytes_of(folder_ / "model.json"), magic);
    }
    for (const char* name : {"link.png", "hard.png", "round/wood.png", "new.webp"})
        refused({"fit", "w-1.png", "-o", name, "--overwrite"}, 1, "name of a picture");
    fs::create_symlink("wood.png", folder_ / "m.btfm");
    refused({"fit", "wood.png", "-o", "m.btfm"}, 1, "that is the picture");
    refused({"fit", "wood.png", "w-1.png", "-o", "round/wood.json"}, 2, "is no folder");
    put_bytes(folder_ / "model.json", "notes");
    EXPECT_EQ(btfield({"fit", "wood.png", "-o", "model.json", "--levels", "1", "--order", "1"}, here_).code,
              0);
}

TEST_F(CliRunFiles, EditsInPlaceAreAskedFor) {
    const Words fit{"compound", "fit", "wood.png", "-o", "c.json", "--regions", "1", "--crop", "0,0,64,64"};
    ASSERT_EQ(btfield(fit, here_).code, 0);
    const std::string model = bytes_of(folder_ / "c.json");
    Words edit{"compound", "edit", "c.json", "-o", "round/c.json", "--contrast", "0.5"};
    refused(edit, 1, "the run reads it");
    EXPECT_EQ(bytes_of(folder_ / "c.json"), model);
    edit.push_back("--overwrite");
    EXPECT_EQ(btfield(edit, here_).code, 0);
    EXPECT_NE(bytes_of(folder_ / "c.json"), model);
}

TEST_F(CliRunFiles, TwoOutputsAreTwoFiles) {
    put_bytes(folder_ / "t.png", "");
    fs::create_symlink("t.png", folder_ / "t-link.png");
    const Words fit{"compound", "fit", "wood.png", "-o", "c.json", "--regions", "1", "--crop", "0,0,64,64"};
    ASSERT_EQ(btfield(fit, here_).code, 0);
    for (const char* labels : {"t.png", "round/t.png", "t-link.png"})
        refused({"synth", "c.json", "-o", "t.png", "--save-labels", labels}, 2, "written twice");
}

TEST_F(CliRunFiles, ModelsGoThroughPipes) {
    const std::string program = test::command_path();
    const std::string fit = program + " fit wood.png --levels 2 --order 2 -o ";
    for (const std::string& line :
         {fit + "- | " + program + " info - --json",
          fit + "/dev/stdout | " + program + " info /dev/stdin --json",
          fit + "/dev/fd/1 > m.json && " + program + " info m.json --json",
          fit + "- >> log.json && " + program + " synth - -o t.exr --size 8x8 --json < log.json",
          program + " compound fit wood.png --regions 1 --crop 0,0,64,64 -o - | " + program +
              " compound edit - -o - --contrast 2 | " + program + " info - --json"}) {
        const Ended ended = run_program({"/bin/sh", "-c", line}, here_);
        EXPECT_EQ(ended.code, 0) << line << ": " << ended.err;
        EXPECT_TRUE(test::parsed(ended.out).is_object()) << line;
        if (line.find("edit") == std::string::npos) {
            EXPECT_NE(ended.err.find("wrote /dev/"), std::string::npos) << ended.err;
        }
    }
    for (const Words& words : {Words{"fit", "wood.png", "-o", "-", "--json"},
                               Words{"fit", "wood.png", "-o", "/dev/stdout", "--json"},
                               Words{"compound", "fit", "wood.png", "-o", "-", "--json"}})
        refused(words, 2, "standard output has no place for both");
    refused({"synth", "wood.json", "-o", "-"}, 1, "no extension");
}

// Names of files may hold any bytes, files and objects only UTF-8.
TEST_F(CliRunFiles, NamesThatAreNotText) {
    const std::string name = "w\xff\xfe.png";
    fs::copy_file(folder_ / "wood.png", folder_ / name);
    for (const char* const model : {"m.json", "m.btfm"}) {
        const Ended fit =
            btfield({"fit", name, "-o", model, "--levels", "1", "--order", "1", "--json"}, here_);
        ASSERT_EQ(fit.code, 0) << fit.err;
        EXPECT_EQ(test::parsed(fit.out)["source"], "w\xef\xbf\xbd\xef\xbf\xbd.png");
        EXPECT_EQ(read_model(folder_ / model).provenance.source, "w\xef\xbf\xbd\xef\xbf\xbd.png");
        refused({"synth", model, "-o", name}, 1, "was fitted");
    }
    const Ended synth = btfield({"synth", "m.json", "-o", "t\xff.png", "--size", "8x8", "--json"}, here_);
    EXPECT_EQ(synth.code, 0) << synth.err;
    EXPECT_EQ(test::parsed(synth.out)["outputs"][0], "t\xef\xbf\xbd.png");
}

TEST_F(CliRunFiles, SideFilesDoNotReplaceModels) {
    const std::string model = bytes_of(folder_ / "wood.json");
    refused({"relief", "integrate", "wood.png", "-o", "wood.exr"}, 1, "a model is there");
    EXPECT_EQ(bytes_of(folder_ / "wood.json"), model);
}

TEST_F(CliRunFiles, PagesDoNotReplacePictures) {
    refused({"experiment", "report", "r.db", "-o", "wood.png"}, 1, "a picture is there");
}

// Two kinds of errors, one line each.
TEST_F(CliRunFiles, DamagedModelsAndThoseNotSupported) {
    const std::string model = bytes_of(folder_ / "wood.json");
    put_bytes(folder_ / "half.json", model.substr(0, model.size() / 2));
    put_bytes(folder_ / "other.json", "hello");
    std::string newer = model;
    const std::size_t at = newer.find("\"version\": [");
    ASSERT_NE(at, std::string::npos);
    newer[at + 12] = '9';
    put_bytes(folder_ / "newer.json", newer);
    refused({"info", "half.json"}, 1, "it is damaged");
    refused({"info", "other.json"}, 1, "it is not supported");
    refused({"info", "newer.json"}, 1, "it is not supported");
}

}  // namespace
}  // namespace btfield

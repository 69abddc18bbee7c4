// Commands, options and files that are nearly right get an answer that says what to write instead.

#include <gtest/gtest.h>

#include <string>

#include "tests/cli_cases.hpp"
#include "tests/places.hpp"
#include "tests/run_program.hpp"
#include "tests/temporary_folder.hpp"

namespace btfield {
namespace {

using test::expect_failure;
using test::put_model;
using test::Surroundings;
using test::TemporaryFolder;

const std::string data = test::data_folder();

TEST(CliMistakenWords, MisspeltCommands) {
    expect_failure({"compond", "fit", "a.png", "-o", "m.btfm"}, 2,
                   "'compond' is no command, did you mean 'btfield compound fit'?");
    expect_failure({"synt", "m.json", "-o", "a.png"}, 2,
                   "'synt' is no command, did you mean 'btfield synth'?");
    expect_failure({"compound", "fitt", "a.png", "-o", "m.btfm"}, 2, "did you mean 'btfield compound fit'?");
    expect_failure({"nonsense", "fit", "a.png", "-o", "m.btfm"}, 2, "not expected: nonsense");
}

TEST(CliMistakenWords, OutputsAreCalledOutput) {
    expect_failure({"fit", data + "/grass.png", "--out", "m.json"}, 2, "did you mean --output?");
    expect_failure({"roll", data + "/grass.png", "--tile", "--out", "m.json"}, 2, "did you mean --output?");
}

TEST(CliMistakenWords, PicturesForModels) {
    const std::string picture = data + "/grass.png",
                      found = "it is a picture, not a model; learn a model of it first";
    expect_failure({"info", picture}, 1, found);
    expect_failure({"synth", picture, "-o", "t.png"}, 1, "with 'btfield fit' or 'btfield compound fit'");
    expect_failure({"synth", data + "/landsat.tif", "-o", "t.png"}, 1, found);
    expect_failure({"compound", "edit", picture, "-o", "m.btfm", "--contrast", "2"}, 1, found);
    expect_failure({"btf", "render", picture, "-o", "t.png"}, 1, "with 'btfield btf fit'");
}

TEST(CliMistakenWords, ModelsForPictures) {
    const TemporaryFolder folder;
    const Surroundings here{.folder = folder.path().string()};
    put_model(folder / "m.json");
    put_model(folder / "m.btfm");
    const std::string found =
        "it is a model of btfield, not a picture; grow a picture of it first, with 'btfield synth'";
    for (const char* const model : {"m.json", "m.btfm"}) {
        expect_failure({"roll", model, "-o", "t.png", "--tile"}, 1, found, here);
        expect_failure({"fit", model, "-o", "n.json"}, 1, found, here);
        expect_failure({"kappa", model}, 1, found, here);
    }
}

}  // namespace
}  // namespace btfield

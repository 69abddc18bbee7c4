// Compound models as files.

#include <gtest/gtest.h>

#include <cstddef>
#include <nlohmann/json.hpp>
#include <string>
#include <variant>

#include "btfield/compound.hpp"
#include "btfield/error.hpp"
#include "btfield/image_io.hpp"
#include "btfield/model_file.hpp"
#include "tests/device_cases.hpp"
#include "tests/example_model.hpp"
#include "tests/places.hpp"
#include "tests/temporary_folder.hpp"

namespace btfield {
namespace {

const std::string data = test::data_folder();

class CompoundFile : public testing::Test {
  protected:
    test::TemporaryFolder folder_;
    static CompoundModel real() {
        CompoundOptions options;
        options.clusters.regions = 3;
        return fit_compound(test::default_device(),
                            read_picture(data + "/bark.png", Crop{0, 0, 64, 64}).image, options);
    }
};

TEST_F(CompoundFile, ComesBackBitForBit) {
    const CompoundModel model = real();
    for (const char* name : {"a.json", "a.btfm"}) {
        write_compound(folder_ / name, model);
        EXPECT_TRUE(std::holds_alternative<CompoundModel>(read_any_model(folder_ / name)));
        const CompoundModel back = read_compound(folder_ / name);
        EXPECT_EQ(back.control.labels, model.control.labels);
        EXPECT_EQ(back.regions[1].weights, model.regions[1].weights);
        write_compound(folder_ / (std::string("b") + name), back);
        EXPECT_EQ(test::bytes_of(folder_ / name), test::bytes_of(folder_ / (std::string("b") + name)));
    }
    EXPECT_LT(test::bytes_of(folder_ / "a.btfm").size(), test::bytes_of(folder_ / "a.json").size() / 2);
}

TEST_F(CompoundFile, FilesWithoutPairsOfNeighboursAreRead) {
    const CompoundModel model = real();
    write_compound(folder_ / "new.json", model);
    nlohmann::ordered_json value = nlohmann::ordered_json::parse(test::bytes_of(folder_ / "new.json"));
    const auto d = static_cast<std::size_t>(model.planes);
    const std::size_t earlier = static_cast<std::size_t>(context_filters - context_pairs) * d;
    for (auto& region : value["regions"]) {
        auto& weights = region["weights"];
        ASSERT_EQ(weights.size(), static_cast<std::size_t>(context_filters) * d);
        weights.erase(weights.begin() + static_cast<std::ptrdiff_t>(earlier), weights.end());
    }
    test::put_bytes(folder_ / "old.json", value.dump());
    const CompoundModel old = read_compound(folder_ / "old.json");
    for (std::size_t k = 0; k < old.regions.size(); ++k)
        for (std::size_t n = 0; n < old.regions[k].weights.size(); ++n)
            EXPECT_EQ(old.regions[k].weights[n], n < earlier ? model.regions[k].weights[n] : 0.0);
    value["regions"][1]["weights"].erase(value["regions"][1]["weights"].begin());
    test::put_bytes(folder_ / "bad.json", value.dump());
    EXPECT_THROW((void)read_compound(folder_ / "bad.json"), InputError);
}

TEST_F(CompoundFile, DamageIsRefused) {
    write_compound(folder_ / "a.btfm", real());
    const std::string bytes = test::bytes_of(folder_ / "a.btfm");
    for (std::size_t length = 0; length < bytes.size(); length += 97) {
        test::put_bytes(folder_ / "b.btfm", std::string_view(bytes).substr(0, length));
        EXPECT_THROW((void)read_compound(folder_ / "b.btfm"), InputError) << length;
    }
    for (std::size_t at = 0; at < bytes.size(); at += 61) {
        std::string broken = bytes;
        broken[at] = static_cast<char>(broken[at] ^ 0x41);
        test::put_bytes(folder_ / "b.btfm", broken);
        try {
            check(read_compound(folder_ / "b.btfm"));  // a number may have become another
        } catch (const InputError&) {
        }
    }
}

TEST_F(CompoundFile, OtherModelsAreToldApart) {
    write_compound(folder_ / "c.json", real());
    EXPECT_THROW((void)read_model(folder_ / "c.json"), InputError);
    write_model(folder_ / "t.json", test::example_model(ModelKind::car3d, 3, 2));
    EXPECT_TRUE(std::holds_alternative<TextureModel>(read_any_model(folder_ / "t.json")));
    EXPECT_THROW((void)read_compound(folder_ / "t.json"), InputError);
}

}  // namespace
}  // namespace btfield

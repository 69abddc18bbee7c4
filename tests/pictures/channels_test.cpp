// Names of channels: what is alpha, what is colour, in which order planes come.

#include "host/pictures/channels.hpp"

#include <gtest/gtest.h>

#include "btfield/error.hpp"

namespace btfield::detail {
namespace {

using Texts = std::vector<std::string>;

Texts planes_of(const Texts& names, const Texts& chosen = {}) {
    Texts result;
    for (const int c : plan_channels(names, chosen, -1, "read").planes)
        result.push_back(names[static_cast<std::size_t>(c)]);
    return result;
}

TEST(Channels, WavelengthsAscend) {
    EXPECT_EQ(planes_of({"1000nm", "400nm", "460nm"}), (Texts{"400nm", "460nm", "1000nm"}));
    EXPECT_EQ(planes_of({"w1000", "w450", "w700"}), (Texts{"w450", "w700", "w1000"}));
    EXPECT_EQ(planes_of({"S0.1000nm", "S0.450,5nm", "S1.1000nm", "S1.450,5nm"}),
              (Texts{"S0.450,5nm", "S0.1000nm", "S1.450,5nm", "S1.1000nm"}));
    EXPECT_EQ(planes_of({"1.2um", "550nm"}), (Texts{"550nm", "1.2um"}));
    // A height stays where it is.
    EXPECT_EQ(planes_of({"1000nm", "450nm", "height"}), (Texts{"450nm", "1000nm", "height"}));
    EXPECT_DOUBLE_EQ(wavelength_of("S0.450,5nm").value(), 450.5);
    EXPECT_DOUBLE_EQ(wavelength_of("450.25 nm").value(), 450.25);
    EXPECT_DOUBLE_EQ(wavelength_of("0.55um").value(), 550.0);
    EXPECT_DOUBLE_EQ(wavelength_of("550").value(), 550.0);
    for (const char* name : {"R", "height", "plane07", "layer2.R", "", "nm", "7", "450,5.1nm"})
        EXPECT_FALSE(wavelength_of(name)) << name;
}

TEST(Channels, WordsAndLettersAreColours) {
    for (const Texts& names :
         {Texts{"blue", "green", "red"}, Texts{"BLUE", "GREEN", "RED"}, Texts{"B", "G", "R"},
          Texts{"LeB", "LeG", "LeR"}, Texts{"diffuse.B", "diffuse.G", "diffuse.R"}}) {
        const ChannelPlan plan = plan_channels(names, {}, -1, "read");
        EXPECT_EQ(plan.colours, ColourSpace::linear) << names[0];
        EXPECT_EQ(plan.planes, (std::vector<int>{2, 1, 0})) << names[0];
    }
    EXPECT_EQ(plan_channels({"X", "Y", "Z"}, {}, -1, "read").colours, ColourSpace::xyz);
    // Normals and positions are no colours.
    EXPECT_FALSE(plan_channels({"N.X", "N.Y", "N.Z"}, {}, -1, "read").colours);
    EXPECT_FALSE(plan_channels({"a.R", "b.G", "c.B"}, {}, -1, "read").colours);
    EXPECT_FALSE(plan_channels({"R", "G", "B", "Z"}, {}, -1, "read").colours);
}

TEST(Channels, NamesThatSayNothingAreLeftOut) {
    EXPECT_TRUE(plan_channels({"R", "G", "B"}, {}, -1, "read").names.empty());
    EXPECT_TRUE(plan_channels({"plane0", "plane1"}, {}, -1, "read").names.empty());
    EXPECT_EQ(plan_channels({"plane0", "plane2"}, {}, -1, "read").names, (Texts{"plane0", "plane2"}));
    EXPECT_EQ(plan_channels({"R", "G", "B", "Z"}, {}, -1, "read").names, (Texts{"R", "G", "B", "Z"}));
    EXPECT_EQ(plan_channels({"h\xff"}, {}, -1, "read").names, (Texts{"h\xef\xbf\xbd"}));
}

TEST(Channels, AlphaOfEveryLayerIsSetAside) {
    EXPECT_EQ(planes_of({"A", "B", "G", "R", "spec.A", "spec.B", "spec.G", "spec.R"}),
              (Texts{"B", "G", "R", "spec.B", "spec.G", "spec.R"}));
    EXPECT_EQ(plan_channels({"R", "G", "B", "alpha"}, {}, -1, "read").alpha, (std::vector<int>{3}));
    EXPECT_EQ(plan_channels({"R", "G", "B", "AR", "AG", "AB"}, {}, -1, "read").planes,
              (std::vector<int>{0, 1, 2}));
    // CIE L*a*b*, and a picture that is nothing else.
    EXPECT_EQ(planes_of({"L", "a", "b"}), (Texts{"L", "a", "b"}));
    EXPECT_EQ(planes_of({"A"}), (Texts{"A"}));
    // Alpha of nothing that has colours is a plane like the others.
    EXPECT_EQ(planes_of({"a", "b", "c"}), (Texts{"a", "b", "c"}));
    EXPECT_EQ(planes_of({"A", "B", "C"}), (Texts{"A", "B", "C"}));
    EXPECT_EQ(planes_of({"UV.A", "UV.U", "UV.V"}), (Texts{"UV.A", "UV.U", "UV.V"}));
    EXPECT_EQ(planes_of({"alpha", "beta", "gamma"}), (Texts{"alpha", "beta", "gamma"}));
    EXPECT_EQ(planes_of({"A", "diffuse.R", "diffuse.G", "diffuse.B"}),
              (Texts{"diffuse.R", "diffuse.G", "diffuse.B"}));
    EXPECT_EQ(planes_of({"450nm", "550nm", "A"}), (Texts{"450nm", "550nm"}));
}

TEST(Channels, ColoursStandInWholeLayers) {
    using enum ColourSpace;
    EXPECT_EQ(spaces_of_channels({"R", "G", "B", "Z", "normal.R", "normal.G", "normal.B"}),
              (std::vector{linear, linear, linear, unspecified, unspecified, unspecified, unspecified}));
    EXPECT_EQ(spaces_of_channels({"R", "G"}), (std::vector{unspecified, unspecified}));
    EXPECT_EQ(spaces_of_channels({"Y", "Z"}), (std::vector{linear, unspecified}));
    EXPECT_EQ(spaces_of_channels({"X", "Y", "Z"}), (std::vector(3, xyz)));
    EXPECT_EQ(spaces_of_channels({"height"}), (std::vector{unspecified}));
}

TEST(Channels, AreChosenByNameLayerAndNumber) {
    const Texts names{"R", "G", "B", "A", "spec.R", "spec.G", "spec.B", "spec.A"};
    EXPECT_EQ(planes_of(names, {"B", "R"}), (Texts{"B", "R"}));
    EXPECT_EQ(planes_of(names, {"spec"}), (Texts{"spec.R", "spec.G", "spec.B"}));
    EXPECT_EQ(planes_of(names, {"3", "G"}), (Texts{"A", "G"}));
    EXPECT_EQ(plan_channels(names, {"A"}, 3, "read").alpha, (std::vector<int>{7}));
    try {
        static_cast<void>(planes_of(names, {"depth"}));
        FAIL();
    } catch (const InputError& error) {
        EXPECT_EQ(error.found(), "it has no plane 'depth'");
        EXPECT_NE(error.remedy().find("spec.A"), std::string::npos);
    }
    EXPECT_THROW(static_cast<void>(planes_of(names, {"R", "0"})), InputError);
    EXPECT_THROW(static_cast<void>(planes_of(names, {"8"})), InputError);
}

}  // namespace
}  // namespace btfield::detail

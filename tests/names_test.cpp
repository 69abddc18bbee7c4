// Words of all enumerations that have some.

#include <gtest/gtest.h>

#include <functional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "btfield/error.hpp"
#include "host/analysis/neighbourhood_names.hpp"
#include "host/cl/device_names.hpp"
#include "host/compound/compound_names.hpp"
#include "host/criteria/metric_names.hpp"
#include "host/experiment/experiment_names.hpp"
#include "host/fit/fit_names.hpp"
#include "host/model/model_names.hpp"
#include "host/pictures/picture_names.hpp"
#include "host/relief/relief_names.hpp"
#include "host/synthesis/synthesis_names.hpp"

namespace btfield {

using namespace detail;

namespace {

template <typename Enum>
class EnumNames : public testing::Test {};

using Enumerations =
    testing::Types<ColourSpace, PixelType, DeviceType, NeighbourhoodKind, ModelKind, Estimator, NoiseForm,
                   Metric, EstimatorChoice, GainMode, MarginalMode, SignificanceRule, SynthesisMethod,
                   NoiseDomain, JobStatus, TableFormat, ExperimentModel, ClusterSpace, Borders, SurfaceEdges,
                   Flattening, NormalConvention, LightRule, LightCoding>;
TYPED_TEST_SUITE(EnumNames, Enumerations);

// The types' own part of a test is short, because a compiler does all of it over twenty times.

struct Entry {
    int value = 0;
    std::string_view word;
    std::string_view word_of_value;
    int value_of_word = 0;
};

template <typename Enum>
std::vector<Entry> entries() {
    std::vector<Entry> result;
    for (const auto& [value, word] : names_of<Enum>())
        result.push_back(
            {static_cast<int>(value), word, word_of(value), static_cast<int>(value_of<Enum>(word))});
    return result;
}

void expect_read_back(const std::vector<Entry>& entries) {
    std::set<std::string_view> words;
    std::set<int> values;
    for (const Entry& entry : entries) {
        EXPECT_EQ(entry.word_of_value, entry.word);
        EXPECT_EQ(entry.value_of_word, entry.value);
        EXPECT_TRUE(words.insert(entry.word).second) << entry.word;
        EXPECT_TRUE(values.insert(entry.value).second) << entry.word;
        EXPECT_FALSE(entry.word.empty());
    }
    // From the first to the last without a gap.
    EXPECT_EQ(*values.begin(), 0);
    EXPECT_EQ(static_cast<std::size_t>(*values.rbegin()) + 1, values.size());
}

TYPED_TEST(EnumNames, ReadBack) {
    const std::vector<Entry> known = entries<TypeParam>();
    expect_read_back(known);
    std::vector<int> listed, named;
    for (const TypeParam value : values_of<TypeParam>()) listed.push_back(static_cast<int>(value));
    for (const Entry& entry : known) named.push_back(entry.value);
    EXPECT_EQ(listed, named);
}

void expect_unknown(const std::string& text, const std::function<void()>& look_up, std::string_view what,
                    const std::string& words, const std::vector<Entry>& entries) {
    try {
        look_up();
        ADD_FAILURE() << "accepted '" << text << "'";
    } catch (const InputError& error) {
        EXPECT_EQ(error.asked(), "find the " + std::string(what) + " '" + text + "'");
        EXPECT_EQ(error.found(), "it is not known");
        EXPECT_EQ(error.remedy(), "use " + words);
        for (const Entry& entry : entries)
            EXPECT_NE(error.remedy().find(entry.word), std::string::npos) << entry.word;
    }
}

TYPED_TEST(EnumNames, UnknownWordsListTheKnownOnes) {
    const std::vector<Entry> known = entries<TypeParam>();
    for (const std::string& text :
         {std::string(), std::string("Unknown"), std::string(known.front().word) + " "}) {
        EXPECT_FALSE(find_value<TypeParam>(text)) << text;
        expect_unknown(
            text, [&] { static_cast<void>(value_of<TypeParam>(text)); }, Names<TypeParam>::what,
            words_of<TypeParam>(), known);
    }
}

TYPED_TEST(EnumNames, OtherValuesHaveNoWord) {
    EXPECT_THROW(static_cast<void>(word_of(static_cast<TypeParam>(names_of<TypeParam>().size()))),
                 InputError);
}

TEST(Words, AreTheWordsOfThePublicFunctions) {
    EXPECT_EQ(name(ColourSpace::srgb), "srgb");
    EXPECT_EQ(name(PixelType::float32), "float");
    EXPECT_EQ(name(DeviceType::accelerator), "accelerator");
    EXPECT_EQ(name(NeighbourhoodKind::unilateral), "unilateral");
    EXPECT_EQ(name(ModelKind::pmrf3d), "3d-pmrf");
    EXPECT_EQ(name(Estimator::random_decrement), "rd");
    EXPECT_EQ(name(Estimator::spectral_root), "sr");
    EXPECT_EQ(name(NoiseForm::diagonal), "diagonal");
    EXPECT_EQ(name(Metric::l2), "l2");
    EXPECT_EQ(name(EstimatorChoice::automatic), "auto");
    EXPECT_EQ(name(GainMode::none), "none");
    EXPECT_EQ(name(MarginalMode::match), "match");
    EXPECT_EQ(name(JobStatus::refused), "refused");
    EXPECT_EQ(words_of<Metric>("|"), "max|l1|l2");
    EXPECT_EQ(words_of<Metric>(", ", " or "), "max, l1 or l2");
    try {
        static_cast<void>(metric("L2"));
        ADD_FAILURE();
    } catch (const InputError& error) {
        EXPECT_STREQ(error.what(), "find the metric 'L2': it is not known; use max, l1, l2");
    }
}

TEST(Words, DimensionsAndFamiliesAreThoseOfTheWords) {
    for (const auto& [kind, word] : names_of<ModelKind>()) {
        EXPECT_EQ(is_2d(kind), word.starts_with("2d-")) << word;
        EXPECT_NE(is_2d(kind), word.starts_with("3d-")) << word;
    }
    EXPECT_EQ(family(ModelKind::car2d), Family::car);
    EXPECT_EQ(family(ModelKind::ma3d), Family::ma);
    EXPECT_EQ(family(ModelKind::msar2d), Family::msar);
    EXPECT_EQ(family(ModelKind::mmrf3d), Family::mmrf);
    EXPECT_EQ(family(ModelKind::pmrf2d), Family::pmrf);
}

}  // namespace
}  // namespace btfield

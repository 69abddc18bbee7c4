// Long work can be ended: by a StopScope, and by what `progress` throws, which is called in the caller's
// thread.

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <thread>
#include <utility>
#include <vector>

#include "btfield/compound.hpp"
#include "btfield/criteria.hpp"
#include "btfield/error.hpp"
#include "btfield/fit.hpp"
#include "btfield/image_io.hpp"
#include "btfield/memd.hpp"
#include "btfield/progress.hpp"
#include "btfield/roller.hpp"
#include "btfield/stop.hpp"
#include "btfield/synthesis.hpp"
#include "tests/device_cases.hpp"
#include "tests/example_model.hpp"
#include "tests/places.hpp"

namespace btfield {
namespace {

struct Work {
    std::string name;
    std::function<void()> run;
};

Image cork() {
    return read_picture(test::data_folder() + "/cork.png", Crop{0, 0, 128, 128}).image;
}

FitOptions likelihood_fit() {
    FitOptions options;
    options.model = ModelKind::msar3d;
    options.order = 3;
    options.levels = 2;
    options.estimator = EstimatorChoice::maximum_likelihood;
    return options;
}

const CompoundModel& test_compound() {
    static const CompoundModel model = fit_compound(test::default_device(), cork());
    return model;
}

class Stopping : public testing::Test {
  protected:
    /// Everything that may take long.
    std::vector<Work> work() {
        const std::vector<std::uint64_t> seeds(static_cast<std::size_t>(3 * synthesiser_.batch()), 1);
        return {
            {"fit", [&] { static_cast<void>(fit(device_, picture_, likelihood_fit())); }},
            {"fit_all",
             [&] {
                 const std::vector<FitOptions> options(2, likelihood_fit());
                 static_cast<void>(Analysis(device_, picture_).fit_all(options));
             }},
            {"synthesis", [&, seeds] { static_cast<void>(synthesiser_.synthesise(seeds)); }},
            {"memd", [&] { static_cast<void>(memd(device_, picture_, other_)); }},
            {"memd on the device",
             [&] {
                 MemdOptions options;
                 options.search = MemdSearch::exhaustive;
                 static_cast<void>(memd(device_, picture_, other_, options));
             }},
            {"kappa", [&] { static_cast<void>(kappa(picture_)); }},
            {"compare", [&] { static_cast<void>(compare(picture_, other_)); }},
            {"quilt",
             [&] {
                 static_cast<void>(roller_.quilt({160, 160}, {}));
             }},
            {"tiles",
             [&] {
                 static_cast<void>(roller_.tiles(3, Size{48, 48}, {}));
             }},
            {"compound fit", [&] { static_cast<void>(fit_compound(device_, picture_)); }},
            {"control field", [&] { static_cast<void>(compound_.control_field(3)); }},
            {"compound texture", [&] { static_cast<void>(compound_.synthesise(3)); }},
        };
    }

    Device device_;
    Image picture_ = cork();
    Image other_ = test::random_image({128, 128}, 3, 0.5F);
    Synthesiser synthesiser_{device_, test::example_model(ModelKind::car3d, 3, 2), {64, 64}};
    Roller roller_{device_, {&picture_, 1}};
    CompoundSynthesiser compound_{device_, test_compound(), {96, 128}, true};
};

TEST_F(Stopping, AllLongWorkAsks) {
    for (const auto& [name, run] : work()) {
        SCOPED_TRACE(name);
        const StopScope scope([] { return true; });
        EXPECT_THROW(run(), Stopped);
    }
}

TEST_F(Stopping, WorkIsEndedInTheMiddleAndCanBeAskedForAgain) {
    for (const auto& [name, run] : work()) {
        SCOPED_TRACE(name);
        run();  // what is kept from a first run is not asked about again
        std::atomic<int> asked{0};
        {
            const StopScope scope([&] {
                ++asked;
                return false;
            });
            run();
        }
        ASSERT_GT(asked.load(), 1);
        const int half = asked.load() / 2;
        asked = 0;
        {
            const StopScope scope([&] { return ++asked > half; });
            EXPECT_THROW(run(), Stopped);
        }
        EXPECT_NO_THROW(run());
    }
}

TEST_F(Stopping, AFitStopsWithinALevel) {
    // One level, one estimate: whoever waits for it does not wait for its end.
    FitOptions options = likelihood_fit();
    options.levels = 1;
    std::atomic<int> asked{0};
    const StopScope scope([&] {
        ++asked;
        return false;
    });
    static_cast<void>(fit(device_, picture_, options));
    EXPECT_GT(asked.load(), 100);
}

/// A stage and the shares of it that were told.
using ToldStages = std::vector<std::pair<std::string, std::vector<double>>>;

ToldStages told_stages(const std::function<void()>& run) {
    ToldStages told;
    const ProgressScope scope([&](std::string_view stage, double share) {
        if (told.empty() || told.back().first != stage) told.emplace_back(stage, std::vector<double>{});
        told.back().second.push_back(share);
    });
    run();
    return told;
}

void expect_stages(const ToldStages& told, const std::vector<std::string>& names) {
    std::vector<std::string> found;
    for (const auto& [name, shares] : told) {
        found.push_back(name);
        EXPECT_EQ(shares.front(), 0.0) << name;
        EXPECT_TRUE(std::ranges::is_sorted(shares)) << name;
        EXPECT_LE(shares.back(), 1.0 + 1e-12) << name;
    }
    EXPECT_EQ(found, names);
}

TEST_F(Stopping, StagesAreToldWhileTheyGoOn) {
    expect_stages(told_stages([&] { static_cast<void>(fit(device_, picture_, likelihood_fit())); }),
                  {"planes", "pyramid", "lag covariances", "fit", "gains"});
    CompoundOptions compound;
    compound.local.model = ModelKind::msar3d;
    compound.local.order = 2;
    const ToldStages told =
        told_stages([&] { static_cast<void>(fit_compound(device_, picture_, compound)); });
    expect_stages(told, {"control field", "conditional mean", "regions"});
    const std::vector<double>& regions = told.back().second;
    // Nowhere is much of it done at once, and its end is not told long before it is reached.
    EXPECT_GT(regions.size(), 30U);
    EXPECT_GT(regions.back(), 0.9);
    for (std::size_t n = 1; n < regions.size(); ++n) EXPECT_LT(regions[n] - regions[n - 1], 0.2);
    expect_stages(told_stages([&] { static_cast<void>(roller_.tile(Size{48, 48}, {})); }), {"tile"});
    expect_stages(told_stages([&] { static_cast<void>(roller_.quilt({160, 160}, {})); }), {"quilt"});
}

TEST_F(Stopping, ACompoundFitStopsWithinARegion) {
    // One region, one level: whoever waits for it does not wait for the end of its likelihood.
    CompoundOptions options;
    options.clusters.regions = 1;
    options.local.model = ModelKind::msar3d;
    options.local.order = 3;
    options.local.levels = 1;
    options.local.estimator = EstimatorChoice::maximum_likelihood;
    bool regions = false;
    std::atomic<int> asked{0};
    const ProgressScope progress([&](std::string_view stage, double) { regions = stage == "regions"; });
    const StopScope scope([&] {
        if (regions) ++asked;
        return asked > 100;
    });
    EXPECT_THROW(static_cast<void>(fit_compound(device_, picture_, options)), Stopped);
}

/// What `progress` throws to end work.
struct Cancelled {};

TEST_F(Stopping, ProgressIsOfTheCallersThreadAndMayThrow) {
    const std::thread::id caller = std::this_thread::get_id();
    int calls = 0, most = 1 << 20;
    double last = 0.0;
    const auto count = [&] {
        EXPECT_EQ(std::this_thread::get_id(), caller);
        if (++calls >= most) throw Cancelled{};
    };
    const auto share = [&](double done) {
        EXPECT_GE(done, last);
        EXPECT_LE(done, 1.0);
        last = done;
        count();
    };
    const auto stage = [&](std::string_view, double) { count(); };
    FitOptions fitting = likelihood_fit();
    fitting.progress = stage;
    MemdOptions searching;
    searching.progress = share;
    MemdOptions on_device = searching;
    on_device.search = MemdSearch::exhaustive;
    RollerOptions rolling;
    rolling.progress = share;
    CompoundOptions compound;
    compound.progress = stage;
    const std::vector<std::uint64_t> seeds(static_cast<std::size_t>(3 * synthesiser_.batch()), 1);
    const std::vector<Work> all{
        {"fit", [&] { static_cast<void>(fit(device_, picture_, fitting)); }},
        {"synthesis", [&] { static_cast<void>(synthesiser_.synthesise(seeds, share)); }},
        {"memd", [&] { static_cast<void>(memd(device_, picture_, other_, searching)); }},
        {"memd on the device", [&] { static_cast<void>(memd(device_, picture_, other_, on_device)); }},
        {"quilt",
         [&] {
             static_cast<void>(roller_.quilt({160, 160}, rolling));
         }},
        {"compound fit", [&] { static_cast<void>(fit_compound(device_, picture_, compound)); }},
        {"control field", [&] { static_cast<void>(compound_.control_field(3, share)); }},
        {"compound texture", [&] { static_cast<void>(compound_.synthesise(3, share)); }},
    };
    for (const auto& [name, run] : all) {
        SCOPED_TRACE(name);
        calls = 0;
        last = 0.0;
        most = 1 << 20;
        run();
        ASSERT_GT(calls, 1);
        most = calls;
        calls = 0;
        last = 0.0;
        EXPECT_THROW(run(), Cancelled);
        EXPECT_EQ(calls, most);
        last = 0.0;
        most = 1 << 20;
        EXPECT_NO_THROW(run());
    }
}

TEST_F(Stopping, ADeviceThatWasStoppedGivesTheSameTextures) {
    const Image before = synthesiser_.synthesise(9);
    for (const auto& [name, run] : work()) {
        std::atomic<int> asked{0};
        const StopScope scope([&] { return ++asked > 1; });
        EXPECT_THROW(run(), Stopped) << name;
    }
    const Image after = synthesiser_.synthesise(9);
    EXPECT_TRUE(std::equal(before.values().begin(), before.values().end(), after.values().begin()));
}

}  // namespace
}  // namespace btfield

// The thread contract of docs/library.md: one device, and whatever was made with it, used from several
// threads at a time gives to the bit what one thread alone gives.

#include <gtest/gtest.h>

#include <atomic>
#include <exception>
#include <functional>
#include <span>
#include <string>
#include <thread>
#include <vector>

#include "btfield/compound.hpp"
#include "btfield/fit.hpp"
#include "btfield/image_io.hpp"
#include "btfield/memd.hpp"
#include "btfield/pyramid.hpp"
#include "btfield/roller.hpp"
#include "btfield/synthesis.hpp"
#include "tests/device_cases.hpp"
#include "tests/example_model.hpp"
#include "tests/places.hpp"

namespace btfield {
namespace {

constexpr int threads = 4;

/// work(number of the thread) in all of them, begun at once; the first exception is passed on.
void in_threads(const std::function<void(int)>& work) {
    std::atomic<int> ready{0};
    std::vector<std::exception_ptr> failures(threads);
    {
        std::vector<std::jthread> crew;
        for (int t = 0; t < threads; ++t)
            crew.emplace_back([&, t] {
                ++ready;
                while (ready < threads) std::this_thread::yield();
                try {
                    work(t);
                } catch (...) {
                    failures[static_cast<std::size_t>(t)] = std::current_exception();
                }
            });
    }
    for (const std::exception_ptr& failure : failures)
        if (failure) std::rethrow_exception(failure);
}

bool same(const Image& a, const Image& b) {
    return a.size() == b.size() && std::equal(a.values().begin(), a.values().end(), b.values().begin());
}

/// Of three levels, three planes and marginals: transforms, pyramid, noise and the planes' restoring.
TextureModel grown_model() {
    return test::example_model(ModelKind::car3d, 3, 3, NoiseForm::full, false, true);
}

constexpr Size grown_size{128, 128};

/// Textures of seeds 0, 1, …, by one thread on a device of its own.
std::vector<Image> alone(const TextureModel& model, int count, const DeviceOptions& device_options = {}) {
    Device device({}, device_options);
    Synthesiser synthesiser(device, model, grown_size);
    std::vector<Image> images;
    for (int seed = 0; seed < count; ++seed)
        images.push_back(synthesiser.synthesise(static_cast<std::uint64_t>(seed)));
    return images;
}

/// How many of `count` textures, begun with another seed in each thread, differ from those of one thread.
int wrong(Synthesiser& synthesiser, int thread, const std::vector<Image>& expected) {
    int sum = 0;
    const auto count = static_cast<int>(expected.size());
    for (int i = 0; i < count; ++i) {
        const int seed = (i + thread * count / threads) % count;
        if (!same(synthesiser.synthesise(static_cast<std::uint64_t>(seed)),
                  expected[static_cast<std::size_t>(seed)]))
            ++sum;
    }
    return sum;
}

TEST(ManyThreads, OneSynthesiser) {
    const TextureModel model = grown_model();
    const std::vector<Image> expected = alone(model, 50);
    Device device;
    Synthesiser synthesiser(device, model, grown_size);
    std::atomic<int> sum{0};
    in_threads([&](int t) { sum += wrong(synthesiser, t, expected); });
    EXPECT_EQ(sum.load(), 0) << "of " << threads * 50;
}

TEST(ManyThreads, LargeTexturesOfOneSynthesiser) {
    // Large enough to be written to the pictures' own memory.
    const TextureModel model = grown_model();
    const Size size{448, 432};
    const std::vector<std::uint64_t> seeds{0, 1, 2, 3, 4};
    Device device;
    Synthesiser synthesiser(device, model, size);
    const std::vector<Image> expected = synthesiser.synthesise(seeds);
    std::atomic<int> sum{0};
    in_threads([&](int t) {
        const std::size_t first = t % 2 == 0 ? 0 : 1;
        for (int repeat = 0; repeat < 4; ++repeat) {
            const std::vector<Image> images = synthesiser.synthesise(std::span(seeds).subspan(first));
            for (std::size_t i = 0; i < images.size(); ++i)
                sum += same(images[i], expected[i + first]) ? 0 : 1;
            sum += same(synthesiser.synthesise(3), expected[3]) ? 0 : 1;
        }
    });
    EXPECT_EQ(sum.load(), 0);
}

TEST(ManyThreads, OneDeviceAndSynthesisersOfTheirOwn) {
    const TextureModel model = grown_model();
    const std::vector<Image> expected = alone(model, 50);
    Device device;
    std::atomic<int> sum{0};
    in_threads([&](int t) {
        Synthesiser synthesiser(device, model, grown_size);
        sum += wrong(synthesiser, t, expected);
    });
    EXPECT_EQ(sum.load(), 0) << "of " << threads * 50;
}

TEST(ManyThreads, DevicesOfTheirOwn) {
    const TextureModel model = grown_model();
    const std::vector<Image> expected = alone(model, 50);
    std::atomic<int> sum{0};
    in_threads([&](int t) {
        Device device;
        Synthesiser synthesiser(device, model, grown_size);
        sum += wrong(synthesiser, t, expected);
    });
    EXPECT_EQ(sum.load(), 0) << "of " << threads * 50;
}

TEST(ManyThreads, SynthesisersComeAndGoWhileOthersWork) {
    // Setting one up rehearses its launches: nobody else's may be cut short by that.
    const TextureModel model = grown_model();
    const std::vector<Image> expected = alone(model, 4);
    Device device;
    std::atomic<int> sum{0};
    in_threads([&](int t) {
        for (int i = 0; i < 10; ++i) {
            Synthesiser synthesiser(device, model, grown_size);
            sum += wrong(synthesiser, t, expected);
        }
    });
    EXPECT_EQ(sum.load(), 0) << "of " << threads * 40;
}

TEST(ManyThreads, RoutesSideBySide) {
    // Models and methods that launch the same kernels with other arguments.
    struct Case {
        TextureModel model;
        SynthesisOptions options;
    };
    std::vector<Case> cases(threads);
    cases[0].model = test::example_model(ModelKind::car3d, 3, 2);
    cases[0].options.method = SynthesisMethod::raster;
    cases[1].model = test::example_model(ModelKind::ma3d, 3, 2);
    cases[1].options.noise_domain = NoiseDomain::spatial;
    cases[2].model = test::example_model(ModelKind::msar3d, 3, 2);
    cases[3].model = test::example_model(ModelKind::car3d, 3, 2);
    Device device;
    const auto textures = [&](const Case& of) {
        Synthesiser synthesiser(device, of.model, {96, 80}, of.options);
        const std::vector<std::uint64_t> seeds{1, 2, 3, 4, 5, 6, 7};
        return synthesiser.synthesise(seeds);
    };
    std::vector<std::vector<Image>> expected;
    for (const Case& each : cases) expected.push_back(textures(each));
    for (int repeat = 0; repeat < 4; ++repeat)
        in_threads([&](int t) {
            const std::vector<Image> images = textures(cases[static_cast<std::size_t>(t)]);
            for (std::size_t i = 0; i < images.size(); ++i)
                EXPECT_TRUE(same(images[i], expected[static_cast<std::size_t>(t)][i])) << t << ", " << i;
        });
}

TEST(ManyThreadsLong, TransformsByTheLibrary) {
    DeviceOptions options;
    options.fft = FftBackend::clfft;
    const TextureModel model = test::example_model(ModelKind::car3d, 3, 1);
    const auto grow = [&](Device& device) {
        Synthesiser synthesiser(device, model, {32, 32});
        std::vector<Image> images;
        for (std::uint64_t seed = 0; seed < 20; ++seed) images.push_back(synthesiser.synthesise(seed));
        return images;
    };
    Device device({}, options);
    const std::vector<Image> expected = grow(device);
    in_threads([&](int) {
        const std::vector<Image> images = grow(device);
        for (std::size_t i = 0; i < images.size(); ++i) EXPECT_TRUE(same(images[i], expected[i])) << i;
    });
}

TEST(ManyThreads, KernelsThatNobodyBuiltYet) {
    const TextureModel model = grown_model();
    const std::vector<Image> expected = alone(model, 2);
    DeviceOptions options;
    options.disk_cache = false;
    Device device({}, options);
    std::atomic<int> sum{0};
    in_threads([&](int t) {
        Synthesiser synthesiser(device, model, grown_size);
        sum += wrong(synthesiser, t, expected);
    });
    EXPECT_EQ(sum.load(), 0);
}

TEST(ManyThreads, LaunchesAreCountedAndTimedOnce) {
    DeviceOptions options;
    options.profile = true;
    Device device({}, options);
    const TextureModel model = grown_model();
    std::vector<std::unique_ptr<Synthesiser>> synthesisers;
    for (int t = 0; t < threads; ++t)
        synthesisers.push_back(std::make_unique<Synthesiser>(device, model, grown_size));
    // Factors are kept, in launches of their own, before a synthesiser's third draw.
    for (const auto& synthesiser : synthesisers)
        for (std::uint64_t seed = 0; seed < 3; ++seed) static_cast<void>(synthesiser->synthesise(seed));
    static_cast<void>(device.take_profile());
    std::uint64_t before = device.launch_count();
    static_cast<void>(synthesisers[0]->synthesise(0));
    const std::uint64_t each = device.launch_count() - before;
    static_cast<void>(device.take_profile());
    before = device.launch_count();
    in_threads([&](int t) {
        for (std::uint64_t seed = 0; seed < 10; ++seed)
            static_cast<void>(synthesisers[static_cast<std::size_t>(t)]->synthesise(seed));
    });
    EXPECT_EQ(device.launch_count() - before, each * 10 * threads);
    std::uint64_t timed = 0;
    for (const ProfileEntry& entry : device.take_profile())
        timed += static_cast<std::uint64_t>(entry.launches);
    EXPECT_EQ(timed, each * 10 * threads);
}

Image cork() {
    return read_picture(test::data_folder() + "/cork.png", Crop{0, 0, 96, 96}).image;
}

std::vector<double> numbers(std::span<const float> values) {
    return {values.begin(), values.end()};
}

std::vector<double> numbers(const TextureModel& model) {
    std::vector<double> all = model.mean;
    for (const LevelModel& level : model.levels) {
        all.push_back(level.gain);
        for (const Model& each : level.models) {
            const LinearField& field = linear_field(each);
            all.insert(all.end(), field.coefficients.begin(), field.coefficients.end());
            all.insert(all.end(), field.noise_covariance.begin(), field.noise_covariance.end());
        }
    }
    return all;
}

std::vector<double> numbers(const SourceMap& map) {
    std::vector<double> all{map.cut_cost, map.seam};
    all.insert(all.end(), map.source.begin(), map.source.end());
    return all;
}

FitOptions small_fit(ModelKind kind) {
    FitOptions options;
    options.model = kind;
    options.order = 2;
    options.levels = 2;
    return options;
}

RollerOptions small_roll(std::uint64_t seed) {
    RollerOptions options;
    options.seed = seed;
    options.block = 24;
    return options;
}

MemdOptions device_search() {
    MemdOptions options;
    options.search = MemdSearch::exhaustive;
    return options;
}

CompoundModel small_compound(Device& device) {
    CompoundOptions options;
    options.clusters.regions = 2;
    options.local.levels = 2;
    return fit_compound(device, cork(), options);
}

/// Everything that takes a device.
using Work = std::function<std::vector<double>(Device&)>;
std::vector<Work> all_work() {
    return {
        [](Device& device) { return numbers(fit(device, cork(), small_fit(ModelKind::car3d))); },
        [](Device& device) { return numbers(fit(device, cork(), small_fit(ModelKind::msar2d))); },
        [](Device& device) {
            const Image image = cork();
            return std::vector{memd(device, image, test::random_image({64, 64}, 3), device_search()).memd};
        },
        [](Device& device) {
            const Image image = cork();
            Roller roller(device, {&image, 1});
            return numbers(roller.quilt({120, 100}, small_roll(3)));
        },
        [](Device& device) {
            const CompoundModel model = small_compound(device);
            CompoundSynthesiser synthesiser(device, model, {64, 64});
            return numbers(synthesiser.synthesise(5).values());
        },
        [](Device& device) {
            const std::vector<Image> levels = decompose(device, cork(), 3, 2);
            return numbers(collapse(device, levels, 2).values());
        },
    };
}

TEST(ManyThreads, AllThatTakesADeviceSideBySide) {
    const std::vector<Work> work = all_work();
    std::vector<std::vector<double>> expected;
    {
        Device device;
        for (const Work& each : work) expected.push_back(each(device));
    }
    Device device;
    in_threads([&](int t) {
        for (std::size_t i = 0; i < work.size(); ++i) {
            const std::size_t n = (i + static_cast<std::size_t>(t)) % work.size();
            EXPECT_EQ(work[n](device), expected[n]) << "work " << n;
        }
    });
}

TEST(ManyThreads, OneOfEachObject) {
    Device device;
    const Image image = cork();
    Analysis analysis(device, image);
    Roller roller(device, {&image, 1});
    MemdReference reference(device, image, device_search());
    const CompoundModel model = small_compound(device);
    CompoundSynthesiser synthesiser(device, model, {64, 64});
    const std::vector<std::function<std::vector<double>()>> work{
        [&] { return numbers(analysis.fit(small_fit(ModelKind::car3d))); },
        [&] { return numbers(analysis.fit(small_fit(ModelKind::ma2d))); },
        [&] {
            return numbers(roller.quilt({100, 120}, small_roll(1)));
        },
        [&] {
            return numbers(roller.tiles(3, Size{32, 32}, {}).back());
        },
        [&] {
            return std::vector{reference(test::random_image({64, 64}, 3)).memd};
        },
        [&] { return numbers(synthesiser.synthesise(7).values()); }};
    std::vector<std::vector<double>> results[threads];
    in_threads([&](int t) {
        results[t].resize(work.size());
        for (std::size_t i = 0; i < work.size(); ++i) {
            const std::size_t n = (i + static_cast<std::size_t>(t)) % work.size();
            results[t][n] = work[n]();
        }
    });
    for (std::size_t n = 0; n < work.size(); ++n) {
        const std::vector<double> expected = work[n]();
        for (int t = 0; t < threads; ++t)
            EXPECT_EQ(results[t][n], expected) << "thread " << t << ", work " << n;
    }
}

}  // namespace
}  // namespace btfield

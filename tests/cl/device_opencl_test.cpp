#include "btfield/device_opencl.hpp"

#include <gtest/gtest.h>

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "btfield/compound.hpp"
#include "btfield/error.hpp"
#include "btfield/image_io.hpp"
#include "btfield/synthesis.hpp"
#include "host/cl/api.hpp"
#include "tests/device_cases.hpp"
#include "tests/example_model.hpp"
#include "tests/places.hpp"

namespace btfield {
namespace {

/// What a program has before it knows of btfield.
class DeviceOfAProgram : public testing::Test {
  protected:
    DeviceOfAProgram() {
        const OpenClHandles handles = opencl_handles(test::default_device());
        device_ = cl::Device(handles.device, true);
        context_ = cl::Context(device_);
        queue_ = cl::CommandQueue(context_, device_);
    }
    [[nodiscard]] OpenClHandles handles() const { return {context_(), device_(), queue_()}; }
    [[nodiscard]] cl::Buffer memory(std::size_t floats, cl_mem_flags flags = CL_MEM_READ_WRITE) const {
        return {context_, flags, floats * sizeof(float)};
    }
    [[nodiscard]] std::vector<float> values(const cl::Buffer& buffer, std::size_t floats) const {
        std::vector<float> result(floats);
        queue_.enqueueReadBuffer(buffer, CL_TRUE, 0, floats * sizeof(float), result.data());
        return result;
    }
    cl::Device device_;
    cl::Context context_;
    cl::CommandQueue queue_;
};

std::vector<float> flat(const std::vector<Image>& images) {
    std::vector<float> all;
    for (const Image& image : images) all.insert(all.end(), image.values().begin(), image.values().end());
    return all;
}

TEST_F(DeviceOfAProgram, ComputesWhatADeviceOfItsOwnDoes) {
    const TextureModel model = test::example_model(ModelKind::car3d, 3, 2);
    const Image expected = Synthesiser(test::default_device(), model, {64, 48}).synthesise(3);
    Device device = device_of(handles());
    EXPECT_EQ(device.info().name, test::default_device().info().name);
    EXPECT_EQ(device.info().platform_index, test::default_device().info().platform_index);
    const Image image = Synthesiser(device, model, {64, 48}).synthesise(3);
    EXPECT_TRUE(std::equal(image.values().begin(), image.values().end(), expected.values().begin()));
}

TEST_F(DeviceOfAProgram, HandlesAreRetainedWhileItLives) {
    const cl::Buffer buffer = memory(16);
    const cl_uint context = context_.getInfo<CL_CONTEXT_REFERENCE_COUNT>(),
                  queue = queue_.getInfo<CL_QUEUE_REFERENCE_COUNT>(),
                  mem = buffer.getInfo<CL_MEM_REFERENCE_COUNT>();
    {
        Device device = device_of(handles());
        EXPECT_GT(context_.getInfo<CL_CONTEXT_REFERENCE_COUNT>(), context);
        EXPECT_GT(queue_.getInfo<CL_QUEUE_REFERENCE_COUNT>(), queue);
        EXPECT_EQ(opencl_handles(device).context, context_());
        EXPECT_EQ(opencl_handles(device).device, device_());
        EXPECT_EQ(opencl_handles(device).queue, queue_());
        const DeviceMemory target = device_memory(device, buffer(), 8);
        const DeviceMemory copy = target;
        EXPECT_EQ(copy.bytes(), 56U);
        EXPECT_EQ(buffer.getInfo<CL_MEM_REFERENCE_COUNT>(), mem + 1);
    }
    EXPECT_EQ(context_.getInfo<CL_CONTEXT_REFERENCE_COUNT>(), context);
    EXPECT_EQ(queue_.getInfo<CL_QUEUE_REFERENCE_COUNT>(), queue);
    EXPECT_EQ(buffer.getInfo<CL_MEM_REFERENCE_COUNT>(), mem);
    // And still works.
    EXPECT_EQ(values(memory(4), 4).size(), 4U);
}

TEST_F(DeviceOfAProgram, MakesAQueueWhereThereIsNone) {
    Device device = device_of({context_(), device_(), nullptr});
    EXPECT_NE(opencl_handles(device).queue, nullptr);
    EXPECT_NE(opencl_handles(device).queue, queue_());
}

TEST_F(DeviceOfAProgram, TexturesAreLeftInItsMemory) {
    const TextureModel model = test::example_model(ModelKind::car3d, 3, 3, NoiseForm::full, false, true);
    Device device = device_of(handles());
    const std::vector<std::uint64_t> seeds{4, 5, 6};
    // Of a lattice of its own, of a larger one that is cropped, and with a raster's margins.
    for (const auto& [size, method] :
         {std::pair{Size{64, 48}, SynthesisMethod::torus}, std::pair{Size{67, 45}, SynthesisMethod::torus},
          std::pair{Size{40, 50}, SynthesisMethod::raster}}) {
        SCOPED_TRACE(test::text(size));
        SynthesisOptions options;
        options.method = method;
        Synthesiser synthesiser(device, model, size, options);
        const std::vector<float> expected = flat(synthesiser.synthesise(seeds));
        constexpr std::size_t before = 5, after = 3;
        const cl::Buffer buffer = memory(before + expected.size() + after);
        queue_.enqueueFillBuffer(buffer, -7.0F, 0, (before + expected.size() + after) * sizeof(float));
        synthesiser.synthesise_to(seeds, device_memory(device, buffer(), before * sizeof(float)));
        // No wait in between: the queue is in order.
        const std::vector<float> all = values(buffer, before + expected.size() + after);
        EXPECT_TRUE(std::equal(expected.begin(), expected.end(), all.begin() + before));
        for (std::size_t n = 0; n < before; ++n) EXPECT_EQ(all[n], -7.0F);
        for (std::size_t n = before + expected.size(); n < all.size(); ++n) EXPECT_EQ(all[n], -7.0F);
    }
}

/// Of two eigenplanes and three planes.
TextureModel model_of_fewer_planes() {
    TextureModel model = test::example_model(ModelKind::car3d, 2, 2, NoiseForm::full, false, true);
    model.planes = 3;
    model.mean = {0.3, 0.4, 0.5};
    model.basis = {3, 2, {0.6, 0.8, 0.0, -0.8, 0.6, 0.0}, model.mean};
    return model;
}

TEST_F(DeviceOfAProgram, LargeTexturesToo) {
    // They fill pictures without copies, one by one and in batches.
    const std::vector<TextureModel> models{
        test::example_model(ModelKind::car3d, 3, 1), test::example_model(ModelKind::car3d, 3, 3),
        test::example_model(ModelKind::car2d, 3, 2),
        test::example_model(ModelKind::msar3d, 3, 3, NoiseForm::full, false, true), model_of_fewer_planes()};
    Device device = device_of(handles());
    const Size size{448, 432};
    for (const TextureModel& model : models) {
        SCOPED_TRACE(&model - models.data());
        Synthesiser synthesiser(device, model, size);
        for (const std::vector<std::uint64_t>& seeds :
             {std::vector<std::uint64_t>{4}, std::vector<std::uint64_t>{4, 5, 6, 7, 8}}) {
            double told = 0.0;
            const std::vector<Image> images = synthesiser.synthesise(seeds, [&](double share) {
                EXPECT_GT(share, told);
                told = share;
            });
            EXPECT_EQ(told, 1.0);
            const std::vector<float> expected = flat(images);
            const cl::Buffer buffer = memory(expected.size());
            synthesiser.synthesise_to(seeds, device_memory(device, buffer()));
            EXPECT_TRUE(values(buffer, expected.size()) == expected) << seeds.size() << " textures";
            EXPECT_EQ(images.back().values().size(), 3 * area(size));
        }
    }
}

TEST_F(DeviceOfAProgram, FinishWaitsForAQueueOfItsOwn) {
    const TextureModel model = test::example_model(ModelKind::car3d, 3, 2);
    Device device = device_of({context_(), device_(), nullptr});
    Synthesiser synthesiser(device, model, {64, 64});
    const std::uint64_t seed = 1;
    const std::vector<float> expected = flat(synthesiser.synthesise({&seed, 1}));
    const cl::Buffer buffer = memory(expected.size());
    synthesiser.synthesise_to({&seed, 1}, device_memory(device, buffer()));
    device.finish();
    EXPECT_EQ(values(buffer, expected.size()), expected);
}

TEST_F(DeviceOfAProgram, CompoundTexturesToo) {
    const Image picture = read_picture(test::data_folder() + "/cork.png", Crop{0, 0, 96, 96}).image;
    Device device = device_of(handles());
    CompoundOptions fit;
    fit.clusters.regions = 2;
    fit.local.levels = 2;
    const CompoundModel model = fit_compound(device, picture, fit);
    for (const Size size : {Size{64, 64}, Size{61, 75}}) {
        CompoundSynthesiser synthesiser(device, model, size);
        const ControlField field = synthesiser.control_field(2);
        const std::vector<float> expected = flat(std::vector{synthesiser.synthesise(2, field)});
        const cl::Buffer buffer = memory(expected.size());
        synthesiser.synthesise_to(2, field, device_memory(device, buffer()));
        EXPECT_EQ(values(buffer, expected.size()), expected) << test::text(size);
        const cl::Buffer small = memory(expected.size() - 1);
        EXPECT_THROW(synthesiser.synthesise_to(2, field, device_memory(device, small())), InputError);
    }
}

template <class Work>
std::string refusal(Work work) {
    try {
        work();
    } catch (const InputError& error) {
        return error.what();
    }
    return "nothing was refused";
}

TEST_F(DeviceOfAProgram, RefusesHandlesThatDoNotBelongTogether) {
    const cl::Context other(device_);
    const cl::CommandQueue others(other, device_);
    const auto of = [&](OpenClHandles handles, const DeviceOptions& options = {}) {
        return refusal([&] { static_cast<void>(device_of(handles, options)); });
    };
    EXPECT_NE(of({nullptr, device_(), nullptr}).find("there is no context"), std::string::npos);
    EXPECT_NE(of({context_(), nullptr, nullptr}).find("there is no device"), std::string::npos);
    EXPECT_NE(of({context_(), device_(), others()}).find("belongs to another context"), std::string::npos);
    DeviceOptions options;
    options.threads = 1;
    EXPECT_NE(of(handles(), options).find("a number of threads is given"), std::string::npos);
    options = {};
    options.profile = true;
    EXPECT_NE(of(handles(), options).find("does not profile"), std::string::npos);
    const cl::CommandQueue profiling(context_, device_, CL_QUEUE_PROFILING_ENABLE);
    Device profiled = device_of({context_(), device_(), profiling()}, options);
    static_cast<void>(Synthesiser(profiled, test::example_model(), {32, 32}).synthesise(1));
    EXPECT_FALSE(profiled.take_profile().empty());
    if (device_.getInfo<CL_DEVICE_QUEUE_PROPERTIES>() & CL_QUEUE_OUT_OF_ORDER_EXEC_MODE_ENABLE) {
        const cl::CommandQueue unordered(context_, device_, CL_QUEUE_OUT_OF_ORDER_EXEC_MODE_ENABLE);
        EXPECT_NE(of({context_(), device_(), unordered()}).find("out of order"), std::string::npos);
    }
}

TEST_F(DeviceOfAProgram, RefusesMemoryThatCannotHoldTheResult) {
    Device device = device_of(handles());
    const auto of = [&](_cl_mem* mem, std::size_t offset = 0) {
        return refusal([&] { static_cast<void>(device_memory(device, mem, offset)); });
    };
    const cl::Buffer own = memory(100), readable = memory(100, CL_MEM_READ_ONLY);
    const cl::Context other(device_);
    const cl::Buffer foreign(other, CL_MEM_READ_WRITE, 400);
    EXPECT_NE(of(nullptr).find("there is none"), std::string::npos);
    EXPECT_NE(of(foreign()).find("another context"), std::string::npos);
    EXPECT_NE(of(readable()).find("cannot be written"), std::string::npos);
    EXPECT_NE(of(own(), 401).find("fewer than the offset of 401"), std::string::npos);

    const TextureModel model = test::example_model(ModelKind::car3d, 3, 1);
    Synthesiser synthesiser(device, model, {8, 8});
    const std::uint64_t seed = 1;
    const auto to = [&](const DeviceMemory& target) {
        return refusal([&] { synthesiser.synthesise_to({&seed, 1}, target); });
    };
    EXPECT_NE(to(device_memory(device, own())).find("takes 768 bytes, the memory holds 400"),
              std::string::npos)
        << to(device_memory(device, own()));
    Device second = device_of({other(), device_(), nullptr});
    EXPECT_NE(to(device_memory(second, foreign())).find("belongs to another context"), std::string::npos);
}

}  // namespace
}  // namespace btfield

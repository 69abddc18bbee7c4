// Texture inside of a program that uses OpenCL itself: opencl_program PICTURE
//
// The program has a context and a queue of its own. btfield works on them and leaves a texture in the
// program's memory, where the program's kernel goes on with it: nothing passes through the host, and nobody
// waits in between. What calls OpenCL links it:
//     g++ -std=c++20 opencl_program.cpp $(pkg-config --cflags --libs btfield) -lOpenCL
#include <cstdint>
#include <cstdio>
#include <stdexcept>
#include <string>
#include <vector>

#define CL_TARGET_OPENCL_VERSION 120
#include <CL/cl.h>

#include "btfield/device_opencl.hpp"
#include "btfield/error.hpp"
#include "btfield/fit.hpp"
#include "btfield/image_io.hpp"
#include "btfield/synthesis.hpp"

namespace {

void require(cl_int code, const char* call) {
    if (code != CL_SUCCESS) throw std::runtime_error(std::string(call) + " failed: " + std::to_string(code));
}

/// What a program that uses OpenCL has anyway.
struct Program {
    cl_device_id device = nullptr;
    cl_context context = nullptr;
    cl_command_queue queue = nullptr;
    cl_kernel darken = nullptr;

    Program() {
        cl_platform_id platform = nullptr;
        require(clGetPlatformIDs(1, &platform, nullptr), "clGetPlatformIDs");
        require(clGetDeviceIDs(platform, CL_DEVICE_TYPE_ALL, 1, &device, nullptr), "clGetDeviceIDs");
        cl_int code = CL_SUCCESS;
        context = clCreateContext(nullptr, 1, &device, nullptr, nullptr, &code);
        require(code, "clCreateContext");
        queue = clCreateCommandQueue(context, device, 0, &code);
        require(code, "clCreateCommandQueue");
        const char* source = "kernel void darken(global float* values) { values[get_global_id(0)] *= 0.5f; }";
        cl_program program = clCreateProgramWithSource(context, 1, &source, nullptr, &code);
        require(code, "clCreateProgramWithSource");
        require(clBuildProgram(program, 1, &device, "", nullptr, nullptr), "clBuildProgram");
        darken = clCreateKernel(program, "darken", &code);
        require(code, "clCreateKernel");
        clReleaseProgram(program);
    }
    ~Program() {
        clReleaseKernel(darken);
        clReleaseCommandQueue(queue);
        clReleaseContext(context);
    }
    Program(const Program&) = delete;
    Program& operator=(const Program&) = delete;
};

double mean(const std::vector<float>& values) {
    double sum = 0.0;
    for (const float value : values) sum += static_cast<double>(value);
    return sum / static_cast<double>(values.size());
}

void run(const char* path) {
    Program own;
    btfield::Device device = btfield::device_of({own.context, own.device, own.queue});
    const btfield::Picture picture = btfield::read_picture(path);
    const btfield::TextureModel model = btfield::fit(device, picture.image);
    const btfield::Size size{256, 512};
    btfield::Synthesiser synthesiser(device, model, size);

    // Planes of float32, one after the other: the program's memory.
    const std::size_t count = static_cast<std::size_t>(model.planes) * area(size);
    cl_int code = CL_SUCCESS;
    cl_mem texture = clCreateBuffer(own.context, CL_MEM_READ_WRITE, count * sizeof(float), nullptr, &code);
    require(code, "clCreateBuffer");
    const std::uint64_t seed = 1;
    synthesiser.synthesise_to({&seed, 1}, btfield::device_memory(device, texture));

    // The queue is in order: this kernel finds the whole texture.
    require(clSetKernelArg(own.darken, 0, sizeof(cl_mem), &texture), "clSetKernelArg");
    require(clEnqueueNDRangeKernel(own.queue, own.darken, 1, nullptr, &count, nullptr, 0, nullptr, nullptr),
            "clEnqueueNDRangeKernel");
    std::vector<float> values(count);
    require(clEnqueueReadBuffer(own.queue, texture, CL_TRUE, 0, count * sizeof(float), values.data(), 0,
                                nullptr, nullptr),
            "clEnqueueReadBuffer");
    clReleaseMemObject(texture);

    const btfield::Image same = synthesiser.synthesise(seed);
    const std::vector<float> expected(same.values().begin(), same.values().end());
    std::printf("mean of the texture %.4f, of the program's half of it %.4f\n", mean(expected), mean(values));
    for (std::size_t n = 0; n < count; ++n)
        if (values[n] != 0.5F * expected[n]) throw std::runtime_error("the two differ");
}

}  // namespace

int main(int count, char** arguments) {
    if (count != 2) {
        std::fprintf(stderr, "usage: opencl_program PICTURE\n");
        return 2;
    }
    try {
        run(arguments[1]);
        return 0;
    } catch (const std::exception& error) {
        std::fprintf(stderr, "%s\n", error.what());
        return 1;
    }
}

#include "host/cl/fft.hpp"

#include <clFFT.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <mutex>
#include <numbers>

#include "host/base/text.hpp"
#include "host/cl/api.hpp"
#include "host/cl/device_impl.hpp"

namespace btfield::detail {

namespace {

bool transformable(int n) {
    for (const int p : {2, 3, 5, 7, 11, 13})
        while (n % p == 0) n /= p;
    return n == 1;
}

/// cos and sin of 2πk/n, k < n.
std::vector<cl_float2> roots_of_unity(int n) {
    std::vector<cl_float2> table(static_cast<std::size_t>(n));
    for (int k = 0; k < n; ++k) {
        const double angle = 2.0 * std::numbers::pi * k / n;
        table[static_cast<std::size_t>(k)] = {
            {static_cast<float>(std::cos(angle)), static_cast<float>(std::sin(angle))}};
    }
    return table;
}

std::size_t groups(int n, int step) {
    return static_cast<std::size_t>((n + step - 1) / step);
}

BuildParameters transform_parameters(const DeviceImpl& device, int length, int sign) {
    int room = 64;
    while (room < length) room *= 4;
    BuildParameters parameters = device.lanes();
    parameters.set("BTFIELD_FFT_ROOM", room).set("BTFIELD_FFT_SIGN", sign);
    parameters.set("BTFIELD_FFT_ODD", (length & (length - 1)) != 0);
    return parameters;
}

/// kernels/cl/fft.cl.
class LaneFft : public Fft {
  public:
    LaneFft(DeviceImpl& device, Size size)
        : size_(size),
          pitch_x_(pitch_of(size.width)),
          roots_x_(device.upload(roots_of_unity(size.width))),
          roots_y_(device.upload(roots_of_unity(size.height))) {}

    void inverse(DeviceImpl& device, Spectrum& spectrum, Buffer& images, int planes) override {
        const Mid mid(device, mid_bytes(planes));
        columns_inverse(device, spectrum.re, spectrum.im, mid, 0, planes, spectrum_floats(size_, 1), 0);
        rows_inverse(device, mid, images, 0, planes);
    }

    [[nodiscard]] bool takes_packed() const override { return true; }

    void inverse_packed(DeviceImpl& device, const Buffer& spectra, int first, const Buffer& images,
                        int count) override {
        const PackedSpectrum packed{size_};
        const int together = planes_together(count);
        const Mid mid(device, mid_bytes(together));
        // In place, an image ends before the spectrum of the next plane begins, which is read later.
        for (int done = 0; done < count; done += together) {
            const int some = std::min(together, count - done);
            columns_inverse(device, spectra, spectra, mid, first + done, some, packed.stride(),
                            packed.imaginary());
            rows_inverse(device, mid, images, done, some);
        }
    }

    void forward(DeviceImpl& device, const Buffer& images, Spectrum& spectrum, int planes) override {
        const int width = device.vector_width();
        Buffer re = device.buffer(mid_bytes(planes)), im = device.buffer(mid_bytes(planes));
        const auto count = static_cast<std::size_t>(planes);
        device.launch(kernel(device, "fft_rows_forward", size_.height, -1),
                      {groups(size_.width, 2 * width), count}, Grain::coarse, rows_work(planes), images, re,
                      im, roots_y_, size_.height, size_.height, size_.width, pitch_x_);
        device.launch(kernel(device, "fft_columns_forward", size_.width, -1),
                      {groups(size_.height / 2 + 1, width), count}, Grain::coarse, columns_work(planes), re,
                      im, spectrum.re, spectrum.im, roots_x_, size_.width, size_.height,
                      spectrum_pitch(size_.height), pitch_x_);
    }

    void correlate(DeviceImpl& device, const Buffer& patches, Size patch, int count, int planes,
                   const Spectrum& sample, Size inside, Buffer& scores) override {
        const int width = device.vector_width();
        const int pitch_in = pitch_of(patch.width);
        const std::size_t in_bytes = sizeof(float) * static_cast<std::size_t>(count) *
                                     static_cast<std::size_t>(planes) * rows() *
                                     static_cast<std::size_t>(pitch_in);
        Buffer in_re = device.buffer(in_bytes), in_im = device.buffer(in_bytes);
        Buffer re = device.buffer(mid_bytes(count)), im = device.buffer(mid_bytes(count));
        const auto patches_count = static_cast<std::size_t>(count);
        device.launch(kernel(device, "fft_rows_forward", size_.height, -1),
                      {groups(patch.width, 2 * width), patches_count * static_cast<std::size_t>(planes)},
                      Grain::coarse, patches, in_re, in_im, roots_y_, size_.height, patch.height, patch.width,
                      pitch_in);
        device.launch(kernel(device, "fft_columns_correlate", size_.width, 1),
                      {patches_count, groups(size_.height / 2 + 1, width)}, Grain::coarse, in_re, in_im,
                      sample.re, sample.im, re, im, roots_x_, size_.width, size_.height, count, planes,
                      patch.width, std::min(size_.width, pitch_of(inside.width)), pitch_in,
                      spectrum_pitch(size_.height), pitch_x_);
        device.launch(kernel(device, "fft_rows_inverse", size_.height, 1),
                      {groups(inside.width, 2 * width), patches_count}, Grain::coarse, re, im, scores,
                      roots_y_, size_.height, size_.width, inside.height, inside.width, pitch_x_, int{0});
    }

    [[nodiscard]] std::size_t scratch_bytes(int planes) const override { return 2 * mid_bytes(planes); }
    [[nodiscard]] std::size_t packed_scratch_bytes(int planes) const override {
        return 2 * mid_bytes(planes_together(planes));
    }

  private:
    /// What lies between the two passes.
    struct Mid {
        Mid(DeviceImpl& device, std::size_t bytes) : re(device.buffer(bytes)), im(device.buffer(bytes)) {}
        Buffer re, im;
    };

    void columns_inverse(DeviceImpl& device, const Buffer& re, const Buffer& im, const Mid& mid, int first,
                         int planes, std::size_t stride, std::size_t imaginary) {
        device.launch(kernel(device, "fft_columns_inverse", size_.width, 1),
                      {groups(size_.height / 2 + 1, device.vector_width()), static_cast<std::size_t>(planes)},
                      Grain::coarse, columns_work(planes), re, im, mid.re, mid.im, roots_x_, size_.width,
                      size_.height, spectrum_pitch(size_.height), pitch_x_, first, std::uint64_t{stride},
                      std::uint64_t{imaginary});
    }
    void rows_inverse(DeviceImpl& device, const Mid& mid, const Buffer& images, int first, int planes) {
        device.launch(kernel(device, "fft_rows_inverse", size_.height, 1),
                      {groups(size_.width, 2 * device.vector_width()), static_cast<std::size_t>(planes)},
                      Grain::coarse, rows_work(planes), mid.re, mid.im, images, roots_y_, size_.height,
                      size_.width, size_.height, size_.width, pitch_x_, first);
    }
    /// As many as leave what lies between the passes in a cache, and have work for many cores.
    [[nodiscard]] int planes_together(int count) const {
        return static_cast<int>(std::clamp<std::size_t>(fft_packed_room / (2 * mid_bytes(1)), 1,
                                                        static_cast<std::size_t>(std::max(count, 1))));
    }
    /// 5 n log2 n operations of a complex transform of n, half as many of a real one.
    [[nodiscard]] LaunchWork columns_work(int planes) const {
        const double frequencies = static_cast<double>(rows()) * size_.width * planes;
        return {.bytes = 4.0 * sizeof(float) * frequencies,
                .operations = 5.0 * std::log2(static_cast<double>(size_.width)) * frequencies};
    }
    [[nodiscard]] LaunchWork rows_work(int planes) const {
        const double frequencies = static_cast<double>(rows()) * size_.width * planes;
        const double values = static_cast<double>(area(size_)) * planes;
        return {.bytes = sizeof(float) * (2.0 * frequencies + values),
                .operations = 2.5 * std::log2(static_cast<double>(size_.height)) * values};
    }
    /// Columns between the passes lie in blocks of 32: BLOCK of kernels/cl/fft.cl.
    static int pitch_of(int columns) { return (columns + 31) / 32 * 32; }
    [[nodiscard]] std::size_t rows() const { return static_cast<std::size_t>(size_.height) / 2 + 1; }
    static Kernel kernel(DeviceImpl& device, const char* name, int length, int sign) {
        return device.kernel("fft", name, transform_parameters(device, length, sign));
    }
    [[nodiscard]] std::size_t mid_bytes(int planes) const {
        return sizeof(float) * static_cast<std::size_t>(planes) * rows() * static_cast<std::size_t>(pitch_x_);
    }

    Size size_;
    int pitch_x_;
    Buffer roots_x_, roots_y_;
};

void check_clfft(clfftStatus status, const char* call, const DeviceImpl& device) {
    if (status != CLFFT_SUCCESS)
        throw DeviceError(std::string("transform with clFFT on device '") + device.info().name + "'",
                          std::string(call) + " failed with " + cl_error_name(static_cast<int>(status)),
                          "report it with the size, or set DeviceOptions::fft to lanes");
}

/// clFFT keeps one table of plans a process; it is set up with the first plan and torn down at exit.
void set_up_clfft(const DeviceImpl& device) {
    struct Library {
        clfftStatus status = CLFFT_SUCCESS;
        Library() {
            clfftSetupData data;
            status = clfftInitSetupData(&data);
            if (status == CLFFT_SUCCESS) status = clfftSetup(&data);
        }
        ~Library() { clfftTeardown(); }
    };
    static const Library library;
    check_clfft(library.status, "clfftSetup", device);
}

/// Held while clFFT is called: its plans share kernels, whose arguments it sets as it enqueues.
std::mutex& clfft_mutex() {
    static std::mutex mutex;
    return mutex;
}

/// clFFT, half along its fastest axis: our ky. Its images come out column by column and are transposed.
class ClFft : public Fft {
  public:
    ClFft(DeviceImpl& device, Size size) : size_(size) { set_up_clfft(device); }
    ~ClFft() override {
        const std::lock_guard lock(clfft_mutex());
        for (auto& [key, plan] : plans_) clfftDestroyPlan(&plan);
    }
    ClFft(const ClFft&) = delete;
    ClFft& operator=(const ClFft&) = delete;

    void inverse(DeviceImpl& device, Spectrum& spectrum, Buffer& images, int planes) override {
        Buffer columns = device.buffer(image_bytes(planes));
        cl_mem in[2] = {(*spectrum.re.handle())(), (*spectrum.im.handle())()};
        cl_mem out[1] = {(*columns.handle())()};
        run(device, planes, CLFFT_BACKWARD, in, out, "clfft inverse");
        device.launch(transpose(device),
                      {groups(size_.width, 16), groups(size_.height, 16), static_cast<std::size_t>(planes)},
                      Grain::coarse, columns, images, size_.height, size_.width);
    }

    void forward(DeviceImpl& device, const Buffer& images, Spectrum& spectrum, int planes) override {
        Buffer columns = device.buffer(image_bytes(planes));
        device.launch(transpose(device),
                      {groups(size_.height, 16), groups(size_.width, 16), static_cast<std::size_t>(planes)},
                      Grain::coarse, images, columns, size_.width, size_.height);
        cl_mem in[1] = {(*columns.handle())()};
        cl_mem out[2] = {(*spectrum.re.handle())(), (*spectrum.im.handle())()};
        run(device, planes, CLFFT_FORWARD, in, out, "clfft forward");
    }

    void correlate(DeviceImpl& device, const Buffer& patches, Size patch, int count, int planes,
                   const Spectrum& sample, Size /*inside*/, Buffer& scores) override {
        const int all = count * planes;
        Buffer images = device.buffer(image_bytes(all));
        device.launch(device.kernel("fft", "spread_patches", transform_parameters(device, 1, 1)),
                      {static_cast<std::size_t>(size_.width), static_cast<std::size_t>(size_.height),
                       static_cast<std::size_t>(all)},
                      Grain::fine, patches, images, size_.height, size_.width, patch.height, patch.width);
        const auto bytes = [&](int of) { return sizeof(float) * spectrum_floats(size_, of); };
        Spectrum spectra{device.buffer(bytes(all)), device.buffer(bytes(all))};
        forward(device, images, spectra, all);
        Spectrum products{device.buffer(bytes(count)), device.buffer(bytes(count))};
        const std::size_t values = spectrum_floats(size_, 1);
        device.launch(
            device.kernel("fft", "correlate_spectra", transform_parameters(device, 1, 1)),
            {groups(static_cast<int>(values), device.vector_width()), static_cast<std::size_t>(count)},
            Grain::fine, sample.re, sample.im, spectra.re, spectra.im, products.re, products.im,
            static_cast<std::uint32_t>(values), planes);
        inverse(device, products, scores, count);
    }

    [[nodiscard]] std::size_t scratch_bytes(int planes) const override {
        return image_bytes(planes) + 2 * sizeof(float) * spectrum_floats(size_, planes);
    }

  private:
    [[nodiscard]] std::size_t image_bytes(int planes) const {
        return sizeof(float) * static_cast<std::size_t>(planes) * area(size_);
    }
    static Kernel transpose(DeviceImpl& device) {
        return device.kernel("fft", "transpose_planes", transform_parameters(device, 1, 1));
    }

    void run(DeviceImpl& device, int planes, clfftDirection direction, cl_mem* in, cl_mem* out,
             const char* label) {
        const std::lock_guard lock(clfft_mutex());
        clfftPlanHandle& handle = plan(device, planes, direction);
        if (device.rehearsing()) return;
        std::size_t bytes = 0;
        check_clfft(clfftGetTmpBufSize(handle, &bytes), "clfftGetTmpBufSize", device);
        Buffer room;
        if (bytes > 0) room = device.buffer(bytes);
        cl_command_queue queue = device.queue()();
        cl::Event event;
        const bool profile = device.options().profile;
        check_clfft(
            clfftEnqueueTransform(handle, direction, 1, &queue, 0, nullptr, profile ? &event() : nullptr, in,
                                  out, room ? (*room.handle())() : nullptr),
            "clfftEnqueueTransform", device);
        device.record(label, event);
    }

    clfftPlanHandle& plan(DeviceImpl& device, int planes, clfftDirection direction) {
        const auto key = std::pair(planes, direction);
        if (const auto found = plans_.find(key); found != plans_.end()) return found->second;
        const std::size_t height = static_cast<std::size_t>(size_.height),
                          width = static_cast<std::size_t>(size_.width);
        const std::size_t lengths[2] = {height, width};
        const auto pitch = static_cast<std::size_t>(spectrum_pitch(size_.height));
        std::size_t half_strides[2] = {1, pitch}, real_strides[2] = {1, height};
        clfftPlanHandle handle{};
        check_clfft(clfftCreateDefaultPlan(&handle, device.context()(), CLFFT_2D, lengths),
                    "clfftCreateDefaultPlan", device);
        clfftPlanHandle& kept = plans_.emplace(key, handle).first->second;
        const bool inverse = direction == CLFFT_BACKWARD;
        const auto set = [&](clfftStatus status, const char* call) { check_clfft(status, call, device); };
        set(clfftSetPlanPrecision(kept, CLFFT_SINGLE), "clfftSetPlanPrecision");
        set(inverse ? clfftSetLayout(kept, CLFFT_HERMITIAN_PLANAR, CLFFT_REAL)
                    : clfftSetLayout(kept, CLFFT_REAL, CLFFT_HERMITIAN_PLANAR),
            "clfftSetLayout");
        set(clfftSetResultLocation(kept, CLFFT_OUTOFPLACE), "clfftSetResultLocation");
        set(clfftSetPlanInStride(kept, CLFFT_2D, inverse ? half_strides : real_strides),
            "clfftSetPlanInStride");
        set(clfftSetPlanOutStride(kept, CLFFT_2D, inverse ? real_strides : half_strides),
            "clfftSetPlanOutStride");
        set(clfftSetPlanDistance(kept, inverse ? pitch * width : height * width,
                                 inverse ? height * width : pitch * width),
            "clfftSetPlanDistance");
        set(clfftSetPlanBatchSize(kept, static_cast<std::size_t>(planes)), "clfftSetPlanBatchSize");
        set(clfftSetPlanScale(kept, direction, 1.0F), "clfftSetPlanScale");
        cl_command_queue queue = device.queue()();
        set(clfftBakePlan(kept, 1, &queue, nullptr, nullptr), "clfftBakePlan");
        return kept;
    }

    Size size_;
    std::map<std::pair<int, clfftDirection>, clfftPlanHandle> plans_;
};

}  // namespace

int next_fft_size(int n) {
    n = std::max(n, 1);
    while (!transformable(n)) ++n;
    return n;
}

FftPlans::FftPlans() = default;
FftPlans::~FftPlans() = default;

FftBackend FftPlans::resolve(const DeviceImpl& device, Size size, FftBackend backend) {
    // clFFT's real transforms need two rows and columns to work with.
    if (size.height < 4 || size.width < 4) return FftBackend::lanes;
    if (backend != FftBackend::automatic) return backend;
    return device.tuning().fft;
}

Fft& FftPlans::plan(DeviceImpl& device, Size size, FftBackend backend) {
    if (size.height < 1 || size.width < 1 || !transformable(size.height) || !transformable(size.width))
        throw DeviceError("plan a " + compact_text_of(size) + " transform",
                          "a side is not a product of 2, 3, 5, 7, 11 and 13",
                          "transform the next larger lattice that is");
    if (size.height > fft_longest_side || size.width > fft_longest_side)
        throw DeviceError("plan a " + compact_text_of(size) + " transform",
                          "sides above " + std::to_string(fft_longest_side) + " pixels are not possible",
                          "work on smaller parts");
    const FftBackend resolved = resolve(device, size, backend);
    const std::lock_guard lock(mutex_);
    std::unique_ptr<Fft>& entry = plans_[{size.height, size.width, resolved}];
    if (!entry) {
        if (resolved == FftBackend::lanes)
            entry = std::make_unique<LaneFft>(device, size);
        else
            entry = std::make_unique<ClFft>(device, size);
    }
    return *entry;
}

}  // namespace btfield::detail

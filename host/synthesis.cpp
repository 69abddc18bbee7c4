#include "btfield/synthesis.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>
#include <string>

#include "btfield/error.hpp"
#include "btfield/pyramid.hpp"
#include "host/planes.hpp"
#include "host/pyramid_stages.hpp"
#include "host/spectral_factors.hpp"

namespace btfield {

namespace {

/// Textures of a batch share launches while what they touch together stays within this much memory: the
/// last-level cache of a CPU, and on a GPU enough to fill it.
constexpr std::size_t cpu_batch_bytes = std::size_t{32} << 20;
constexpr std::size_t gpu_batch_bytes = std::size_t{1} << 30;
constexpr int largest_batch = 64;
constexpr int largest_side = 1 << 20;

/// Part of the device's memory that synthesis may plan with; a CPU device shares it with everything else.
double memory_limit(const Device::Impl& device) {
    return (device.is_cpu() ? 0.7 : 0.9) * static_cast<double>(device.info().memory_bytes);
}

std::string text(Size size) {
    return std::to_string(size.width) + "x" + std::to_string(size.height);
}

/// n^(K−1): what a tileable side is a multiple of. 0 when it exceeds every possible side.
int coarsest_step(const TextureModel& model) {
    long long step = 1;
    for (std::size_t k = 1; k < model.levels.size(); ++k) {
        step *= model.factor;
        if (step > (1 << 24)) return 0;
    }
    return static_cast<int>(step);
}

/// The smallest lattice of at least this side whose coarsest level suits the FFT.
int lattice_side(int side, int step) {
    return step * next_fft_size((side + step - 1) / step);
}

/// Sizes of all lattices of one synthesis, and the memory that they take.
struct Layout {
    Size lattice;                  ///< of the finest level before cropping
    std::vector<Size> sizes;       ///< per level
    std::vector<Size> transforms;  ///< per level; larger than the level where n has a prime factor over 13

    Layout(const TextureModel& model, Size size) {
        const int step = coarsest_step(model);
        if (step == 0 || size.height > largest_side || size.width > largest_side)
            throw InputError("synthesise " + text(size),
                             "sides are limited to " + std::to_string(largest_side), "give a smaller size");
        lattice = {lattice_side(size.height, step), lattice_side(size.width, step)};
        sizes = pyramid_sizes(lattice, static_cast<int>(model.levels.size()), model.factor);
        for (const Size& s : sizes) transforms.push_back({next_fft_size(s.height), next_fft_size(s.width)});
    }

    /// Bytes of device memory for `batch` textures at once, without stored factors.
    [[nodiscard]] double bytes(int planes, int batch) const {
        const double count = static_cast<double>(planes) * batch;
        const double pixels = static_cast<double>(area(transforms.front()));
        const double half = static_cast<double>(spectrum_floats(transforms.front(), 1));
        // The finest level's spectrum and transform's room and picture; the coarser levels' sum, and its rows
        // expanded.
        const double coarse = sizes.size() > 1 ? static_cast<double>(area(sizes[1])) * (1.0 + 2.0) : 0.0;
        return sizeof(float) * count * (2.0 * half + 2.0 * half + pixels + coarse);
    }
    /// The largest single buffer.
    [[nodiscard]] double largest(int planes, int batch) const {
        return sizeof(float) * static_cast<double>(planes) * batch *
               std::max(static_cast<double>(area(transforms.front())),
                        static_cast<double>(spectrum_floats(transforms.front(), 1)));
    }
};

bool fits(const Device::Impl& device, const Layout& layout, int planes, int batch) {
    return layout.bytes(planes, batch) <= memory_limit(device) &&
           layout.largest(planes, batch) <= static_cast<double>(device.largest_allocation());
}

[[noreturn]] void refuse_size(const Device::Impl& device, const TextureModel& model, Size size,
                              const Layout& layout) {
    int fitting = 0;
    for (int side = 16; side < largest_side; side *= 2)
        for (const int candidate : {side, side + side / 2})
            if (fits(device, Layout(model, {candidate, candidate}), model.planes, 1)) fitting = candidate;
    const auto gigabytes = [](double bytes) {
        const auto tenths = static_cast<long long>(bytes / 1e8);
        return std::to_string(tenths / 10) + "." + std::to_string(tenths % 10) + " GB";
    };
    throw DeviceError(
        "synthesise " + text(size) + " with " + std::to_string(model.planes) + " planes on device '" +
            device.info().name + "'",
        "it takes " + gigabytes(layout.bytes(model.planes, 1)) + " where " + gigabytes(memory_limit(device)) +
            " may be used, at most " + gigabytes(static_cast<double>(device.largest_allocation())) +
            " in one piece",
        "give a size up to about " + text({fitting, fitting}) + ", or a device with more memory");
}

std::vector<cl_uint2> key_words(std::span<const std::uint64_t> seeds) {
    std::vector<cl_uint2> words;
    for (const std::uint64_t seed : seeds)
        words.push_back({{static_cast<cl_uint>(seed), static_cast<cl_uint>(seed >> 32)}});
    return words;
}

}  // namespace

class Synthesiser::Impl {
  public:
    Impl(Device& device, const TextureModel& model, Size size, const SynthesisOptions& options)
        : device_(&device.impl()),
          planes_(model.planes),
          modelled_(modelled_planes(model)),
          space_(model.space),
          size_(size),
          layout_(checked(model, size, options)),
          options_(options),
          stages_(*device_, model.factor) {
        if (model.basis.planes > 0)
            restorer_.emplace(*device_, model.basis, model.marginals, model.whitening);
        if (!fits(*device_, layout_, planes_, 1)) refuse_size(*device_, model, size, layout_);
        const std::size_t target = device_->is_cpu() ? cpu_batch_bytes : gpu_batch_bytes;
        batch_ = 1;
        while (batch_ < largest_batch && layout_.bytes(planes_, 2 * batch_) <= static_cast<double>(target) &&
               fits(*device_, layout_, planes_, 2 * batch_))
            batch_ *= 2;

        const std::size_t last = model.levels.size() - 1;
        double spare = memory_limit(*device_) - layout_.bytes(planes_, batch_);
        for (std::size_t k = 0; k <= last; ++k) {
            const Size t = layout_.transforms[k];
            const double variance = options.noise_domain == NoiseDomain::frequency
                                        ? 1.0 / (2.0 * static_cast<double>(area(t)))
                                        : 1.0 / (static_cast<double>(area(t)) * static_cast<double>(area(t)));
            // Where there is a basis, the mean is added with it.
            const bool adds_mean = k == last && model.basis.planes == 0;
            const std::vector<double> mean =
                adds_mean ? model.mean : std::vector<double>(static_cast<std::size_t>(modelled_), 0.0);
            const std::vector<Model>& models = model.levels[k].models;
            factors_.emplace_back(*device_, std::vector<SpectralForm>(models.begin(), models.end()), t,
                                  model.levels[k].gain * std::sqrt(variance), mean, spare / 4.0);
            spare -= factors_.back().stored_bytes();
            static_cast<void>(device_->ffts().plan(*device_, t, device_->options().fft));
        }
        const std::uint64_t seed = 0;
        {
            const Device::Impl::Rehearsal rehearsal(*device_);
            static_cast<void>(grow({&seed, 1}));
        }
        device_->finish();
    }

    [[nodiscard]] std::vector<Image> synthesise(std::span<const std::uint64_t> seeds) {
        std::vector<Image> images;
        images.reserve(seeds.size());
        for (std::size_t first = 0; first < seeds.size(); first += static_cast<std::size_t>(batch_)) {
            const auto some =
                seeds.subspan(first, std::min(static_cast<std::size_t>(batch_), seeds.size() - first));
            const DevicePlanes planes = grow(some);
            for (std::size_t i = 0; i < some.size(); ++i) images.push_back(download(planes, i));
        }
        return images;
    }

    [[nodiscard]] Size size() const { return size_; }
    [[nodiscard]] Size lattice() const { return layout_.lattice; }
    [[nodiscard]] bool tileable() const {
        return layout_.lattice == size_ && layout_.transforms == layout_.sizes;
    }
    [[nodiscard]] int batch() const { return batch_; }

  private:
    static Layout checked(const TextureModel& model, Size size, const SynthesisOptions& options) {
        check(model);
        if (size.height < 1 || size.width < 1)
            throw InputError("synthesise " + text(size), "a side is smaller than 1", "give positive sides");
        if (!options.allow_invalid)
            for (std::size_t k = 0; k < model.levels.size(); ++k)
                if (!model.levels[k].certificate.valid)
                    throw InputError(
                        "synthesise from this " + std::string(name(model.kind)) + " model",
                        "the certificate of level " + std::to_string(k) + " fails (" +
                            std::to_string(model.levels[k].certificate.zeros) +
                            " zeros of det Λ): the texture's variance would have nothing to do with the "
                            "picture's",
                        "fit with a causal neighbourhood or --model 3d-car, or insist with --allow-invalid");
        return {model, size};
    }

    /// All levels of one batch, collapsed: [texture · d + plane].
    [[nodiscard]] DevicePlanes grow(std::span<const std::uint64_t> seeds) {
        const int batch = static_cast<int>(seeds.size());
        const Buffer keys = device_->upload(key_words(seeds));
        DevicePlanes sum;
        for (std::size_t k = factors_.size(); k-- > 0;) {
            DevicePlanes level = grow_level(k, keys, batch);
            sum = sum.values ? stages_.add_expanded(std::move(level), sum, 1.0F) : std::move(level);
        }
        return restorer_ ? restorer_->restore(std::move(sum)) : std::move(sum);
    }

    [[nodiscard]] DevicePlanes grow_level(std::size_t k, const Buffer& keys, int batch) {
        const Size t = layout_.transforms[k];
        const int planes = batch * modelled_;
        Fft& fft = device_->ffts().plan(*device_, t, device_->options().fft);
        const std::size_t half = sizeof(float) * spectrum_floats(t, planes);
        Buffer images;
        Spectrum spectrum{device_->buffer(half), device_->buffer(half)};
        const std::size_t bytes = sizeof(float) * static_cast<std::size_t>(planes) * area(t);
        if (options_.noise_domain == NoiseDomain::spatial) {
            images = device_->buffer(bytes);
            draw_normal_field(*device_, images, keys, t, modelled_, batch, static_cast<int>(k));
            fft.forward(*device_, images, spectrum, planes);
            factors_[k].filter(*device_, spectrum, batch);
        } else {
            factors_[k].draw(*device_, spectrum, keys, batch, static_cast<int>(k));
            images = device_->buffer(bytes);
        }
        fft.inverse(*device_, spectrum, images, planes);
        return {std::move(images), layout_.sizes[k], t, planes};
    }

    [[nodiscard]] Image download(const DevicePlanes& planes, std::size_t texture) const {
        Image image(size_, planes_, space_);
        const std::size_t plane_bytes = sizeof(float) * area(planes.lattice);
        const std::size_t offset = texture * static_cast<std::size_t>(planes_) * plane_bytes;
        if (planes.lattice == size_) {
            device_->read(planes.values, image.values().data(), image.values().size_bytes(), offset);
            return image;
        }
        std::vector<float> plane(area(planes.lattice));
        for (int p = 0; p < planes_; ++p) {
            device_->read(planes.values, plane.data(), plane_bytes,
                          offset + static_cast<std::size_t>(p) * plane_bytes);
            const std::span<float> target = image.plane(p);
            for (std::size_t r = 0; r < static_cast<std::size_t>(size_.height); ++r)
                std::copy_n(
                    plane.begin() +
                        static_cast<std::ptrdiff_t>(r * static_cast<std::size_t>(planes.lattice.width)),
                    size_.width,
                    target.begin() + static_cast<std::ptrdiff_t>(r * static_cast<std::size_t>(size_.width)));
        }
        return image;
    }

    Device::Impl* device_;
    int planes_;    ///< of the picture
    int modelled_;  ///< of the levels
    ColourSpace space_;
    Size size_;
    Layout layout_;
    SynthesisOptions options_;
    PyramidStages stages_;
    int batch_ = 1;
    std::vector<SpectralFactors> factors_;
    std::optional<PlaneRestorer> restorer_;
};

Synthesiser::Synthesiser(Device& device, const TextureModel& model, Size size,
                         const SynthesisOptions& options)
    : impl_(std::make_unique<Impl>(device, model, size, options)) {}
Synthesiser::~Synthesiser() = default;
Synthesiser::Synthesiser(Synthesiser&&) noexcept = default;
Synthesiser& Synthesiser::operator=(Synthesiser&&) noexcept = default;

Image Synthesiser::synthesise(std::uint64_t seed) {
    return std::move(impl_->synthesise(std::span<const std::uint64_t>(&seed, 1)).front());
}
std::vector<Image> Synthesiser::synthesise(std::span<const std::uint64_t> seeds) {
    return impl_->synthesise(seeds);
}
Size Synthesiser::size() const {
    return impl_->size();
}
Size Synthesiser::lattice() const {
    return impl_->lattice();
}
bool Synthesiser::tileable() const {
    return impl_->tileable();
}
int Synthesiser::batch() const {
    return impl_->batch();
}

}  // namespace btfield

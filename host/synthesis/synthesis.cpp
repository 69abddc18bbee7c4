#include "btfield/synthesis.hpp"

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <cstdint>
#include <mutex>
#include <optional>
#include <shared_mutex>
#include <span>
#include <string>
#include <utility>
#include <variant>

#include "btfield/error.hpp"
#include "host/analysis/pyramid_stages.hpp"
#include "host/base/limits.hpp"
#include "host/base/parallel.hpp"
#include "host/base/stop.hpp"
#include "host/base/text.hpp"
#include "host/cl/host_memory.hpp"
#include "host/pictures/picture_room.hpp"
#include "host/spectrum/small_torus.hpp"
#include "host/synthesis/causal_recursion.hpp"
#include "host/synthesis/convolution.hpp"
#include "host/synthesis/independent_planes.hpp"
#include "host/synthesis/plane_restorer.hpp"
#include "host/synthesis/spectral_factors.hpp"
#include "host/synthesis/synthesis_layout.hpp"
#include "host/synthesis/synthesis_request.hpp"

namespace btfield {

using namespace detail;

namespace {

/// Lower and upper half of each seed, as the kernels take them.
std::vector<std::array<std::uint32_t, 2>> key_words(std::span<const std::uint64_t> seeds) {
    std::vector<std::array<std::uint32_t, 2>> words;
    for (const std::uint64_t seed : seeds)
        words.push_back({static_cast<std::uint32_t>(seed), static_cast<std::uint32_t>(seed >> 32)});
    return words;
}

}  // namespace

class [[gnu::visibility("hidden")]] Synthesiser::Impl {
  public:
    Impl(Device & device, const TextureModel& model, Size size, const SynthesisOptions& options)
        : device_(&device.impl()),
          planes_(model.planes),
          modelled_(modelled_planes(model)),
          space_(model.space),
          names_(model.names),
          plane_spaces_(model.plane_spaces),
          layout_(checked(model, size, options)),
          packed_(FftPlans::resolve(*device_, layout_.transforms.front(), device_->options().fft) ==
                  FftBackend::lanes),
          stages_(*device_, model.factor) {
        if (layout_.routes.front() == LevelRoute::recursion) add_recursions(model);
        if (model.basis.planes > 0)
            restorer_.emplace(*device_, model.basis, model.marginals, model.whitening);
        if (!fits(layout_, 1)) refuse_size(model);
        while (batch_ < device_->tuning().largest_batch && is_worth(2 * batch_) && fits(layout_, 2 * batch_))
            batch_ *= 2;
        if (levels_.empty()) add_torus_levels(model);

        fills_pictures_ = may_fill_pictures();
        rehearse();
    }

    [[nodiscard]] std::vector<Image> synthesise(std::span<const std::uint64_t> seeds,
                                                const std::function<void(double)>& progress) {
        std::vector<Image> images;
        images.reserve(seeds.size());
        if (fills_pictures_) {
            synthesise_in_place(seeds, images, progress);
            return images;
        }
        in_batches(seeds, [&](std::span<const std::uint64_t> some, std::size_t first) {
            const DevicePlanes planes = grow(some);
            if (bytes(layout_, batch_) > large_work) {
                // What it was made in goes before the picture's own memory is touched.
                device_->finish();
                device_->pool().clear();
            }
            for (std::size_t i = 0; i < some.size(); ++i) images.push_back(picture(0));
            for (std::size_t i = 0; i < some.size(); ++i) download(planes, i, images[first + i]);
            if (progress) progress(static_cast<double>(images.size()) / static_cast<double>(seeds.size()));
        });
        return images;
    }

    void synthesise_to(std::span<const std::uint64_t> seeds, const DeviceMemory& target) {
        const std::size_t values = static_cast<std::size_t>(planes_) * area(layout_.size);
        device_->check_target(target, sizeof(float) * values * seeds.size(),
                              std::to_string(seeds.size()) + (seeds.size() == 1 ? " texture" : " textures") +
                                  " of " + text_of(layout_.size) + " with " + std::to_string(planes_) +
                                  (planes_ == 1 ? " plane" : " planes"));
        in_batches(seeds, [&](std::span<const std::uint64_t> some, std::size_t first) {
            const DevicePlanes planes = grow(some);
            device_->copy(planes.values,
                          {planes.lattice, 0, some.size() * static_cast<std::size_t>(planes_),
                           layout_.crop.row, layout_.crop.column, layout_.size},
                          target, first * values);
            device_->flush();
        });
    }

    [[nodiscard]] Size size() const {
        return layout_.size;
    }
    [[nodiscard]] Size lattice() const {
        return layout_.lattice;
    }
    [[nodiscard]] bool tileable() const {
        return layout_.tiles();
    }
    [[nodiscard]] int batch() const {
        return batch_;
    }

  private:
    static constexpr double large_work = 1e9;  // bytes
    using Level = std::variant<SpectralFactors, Convolution, CausalRecursion>;

    static SynthesisLayout checked(const TextureModel& model, Size size, const SynthesisOptions& options) {
        check_request(model, size, options);
        return {model, size, routes_of(model, options)};
    }

    /// Bytes of device memory for a batch, without stored factors.
    [[nodiscard]] double bytes(const SynthesisLayout& layout, int batch) const {
        return layout.bytes(modelled_ * batch, packed_) + restoring_bytes(layout, batch);
    }
    [[nodiscard]] double restoring_bytes(const SynthesisLayout& layout, int batch) const {
        return restorer_ ? static_cast<double>(restorer_->scratch_bytes(layout.transforms.front(), batch))
                         : 0.0;
    }

    [[nodiscard]] bool fits(const SynthesisLayout& layout, int batch) const {
        const double largest =
            std::max(layout.largest(modelled_ * batch, packed_), restoring_bytes(layout, batch));
        return bytes(layout, batch) <= device_->memory_limit() &&
               largest <= static_cast<double>(device_->largest_allocation());
    }

    /// Whether a batch is faster than its halves one after the other: while they share the cache, and while a
    /// recursion, which has few rows to work on at once, leaves compute units without a texture of their own.
    [[nodiscard]] bool is_worth(int batch) const {
        if (bytes(layout_, batch) <= static_cast<double>(device_->tuning().batch_bytes)) return true;
        return layout_.routes.front() == LevelRoute::recursion && batch <= 2 * device_->info().compute_units;
    }

    [[noreturn]] void refuse_size(const TextureModel& model) const {
        int fitting = 0;
        for (int side = 16; side <= fft_longest_side / 2; side *= 2)
            for (const int candidate : {side, side + side / 2})
                if (fits(layout_.resized(model, {candidate, candidate}), 1)) fitting = candidate;
        const auto largest = static_cast<double>(device_->largest_allocation());
        const std::string piece =
            largest < device_->memory_limit() ? ", at most " + bytes_text(largest) + " in one piece" : "";
        throw DeviceError(
            "synthesise " + compact_text_of(layout_.size) + " with " + counted(planes_, "plane") +
                " on device '" + device_->info().name + "'",
            "it takes " + bytes_text(bytes(layout_, 1)) + " where " + bytes_text(device_->memory_limit()) +
                " may be used" + piece,
            (fitting > 0 ? "give a size up to about " + compact_size_text(fitting, fitting) + ", allow"
                         : std::string("allow")) +
                " more device memory ($BTFIELD_MEMORY), or take a device that has more");
    }

    /// What the level of this number adds to every pixel.
    [[nodiscard]] std::vector<double> level_mean(const TextureModel& model, std::size_t k) const {
        // Where there is a basis, the mean is added with it.
        const bool adds_mean = k + 1 == model.levels.size() && model.basis.planes == 0;
        return adds_mean ? model.mean : std::vector<double>(static_cast<std::size_t>(modelled_), 0.0);
    }

    void add_recursions(const TextureModel& model) {
        for (std::size_t k = 0; k < model.levels.size(); ++k)
            at_level(k, [&] {
                CausalRecursion recursion(*device_, joined_planes(model.levels[k].models), layout_.sizes[k],
                                          model.levels[k].gain, level_mean(model, k));
                layout_.margins.push_back(recursion.margins());
                levels_.emplace_back(std::move(recursion));
            });
    }

    void add_torus_levels(const TextureModel& model) {
        double spare = std::min(device_->memory_limit() - bytes(layout_, batch_),
                                4.0 * static_cast<double>(device_->tuning().factor_bytes));
        for (std::size_t k = 0; k < model.levels.size(); ++k) {
            const Size t = layout_.transforms[k];
            const LevelModel& level = model.levels[k];
            if (layout_.routes[k] == LevelRoute::convolution) {
                levels_.emplace_back(std::in_place_type<Convolution>, *device_, joined_planes(level.models),
                                     t, level.gain, level_mean(model, k));
                continue;
            }
            const auto n = static_cast<double>(area(t));
            const double variance =
                layout_.routes[k] == LevelRoute::spectrum ? 1.0 / (2.0 * n) : 1.0 / (n * n);
            const std::vector<SpectralForm> forms(level.models.begin(), level.models.end());
            std::vector<std::optional<Eigen::MatrixXd>> means;
            if (layout_.routes[k] == LevelRoute::spectrum && level.certificate.valid)
                for (const SpectralForm& form : forms)
                    means.push_back(mean_density(form, t, model.factor, static_cast<int>(k)));
            const bool own_means =
                std::ranges::any_of(means, [](const auto& mean) { return mean.has_value(); });
            SpectralFactors factors(*device_, forms, t, level.gain * std::sqrt(variance),
                                    level_mean(model, k), spare / 4.0, !level.certificate.valid);
            if (own_means) factors.set_means(*device_, means);
            spare -= factors.storable_bytes();
            levels_.emplace_back(std::move(factors));
            static_cast<void>(device_->ffts().plan(*device_, t, device_->options().fft));
        }
    }

    /// work(seeds of a batch, number of the first)
    template <class Work>
    void in_batches(std::span<const std::uint64_t> seeds, Work work) const {
        const auto most = static_cast<std::size_t>(batch_);
        for (std::size_t first = 0; first < seeds.size(); first += most) {
            stop_if_asked();
            work(seeds.subspan(first, std::min(most, seeds.size() - first)), first);
        }
    }

    /// Factors are kept when they are wanted again and again: computing them where they are used takes less
    /// time and memory for a few draws.
    void count_draw() {
        constexpr int worth_keeping = 2;
        if (DeviceImpl::rehearsing() || draws_.fetch_add(1) != worth_keeping) return;
        const std::unique_lock lock(factors_mutex_);
        for (Level& level : levels_)
            if (auto* const factors = std::get_if<SpectralFactors>(&level)) factors->store(*device_);
    }

    /// Seeds in device memory, and which of them a batch takes.
    struct Keys {
        const Buffer& words;
        int first, batch;
    };

    /// A picture to be filled, whose memory holds so many floats or more.
    [[nodiscard]] Image picture(std::size_t room) const {
        Image image = PictureRoom::make(layout_.size, planes_, space_, room);
        image.set_names(names_);
        image.set_plane_spaces(plane_spaces_);
        return image;
    }

    /// Whether the last kernel may write to the pictures' own memory: it leaves there what the picture shows
    /// and no more, and device and host share it.
    [[nodiscard]] bool may_fill_pictures() const {
        const Size t = layout_.transforms.front();
        if (layout_.routes.front() != LevelRoute::spectrum || !packed_ || layout_.lattice != layout_.size ||
            t != layout_.size)
            return false;
        Image image = picture(0);
        return HostMemory::suits(*device_, PictureRoom::of(image));
    }

    void rehearse() {
        const std::uint64_t seed = 0;
        const DeviceImpl::Rehearsal rehearsal;
        if (fills_pictures_) {
            std::vector<Image> images;
            synthesise_in_place({&seed, 1}, images, {});
        } else {
            static_cast<void>(grow({&seed, 1}));
        }
        device_->finish();
    }

    /// The same without copies: while a batch is grown, the next is enqueued.
    void synthesise_in_place(std::span<const std::uint64_t> seeds, std::vector<Image> & images,
                             const std::function<void(double)>& progress) {
        const Buffer words = device_->upload(key_words(seeds));
        // What waits for launches goes before the pictures that they write to.
        std::vector<HostMemory> growing;
        std::size_t done = 0;
        const auto settle = [&](std::vector<HostMemory> next) {
            for (HostMemory& memory : growing) memory.wait();
            done += growing.size();
            if (progress && done > 0) progress(static_cast<double>(done) / static_cast<double>(seeds.size()));
            growing = std::move(next);
        };
        in_batches(seeds, [&](std::span<const std::uint64_t> some, std::size_t first) {
            std::vector<HostMemory> targets;
            // The spectrum of a single texture lies where the picture will be.
            const std::size_t room = some.size() > 1 || restores_more_planes()
                                         ? 0
                                         : PackedSpectrum{layout_.size}.bytes(planes_) / sizeof(float);
            for (std::size_t i = 0; i < some.size(); ++i)
                targets.emplace_back(*device_, PictureRoom::of(images.emplace_back(picture(room))));
            grow({words, static_cast<int>(first), static_cast<int>(some.size())}, targets);
            for (HostMemory& target : targets) target.show();
            device_->flush();
            settle(std::move(targets));
            if (bytes(layout_, batch_) <= large_work) return;
            settle({});
            device_->pool().clear();
        });
        settle({});
    }

    [[nodiscard]] bool restores_more_planes() const {
        return restorer_ && restorer_->rank() != restorer_->planes();
    }

    /// All levels of one batch, collapsed: [texture · d + plane].
    [[nodiscard]] DevicePlanes grow(std::span<const std::uint64_t> seeds) {
        count_draw();
        const Buffer words = device_->upload(key_words(seeds));
        const Keys keys{words, 0, static_cast<int>(seeds.size())};
        DevicePlanes sum = grow_levels(0, keys);
        return restorer_ ? restorer_->restore(std::move(sum)) : std::move(sum);
    }

    /// The same, each texture to its own memory.
    void grow(const Keys& keys, std::span<const HostMemory> targets) {
        count_draw();
        if (restores_more_planes()) {
            const DevicePlanes sum = grow_levels(0, keys);
            for (int i = 0; i < keys.batch; ++i)
                restorer_->restore(sum, i, targets[static_cast<std::size_t>(i)].buffer());
            return;
        }
        const DevicePlanes coarse = grow_levels(1, keys);
        const Size size = layout_.size;
        const std::size_t bytes = PackedSpectrum{size}.bytes(keys.batch * planes_);
        Buffer spectra = targets.front().buffer();
        if (spectra.bytes() < bytes) spectra = device_->buffer(bytes);
        {
            const std::shared_lock lock(factors_mutex_);
            std::get<SpectralFactors>(levels_.front())
                .draw(*device_, spectra, keys.words, keys.batch, 0, keys.first);
        }
        Fft& fft = device_->ffts().plan(*device_, size, device_->options().fft);
        for (int i = 0; i < keys.batch; ++i) {
            DevicePlanes texture{targets[static_cast<std::size_t>(i)].buffer(), size, size, planes_};
            fft.inverse_packed(*device_, spectra, i * planes_, texture.values, planes_);
            if (coarse.values) texture = stages_.add_expanded(std::move(texture), coarse, 1.0F, i * planes_);
            if (restorer_) static_cast<void>(restorer_->restore(std::move(texture)));
        }
    }

    /// The sum of the levels from `finest` on; nothing where there are none.
    [[nodiscard]] DevicePlanes grow_levels(std::size_t finest, const Keys& keys) {
        DevicePlanes sum;
        for (std::size_t k = levels_.size(); k-- > finest;) {
            DevicePlanes level = grow_level(k, keys);
            sum = sum.values ? stages_.add_expanded(std::move(level), sum, 1.0F) : std::move(level);
        }
        return sum;
    }

    [[nodiscard]] DevicePlanes grow_level(std::size_t k, const Keys& keys) {
        const Size t = layout_.transforms[k];
        const int batch = keys.batch;
        const int planes = batch * modelled_, number = static_cast<int>(k);
        DevicePlanes level{{}, layout_.sizes[k], t, planes};
        const std::size_t bytes = sizeof(float) * static_cast<std::size_t>(planes) * area(t);
        if (const auto* factors = std::get_if<SpectralFactors>(&levels_[k])) {
            level.values = grow_spectrum(*factors, k, keys, bytes);
        } else {
            level.values = device_->buffer(bytes);
            if (const auto* convolution = std::get_if<Convolution>(&levels_[k]))
                convolution->draw(*device_, level.values, keys.words, batch, number);
            else
                std::get<CausalRecursion>(levels_[k]).draw(*device_, level.values, keys.words, batch, number);
        }
        return level;
    }

    [[nodiscard]] Buffer grow_spectrum(const SpectralFactors& factors, std::size_t k, const Keys& keys,
                                       std::size_t bytes) {
        const Size t = layout_.transforms[k];
        const int batch = keys.batch, planes = batch * modelled_, number = static_cast<int>(k);
        Fft& fft = device_->ffts().plan(*device_, t, device_->options().fft);
        const std::shared_lock lock(factors_mutex_);
        if (layout_.routes[k] == LevelRoute::spectrum && fft.takes_packed()) {
            Buffer packed = device_->buffer(PackedSpectrum{t}.bytes(planes));
            factors.draw(*device_, packed, keys.words, batch, number, keys.first);
            fft.inverse_packed(*device_, packed, 0, packed, planes);
            return packed;
        }
        const std::size_t half = sizeof(float) * spectrum_floats(t, planes);
        Buffer images;
        Spectrum spectrum{device_->buffer(half), device_->buffer(half)};
        if (layout_.routes[k] == LevelRoute::transfer) {
            images = device_->buffer(bytes);
            draw_normal_field(*device_, images, keys.words, t, modelled_, batch, number);
            fft.forward(*device_, images, spectrum, planes);
            factors.filter(*device_, spectrum, batch);
        } else {
            factors.draw(*device_, spectrum, keys.words, batch, number, keys.first);
            images = device_->buffer(bytes);
        }
        fft.inverse(*device_, spectrum, images, planes);
        return images;
    }

    /// The window of the lattice that is wanted, on all cores: the picture's memory is touched here first.
    void download(const DevicePlanes& planes, std::size_t texture, Image& image) const {
        const Size size = layout_.size;
        const std::size_t lattice = area(planes.lattice), count = static_cast<std::size_t>(planes_);
        const auto pitch = static_cast<std::size_t>(planes.lattice.width);
        const auto width = static_cast<std::size_t>(size.width),
                   height = static_cast<std::size_t>(size.height);
        const std::size_t corner = static_cast<std::size_t>(layout_.crop.row) * pitch +
                                   static_cast<std::size_t>(layout_.crop.column);
        // A block of rows is work for a thread, a few huge pages of memory.
        const std::size_t rows = std::max<std::size_t>(1, (std::size_t{1} << 20) / width);
        const std::size_t blocks = (height + rows - 1) / rows;
        const auto copy = [&](const std::byte* bytes) {
            const auto* const source = reinterpret_cast<const float*>(bytes);
            for_each_block(static_cast<int>(blocks * count), [&](int block) {
                const std::size_t p = static_cast<std::size_t>(block) / blocks;
                const std::size_t first = static_cast<std::size_t>(block) % blocks * rows;
                const std::span<const float> plane(source + p * lattice, lattice);
                const std::span<float> target = image.plane(static_cast<int>(p));
                for (std::size_t r = first; r < std::min(height, first + rows); ++r)
                    std::ranges::copy(plane.subspan(corner + r * pitch, width),
                                      target.subspan(r * width).begin());
            });
        };
        device_->look(planes.values, sizeof(float) * texture * count * lattice,
                      sizeof(float) * count * lattice, copy);
    }

    DeviceImpl* device_;
    int planes_;    ///< of the picture
    int modelled_;  ///< of the levels
    ColourSpace space_;
    std::vector<std::string> names_;
    std::vector<ColourSpace> plane_spaces_;
    SynthesisLayout layout_;
    bool packed_;                  ///< transforms are done where spectra lie
    bool fills_pictures_ = false;  ///< see may_fill_pictures()
    PyramidStages stages_;
    int batch_ = 1;
    std::vector<Level> levels_;
    std::shared_mutex factors_mutex_;  ///< of what levels_ keep of factors
    std::atomic<int> draws_ = 0;
    std::optional<PlaneRestorer> restorer_;
};

Synthesiser::Synthesiser(Device& device, const TextureModel& model, Size size,
                         const SynthesisOptions& options)
    : impl_(std::make_unique<Impl>(device, model, size, options)) {}
Synthesiser::~Synthesiser() = default;
Synthesiser::Synthesiser(Synthesiser&&) noexcept = default;
Synthesiser& Synthesiser::operator=(Synthesiser&&) noexcept = default;

Image Synthesiser::synthesise(std::uint64_t seed) {
    return std::move(impl_->synthesise(std::span<const std::uint64_t>(&seed, 1), {}).front());
}
std::vector<Image> Synthesiser::synthesise(std::span<const std::uint64_t> seeds) {
    return impl_->synthesise(seeds, {});
}
std::vector<Image> Synthesiser::synthesise(std::span<const std::uint64_t> seeds,
                                           const std::function<void(double)>& progress) {
    return impl_->synthesise(seeds, progress);
}
void Synthesiser::synthesise_to(std::span<const std::uint64_t> seeds, const DeviceMemory& target) {
    impl_->synthesise_to(seeds, target);
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

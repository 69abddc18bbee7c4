#include "bench/peers/synthesis.hpp"

#include <array>

#include "bench/peers/fftw.hpp"
#include "bench/peers/noise.hpp"
#include "bench/peers/parallel.hpp"
#include "bench/peers/pyramid.hpp"
#include "bench/peers/spectral_factors.hpp"

namespace btfield::peer {
namespace {

struct Level {
    SpectralFactors factors;
    Plan alone, together;  ///< one thread per texture; all threads on one texture

    Level(const LinearField& field, Size size, double gain)
        : factors(field, size, gain),
          alone(size, field.planes, Plan::Direction::inverse, 1),
          together(size, field.planes, Plan::Direction::inverse, threads) {}
};

/// Memory of one texture under way.
struct Work {
    std::vector<Buffer<fftwf_complex>> spectra;
    std::vector<Buffer<float>> levels;  ///< without the finest, which is the output itself
};

}  // namespace

class Synthesiser::Impl {
  public:
    Impl(const TextureModel& model, Size size) : mean_(model.mean), planes_(model.planes) {
        for (const LevelModel& level : model.levels) {
            levels_.push_back(std::make_unique<Level>(linear_field(level.models.front()), size, level.gain));
            size = {(size.height + 1) / 2, (size.width + 1) / 2};
        }
        for (Work& work : work_)
            for (const auto& level : levels_) {
                const auto d = static_cast<std::size_t>(planes_);
                work.spectra.push_back(allocate<fftwf_complex>(d * spectrum_size(level->factors.size())));
                work.levels.push_back(allocate<float>(d * area(level->factors.size())));
            }
    }

    void together(std::uint64_t seed, Image& out) {
        Work& work = work_[0];
        parallel([&](int t) {
            NoiseSource source(seed * threads + static_cast<std::uint64_t>(t));
            for (std::size_t k = 0; k < levels_.size(); ++k)
                levels_[k]->factors.draw(source, share(levels_[k]->factors.blocks(), t),
                                         share(levels_[k]->factors.blocks(), t + 1), work.spectra[k].get());
        });
        set_mean(work);
        for (std::size_t k = 0; k < levels_.size(); ++k)
            levels_[k]->together.inverse(work.spectra[k].get(), values(work, k, out));
        for (std::size_t k = levels_.size() - 1; k-- > 0;)
            parallel([&](int t) {
                const int h = levels_[k]->factors.size().height;
                collapse(work, k, out, share(h, t), share(h, t + 1));
            });
    }

    void alone(std::uint64_t seed, int thread, Image& out) {
        Work& work = work_[static_cast<std::size_t>(thread)];
        NoiseSource source(seed);
        for (std::size_t k = 0; k < levels_.size(); ++k)
            levels_[k]->factors.draw(source, 0, levels_[k]->factors.blocks(), work.spectra[k].get());
        set_mean(work);
        for (std::size_t k = 0; k < levels_.size(); ++k)
            levels_[k]->alone.inverse(work.spectra[k].get(), values(work, k, out));
        for (std::size_t k = levels_.size() - 1; k-- > 0;)
            collapse(work, k, out, 0, levels_[k]->factors.size().height);
    }

  private:
    float* values(Work& work, std::size_t k, Image& out) const {
        return k == 0 ? out.values().data() : work.levels[k].get();
    }

    void set_mean(Work& work) const {
        const std::size_t n = spectrum_size(levels_[0]->factors.size());
        for (std::size_t p = 0; p < mean_.size(); ++p)
            work.spectra[0][p * n][0] += static_cast<float>(mean_[p]);
    }

    void collapse(Work& work, std::size_t k, Image& out, int begin, int end) const {
        const Size fine = levels_[k]->factors.size(), coarse = levels_[k + 1]->factors.size();
        for (int p = 0; p < planes_; ++p)
            add_expanded(values(work, k + 1, out) + static_cast<std::size_t>(p) * area(coarse), coarse,
                         values(work, k, out) + static_cast<std::size_t>(p) * area(fine), begin, end);
    }

    std::vector<double> mean_;
    int planes_;
    std::vector<std::unique_ptr<Level>> levels_;
    std::array<Work, threads> work_;
};

Synthesiser::Synthesiser(const TextureModel& model, Size size) : impl_(std::make_unique<Impl>(model, size)) {}
Synthesiser::~Synthesiser() = default;

void Synthesiser::synthesise(std::uint64_t seed, Image& out) {
    impl_->together(seed, out);
}

void Synthesiser::synthesise(std::span<const std::uint64_t> seeds, std::vector<Image>& out) {
    parallel([&](int t) {
        for (std::size_t i = static_cast<std::size_t>(t); i < seeds.size(); i += threads)
            impl_->alone(seeds[i], t, out[i]);
    });
}

}  // namespace btfield::peer

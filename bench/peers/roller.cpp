#include "bench/peers/roller.hpp"

#include <algorithm>
#include <array>
#include <limits>
#include <map>
#include <optional>
#include <random>
#include <tuple>

#include "bench/peers/fftw.hpp"
#include "bench/peers/parallel.hpp"

namespace btfield::peer {
namespace {

constexpr int planes = 3;
constexpr float tolerance = 0.1F;
constexpr std::uint32_t nothing = std::numeric_limits<std::uint32_t>::max();

std::size_t at(int row, int column, int width) {
    return static_cast<std::size_t>(row) * static_cast<std::size_t>(width) + static_cast<std::size_t>(column);
}

/// Blocks along one side of the torus.
struct Axis {
    int length, count, block;
    Axis(int side, int wanted, int overlap)
        : length(side),
          count(std::max(2, (side + wanted - overlap - 1) / (wanted - overlap))),
          block(std::min({wanted, side, 2 * (side / count)})) {}
    [[nodiscard]] int begin(int i) const { return static_cast<int>(static_cast<long>(i) * length / count); }
    /// Of block i and the one before; i = count is the wrap.
    [[nodiscard]] int overlap(int i) const { return begin(i - 1) + block - begin(i); }
};

/// What is known of a block: strips of these widths.
struct Mask {
    int top = 0, left = 0, bottom = 0, right = 0;
    auto operator<=>(const Mask&) const = default;
};

struct Place {
    int row = 0, column = 0;
};

/// First pixel of the new block in each row, seen from the side where the other one lies.
template <typename Error>
std::vector<int> boundary_cut(int rows, int columns, const Error& error) {
    std::vector<int> cut(static_cast<std::size_t>(rows), 0);
    if (columns == 0) return cut;
    std::vector<float> cost(at(rows, 0, columns));
    for (int c = 0; c < columns; ++c) cost[at(0, c, columns)] = error(0, c);
    const auto cheapest = [&](int r, int c) {
        const int end = std::min(columns, c + 2);
        int best = std::max(0, c - 1);
        for (int k = best + 1; k < end; ++k)
            if (cost[at(r, k, columns)] < cost[at(r, best, columns)]) best = k;
        return best;
    };
    for (int r = 1; r < rows; ++r)
        for (int c = 0; c < columns; ++c)
            cost[at(r, c, columns)] = error(r, c) + cost[at(r - 1, cheapest(r - 1, c), columns)];
    const float* last = cost.data() + at(rows - 1, 0, columns);
    int c = static_cast<int>(std::min_element(last, last + columns) - last);
    for (int r = rows - 1; r >= 0; --r) {
        cut[static_cast<std::size_t>(r)] = c;
        if (r > 0) c = cheapest(r - 1, c);
    }
    return cut;
}

}  // namespace

class Roller::Impl {
  public:
    Impl(const Image& sample, int block, int overlap)
        : sample_(sample.size()),
          block_(block),
          overlap_(overlap),
          half_(spectrum_size(sample_)),
          forward_(sample_, planes, Plan::Direction::forward, threads),
          inverse_(sample_, 1, Plan::Direction::inverse, threads),
          image_(allocate<float>(planes * area(sample_))),
          correlation_(allocate<float>(area(sample_))),
          sample_spectra_(allocate<fftwf_complex>(planes * half_)),
          spectra_(allocate<fftwf_complex>(planes * half_)),
          product_(allocate<fftwf_complex>(half_)),
          features_(area(sample_)),
          squares_(at(sample_.height + 1, sample_.width + 1, sample_.width + 1), 0.0) {
        for (int p = 0; p < planes; ++p) {
            const auto plane = sample.plane(p);
            double sum = 0.0;
            for (const float v : plane) sum += static_cast<double>(v);
            const float mean = static_cast<float>(sum / static_cast<double>(plane.size()));
            for (std::size_t i = 0; i < plane.size(); ++i) {
                features_[i][static_cast<std::size_t>(p)] = plane[i] - mean;
                image_[static_cast<std::size_t>(p) * area(sample_) + i] = plane[i] - mean;
            }
        }
        forward_.forward(image_.get(), sample_spectra_.get());
        std::fill_n(image_.get(), planes * area(sample_), 0.0F);
        for (int r = 0; r < sample_.height; ++r) {
            double row = 0.0;
            for (int c = 0; c < sample_.width; ++c) {
                const Colour& colour = features_[at(r, c, sample_.width)];
                for (const float v : colour) row += static_cast<double>(v * v);
                squares_[at(r + 1, c + 1, sample_.width + 1)] =
                    squares_[at(r, c + 1, sample_.width + 1)] + row;
            }
        }
    }

    std::vector<std::uint32_t> quilt(Size size, unsigned seed) {
        const Axis down(size.height, block_, overlap_), right(size.width, block_, overlap_);
        torus_ = size;
        patch_ = {down.block, right.block};
        map_.assign(area(size), nothing);
        std::mt19937 random(seed);
        std::vector<std::optional<Place>> chosen(at(down.count, 0, right.count));
        for (int r = 0; r < down.count; ++r)
            for (int c = 0; c < right.count; ++c) {
                const Place origin{down.begin(r), right.begin(c)};
                const Mask mask{.top = r > 0 ? down.overlap(r) : 0,
                                .left = c > 0 ? right.overlap(c) : 0,
                                .bottom = r + 1 == down.count ? down.overlap(r + 1) : 0,
                                .right = c + 1 == right.count ? right.overlap(c + 1) : 0};
                // A neighbour goes on without any error: only copies of the sample would come out.
                std::vector<Place> continued;
                for (int i = -1; i <= 1; ++i)
                    for (int k = -1; k <= 1; ++k) {
                        const int row = (r + i + down.count) % down.count,
                                  column = (c + k + right.count) % right.count;
                        if (const auto& place = chosen[at(row, column, right.count)])
                            continued.push_back(
                                {place->row + origin.row - down.begin(row) - wraps(r + i, down),
                                 place->column + origin.column - right.begin(column) - wraps(c + k, right)});
                    }
                const Place found = r + c == 0 ? anywhere(random) : find(origin, mask, continued, random);
                chosen[at(r, c, right.count)] = found;
                lay(origin, mask, found);
            }
        return map_;
    }

  private:
    using Colour = std::array<float, 4>;  // one vector; the last is 0

    /// What the torus adds to the begin of block i, −1 … count.
    static int wraps(int i, const Axis& axis) {
        return i < 0 ? -axis.length : i < axis.count ? 0 : axis.length;
    }

    [[nodiscard]] std::size_t on_torus(int row, int column) const {
        return at(row % torus_.height, column % torus_.width, torus_.width);
    }

    Place anywhere(std::mt19937& random) const {
        std::uniform_int_distribution<int> row(0, sample_.height - patch_.height),
            column(0, sample_.width - patch_.width);
        const int r = row(random);
        return {r, column(random)};
    }

    /// Σ sample² under the mask at each place, from the table of sums.
    const std::vector<float>& energy(const Mask& mask) {
        const auto [entry, is_new] = energies_.try_emplace({patch_.height, patch_.width, mask});
        std::vector<float>& values = entry->second;
        if (!is_new) return values;
        const auto sum = [&](int top, int left, int bottom, int right) {
            const int pitch = sample_.width + 1;
            return squares_[at(bottom, right, pitch)] - squares_[at(top, right, pitch)] -
                   squares_[at(bottom, left, pitch)] + squares_[at(top, left, pitch)];
        };
        for (int r = 0; r + patch_.height <= sample_.height; ++r)
            for (int c = 0; c + patch_.width <= sample_.width; ++c)
                values.push_back(
                    static_cast<float>(sum(r, c, r + patch_.height, c + patch_.width) -
                                       sum(r + mask.top, c + mask.left, r + patch_.height - mask.bottom,
                                           c + patch_.width - mask.right)));
        return values;
    }

    /// Puts what is known into the corner of the zero image.
    /// \return Σ known²
    float write_known(Place origin, const Mask& mask) {
        float sum = 0.0F;
        for (int r = 0; r < patch_.height; ++r) {
            const bool all = r < mask.top || r >= patch_.height - mask.bottom;
            for (int c = 0; c < patch_.width; ++c) {
                const bool known = all || c < mask.left || c >= patch_.width - mask.right;
                const Colour colour =
                    known ? features_[map_[on_torus(origin.row + r, origin.column + c)]] : Colour{};
                for (int p = 0; p < planes; ++p) {
                    const float v = colour[static_cast<std::size_t>(p)];
                    image_[static_cast<std::size_t>(p) * area(sample_) + at(r, c, sample_.width)] = v;
                    sum += v * v;
                }
            }
        }
        return sum;
    }

    void correlate() {
        forward_.forward(image_.get(), spectra_.get());
        parallel([&](int thread) {
            const auto n = static_cast<int>(half_);
            const float *s = &sample_spectra_[0][0], *k = &spectra_[0][0];
            float* to = &product_[0][0];
            for (int i = share(n, thread); i < share(n, thread + 1); ++i) {
                float re = 0.0F, im = 0.0F;
                for (int p = 0; p < planes; ++p) {
                    const int j = 2 * (p * n + i);
                    re += s[j] * k[j] + s[j + 1] * k[j + 1];
                    im += s[j + 1] * k[j] - s[j] * k[j + 1];
                }
                to[2 * i] = re;
                to[2 * i + 1] = im;
            }
        });
        inverse_.inverse(product_.get(), correlation_.get());
    }

    Place find(Place origin, const Mask& mask, const std::vector<Place>& continued, std::mt19937& random) {
        const float known = write_known(origin, mask);
        correlate();
        const int rows = sample_.height - patch_.height + 1, columns = sample_.width - patch_.width + 1;
        scores_ = energy(mask);
        const float scale = 2.0F / static_cast<float>(area(sample_));
        for (int r = 0; r < rows; ++r) {
            float* to = scores_.data() + at(r, 0, columns);
            const float* from = correlation_.get() + at(r, 0, sample_.width);
            for (int c = 0; c < columns; ++c) to[c] += known - scale * from[c];
        }
        const int radius = block_ / 4;
        for (const Place& place : continued)
            for (int r = std::max(0, place.row - radius + 1); r < std::min(rows, place.row + radius); ++r)
                for (int c = std::max(0, place.column - radius + 1);
                     c < std::min(columns, place.column + radius); ++c)
                    scores_[at(r, c, columns)] = std::numeric_limits<float>::max();
        float least = std::numeric_limits<float>::max();
        for (const float score : scores_) least = std::min(least, score);
        const float most = std::max(least, (1.0F + tolerance) * least);  // rounding may go below 0
        candidates_.clear();
        for (std::size_t i = 0; i < scores_.size(); ++i)
            if (scores_[i] <= most) candidates_.push_back(static_cast<int>(i));
        std::uniform_int_distribution<std::size_t> any(0, candidates_.size() - 1);
        const int found = candidates_[any(random)];
        return {found / columns, found % columns};
    }

    void lay(Place origin, const Mask& mask, Place from) {
        const int h = patch_.height, w = patch_.width;
        const auto pixel = [&](int r, int c) { return at(from.row + r, from.column + c, sample_.width); };
        const auto error = [&](int r, int c) {
            const Colour &a = features_[pixel(r, c)],
                         &b = features_[map_[on_torus(origin.row + r, origin.column + c)]];
            float sum = 0.0F;
            for (std::size_t p = 0; p < a.size(); ++p) sum += (a[p] - b[p]) * (a[p] - b[p]);
            return sum;
        };
        const auto left = boundary_cut(h, mask.left, error);
        const auto right = boundary_cut(h, mask.right, [&](int r, int c) { return error(r, w - 1 - c); });
        const auto top = boundary_cut(w, mask.top, [&](int c, int r) { return error(r, c); });
        const auto bottom = boundary_cut(w, mask.bottom, [&](int c, int r) { return error(h - 1 - r, c); });
        for (int r = 0; r < h; ++r)
            for (int c = 0; c < w; ++c) {
                const auto row = static_cast<std::size_t>(r), column = static_cast<std::size_t>(c);
                if (c >= left[row] && w - 1 - c >= right[row] && r >= top[column] &&
                    h - 1 - r >= bottom[column])
                    map_[on_torus(origin.row + r, origin.column + c)] =
                        static_cast<std::uint32_t>(pixel(r, c));
            }
    }

    Size sample_;
    int block_, overlap_;
    std::size_t half_;
    Plan forward_, inverse_;
    Buffer<float> image_, correlation_;
    Buffer<fftwf_complex> sample_spectra_, spectra_, product_;
    std::vector<Colour> features_;
    std::vector<double> squares_;  ///< above and left of each place
    std::map<std::tuple<int, int, Mask>, std::vector<float>> energies_;
    std::vector<float> scores_;
    std::vector<int> candidates_;
    Size torus_, patch_;
    std::vector<std::uint32_t> map_;
};

Roller::Roller(const Image& sample, int block, int overlap)
    : impl_(std::make_unique<Impl>(sample, block, overlap)) {}
Roller::~Roller() = default;
std::vector<std::uint32_t> Roller::quilt(Size size, unsigned seed) {
    return impl_->quilt(size, seed);
}

}  // namespace btfield::peer

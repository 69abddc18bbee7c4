#include "host/analysis/lag_products.hpp"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdlib>
#include <cstring>

#include "host/base/parallel.hpp"
#include "host/base/work_part.hpp"

namespace btfield::detail {
namespace {

using std::size_t;

// Products are taken in tiles of up to 3 planes × 4 lags: every row value that is loaded then takes part in
// several products, and the sums still fit the 16 vector registers of AVX2.
constexpr int tile_planes = 3;
constexpr int tile_lags = 4;
// Rows are padded with zeros to a multiple of the widest vector, so that the loops have no tail.
constexpr size_t padding = 4;

struct Tile {
    int planes = 0, lags = 0;
    std::array<const double*, tile_planes> x{};  ///< centred rows of planes i, zero beyond their end
    std::array<const double*, tile_lags> y{};    ///< centred row of plane j, wrapped and shifted by each lag
    size_t length = 0;                           ///< multiple of `padding`
};

/// work(0), …, work(Count − 1), unrolled: arrays indexed by the counter then live in registers.
template <int Count, class Work>
[[gnu::always_inline]] inline void unrolled(const Work& work) {
    if constexpr (Count > 0) {
        unrolled<Count - 1>(work);
        work(Count - 1);
    }
}

template <class Lanes>
[[gnu::always_inline]] inline void load(Lanes& lanes, const double* values) {
    std::memcpy(&lanes, values, sizeof(Lanes));
}

/// out[p · tile_lags + l] += sum_c x_p[c] y[c + shift_l]
template <class Lanes, int Planes, int Lags>
[[gnu::always_inline]] inline void add_products(const Tile& tile, double* out) {
    constexpr size_t width = sizeof(Lanes) / sizeof(double);
    const std::array<const double*, tile_planes> rows = tile.x;
    const std::array<const double*, tile_lags> shifted = tile.y;
    Lanes sums[Planes][Lags] = {};
    for (size_t c = 0; c < tile.length; c += width) {
        Lanes x[Planes];
        unrolled<Planes>([&](int p) __attribute__((always_inline)) {
            load(x[p], rows[static_cast<size_t>(p)] + c);
        });
        unrolled<Lags>([&](int l) __attribute__((always_inline)) {
            Lanes y;
            load(y, shifted[static_cast<size_t>(l)] + c);
            unrolled<Planes>([&](int p) __attribute__((always_inline)) { sums[p][l] += x[p] * y; });
        });
    }
    for (int p = 0; p < Planes; ++p) {
        for (int l = 0; l < Lags; ++l) {
            double total = 0.0;
            for (size_t k = 0; k < width; ++k) total += sums[p][l][k];
            out[p * tile_lags + l] += total;
        }
    }
}

template <class Lanes>
[[gnu::always_inline]] inline void add_tile(const Tile& tile, double* out) {
    switch (tile.planes * 10 + tile.lags) {
        case 11:
            return add_products<Lanes, 1, 1>(tile, out);
        case 12:
            return add_products<Lanes, 1, 2>(tile, out);
        case 13:
            return add_products<Lanes, 1, 3>(tile, out);
        case 14:
            return add_products<Lanes, 1, 4>(tile, out);
        case 21:
            return add_products<Lanes, 2, 1>(tile, out);
        case 22:
            return add_products<Lanes, 2, 2>(tile, out);
        case 23:
            return add_products<Lanes, 2, 3>(tile, out);
        case 24:
            return add_products<Lanes, 2, 4>(tile, out);
        case 31:
            return add_products<Lanes, 3, 1>(tile, out);
        case 32:
            return add_products<Lanes, 3, 2>(tile, out);
        case 33:
            return add_products<Lanes, 3, 3>(tile, out);
        case 34:
            return add_products<Lanes, 3, 4>(tile, out);
        default:
            return;
    }
}

using TwoLanes [[gnu::vector_size(16)]] = double;
void add_tile_baseline(const Tile& tile, double* out) {
    add_tile<TwoLanes>(tile, out);
}

#if defined(__x86_64__)
using FourLanes [[gnu::vector_size(32)]] = double;
[[gnu::target("avx2,fma")]] void add_tile_avx2(const Tile& tile, double* out) {
    add_tile<FourLanes>(tile, out);
}
#endif

using AddTile = void (*)(const Tile&, double*);

AddTile choose_add_tile() {
#if defined(__x86_64__)
    if (__builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma")) return add_tile_avx2;
#endif
    return add_tile_baseline;
}

/// Centred rows of all planes: [plane][row][pad + column + pad], columns continued by wrap.
class RowBuffer {
  public:
    RowBuffer(int planes, int rows, int width, int pad)
        : pad_(pad),
          width_(width),
          rows_(rows),
          stride_(static_cast<size_t>(width) + 2 * static_cast<size_t>(pad) + padding),
          values_(static_cast<size_t>(planes) * static_cast<size_t>(rows) * stride_) {}

    void fill(const Image& image, std::span<const double> means, int first_row, int rows) {
        const auto width = static_cast<size_t>(width_);
        const auto pad = static_cast<size_t>(pad_);
        for (int plane = 0; plane < image.planes(); ++plane) {
            const double mean = means[static_cast<size_t>(plane)];
            const std::span<const float> values = image.plane(plane);
            for (int k = 0; k < rows; ++k) {
                const int row = (first_row + k) % image.height();
                const float* source = values.data() + static_cast<size_t>(row) * width;
                double* target = start(plane, k);
                for (size_t c = 0; c < width; ++c) target[pad + c] = static_cast<double>(source[c]) - mean;
                for (size_t c = pad; c-- > 0;) target[c] = target[c + width];
                for (size_t c = 0; c < pad; ++c) target[pad + width + c] = target[pad + c];
            }
        }
    }
    [[nodiscard]] const double* row(int plane, int k) const {
        return values_.data() + offset(plane, k) + static_cast<size_t>(pad_);
    }

  private:
    [[nodiscard]] size_t offset(int plane, int k) const {
        return (static_cast<size_t>(plane) * static_cast<size_t>(rows_) + static_cast<size_t>(k)) * stride_;
    }
    [[nodiscard]] double* start(int plane, int k) { return values_.data() + offset(plane, k); }
    int pad_, width_, rows_;
    size_t stride_;
    std::vector<double> values_;
};

size_t lag_count(std::span<const LagRow> lags) {
    size_t count = 0;
    for (const LagRow& row : lags) count += row.columns.size();
    return count;
}

int rows_per_block(const Image& image) {
    // Both buffers of a block should stay in a level-2 cache; the block must not depend on the number of
    // threads.
    const auto row_values = static_cast<double>(image.width()) * image.planes();
    return std::clamp(static_cast<int>(16384.0 / row_values), 1, 32);
}

/// Products of one row of x with one row of y (all planes), added to sums[lag][i][j].
void add_row(const RowBuffer& x, const RowBuffer& y, int k, int planes, const std::vector<int>& columns,
             size_t length, AddTile add, double* sums) {
    const auto d = static_cast<size_t>(planes);
    Tile tile;
    tile.length = length;
    for (int i = 0; i < planes; i += tile_planes) {
        tile.planes = std::min(tile_planes, planes - i);
        for (int p = 0; p < tile.planes; ++p) tile.x[static_cast<size_t>(p)] = x.row(i + p, k);
        for (int j = 0; j < planes; ++j) {
            const double* row = y.row(j, k);
            for (size_t first = 0; first < columns.size(); first += tile_lags) {
                tile.lags = static_cast<int>(std::min<size_t>(tile_lags, columns.size() - first));
                for (size_t l = 0; l < static_cast<size_t>(tile.lags); ++l)
                    tile.y[l] = row + columns[first + l];
                std::array<double, static_cast<size_t>(tile_planes) * tile_lags> out{};
                add(tile, out.data());
                for (size_t l = 0; l < static_cast<size_t>(tile.lags); ++l) {
                    for (size_t p = 0; p < static_cast<size_t>(tile.planes); ++p) {
                        sums[((first + l) * d + static_cast<size_t>(i) + p) * d + static_cast<size_t>(j)] +=
                            out[p * tile_lags + l];
                    }
                }
            }
        }
    }
}

}  // namespace

std::vector<double> plane_means(const Image& image) {
    const auto planes = static_cast<size_t>(image.planes());
    std::vector<double> means(planes);
    const double pixels = static_cast<double>(area(image.size()));
    for_each_block(image.planes(), [&](int plane) {
        double total = 0.0;
        const std::span<const float> values = image.plane(plane);
        const auto width = static_cast<size_t>(image.width());
        for (size_t start = 0; start < values.size(); start += width) {
            // Four running sums: one alone would wait for each addition in turn.
            std::array<double, 4> sums{};
            size_t c = 0;
            for (; c + 4 <= width; c += 4) {
                for (size_t k = 0; k < 4; ++k) sums[k] += static_cast<double>(values[start + c + k]);
            }
            for (; c < width; ++c) sums[0] += static_cast<double>(values[start + c]);
            total += (sums[0] + sums[1]) + (sums[2] + sums[3]);
        }
        means[static_cast<size_t>(plane)] = total / pixels;
    });
    return means;
}

std::vector<double> lag_products(const Image& image, std::span<const double> means,
                                 std::span<const LagRow> lags) {
    const int planes = image.planes();
    const size_t pair_count = static_cast<size_t>(planes) * static_cast<size_t>(planes);
    const size_t values = lag_count(lags) * pair_count;
    int pad = 0;
    for (const LagRow& row : lags) {
        for (const int column : row.columns) pad = std::max(pad, std::abs(column));
    }
    const int rows = rows_per_block(image);
    const int blocks = (image.height() + rows - 1) / rows;
    const size_t length = (static_cast<size_t>(image.width()) + padding - 1) / padding * padding;
    const AddTile add = choose_add_tile();

    // Blocks are summed in groups of fixed size, to bound the memory that the partial sums take.
    const int group_size = std::max(1, (blocks + 63) / 64);
    const int groups = (blocks + group_size - 1) / group_size;
    std::vector<std::vector<double>> partial(static_cast<size_t>(groups));
    for_each_part(groups, [&](int group) {
        std::vector<double> sums(values);
        RowBuffer x(planes, rows, image.width(), 0);
        RowBuffer y(planes, rows, image.width(), pad);
        const int last = std::min(blocks, (group + 1) * group_size);
        for (int block = group * group_size; block < last; ++block) {
            const int first_row = block * rows;
            const int here = std::min(rows, image.height() - first_row);
            x.fill(image, means, first_row, here);
            double* target = sums.data();
            for (const LagRow& row : lags) {
                y.fill(image, means, first_row + row.row, here);
                for (int k = 0; k < here; ++k) add_row(x, y, k, planes, row.columns, length, add, target);
                target += row.columns.size() * pair_count;
            }
        }
        partial[static_cast<size_t>(group)] = std::move(sums);
    });
    std::vector<double> total(values);
    for (const std::vector<double>& sums : partial) {
        for (size_t k = 0; k < values; ++k) total[k] += sums[k];
    }
    return total;
}

}  // namespace btfield::detail

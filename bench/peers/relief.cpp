#include "bench/peers/relief.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "bench/peers/fftw.hpp"
#include "bench/peers/parallel.hpp"

namespace btfield::peer {
namespace {

using Vector = std::array<float, 3>;

constexpr int block = 256;

/// a⁻¹ y of a symmetric 3 × 3 matrix xx, xy, yy, xz, yz, zz.
Vector solved(const float* a, const float* y) {
    const float c0 = a[2] * a[5] - a[4] * a[4], c1 = a[3] * a[4] - a[1] * a[5],
                c2 = a[1] * a[4] - a[2] * a[3];
    const float inverse = 1.0F / (a[0] * c0 + a[1] * c1 + a[3] * c2);
    const float d1 = a[0] * a[5] - a[3] * a[3], d2 = a[1] * a[3] - a[0] * a[4],
                e2 = a[0] * a[2] - a[1] * a[1];
    return {inverse * (c0 * y[0] + c1 * y[1] + c2 * y[2]), inverse * (c1 * y[0] + d1 * y[1] + d2 * y[2]),
            inverse * (c2 * y[0] + d2 * y[1] + e2 * y[2])};
}

struct Lights {
    std::vector<Vector> direction, inverse;

    explicit Lights(std::span<const std::array<double, 3>> lights) {
        float a[6] = {};
        for (const auto& l : lights) {
            direction.push_back(
                {static_cast<float>(l[0]), static_cast<float>(l[1]), static_cast<float>(l[2])});
            const Vector& d = direction.back();
            a[0] += d[0] * d[0];
            a[1] += d[0] * d[1];
            a[2] += d[1] * d[1];
            a[3] += d[0] * d[2];
            a[4] += d[1] * d[2];
            a[5] += d[2] * d[2];
        }
        for (const Vector& d : direction) inverse.push_back(solved(a, d.data()));
    }
};

/// b of the pixels of a block, [x, y, z][pixel].
struct Block {
    float x[block], y[block], z[block];
};

void start(std::span<const Image> pictures, const Lights& lights, int first, int count, Block& b) {
    std::fill_n(b.x, count, 0.0F);
    std::fill_n(b.y, count, 0.0F);
    std::fill_n(b.z, count, 0.0F);
    for (std::size_t k = 0; k < pictures.size(); ++k) {
        const float* values = pictures[k].values().data() + first;
        const Vector& row = lights.inverse[k];
        for (int i = 0; i < count; ++i) {
            b.x[i] += row[0] * values[i];
            b.y[i] += row[1] * values[i];
            b.z[i] += row[2] * values[i];
        }
    }
}

/// Normals, albedo by least squares over lights that reach the pixel, residual.
void finish(std::span<const Image> pictures, const Lights& lights, int first, int count, const Block& b,
            const float* weights, PixelNormals& result) {
    float length[block], product[block] = {}, square[block] = {}, left[block] = {}, all[block] = {};
    for (int i = 0; i < count; ++i)
        length[i] = std::sqrt(b.x[i] * b.x[i] + b.y[i] * b.y[i] + b.z[i] * b.z[i]) + 1e-30F;
    for (std::size_t k = 0; k < pictures.size(); ++k) {
        const float* values = pictures[k].values().data() + first;
        const Vector& l = lights.direction[k];
        for (int i = 0; i < count; ++i) {
            const float shade = std::max(0.0F, b.x[i] * l[0] + b.y[i] * l[1] + b.z[i] * l[2]);
            const float w = (weights != nullptr ? weights[k * block + static_cast<std::size_t>(i)] : 1.0F);
            left[i] += std::abs(values[i] - shade);
            all[i] += values[i];
            product[i] += w * shade * values[i];
            square[i] += w * shade * shade;
        }
    }
    for (int i = 0; i < count; ++i) {
        const auto at = static_cast<std::size_t>(first + i);
        result.normals.plane(0)[at] = b.x[i] / length[i];
        result.normals.plane(1)[at] = b.y[i] / length[i];
        result.normals.plane(2)[at] = b.z[i] / length[i];
        result.albedo.values()[at] = length[i] * product[i] / (square[i] + 1e-30F);
        result.residual.values()[at] = left[i] / (all[i] + 1e-30F);
    }
}

/// work(first, count) for all blocks of pixels.
template <class Work>
void for_blocks(Size size, const Work& work) {
    const auto pixels = static_cast<int>(area(size));
    const int blocks = (pixels + block - 1) / block;
    parallel([&](int thread) {
        for (int n = share(blocks, thread); n < share(blocks, thread + 1); ++n)
            work(n * block, std::min(block, pixels - n * block));
    });
}

PixelNormals room(Size size) {
    return {Image(size, 3), Image(size, 1), Image(size, 1)};
}

/// Value of this rank of each pixel, from [light][pixel].
void of_rank(const float* values, int lights, int count, const int* rank, float* result) {
    std::vector<float> column(static_cast<std::size_t>(lights));
    for (int i = 0; i < count; ++i) {
        for (int k = 0; k < lights; ++k) column[static_cast<std::size_t>(k)] = values[k * block + i];
        std::nth_element(column.begin(), column.begin() + rank[i], column.end());
        result[i] = column[static_cast<std::size_t>(rank[i])];
    }
}

/// What twelve steps need of a block.
struct Reweighting {
    int lights, count;
    std::vector<float> values, sizes, weights;  ///< [light][pixel]
    float gate[block], floor[block];

    Reweighting(std::span<const Image> pictures, int first, int pixels)
        : lights(static_cast<int>(pictures.size())),
          count(pixels),
          values(pictures.size() * block),
          sizes(values.size()),
          weights(values.size()) {
        for (std::size_t k = 0; k < pictures.size(); ++k)
            std::copy_n(pictures[k].values().data() + first, count, values.data() + k * block);
        int rank[block];
        std::fill_n(rank, count, 8 * (lights - 1) / 10);
        of_rank(values.data(), lights, count, rank, gate);
        std::fill_n(rank, count, 9 * (lights - 1) / 10);
        of_rank(values.data(), lights, count, rank, floor);
        for (int i = 0; i < count; ++i) {
            gate[i] *= 0.15F;
            floor[i] = std::max(0.01F * floor[i], 1e-30F);
        }
    }

    void weigh(const Lights& of, const Block& b) {
        int rank[block] = {};
        for (int k = 0; k < lights; ++k) {
            const Vector& l = of.direction[static_cast<std::size_t>(k)];
            const float* value = values.data() + k * block;
            for (int i = 0; i < count; ++i) {
                const float shade = b.x[i] * l[0] + b.y[i] * l[1] + b.z[i] * l[2];
                const bool counts = value[i] >= gate[i];
                sizes[static_cast<std::size_t>(k * block + i)] =
                    counts ? std::abs(value[i] - std::max(0.0F, shade)) : 3e38F;
                weights[static_cast<std::size_t>(k * block + i)] = counts && shade > 0.0F ? 1.0F : 0.0F;
                rank[i] += counts ? 1 : 0;
            }
        }
        float scale[block];
        for (int i = 0; i < count; ++i) rank[i] /= 2;
        of_rank(sizes.data(), lights, count, rank, scale);
        for (int i = 0; i < count; ++i) scale[i] = std::max(1.4826F * scale[i], floor[i]);
        for (int k = 0; k < lights; ++k)
            for (int i = 0; i < count; ++i) {
                const auto at = static_cast<std::size_t>(k * block + i);
                weights[at] *= std::min(1.0F, 1.345F * scale[i] / std::max(sizes[at], 1e-30F));
            }
    }

    void step(const Lights& of, Block& b) const {
        float a[6][block] = {}, y[3][block] = {};
        for (int k = 0; k < lights; ++k) {
            const Vector& l = of.direction[static_cast<std::size_t>(k)];
            const float* value = values.data() + k * block;
            const float* weight = weights.data() + k * block;
            for (int i = 0; i < count; ++i) {
                const float w = weight[i], v = w * value[i];
                a[0][i] += w * (l[0] * l[0]);
                a[1][i] += w * (l[0] * l[1]);
                a[2][i] += w * (l[1] * l[1]);
                a[3][i] += w * (l[0] * l[2]);
                a[4][i] += w * (l[1] * l[2]);
                a[5][i] += w * (l[2] * l[2]);
                y[0][i] += v * l[0];
                y[1][i] += v * l[1];
                y[2][i] += v * l[2];
            }
        }
        for (int i = 0; i < count; ++i) {
            const float of_pixel[6] = {a[0][i] + 1e-12F, a[1][i], a[2][i] + 1e-12F,
                                       a[3][i],          a[4][i], a[5][i] + 1e-12F};
            const float right[3] = {y[0][i], y[1][i], y[2][i]};
            const Vector next = solved(of_pixel, right);
            b.x[i] = next[0];
            b.y[i] = next[1];
            b.z[i] = next[2];
        }
    }
};

}  // namespace

PixelNormals least_squares(std::span<const Image> pictures, std::span<const std::array<double, 3>> lights) {
    const Lights of(lights);
    PixelNormals result = room(pictures.front().size());
    for_blocks(pictures.front().size(), [&](int first, int count) {
        Block b;
        start(pictures, of, first, count, b);
        finish(pictures, of, first, count, b, nullptr, result);
    });
    return result;
}

PixelNormals huber(std::span<const Image> pictures, std::span<const std::array<double, 3>> lights) {
    const Lights of(lights);
    PixelNormals result = room(pictures.front().size());
    for_blocks(pictures.front().size(), [&](int first, int count) {
        Block b;
        start(pictures, of, first, count, b);
        Reweighting steps(pictures, first, count);
        for (int t = 0; t < 12; ++t) {
            steps.weigh(of, b);
            steps.step(of, b);
        }
        steps.weigh(of, b);
        finish(pictures, of, first, count, b, steps.weights.data(), result);
    });
    return result;
}

class Integrator::Impl {
  public:
    explicit Impl(Size size)
        : size_(size),
          image_(allocate<float>(area(size))),
          spectrum_(allocate<fftwf_complex>(spectrum_size(size))),
          forward_(size, 1, Plan::Direction::forward, threads),
          inverse_(size, 1, Plan::Direction::inverse, threads) {
        for (int k = 0; k < size.height; ++k) down_.push_back(square_of_sine(k, size.height));
        for (int k = 0; k <= size.width / 2; ++k) across_.push_back(square_of_sine(k, size.width));
    }

    Image integrate(const Image& slopes) {
        adjoint(slopes);
        forward_.forward(image_.get(), spectrum_.get());
        divide();
        inverse_.inverse(spectrum_.get(), image_.get());
        Image height(size_, 1);
        std::copy_n(image_.get(), area(size_), height.values().data());
        return height;
    }

  private:
    static float square_of_sine(int k, int n) {
        const double sine = std::sin(2.0 * std::numbers::pi * k / n);
        return static_cast<float>(2 * k == n ? 0.0 : sine * sine);
    }

    void adjoint(const Image& slopes) {
        const int width = size_.width, height = size_.height;
        parallel([&](int thread) {
            for (int r = share(height, thread); r < share(height, thread + 1); ++r) {
                const auto row = [&](int plane, int at) {
                    return slopes.plane(plane).data() +
                           static_cast<std::size_t>(at) * static_cast<std::size_t>(width);
                };
                const float *p = row(0, r), *above = row(1, (r + height - 1) % height),
                            *below = row(1, (r + 1) % height);
                float* to = image_.get() + static_cast<std::size_t>(r) * static_cast<std::size_t>(width);
                to[0] = -0.5F * (p[1] - p[width - 1] + below[0] - above[0]);
                for (int c = 1; c < width - 1; ++c)
                    to[c] = -0.5F * (p[c + 1] - p[c - 1] + below[c] - above[c]);
                to[width - 1] = -0.5F * (p[0] - p[width - 2] + below[width - 1] - above[width - 1]);
            }
        });
    }

    void divide() {
        const float scale = 1.0F / static_cast<float>(area(size_));
        parallel([&](int thread) {
            for (int r = share(size_.height, thread); r < share(size_.height, thread + 1); ++r) {
                fftwf_complex* row = spectrum_.get() + static_cast<std::size_t>(r) * across_.size();
                for (std::size_t c = 0; c < across_.size(); ++c) {
                    const float lambda = across_[c] + down_[static_cast<std::size_t>(r)];
                    const float factor = lambda > 0.0F ? scale / lambda : 0.0F;
                    row[c][0] *= factor;
                    row[c][1] *= factor;
                }
            }
        });
    }

    Size size_;
    Buffer<float> image_;
    Buffer<fftwf_complex> spectrum_;
    Plan forward_, inverse_;
    std::vector<float> across_, down_;
};

Integrator::Integrator(Size size) : impl_(std::make_unique<Impl>(size)) {}
Integrator::~Integrator() = default;

Image Integrator::operator()(const Image& slopes) {
    return impl_->integrate(slopes);
}

}  // namespace btfield::peer

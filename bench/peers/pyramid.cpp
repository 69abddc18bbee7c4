#include "bench/peers/pyramid.hpp"

#include <array>

#include "bench/peers/parallel.hpp"

namespace btfield::peer {
namespace {

constexpr std::array<float, 5> w{0.05F, 0.25F, 0.4F, 0.25F, 0.05F};

std::size_t at(int row, int width) {
    return static_cast<std::size_t>(row) * static_cast<std::size_t>(width);
}

/// Rows [begin, end) of ↓2(fine ⊗ w).
void reduce(const float* fine, Size size, float* coarse, int begin, int end) {
    std::vector<float> line(static_cast<std::size_t>(size.width) + 4);
    const int h = size.height, n = size.width;
    for (int r = begin; r < end; ++r) {
        std::array<const float*, 5> rows{};
        for (int k = 0; k < 5; ++k) rows[static_cast<std::size_t>(k)] = fine + at((2 * r + k - 2 + h) % h, n);
        for (int c = 0; c < n; ++c)
            line[static_cast<std::size_t>(c) + 2] =
                w[0] * (rows[0][c] + rows[4][c]) + w[1] * (rows[1][c] + rows[3][c]) + w[2] * rows[2][c];
        line[0] = line[static_cast<std::size_t>(n)];
        line[1] = line[static_cast<std::size_t>(n) + 1];
        line[static_cast<std::size_t>(n) + 2] = line[2];
        line[static_cast<std::size_t>(n) + 3] = line[3];
        float* out = coarse + at(r, n / 2);
        for (int c = 0; c < n / 2; ++c) {
            const float* x = line.data() + 2 * static_cast<std::ptrdiff_t>(c);
            out[c] = w[0] * (x[0] + x[4]) + w[1] * (x[1] + x[3]) + w[2] * x[2];
        }
    }
}

/// fine += sign · ↑2(coarse) on rows [begin, end) of fine.
void expand(const float* coarse, Size size, float sign, float* fine, int begin, int end) {
    const int h = size.height, n = size.width;
    std::vector<float> line(static_cast<std::size_t>(n) + 2);
    for (int r = begin; r < end; ++r) {
        const int q = r / 2;
        const float* here = coarse + at(q, n);
        const float* below = coarse + at((q + 1) % h, n);
        const float* above = coarse + at((q + h - 1) % h, n);
        float* middle = line.data() + 1;
        if (r % 2 == 0)
            for (int c = 0; c < n; ++c) middle[c] = sign * (0.1F * (above[c] + below[c]) + 0.8F * here[c]);
        else
            for (int c = 0; c < n; ++c) middle[c] = sign * 0.5F * (here[c] + below[c]);
        middle[-1] = middle[n - 1];
        middle[n] = middle[0];
        float* out = fine + at(r, 2 * n);
        for (int c = 0; c < n; ++c) {
            out[2 * c] += 0.1F * (middle[c - 1] + middle[c + 1]) + 0.8F * middle[c];
            out[2 * c + 1] += 0.5F * (middle[c] + middle[c + 1]);
        }
    }
}

}  // namespace

void add_expanded(const float* coarse, Size coarse_size, float* fine, int begin, int end) {
    expand(coarse, coarse_size, 1.0F, fine, begin, end);
}

std::vector<Image> decompose(const Image& image, int levels) {
    std::vector<Image> result{image};
    for (int k = 1; k < levels; ++k) {
        Image& fine = result.back();
        Image coarse({fine.height() / 2, fine.width() / 2}, fine.planes(), fine.space());
        parallel([&](int t) {
            for (int p = 0; p < fine.planes(); ++p)
                reduce(fine.plane(p).data(), fine.size(), coarse.plane(p).data(), share(coarse.height(), t),
                       share(coarse.height(), t + 1));
        });
        parallel([&](int t) {
            for (int p = 0; p < fine.planes(); ++p)
                expand(coarse.plane(p).data(), coarse.size(), -1.0F, fine.plane(p).data(),
                       share(fine.height(), t), share(fine.height(), t + 1));
        });
        result.push_back(std::move(coarse));
    }
    return result;
}

}  // namespace btfield::peer

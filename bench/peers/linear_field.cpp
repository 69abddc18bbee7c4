#include "bench/peers/linear_field.hpp"

#include <algorithm>
#include <array>
#include <vector>

#include "bench/peers/parallel.hpp"

namespace btfield::peer {

using std::size_t;

void convolve(std::span<const Offset> offsets, std::span<const float> m, int planes, Size size,
              std::span<const float> noise, std::span<float> out) {
    int margin = 0;
    for (const Offset s : offsets) margin = std::max({margin, s.column, -s.column});
    const auto width = static_cast<size_t>(size.width), pad = static_cast<size_t>(margin);
    const auto height = static_cast<size_t>(size.height), d = static_cast<size_t>(planes);
    const size_t pitch = width + 2 * pad;
    std::vector<float> padded(d * height * pitch);
    parallel([&](int t) {
        for (size_t row = static_cast<size_t>(share(static_cast<int>(d * height), t));
             row < static_cast<size_t>(share(static_cast<int>(d * height), t + 1)); ++row) {
            const float* from = noise.data() + row * width;
            float* to = padded.data() + row * pitch;
            for (size_t c = 0; c < pitch; ++c) to[c] = from[(c + width - pad % width) % width];
        }
    });
    parallel([&](int t) {
        for (int r = share(size.height, t); r < share(size.height, t + 1); ++r) {
            for (size_t i = 0; i < d; ++i) {
                float* y = out.data() + (i * height + static_cast<size_t>(r)) * width;
                std::fill_n(y, width, 0.0F);
                for (size_t s = 0; s < offsets.size(); ++s) {
                    const int from = ((r - offsets[s].row) % size.height + size.height) % size.height;
                    for (size_t j = 0; j < d; ++j) {
                        const float a = m[(s * d + i) * d + j];
                        const float* x = padded.data() + (j * height + static_cast<size_t>(from)) * pitch +
                                         static_cast<size_t>(margin - offsets[s].column);
                        for (size_t c = 0; c < width; ++c) y[c] += a * x[c];
                    }
                }
            }
        }
    });
}

void causal_recursion(std::span<const Offset> offsets, std::span<const float> a, std::span<const float> root,
                      int planes, Size size, std::span<float> field) {
    constexpr size_t most = 8;
    const auto d = static_cast<size_t>(planes);
    for (int r = 0; r < size.height; ++r) {
        for (int c = 0; c < size.width; ++c) {
            float* here =
                field.data() +
                (static_cast<size_t>(r) * static_cast<size_t>(size.width) + static_cast<size_t>(c)) * d;
            std::array<float, most> sum{};
            for (size_t i = 0; i < d; ++i)
                for (size_t j = 0; j <= i; ++j) sum[i] += root[i * d + j] * here[j];
            for (size_t s = 0; s < offsets.size(); ++s) {
                const int row = r + offsets[s].row, column = c + offsets[s].column;
                if (row < 0 || column < 0 || column >= size.width) continue;
                const float* x = field.data() + (static_cast<size_t>(row) * static_cast<size_t>(size.width) +
                                                 static_cast<size_t>(column)) *
                                                    d;
                for (size_t i = 0; i < d; ++i)
                    for (size_t j = 0; j < d; ++j) sum[i] += a[(s * d + i) * d + j] * x[j];
            }
            std::copy_n(sum.data(), d, here);
        }
    }
}

}  // namespace btfield::peer

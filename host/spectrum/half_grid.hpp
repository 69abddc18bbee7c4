#pragma once

// Half of a frequency grid, row by row: f(−ω) = conj f(ω) gives the rest (theory 1.2).

#include <algorithm>
#include <complex>
#include <cstddef>
#include <vector>

namespace btfield::detail {

/// Rows m = 0 … N/2 of a uniform grid of N rows stand for all: how many each stands for.
[[nodiscard]] constexpr int row_weight(int m, int rows) {
    return m == 0 || 2 * m == rows ? 1 : 2;
}
[[nodiscard]] constexpr int half_rows(int rows) {
    return rows / 2 + 1;
}

/// Consecutive rows that a thread visits one after another. The division depends on the grid alone: sums
/// taken block by block are the same for any number of threads.
struct RowBlocks {
    int rows, per_block, count;
    /// \param all  rows that are visited
    /// \param most blocks: less where the sums of one are large
    explicit RowBlocks(int all, int most = 32)
        : rows(all), per_block((all + most - 1) / most), count((all + per_block - 1) / per_block) {}
    [[nodiscard]] int first(int block) const { return block * per_block; }
    [[nodiscard]] int last(int block) const { return std::min(rows, (block + 1) * per_block); }
};

/// e^{2πi k / n}, from a table.
class RootsOfUnity {
  public:
    explicit RootsOfUnity(int n);
    [[nodiscard]] std::complex<double> operator()(long long k) const {
        const auto n = static_cast<long long>(roots_.size());
        return roots_[static_cast<std::size_t>(((k % n) + n) % n)];
    }

  private:
    std::vector<std::complex<double>> roots_;
};

}  // namespace btfield::detail

#pragma once

// All pictures of one view, as few planes (theory 21.2).

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <utility>
#include <vector>

#include "btfield/image.hpp"
#include "host/base/eigen.hpp"

namespace btfield::detail {

/// Numbers that do not change any more, in memory or in a file that is mapped; copies share them.
class SharedNumbers {
  public:
    SharedNumbers() = default;
    explicit SharedNumbers(std::vector<std::int16_t> numbers) {
        const auto owner = std::make_shared<const std::vector<std::int16_t>>(std::move(numbers));
        numbers_ = *owner;
        owner_ = owner;
    }
    /// \param owner  of their memory
    SharedNumbers(std::shared_ptr<const void> owner, std::span<const std::int16_t> numbers)
        : owner_(std::move(owner)), numbers_(numbers) {}
    [[nodiscard]] std::span<const std::int16_t> span() const { return numbers_; }

  private:
    std::shared_ptr<const void> owner_;
    std::span<const std::int16_t> numbers_;
};

/// Relative pictures z = √(I / μ) of a view: z ≈ offset + A B, a row for each colour of each picture. A has
/// orthonormal columns, B is kept in 16 bits.
struct ReducedView {
    std::vector<double> mean;      ///< μ of each row, in the unit of I; 0 of black ones, whose z is 0
    std::vector<double> contrast;  ///< standard deviation of I as a share of μ
    std::vector<double> offset;    ///< mean of z
    RowMajorMatrix basis;          ///< A
    SharedNumbers values;          ///< B, [pixel][column of A], in units of `units`
    std::vector<double> units;
    double energy = 0.0;  ///< Σ (z − offset)² over rows and pixels
    double lost = 0.0;    ///< what A B leaves of it

    [[nodiscard]] std::size_t rank() const { return units.size(); }
    /// B of pixels [first, first + rows of result).
    void take(std::size_t first, Eigen::Ref<RowMajorMatrix> result) const;
};

/// \param pictures  number of them
/// \param read      called for each, from any thread: I, [colour][pixel], in linear light
/// \param rank      of A at most
[[nodiscard]] ReducedView reduce_view(int pictures, int colours, std::size_t pixels, int rank,
                                      const std::function<void(int, std::span<float>)>& read);

/// Bytes that reduce_view() takes at most, its result among them.
/// \param rows  pictures times colours
[[nodiscard]] double reduction_bytes(std::size_t rows, std::size_t pixels, int rank);
/// Bytes of B.
[[nodiscard]] double reduced_bytes(std::size_t rows, std::size_t pixels, int rank);

/// The part of a view's pictures from (row, column) on.
[[nodiscard]] ReducedView windowed(const ReducedView& view, Size size, int row, int column, Size part);

}  // namespace btfield::detail

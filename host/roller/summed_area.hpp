#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "btfield/image.hpp"
#include "host/base/stop.hpp"

namespace btfield::detail {

/// Sums of integers over rectangles, each in four steps (Crow 1984).
class SummedArea {
  public:
    /// Of nothing.
    SummedArea() = default;
    /// \param value of a pixel, called as value(row, column)
    template <class Value>
    SummedArea(Size size, const Value& value) : pitch_(static_cast<std::size_t>(size.width) + 1) {
        sums_.assign((static_cast<std::size_t>(size.height) + 1) * pitch_, 0);
        for (int r = 0; r < size.height; ++r) {
            if (r % 128 == 0) stop_if_asked();
            std::int64_t row = 0;
            for (int c = 0; c < size.width; ++c) {
                row += value(r, c);
                const std::size_t i =
                    (static_cast<std::size_t>(r) + 1) * pitch_ + static_cast<std::size_t>(c) + 1;
                sums_[i] = sums_[i - pitch_] + row;
            }
        }
    }
    /// Over rows [top, bottom) and columns [left, right); 0 where there are none.
    [[nodiscard]] std::int64_t sum(int top, int left, int bottom, int right) const {
        if (bottom <= top || right <= left) return 0;
        const auto at = [&](int r, int c) {
            return sums_[static_cast<std::size_t>(r) * pitch_ + static_cast<std::size_t>(c)];
        };
        return at(bottom, right) - at(top, right) - at(bottom, left) + at(top, left);
    }

  private:
    std::size_t pitch_ = 0;
    std::vector<std::int64_t> sums_;
};

}  // namespace btfield::detail

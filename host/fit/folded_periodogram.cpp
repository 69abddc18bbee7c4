#include "host/fit/folded_periodogram.hpp"

#include <algorithm>
#include <complex>
#include <cstddef>
#include <numbers>
#include <span>

#include "btfield/error.hpp"
#include "host/analysis/picture_spectra.hpp"
#include "host/base/parallel.hpp"

namespace btfield::detail {
namespace {

using Complex = std::complex<double>;
using std::size_t;

struct Cells {
    std::vector<double> centre;  ///< ω
    std::vector<double> share;   ///< of the axis' frequencies
    std::vector<int> of;  ///< cell of each frequency 0 … N − 1; −1 where its mirror image stands for it
};

/// Cells of one axis, mirror images of each other around 0.
/// \param both  both signs, else only 0 <= ω <= π
Cells cells_of(int count, bool both) {
    Cells cells;
    cells.of.assign(static_cast<size_t>(count), -1);
    const double unit = 2.0 * std::numbers::pi / count;
    const auto add = [&](int first, int last) {
        const int cell = static_cast<int>(cells.centre.size());
        cells.centre.push_back(0.5 * unit * (first + last));
        cells.share.push_back(static_cast<double>(last - first + 1) / count);
        for (int k = first; k <= last; ++k) cells.of[static_cast<size_t>((k + count) % count)] = cell;
    };
    add(0, 0);
    const int half = (count - 1) / 2;  // beyond it only count / 2 for even counts, its own mirror image
    for (int k = 1; k <= half;) {
        const int width = std::clamp(k / 12, 1, std::max(1, count / 100));
        const int last = std::min(half, k + width - 1);
        add(k, last);
        if (both) add(-last, -k);
        k = last + 1;
    }
    if (count % 2 == 0) add(count / 2, count / 2);
    return cells;
}

/// \param height of the picture
FrequencyGrid grid_of(const Cells& rows, int height, const Cells& columns) {
    FrequencyGrid grid;
    grid.row = rows.centre;
    for (size_t m = 0; m < rows.centre.size(); ++m) {
        const bool own_mirror = m == 0 || (height % 2 == 0 && m + 1 == rows.centre.size());
        grid.row_weight.push_back((own_mirror ? 1.0 : 2.0) * rows.share[m]);
    }
    grid.column = columns.centre;
    grid.column_weight = columns.share;
    return grid;
}

/// Adds the products a conj(b) of one row of frequencies to the cells that hold them.
void add_products(std::span<const Complex> a, std::span<const Complex> b, const Cells& columns, double* re,
                  double* im) {
    for (size_t n = 0; n < a.size(); ++n) {
        const Complex product = a[n] * std::conj(b[n]);
        re[columns.of[n]] += product.real();
        im[columns.of[n]] += product.imag();
    }
}

/// Mean of the periodogram over each cell of one row of cells.
/// \param members rows of frequencies that it holds
LaneMatrix row_of_cells(const std::vector<PictureSpectrum>& spectra, Size size,
                        const std::vector<int>& members, const Cells& columns) {
    const auto width = static_cast<size_t>(size.width);
    LaneMatrix row(static_cast<int>(spectra.size()), columns.centre.size());
    for (int i = 0; i < row.planes(); ++i) {
        for (int j = 0; j <= i; ++j) {
            for (const int member : members) {
                const auto line = [&](int plane) {
                    return std::span(spectra[static_cast<size_t>(plane)])
                        .subspan(static_cast<size_t>(member) * width, width);
                };
                add_products(line(i), line(j), columns, row.real(i, j), row.imaginary(i, j));
            }
            for (size_t n = 0; n < row.lanes(); ++n) {
                const double count = columns.share[n] * size.width * static_cast<double>(members.size());
                const double scale = 1.0 / (count * static_cast<double>(area(size)));
                row.real(i, j)[n] *= scale;
                row.imaginary(i, j)[n] *= scale;
            }
        }
    }
    row.complete_hermitian();
    return row;
}

}  // namespace

FoldedPeriodogram folded_periodogram(const Image& image) {
    if (image.planes() < 1 || area(image.size()) == 0) {
        throw InputError("periodogram of a picture", "the picture is empty",
                         "give a picture with at least one pixel");
    }
    const std::vector<PictureSpectrum> spectra = spectra_of(image);
    const Cells rows = cells_of(image.height(), false), columns = cells_of(image.width(), true);
    std::vector<std::vector<int>> members(rows.centre.size());
    for (int row = 0; row < image.height(); ++row) {
        if (const int cell = rows.of[static_cast<size_t>(row)]; cell >= 0)
            members[static_cast<size_t>(cell)].push_back(row);
    }
    FoldedPeriodogram result{grid_of(rows, image.height(), columns), std::vector<LaneMatrix>(members.size())};
    for_each_block(static_cast<int>(members.size()), [&](int block) {
        const auto m = static_cast<size_t>(block);
        result.rows[m] = row_of_cells(spectra, image.size(), members[m], columns);
    });
    return result;
}

}  // namespace btfield::detail

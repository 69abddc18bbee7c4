#include "btfield/lag_covariance.hpp"

#include <algorithm>
#include <limits>
#include <map>
#include <string>

#include "btfield/error.hpp"
#include "host/analysis/lag_products.hpp"
#include "host/base/text.hpp"

namespace btfield {

using namespace detail;

namespace {

using std::size_t;

int wrap(int value, int period) {
    const int rest = value % period;
    return rest < 0 ? rest + period : rest;
}

/// The representative of a column lag that needs the least padding: −W/2 < c <= W/2.
int nearest_column(int value, int width) {
    const int rest = wrap(value, width);
    return rest > width / 2 ? rest - width : rest;
}

void require_pixels(const Image& image, const char* asked) {
    if (image.planes() < 1 || area(image.size()) == 0) {
        throw InputError(asked, "the picture is empty", "give a picture with at least one pixel");
    }
}

}  // namespace

LagCovariance::LagCovariance(int planes, Size size, Offset box) : planes_(planes), size_(size), box_(box) {
    const std::string asked =
        "lag covariances of " + detail::counted(planes, "plane") + " up to lag " + detail::text_of(box);
    if (planes < 1) throw InputError(asked, "there is no plane", "use at least one");
    if (box.row < 0 || box.column < 0) throw InputError(asked, "the box is negative", "use lags from 0 up");
    const double count = (static_cast<double>(box.row) + 1.0) * (2.0 * box.column + 1.0) *
                         static_cast<double>(planes) * static_cast<double>(planes);
    if (!(count < 1e9)) throw InputError(asked, "the box is too large", "use a smaller support");
    mean_.resize(static_cast<size_t>(planes));
    values_.resize(static_cast<size_t>(count));
}

void LagCovariance::set(int i, int j, Offset s, double value) {
    if (in_half(s)) values_[index(i, j, s)] = value;
    if (in_half(-s)) values_[index(j, i, -s)] = value;
}

LagCovariance lag_covariance(const Image& image, Offset box) {
    require_pixels(image, "lag covariances");
    LagCovariance statistic(image.planes(), image.size(), box);
    const std::vector<double> means = plane_means(image);
    std::copy(means.begin(), means.end(), statistic.mean().begin());

    std::vector<LagRow> lags;
    std::vector<Offset> offsets;
    for (int row = 0; row <= box.row; ++row) {
        LagRow& lag = lags.emplace_back();
        lag.row = wrap(row, image.height());
        for (int column = row == 0 ? 0 : -box.column; column <= box.column; ++column) {
            lag.columns.push_back(nearest_column(column, image.width()));
            offsets.push_back({row, column});
        }
    }
    const std::vector<double> sums = lag_products(image, means, lags);
    const double pixels = static_cast<double>(area(image.size()));
    size_t next = 0;
    for (const Offset s : offsets) {
        for (int i = 0; i < image.planes(); ++i) {
            for (int j = 0; j < image.planes(); ++j) statistic.set(i, j, s, sums[next++] / pixels);
        }
    }
    return statistic;
}

std::vector<double> covariances_at(const Image& image, std::span<const Offset> lags) {
    require_pixels(image, "covariances at given lags");
    const std::vector<double> means = plane_means(image);

    // Lags of one row offset share the rows that they read; each (row, column) is computed once.
    std::map<int, std::map<int, size_t>> wanted;
    for (const Offset s : lags)
        wanted[wrap(s.row, image.height())][nearest_column(s.column, image.width())] = 0;
    std::vector<LagRow> rows;
    size_t next = 0;
    for (auto& [row, columns] : wanted) {
        LagRow& lag = rows.emplace_back();
        lag.row = row;
        for (auto& [column, position] : columns) {
            lag.columns.push_back(column);
            position = next++;
        }
    }
    const std::vector<double> sums = lag_products(image, means, rows);
    const double pixels = static_cast<double>(area(image.size()));
    const size_t pairs = static_cast<size_t>(image.planes()) * static_cast<size_t>(image.planes());
    std::vector<double> values;
    values.reserve(lags.size() * pairs);
    for (const Offset s : lags) {
        const size_t position = wanted[wrap(s.row, image.height())][nearest_column(s.column, image.width())];
        for (size_t k = 0; k < pairs; ++k) values.push_back(sums[position * pairs + k] / pixels);
    }
    return values;
}

std::vector<Offset> probe_lags(Size size) {
    std::vector<Offset> lags = {{0, 0}};
    const int side = std::min(size.height, size.width);
    for (const int h : {1, 2, 4, 8, 16}) {
        if (2 * h >= side) break;
        lags.insert(lags.end(), {Offset{0, h}, Offset{h, 0}, Offset{h, h}, Offset{h, -h}});
    }
    return lags;
}

}  // namespace btfield

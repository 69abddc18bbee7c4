#include "host/btf/picture_factors.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <span>
#include <utility>

#include "btfield/threads.hpp"
#include "host/base/decompositions.hpp"
#include "host/base/dense.hpp"
#include "host/base/parallel.hpp"

namespace btfield::detail {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;

/// Columns beside those that are asked for, so that these are the leading ones.
constexpr int spare_components = 16;
/// Pixels that are worked on together, and pictures, by bytes of their values.
constexpr Index block_pixels = 1024;
constexpr std::size_t batch_bytes = std::size_t{96} << 20U;
constexpr std::size_t most_at_once = 64;
/// Pictures whose rows are multiplied together.
constexpr std::size_t pictures_of_block = 8;

/// +1 or −1, of a place: the finalisation of SplitMix64 (Steele, Lea and Flood 2014).
double sign_at(std::uint64_t place) {
    std::uint64_t z = 0x9e3779b97f4a7c15U * (place + 1);
    z = (z ^ z >> 30U) * 0xbf58476d1ce4e5b9U;
    z = (z ^ z >> 27U) * 0x94d049bb133111ebU;
    return ((z ^ z >> 31U) & 1U) != 0 ? 1.0 : -1.0;
}

class PictureRows {
  public:
    PictureRows(const BtfSet& set, const std::function<Image(Image)>& prepared,
                const std::function<void(std::uint64_t)>& progress)
        : set_(&set), prepared_(&prepared), progress_(&progress), pairs_(set.pictures()) {}

    [[nodiscard]] Index pixels() const { return static_cast<Index>(area(set_->size())); }
    [[nodiscard]] Index rows() const { return static_cast<Index>(pairs_.size()) * set_->planes(); }

    /// A basis of pixels, and A times it: a reading.
    struct Reading {
        RowMajorMatrix projected;  ///< A B, [row][column]
        double energy = 0.0;
    };
    /// \param back  Aᵀ A B, where it is wanted
    [[nodiscard]] Reading read(const RowMajorMatrix& basis, RowMajorMatrix* back);

  private:
    [[nodiscard]] std::size_t at_once() const {
        const std::size_t bytes =
            static_cast<std::size_t>(pixels()) * static_cast<std::size_t>(set_->planes()) * sizeof(double);
        return std::clamp<std::size_t>(batch_bytes / bytes, pictures_of_block, most_at_once);
    }
    /// Some pictures as rows, and their part of A B.
    void read_block(std::size_t first, std::size_t count, Rows rows, const RowMajorMatrix& basis,
                    const Rows& projected) const;

    const BtfSet* set_;
    const std::function<Image(Image)>* prepared_;
    const std::function<void(std::uint64_t)>* progress_;
    std::vector<BtfPair> pairs_;
    std::uint64_t told_ = 0;
};

void PictureRows::read_block(std::size_t first, std::size_t count, Rows rows, const RowMajorMatrix& basis,
                             const Rows& projected) const {
    const Index planes = set_->planes();
    for (std::size_t i = 0; i < count; ++i) {
        const BtfPair& pair = pairs_[first + i];
        const Image picture = (*prepared_)(set_->picture(pair.view, pair.light));
        for (Index c = 0; c < planes; ++c) {
            const std::span<const float> from = picture.plane(static_cast<int>(c));
            double* const to = rows.data() + (static_cast<Index>(i) * planes + c) * rows.outerStride();
            std::ranges::transform(from, to, [](float value) { return static_cast<double>(value); });
        }
    }
    for (Index at = 0; at < pixels(); at += block_pixels) {
        const Index size = std::min(block_pixels, pixels() - at);
        add_product(rows.middleCols(at, size), basis.middleRows(at, size), projected);
    }
}

PictureRows::Reading PictureRows::read(const RowMajorMatrix& basis, RowMajorMatrix* back) {
    const Index planes = set_->planes(), columns = basis.cols();
    Reading reading;
    reading.projected.setZero(rows(), columns);
    if (back != nullptr) back->setZero(pixels(), columns);
    RowMajorMatrix batch;
    std::vector<double> energy;
    for (std::size_t first = 0; first < pairs_.size(); first += at_once()) {
        const std::size_t count = std::min(at_once(), pairs_.size() - first);
        const Index all = static_cast<Index>(count) * planes, row = static_cast<Index>(first) * planes;
        if (batch.rows() != all) batch.resize(all, pixels());
        const std::size_t blocks = (count + pictures_of_block - 1) / pictures_of_block;
        energy.assign(blocks, 0.0);
        for_each_block(static_cast<int>(blocks), [&](int block) {
            const std::size_t begin = static_cast<std::size_t>(block) * pictures_of_block,
                              size = std::min(pictures_of_block, count - begin);
            const Index own = static_cast<Index>(begin) * planes, height = static_cast<Index>(size) * planes;
            read_block(first + begin, size, batch.middleRows(own, height), basis,
                       reading.projected.middleRows(row + own, height));
            energy[static_cast<std::size_t>(block)] = batch.middleRows(own, height).squaredNorm();
        });
        for (const double part : energy) reading.energy += part;
        if (back != nullptr) {
            const auto blocks_of_pixels = static_cast<int>((pixels() + block_pixels - 1) / block_pixels);
            for_each_block(blocks_of_pixels, [&](int block) {
                const Index at = block * block_pixels, size = std::min(block_pixels, pixels() - at);
                const RowMajorMatrix across = batch.middleCols(at, size).transpose();
                add_product(across, reading.projected.middleRows(row, all), back->middleRows(at, size));
            });
        }
        told_ += count;
        (*progress_)(told_);
    }
    return reading;
}

/// Yᵀ Y, blocks of rows in order.
MatrixXd moments_of(const RowMajorMatrix& y) {
    RowMajorMatrix sum = RowMajorMatrix::Zero(y.cols(), y.cols());
    for (Index at = 0; at < y.rows(); at += block_pixels) {
        const Index size = std::min(block_pixels, y.rows() - at);
        const RowMajorMatrix across = y.middleRows(at, size).transpose();
        add_product(across, y.middleRows(at, size), sum);
    }
    return sum;
}

/// a b, blocks of rows at a time.
RowMajorMatrix long_product(const RowMajorMatrix& a, const RowMajorMatrix& b) {
    RowMajorMatrix result = RowMajorMatrix::Zero(a.rows(), b.cols());
    for_each_block(static_cast<int>((a.rows() + block_pixels - 1) / block_pixels), [&](int block) {
        const Index at = block * block_pixels, size = std::min(block_pixels, a.rows() - at);
        add_product(a.middleRows(at, size), b, result.middleRows(at, size));
    });
    return result;
}

int columns_for(const BtfSet& set, int components) {
    return static_cast<int>(std::min<std::uint64_t>(static_cast<std::uint64_t>(components) + spare_components,
                                                    most_components(set)));
}

}  // namespace

std::uint64_t most_components(const BtfSet& set) {
    return std::min<std::uint64_t>(area(set.size()),
                                   set.pictures().size() * static_cast<std::uint64_t>(set.planes()));
}

double factor_bytes(const BtfSet& set, int components) {
    const auto columns = static_cast<double>(columns_for(set, components)),
               pixels = static_cast<double>(area(set.size())), planes = static_cast<double>(set.planes()),
               rows = planes * static_cast<double>(set.pictures().size());
    // The basis, what comes back of it, and its decomposition; a batch.
    return sizeof(double) * (4.0 * pixels * columns + 2.0 * rows * columns +
                             std::max(static_cast<double>(batch_bytes) / sizeof(double),
                                      static_cast<double>(pictures_of_block) * planes * pixels));
}

PictureFactors factor_pictures(const BtfSet& set, int components, const std::function<Image(Image)>& prepared,
                               const std::function<void(std::uint64_t)>& progress) {
    PictureRows pictures(set, prepared, progress);
    RowMajorMatrix basis(pictures.pixels(), columns_for(set, components));
    for (Index i = 0; i < basis.size(); ++i) basis.data()[i] = sign_at(static_cast<std::uint64_t>(i));
    RowMajorMatrix back;
    for (int reading = 1; reading < factor_readings; ++reading) {
        static_cast<void>(pictures.read(basis, &back));
        basis = orthonormal_columns(back);
    }
    back.resize(0, 0);
    PictureRows::Reading last = pictures.read(basis, nullptr);
    const Eigen::SelfAdjointEigenSolver<MatrixXd> solver(moments_of(last.projected));
    const RowMajorMatrix turn = solver.eigenvectors().rowwise().reverse().leftCols(components);
    PictureFactors factors;
    factors.energy = factors.left = last.energy;
    factors.rows = long_product(last.projected, turn);
    last.projected.resize(0, 0);
    factors.pixels = long_product(basis, turn);
    for (Index k = 0; k < components; ++k) {
        const double length = factors.rows.col(k).norm();
        factors.singular.push_back(length);
        factors.left -= length * length;
        if (length > 0.0) factors.rows.col(k) /= length;
        factors.pixels.col(k) *= length;
    }
    factors.left = std::max(factors.left, 0.0);
    return factors;
}

}  // namespace btfield::detail

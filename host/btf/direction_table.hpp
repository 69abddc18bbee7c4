#pragma once

// What the tables of a model say of any direction (theory 21.3).

#include <vector>

#include "btfield/btf_model.hpp"
#include "host/base/eigen.hpp"
#include "host/btf/direction_interpolation.hpp"

namespace btfield::detail {

/// What makes a picture of planes: I_c = μ_c (m_c + Σ_k U_ck T_k)².
struct PictureWeights {
    std::vector<double> mean, offsets, weights;  ///< [colour], [colour], [colour][plane]
};

[[nodiscard]] BtfDirection light_of(const BtfModel& model, std::size_t pair);
/// Directions of the model's pairs.
[[nodiscard]] std::vector<DirectionPair> direction_pairs(const BtfModel& model);

class DirectionTable {
  public:
    /// \param model  is to outlive it
    explicit DirectionTable(const BtfModel& model);
    [[nodiscard]] PictureWeights weights(const BtfDirection& view, const BtfDirection& light) const;
    /// Mean of z² of each colour, where planes as the view shows them have these means and second moments.
    [[nodiscard]] std::vector<double> mean_squares(const DirectionPair& at, const Eigen::VectorXd& mean,
                                                   const Eigen::MatrixXd& moments) const;
    /// Where means are known, and where offsets and weights are.
    [[nodiscard]] const DirectionPoints& measured() const { return measured_; }

  private:
    void add_weights(const DirectionPair& at, PictureWeights& result) const;

    const BtfModel* model_;
    DirectionPoints measured_, kept_;
};

}  // namespace btfield::detail

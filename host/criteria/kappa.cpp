#include <algorithm>
#include <cmath>
#include <cstddef>
#include <string>

#include "btfield/criteria.hpp"
#include "btfield/error.hpp"
#include "btfield/lag_covariance.hpp"
#include "host/base/eigen.hpp"

namespace btfield {

Kappa kappa(const Image& image, double cmax, double white) {
    const std::string asked = "compute kappa";
    if (image.planes() < 1) throw InputError(asked, "the picture is empty", "give a picture");
    const auto positive = [](double x) { return x > 0.0 && std::isfinite(x); };
    if (!positive(cmax) || !positive(white))
        throw InputError(asked,
                         "cmax is " + std::to_string(cmax) + " and the white level " + std::to_string(white),
                         "give positive numbers");
    const auto values = image.values();
    if (!std::all_of(values.begin(), values.end(), [](float v) { return std::isfinite(v); }))
        throw InputError(asked, "the picture holds values that are NaN or infinite", "give finite values");

    const Offset here[] = {{0, 0}};
    Kappa result;
    result.cmax = cmax;
    result.white = white;
    result.covariance = covariances_at(image, here);
    const double scale = cmax / white;
    for (double& entry : result.covariance) entry *= scale * scale;

    // det(Σ) / cⁿ as a product over eigenvalues, none of which rounding may turn negative.
    const Eigen::Index n = image.planes();
    const Eigen::MatrixXd sigma = Eigen::Map<const Eigen::MatrixXd>(result.covariance.data(), n, n);
    const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(sigma, Eigen::EigenvaluesOnly);
    // What is below the rounding of the largest eigenvalue is none: equal planes have κ = 0.
    const double noise = static_cast<double>(n) * 1e-15 * solver.eigenvalues().maxCoeff();
    result.kappa = 1.0;
    double log_kappa = 0.0;
    for (const double value : solver.eigenvalues()) {
        result.kappa *= value > noise ? value / cmax : 0.0;
        log_kappa += value > noise ? std::log(value / cmax) : 0.0;
    }
    if (result.kappa > 0.0)
        result.white_at_threshold =
            white * std::exp((log_kappa - std::log(Kappa::threshold)) / (2.0 * static_cast<double>(n)));
    return result;
}

}  // namespace btfield

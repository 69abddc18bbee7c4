#include "host/base/normal_distribution.hpp"

#include <array>
#include <cmath>
#include <numbers>

namespace btfield::detail {
namespace {

using Coefficients = std::array<double, 8>;

/// Horner's rule.
double polynomial(const Coefficients& c, double x) {
    double sum = c[7];
    for (std::size_t k = 7; k-- > 0;) sum = sum * x + c[k];
    return sum;
}

// Wichura, M. J. (1988), Applied Statistics 37, 477-484: |u − 1/2| <= 0.425, then √−ln u up to 5, then
// beyond.
constexpr Coefficients centre_above = {
    3.3871328727963666080,    1.3314166789178437745e+2, 1.9715909503065514427e+3, 1.3731693765509461125e+4,
    4.5921953931549871457e+4, 6.7265770927008700853e+4, 3.3430575583588128105e+4, 2.5090809287301226727e+3};
constexpr Coefficients centre_below = {1.0,
                                       4.2313330701600911252e+1,
                                       6.8718700749205790830e+2,
                                       5.3941960214247511077e+3,
                                       2.1213794301586595867e+4,
                                       3.9307895800092710610e+4,
                                       2.8729085735721942674e+4,
                                       5.2264952788528545610e+3};
constexpr Coefficients middle_above = {
    1.42343711074968357734, 4.63033784615654529590,    5.76949722146069140550,    3.64784832476320460504,
    1.27045825245236838258, 2.41780725177450611770e-1, 2.27238449892691845833e-2, 7.74545014278341407640e-4};
constexpr Coefficients middle_below = {1.0,
                                       2.05319162663775882187,
                                       1.67638483018380384940,
                                       6.89767334985100004550e-1,
                                       1.48103976427480074590e-1,
                                       1.51986665636164571966e-2,
                                       5.47593808499534494600e-4,
                                       1.05075007164441684324e-9};
constexpr Coefficients tail_above = {6.65790464350110377720,    5.46378491116411436990,
                                     1.78482653991729133580,    2.96560571828504891230e-1,
                                     2.65321895265761230930e-2, 1.24266094738807843860e-3,
                                     2.71155556874348757815e-5, 2.01033439929228813265e-7};
constexpr Coefficients tail_below = {1.0,
                                     5.99832206555887937690e-1,
                                     1.36929880922735805310e-1,
                                     1.48753612908506148525e-2,
                                     7.86869131145613259100e-4,
                                     1.84631831751005468180e-5,
                                     1.42151175831644588870e-7,
                                     2.04426310338993978564e-15};

}  // namespace

double normal_density(double x) {
    return std::exp(-0.5 * x * x) / std::sqrt(2.0 * std::numbers::pi);
}

double normal_cumulative(double x) {
    return 0.5 * std::erfc(-x / std::numbers::sqrt2);
}

double normal_probability(double a, double b) {
    return a > 0.0 ? normal_cumulative(-a) - normal_cumulative(-b)
                   : normal_cumulative(b) - normal_cumulative(a);
}

double normal_quantile(double u) {
    const double q = u - 0.5;
    if (std::abs(q) <= 0.425) {
        const double r = 0.180625 - q * q;
        return q * polynomial(centre_above, r) / polynomial(centre_below, r);
    }
    const double root = std::sqrt(-std::log(q < 0.0 ? u : 1.0 - u));
    const double x = root <= 5.0 ? polynomial(middle_above, root - 1.6) / polynomial(middle_below, root - 1.6)
                                 : polynomial(tail_above, root - 5.0) / polynomial(tail_below, root - 5.0);
    return q < 0.0 ? -x : x;
}

}  // namespace btfield::detail

// What makes a TextureModel unusable: check(), of models.hpp.

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <limits>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "btfield/error.hpp"
#include "btfield/models.hpp"
#include "host/base/text.hpp"
#include "host/model/model_check.hpp"
#include "host/pictures/colour.hpp"

namespace btfield {

using namespace detail;

namespace {

[[noreturn]] void refuse(const std::string& found, const std::string& remedy = "fit the model again") {
    throw InputError("use the model", found, remedy);
}

/// Offsets and their differences must stay far from the ends of int, and phases exact in double.
constexpr int largest_offset = 32767;

int ceil_divided(int value, int divisor) {
    return value / divisor + (value % divisor != 0 ? 1 : 0);
}

/// a * b, refused rather than wrapped.
std::size_t product(std::size_t a, std::size_t b, const std::string& where) {
    if (b != 0 && a > std::numeric_limits<std::size_t>::max() / b) refuse(where + "the sizes overflow");
    return a * b;
}

constexpr bool precedes(Offset s) {
    return s.row < 0 || (s.row == 0 && s.column < 0);
}

void check_kind(const LinearField& field, const std::set<Offset>& present, const std::string& where) {
    for (const Offset s : field.offsets) {
        if (s == Offset{}) continue;  // of moving averages: every kind holds it
        bool fits = true;
        switch (field.kind) {
            case NeighbourhoodKind::symmetric:
                fits = present.count(-s) == 1;
                break;
            case NeighbourhoodKind::half:
                fits = precedes(-s);
                break;
            case NeighbourhoodKind::causal:
                fits = precedes(s);
                break;
            case NeighbourhoodKind::unilateral:
                fits = s.row <= 0 && s.column <= 0;
                break;
            case NeighbourhoodKind::custom:
                break;
        }
        if (!fits) {
            refuse(where + "offset " + text_of(s) + " does not belong to a " + std::string(name(field.kind)) +
                   " neighbourhood");
        }
    }
}

void check_offsets(const LinearField& field, Family family, const std::string& where) {
    std::set<Offset> present;
    for (const Offset s : field.offsets) {
        if (s.row < -largest_offset || s.row > largest_offset || s.column < -largest_offset ||
            s.column > largest_offset) {
            refuse(where + "offset " + text_of(s) + " is farther than " + std::to_string(largest_offset));
        }
        if (s == Offset{} && family != Family::ma) refuse(where + "the centre (0, 0) is among the offsets");
        if (!present.insert(s).second) refuse(where + "offset " + text_of(s) + " is there twice");
        if (family == Family::car && !precedes(s)) {
            refuse(where + "offset " + text_of(s) +
                   " does not precede the centre in raster order, as CAR needs");
        }
    }
    if (family == Family::mmrf || family == Family::pmrf) {
        for (const Offset s : field.offsets) {
            if (present.count(-s) == 0) {
                refuse(where + "offset " + text_of(s) +
                       " has no opposite one among the offsets, as Markov models need");
            }
        }
    }
    check_kind(field, present, where);
}

void check_coefficients(const LinearField& field, const std::string& where) {
    const auto d = static_cast<std::size_t>(field.planes);
    const std::size_t expected = product(product(d, d, where), field.offsets.size(), where);
    if (field.coefficients.size() != expected) {
        refuse(where + std::to_string(field.coefficients.size()) + " coefficients instead of " +
               std::to_string(expected));
    }
    if (!field.active.empty() && field.active.size() != expected) {
        refuse(where + std::to_string(field.active.size()) + " entries in 'active' instead of none or " +
               std::to_string(expected));
    }
    for (std::size_t i = 0; i < expected; ++i) {
        const double a = field.coefficients[i];
        if (!std::isfinite(a)) refuse(where + "coefficient " + std::to_string(i) + " is not finite");
        if (field.active.empty()) continue;
        if (field.active[i] > 1)
            refuse(where + "entry " + std::to_string(i) + " of 'active' is neither 0 nor 1");
        if (field.active[i] == 0 && a != 0.0) {
            refuse(where + "coefficient " + std::to_string(i) +
                   " is not 0 although 'active' says that it is absent");
        }
    }
}

/// Positive definite when every pivot of the Cholesky factorisation is positive in float64.
/// \param slack added to the diagonal, in units of it, to let semidefinite matrices pass
bool positive_definite(const std::vector<double>& matrix, std::size_t d, double slack) {
    std::vector<double> factor(matrix.size(), 0.0);
    for (std::size_t j = 0; j < d; ++j) {
        for (std::size_t i = j; i < d; ++i) {
            double sum = matrix[i * d + j] * (i == j ? 1.0 + slack : 1.0);
            for (std::size_t k = 0; k < j; ++k) sum -= factor[i * d + k] * factor[j * d + k];
            if (i == j) {
                if (!(sum > 0.0) || !std::isfinite(sum)) return false;
                factor[j * d + j] = std::sqrt(sum);
            } else {
                factor[i * d + j] = sum / factor[j * d + j];
            }
        }
    }
    return true;
}

void check_noise(const LinearField& field, NoiseForm form, bool semidefinite, const std::string& where) {
    const auto d = static_cast<std::size_t>(field.planes);
    const std::vector<double>& sigma = field.noise_covariance;
    const std::size_t expected = product(d, d, where);
    if (sigma.size() != expected) {
        refuse(where + "the noise covariance has " + std::to_string(sigma.size()) + " entries instead of " +
               std::to_string(expected));
    }
    for (const double value : sigma) {
        if (!std::isfinite(value)) refuse(where + "the noise covariance is not finite");
    }
    // Two sums of the same terms in another order differ by a few roundings of the terms, which the diagonal
    // bounds.
    constexpr double rounding = 1e3 * std::numeric_limits<double>::epsilon();
    for (std::size_t i = 0; i < d; ++i) {
        if (!(sigma[i * d + i] > 0.0))
            refuse(where + "the noise variance of plane " + std::to_string(i) + " is not positive");
        for (std::size_t j = 0; j < i; ++j) {
            const double scale = std::sqrt(sigma[i * d + i]) * std::sqrt(sigma[j * d + j]);
            if (!(std::abs(sigma[i * d + j] - sigma[j * d + i]) <= rounding * scale)) {
                refuse(where + "the noise covariance is not symmetric");
            }
            if (form == NoiseForm::diagonal && (sigma[i * d + j] != 0.0 || sigma[j * d + i] != 0.0)) {
                refuse(where + "the noise covariance is not diagonal, as the model's noise form says");
            }
        }
    }
    if (!positive_definite(sigma, d, semidefinite ? 1e-9 : 0.0))
        refuse(where + "the noise covariance is not positive definite");
}

void check_certificate(const LevelModel& level, int planes, bool has_likelihood, const std::string& where) {
    const Certificate& c = level.certificate;
    if (!c.variance_ratio.empty() && c.variance_ratio.size() != static_cast<std::size_t>(planes)) {
        refuse(where + "the certificate has " + std::to_string(c.variance_ratio.size()) +
               " variance ratios instead of " + std::to_string(planes));
    }
    if (c.zeros < 0) refuse(where + "the certificate counts " + std::to_string(c.zeros) + " zeros");
    if (!c.valid) return;
    if (!std::isfinite(c.min_singular) || c.min_singular < 0.0) {
        refuse(where + "the certificate's smallest singular value is not a finite number >= 0");
    }
    for (const double ratio : c.variance_ratio) {
        if (!std::isfinite(ratio) || ratio < 0.0) {
            refuse(where + "a variance ratio of a valid certificate is not a finite number >= 0");
        }
    }
    if (has_likelihood && !std::isfinite(level.log_likelihood))
        refuse(where + "the log-likelihood is not finite");
}

/// Markov symmetry: Σ⁻¹ A_{−s} = (Σ⁻¹ A_s)ᵀ, which is A_{−s} Σ = Σ A_sᵀ, or A_{−s} = A_sᵀ.
void check_symmetry(const MrfModel& model, const std::string& where) {
    const auto d = static_cast<std::size_t>(model.planes);
    const std::vector<double>& sigma = model.noise_covariance;
    const auto times_noise = [&](std::size_t s, std::size_t i, std::size_t j) {
        if (model.form == MrfForm::pmrf) return model.coefficients[(s * d + i) * d + j];
        double sum = 0.0;
        for (std::size_t k = 0; k < d; ++k) sum += model.coefficients[(s * d + i) * d + k] * sigma[k * d + j];
        return sum;
    };
    for (std::size_t s = 0; s < model.offsets.size(); ++s) {
        const auto found = std::find(model.offsets.begin(), model.offsets.end(), -model.offsets[s]);
        const auto opposite = static_cast<std::size_t>(found - model.offsets.begin());
        for (std::size_t i = 0; i < d; ++i) {
            for (std::size_t j = 0; j < d; ++j) {
                const double here = times_noise(s, i, j), there = times_noise(opposite, j, i);
                // Written in decimal and rounded on the way, the two sides differ by roundings of the terms.
                const double scale = model.form == MrfForm::pmrf
                                         ? 1.0
                                         : std::sqrt(sigma[i * d + i]) * std::sqrt(sigma[j * d + j]);
                if (!(std::abs(here - there) <= 1e-9 * (scale + std::abs(here)))) {
                    refuse(where + "the coefficients of offset " + text_of(model.offsets[s]) +
                           " and of its opposite are not those of a Markov model");
                }
            }
        }
    }
}

Family family_of(const Model& model) {
    if (std::holds_alternative<CarModel>(model)) return Family::car;
    if (std::holds_alternative<SarModel>(model)) return Family::msar;
    if (std::holds_alternative<MaModel>(model)) return Family::ma;
    return std::get<MrfModel>(model).form == MrfForm::mmrf ? Family::mmrf : Family::pmrf;
}

void check_part(const TextureModel& model, const Model& part, const std::string& where) {
    if (family_of(part) != family(model.kind)) {
        refuse(where + "it is not a " + std::string(name(model.kind)) + " as the model is");
    }
    const LinearField& field = linear_field(part);
    const int planes = is_2d(model.kind) ? 1 : modelled_planes(model);
    if (field.planes != planes) {
        refuse(where + counted(field.planes, "plane") + " instead of " + std::to_string(planes));
    }
    check_offsets(field, family(model.kind), where);
    check_coefficients(field, where);
    check_noise(field, model.noise, family(model.kind) == Family::ma, where);
    if (const auto* markov = std::get_if<MrfModel>(&part)) check_symmetry(*markov, where);
}

void check_level(const TextureModel& model, const LevelModel& level, Size size, const std::string& where) {
    if (level.size != size) {
        refuse(where + "its size is " + text_of(level.size) + " instead of " + text_of(size) +
               ", which the pyramid of " + text_of(model.size) + " by factor " +
               std::to_string(model.factor) + " has");
    }
    const int planes = modelled_planes(model);
    const auto parts = static_cast<std::size_t>(is_2d(model.kind) ? planes : 1);
    if (level.models.size() != parts) {
        refuse(where + std::to_string(level.models.size()) + " models instead of " + std::to_string(parts));
    }
    for (std::size_t p = 0; p < parts; ++p) {
        check_part(model, level.models[p], parts > 1 ? where + "plane " + std::to_string(p) + ": " : where);
    }
    if (!std::isfinite(level.gain) || level.gain < 0.0)
        refuse(where + "its gain is not a finite number >= 0");
    if (level.iterations < 0) refuse(where + "its number of iterations is negative");
    check_certificate(level, planes, family(model.kind) != Family::ma, where);
}

/// Computed as a product, a matrix is symmetric but for rounding.
void check_symmetry(const std::vector<double>& whitening, std::size_t r) {
    double largest = 0.0;
    for (const double value : whitening) largest = std::max(largest, std::abs(value));
    for (std::size_t i = 0; i < r; ++i)
        for (std::size_t k = 0; k < i; ++k)
            if (!(std::abs(whitening[i * r + k] - whitening[k * r + i]) <= 1e-9 * largest))
                refuse("its whitening is not symmetric");
}

void check_basis(const TextureModel& model) {
    const SpectralBasis& basis = model.basis;
    if (basis.planes == 0) {
        if (is_2d(model.kind)) refuse("a " + std::string(name(model.kind)) + " model has no basis");
        if (!model.marginals.empty()) refuse("it has marginals and no basis");
        return;
    }
    if (basis.planes != model.planes || basis.mean != model.mean) {
        refuse("its basis is not one of its " + counted(model.planes, "plane") + " and their means");
    }
    check(basis);
    if (model.marginals.empty()) return;
    if (model.marginals.size() != static_cast<std::size_t>(basis.rank)) {
        refuse(counted(model.marginals.size(), "marginal") + " for " + std::to_string(basis.rank) +
               " rows of the basis");
    }
    for (const Marginal& marginal : model.marginals) check(marginal);
    const auto r = static_cast<std::size_t>(basis.rank);
    if (model.whitening.size() != r * r) {
        refuse("its whitening has " + counted(model.whitening.size(), "number") + " instead of " +
               std::to_string(r * r));
    }
    for (const double value : model.whitening) {
        if (!std::isfinite(value)) refuse("its whitening is not finite");
    }
    check_symmetry(model.whitening, r);
}

}  // namespace

std::string detail::defect_of(const std::vector<ColourSpace>& spaces, ColourSpace all, int planes) {
    if (!spaces.empty() && all != ColourSpace::unspecified)
        return "its planes have colour spaces of their own, and all of them " + std::string(name(all));
    return defect_of(std::span<const ColourSpace>(spaces), planes);
}

std::string detail::defect_of(const std::vector<MaterialMap>& maps, int planes) {
    std::set<std::string> stems;
    std::int64_t sum = 0;
    bool height = false;
    for (const MaterialMap& map : maps) {
        const std::string stem = std::filesystem::path(map.name).stem().string();
        const bool file = map.name.find_first_of(std::string_view("/\\\0", 3)) == std::string::npos &&
                          !stem.empty() && stem != "." && stem != "..";
        if (!file) return "a map's name is that of no file";
        if (!stems.insert(stem).second) return "two of its maps are called '" + stem + "'";
        const bool hidden = map.role == MapRole::normal && map.planes == 0;
        if (map.planes < (hidden ? 0 : 1) || (map.role == MapRole::normal && map.planes > 1) ||
            (map.role == MapRole::height && map.planes != 1))
            return "its map '" + map.name + "' has " + counted(map.planes, "plane");
        if (!(map.scale >= 0.0) || !std::isfinite(map.scale))
            return "its map '" + map.name + "' has no scale";
        constexpr std::size_t most_levels = 16;
        if (map.role == MapRole::normal && !map.gains.empty())
            return "its map '" + map.name +
                   "' is of normals and has gains, as an older btfield made them: fit it again";
        if (map.gains.size() > most_levels ||
            !std::ranges::all_of(map.gains, [](double gain) { return std::isfinite(gain) && gain >= 0.0; }))
            return "its map '" + map.name + "' has impossible gains";
        height = height || (map.role == MapRole::height && map.scale > 0.0);
        sum += map.planes;
    }
    for (const MaterialMap& map : maps)
        if (map.role == MapRole::normal && map.planes == 0 && !height)
            return "its map '" + map.name + "' lacks a height that tells normals";
    if (!maps.empty() && sum != planes)
        return "its maps have " + std::to_string(sum) + " planes, and it has " + std::to_string(planes);
    return {};
}

void check(const TextureModel& model) {
    if (model.planes < 1) refuse("it has " + counted(model.planes, "plane"));
    if (model.size.height < 1 || model.size.width < 1) refuse("its picture size is " + text_of(model.size));
    const auto largest = static_cast<std::size_t>(std::numeric_limits<std::ptrdiff_t>::max()) / sizeof(float);
    if (area(model.size) > largest / static_cast<std::size_t>(model.planes)) {
        refuse("a picture of " + text_of(model.size) + " with " + counted(model.planes, "plane") +
               " has more values than memory has addresses");
    }
    if (model.factor < 2) refuse("its pyramid factor is " + std::to_string(model.factor) + ", less than 2");
    if (model.mean.size() != static_cast<std::size_t>(model.planes)) {
        refuse(counted(model.mean.size(), "mean") + " for " + counted(model.planes, "plane"));
    }
    for (const double value : model.mean) {
        if (!std::isfinite(value)) refuse("a mean is not finite");
    }
    if (!model.names.empty() && model.names.size() != model.mean.size())
        refuse(std::to_string(model.names.size()) + " names for " + std::to_string(model.planes) + " planes");
    if (const std::string defect = defect_of(model.plane_spaces, model.space, model.planes); !defect.empty())
        refuse(defect);
    const std::vector<PlaneLimits>& limits = model.provenance.limits;
    if (!limits.empty() && limits.size() != model.mean.size())
        refuse("limits of " + counted(limits.size(), "plane") + " for " + std::to_string(model.planes));
    if (const std::string defect = defect_of(model.provenance.maps, model.planes); !defect.empty())
        refuse(defect);
    check_basis(model);
    if (model.levels.empty()) refuse("it has no level");
    Size size = model.size;
    for (std::size_t k = 0; k < model.levels.size(); ++k) {
        check_level(model, model.levels[k], size, "level " + std::to_string(k) + ": ");
        size = {ceil_divided(size.height, model.factor), ceil_divided(size.width, model.factor)};
    }
}

}  // namespace btfield

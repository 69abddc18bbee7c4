#pragma once

/// \file
/// The cells of P4's Table 1 as text, for every format that shows it.

#include <string>
#include <vector>

#include "btfield/experiment.hpp"

namespace btfield::detail {

/// "2D CAR" for "2d-car"; "compound" and "roll" as they are.
[[nodiscard]] std::string model_title(const std::string& model);
/// "1.87e-3", "18.8".
[[nodiscard]] std::string kappa_text(double kappa);
/// Two decimals; "-" for what is not a number.
[[nodiscard]] std::string percent_text(double value);

/// One or more materials, or all: two columns each.
struct TableGrid {
    std::vector<std::string> titles;             ///< of the pairs of columns
    std::vector<std::vector<std::string>> rows;  ///< title, then two cells per pair; the second may be empty
    std::size_t models = 0;                      ///< rows that come first; the others are about κ
};

/// \param first, end range of materials
/// \param all add the pair of all materials
[[nodiscard]] TableGrid table_grid(const ExperimentTable& table, std::size_t first, std::size_t end,
                                   bool all);

/// "MEMD* of the best textures in percent, mean and standard deviation over pictures (metric max, marginals
/// match)".
[[nodiscard]] std::string table_caption(const ExperimentTable& table);
/// "120 jobs done, 6 refused, 0 failed".
[[nodiscard]] std::string table_counts(const ExperimentTable& table);

}  // namespace btfield::detail

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
/// "12.63"; "12.63 (1/6)" of a mean over fewer than all pictures.
[[nodiscard]] std::string mean_text(double mean, int pictures, int all);

/// One or more materials, or all: two columns each. Models stand in blocks as in P4: 2D, 3D, others; what is
/// about κ follows.
struct TableGrid {
    struct Row {
        std::vector<std::string> cells;  ///< title, then two per pair; the second may be empty
        std::vector<bool> least;         ///< of each pair: the least mean of those over all pictures
        bool model = false;              ///< else about κ
    };
    std::vector<std::string> titles;  ///< of the pairs of columns
    std::vector<Row> rows;
    std::vector<std::size_t> blocks;  ///< first rows of all but the first block
    bool partial = false;             ///< some mean is not over all pictures
};

/// \param first, end range of materials
/// \param all add the pair of all materials
[[nodiscard]] TableGrid table_grid(const ExperimentTable& table, std::size_t first, std::size_t end,
                                   bool all);

/// "MEMD* of the best textures in percent, mean and standard deviation over pictures (metric max, marginals
/// match, noise full, …; configuration 'Sand'); …": what n/N means where means are partial.
[[nodiscard]] std::string table_caption(const ExperimentTable& table);
/// "120 jobs done, 6 refused, 0 failed".
[[nodiscard]] std::string table_counts(const ExperimentTable& table);
/// "refused, 12 jobs of 3D MSAR: …", a line for each kind of reason, the first `most` of them.
[[nodiscard]] std::vector<std::string> table_reasons(const ExperimentTable& table, std::size_t most = 8);

}  // namespace btfield::detail

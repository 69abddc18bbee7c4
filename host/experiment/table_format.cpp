#include "host/experiment/table_format.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <cstdio>
#include <limits>
#include <optional>
#include <utility>

#include "host/base/text.hpp"
#include "host/base/text_table.hpp"
#include "host/experiment/angles.hpp"
#include "host/model/model_names.hpp"

namespace btfield {

using namespace detail;
namespace {

std::string formatted(const char* format, double value) {
    std::array<char, 48> text{};
    std::snprintf(text.data(), text.size(), format, value);
    return text.data();
}

/// Whether some picture is one of a BTF.
bool has_directions(const ExperimentTable& table) {
    return std::ranges::any_of(table.picture_rows,
                               [](const auto& row) { return row.directions.has_value(); });
}

/// Pictures one by one: the head, and a row for each. Of BTFs the ratios of standard deviations too.
std::vector<std::vector<std::string>> picture_cells(const ExperimentTable& table) {
    std::vector<std::vector<std::string>> rows;
    if (table.picture_rows.empty()) return rows;
    const bool ratios = has_directions(table);
    rows.push_back({"picture", "material", "κ(256)"});
    for (const ExperimentTable::Row& row : table.rows) rows.front().push_back(model_title(row.model));
    if (ratios)
        for (const ExperimentTable::Row& row : table.rows)
            rows.front().push_back("std " + model_title(row.model));
    for (const ExperimentTable::PictureRow& row : table.picture_rows) {
        rows.push_back({row.picture, row.material, kappa_text(row.kappa)});
        for (const double best : row.best) rows.back().push_back(percent_text(best));
        if (!ratios) continue;
        for (const double ratio : row.std_ratio)
            rows.back().push_back(std::isfinite(ratio) ? formatted("%.3f", ratio) : "-");
    }
    return rows;
}

/// What stands below a table: counts, and why jobs have no texture.
std::string foot_text(const ExperimentTable& table, const std::string& before) {
    std::string text = table_counts(table) + "\n";
    for (const std::string& reason : table_reasons(table)) text += before + reason + "\n";
    return text;
}

std::string text_of(const ExperimentTable& table) {
    constexpr std::size_t across = 4;  // fits into 100 columns with usual names
    std::string text = table_caption(table) + "\n";
    for (std::size_t first = 0; first == 0 || first < table.materials.size(); first += across) {
        const std::size_t end = std::min(first + across, table.materials.size());
        const TableGrid grid = table_grid(table, first, end, end == table.materials.size());
        std::vector<std::vector<std::string>> rows(2);
        rows[0] = {""};
        rows[1] = {"model"};
        for (const std::string& title : grid.titles) {
            rows[0].insert(rows[0].end(), {title, ""});
            rows[1].insert(rows[1].end(), {"mean", "std"});
        }
        for (const TableGrid::Row& row : grid.rows) rows.push_back(row.cells);
        text += "\n" + btfield::detail::table(rows, "lr");
    }
    const std::vector<std::vector<std::string>> pictures = picture_cells(table);
    if (!pictures.empty()) text += "\n" + btfield::detail::table(pictures, "llr");
    return text + "\n" + foot_text(table, "");
}

std::string markdown_cell(const std::string& text) {
    std::string escaped;
    for (const char c : text) escaped += (c == '|' ? "\\|" : std::string(1, c));
    return escaped;
}

std::string markdown_of(const ExperimentTable& table) {
    const TableGrid grid = table_grid(table, 0, table.materials.size(), true);
    std::string text = table_caption(table) + "\n\n| model |", line = "|---|";
    for (const std::string& title : grid.titles) {
        text += " " + markdown_cell(title) + " | std |";
        line += "--:|--:|";
    }
    text += "\n" + line + "\n";
    for (const TableGrid::Row& row : grid.rows) {
        text += "|";
        for (const std::string& cell : row.cells) text += " " + markdown_cell(cell) + " |";
        text += "\n";
    }
    const std::vector<std::vector<std::string>> pictures = picture_cells(table);
    for (std::size_t r = 0; r < pictures.size(); ++r) {
        text += r == 0 ? "\n|" : "|";
        for (const std::string& cell : pictures[r]) text += " " + markdown_cell(cell) + " |";
        text += "\n";
        if (r > 0) continue;
        text += "|---|---|";
        for (std::size_t c = 2; c < pictures[r].size(); ++c) text += "--:|";
        text += "\n";
    }
    return text + "\n" + foot_text(table, table.reasons.empty() ? "" : "- ");
}

std::string latex_text(const std::string& text) {
    std::string escaped;
    for (const char c : text) {
        if (std::string_view("&%$#_{}").find(c) != std::string_view::npos) {
            escaped += std::string("\\") + c;
        } else if (c == '\\') {
            escaped += "\\textbackslash{}";
        } else if (c == '<' || c == '>' || c == '|') {  // other signs in the usual encoding of fonts
            escaped += c == '<' ? "\\textless{}" : c == '>' ? "\\textgreater{}" : "\\textbar{}";
        } else if (c == '"') {
            escaped += "\\textquotedbl{}";
        } else if (c == '~' || c == '^') {
            escaped += std::string("\\") + c + "{}";
        } else {
            escaped += c;
        }
    }
    const std::string kappa = "κ";
    for (std::size_t at = escaped.find(kappa); at != std::string::npos; at = escaped.find(kappa, at)) {
        escaped.replace(at, kappa.size(), "$\\kappa$");
    }
    const std::string star = "MEMD*";
    for (std::size_t at = escaped.find(star); at != std::string::npos; at = escaped.find(star, at)) {
        escaped.replace(at, star.size(), "MEMD$^*$");
    }
    return escaped;
}

/// "tab:memd-natural-textures-max-match": letters, digits and dashes.
std::string latex_label(const ExperimentTable& table) {
    std::string label = "tab:memd";
    for (const std::string& part :
         {table.configuration, table.metric, table.marginals, table.noise, table.gains, table.estimators}) {
        if (!part.empty()) label += '-';
        for (const char c : part) {
            const auto byte = static_cast<unsigned char>(c);
            if (byte < 128 && std::isalnum(byte) != 0) {
                label += static_cast<char>(std::tolower(byte));
            } else if (label.back() != '-') {
                label += '-';
            }
        }
        while (label.back() == '-') label.pop_back();
    }
    return label;
}

std::string latex_head(const TableGrid& grid) {
    std::string text = "\\begin{tabular}{l", second = "model", rules;
    for (std::size_t i = 0; i < grid.titles.size(); ++i) text += "rr";
    text += "}\n\\toprule\n";
    for (std::size_t i = 0; i < grid.titles.size(); ++i) {
        text += " & \\multicolumn{2}{c}{" + latex_text(grid.titles[i]) + "}";
        second += " & mean & std";
        rules += "\\cmidrule(lr){" + std::to_string(2 * i + 2) + "-" + std::to_string(2 * i + 3) + "}";
    }
    return text + " \\\\\n" + rules + "\n" + second + " \\\\\n\\midrule\n";
}

std::string latex_of(const ExperimentTable& table) {
    constexpr std::size_t across = 8;  // as P4
    std::string text = "% needs \\usepackage{booktabs}\n\\begin{table}\n\\centering\n";
    for (std::size_t first = 0; first == 0 || first < table.materials.size(); first += across) {
        const std::size_t end = std::min(first + across, table.materials.size());
        const TableGrid grid = table_grid(table, first, end, end == table.materials.size());
        text += latex_head(grid);
        for (std::size_t r = 0; r < grid.rows.size(); ++r) {
            if (std::ranges::find(grid.blocks, r) != grid.blocks.end()) text += "\\midrule\n";
            const TableGrid::Row& row = grid.rows[r];
            std::string line;
            for (std::size_t c = 0; c < row.cells.size(); ++c) {
                const bool least = row.model && c % 2 == 1 && row.least[c / 2];
                const std::string cell = latex_text(row.cells[c]);
                line += (c == 0 ? "" : " & ") + (least ? "\\textbf{" + cell + "}" : cell);
            }
            text += line + " \\\\\n";
        }
        text += "\\bottomrule\n\\end{tabular}\n\n";
    }
    const std::vector<std::vector<std::string>> pictures = picture_cells(table);
    for (std::size_t r = 0; r < pictures.size(); ++r) {
        if (r == 0)
            text += "\\begin{tabular}{ll" + std::string(pictures[r].size() - 2, 'r') + "}\n\\toprule\n";
        for (std::size_t c = 0; c < pictures[r].size(); ++c)
            text += (c == 0 ? "" : " & ") + latex_text(pictures[r][c]);
        text += r == 0 ? " \\\\\n\\midrule\n" : " \\\\\n";
    }
    if (!pictures.empty()) text += "\\bottomrule\n\\end{tabular}\n\n";
    std::string reasons;
    for (const std::string& reason : table_reasons(table)) reasons += "% " + reason + "\n";
    return text + "\\caption{" + latex_text(table_caption(table) + ". " + table_counts(table) + ".") +
           "}\n\\label{" + latex_label(table) + "}\n\\end{table}\n" + reasons;
}

std::string csv_text(const std::string& text) {
    if (text.find_first_of(",\"\r\n") == std::string::npos) return text;
    std::string quoted = "\"";
    for (const char c : text) quoted += (c == '"' ? "\"\"" : std::string(1, c));
    return quoted + "\"";
}

std::string csv_number(double value) {
    return std::isfinite(value) ? formatted("%.17g", value) : "";
}

/// One line per material and model; the material is empty for all together.
std::string csv_of(const std::vector<ExperimentTable>& tables) {
    std::string text =
        "metric,marginals,material,kappa,best_2d,best_3d,model,mean,std,pictures,of,configuration,noise,"
        "gains,"
        "estimator";
    const bool by_picture =
        std::ranges::any_of(tables, [](const ExperimentTable& table) { return !table.picture_rows.empty(); });
    const bool directed = std::ranges::any_of(tables, has_directions);
    text += by_picture ? ",picture" : "";
    text += directed ? ",view_theta,view_phi,light_theta,light_phi,std_ratio\n" : "\n";
    const auto angle = [](double value) { return formatted("%.7g", in_degrees(value)); };
    const auto directions = [&](const ExperimentTable::PictureRow& row, std::size_t m) {
        if (!directed) return std::string();
        std::string cells = ",,,,";
        if (row.directions) {
            const auto& [view, light] = *row.directions;
            cells = "," + angle(view.theta) + "," + angle(view.phi) + "," + angle(light.theta) + "," +
                    angle(light.phi);
        }
        return cells + "," + csv_number(row.std_ratio[m]);
    };
    for (const ExperimentTable& table : tables) {
        const std::string start = csv_text(table.metric) + "," + csv_text(table.marginals) + ",";
        const std::string settings = "," + csv_text(table.configuration) + "," + csv_text(table.noise) + "," +
                                     csv_text(table.gains) + "," + csv_text(table.estimators);
        const auto end = [&](const ExperimentTable::Cell& cell, int of) {
            return "," + csv_number(cell.mean) + "," + csv_number(cell.deviation) + "," +
                   std::to_string(cell.pictures) + "," + std::to_string(of) + settings +
                   (by_picture ? "," : "") + (directed ? ",,,,,\n" : "\n");
        };
        for (const ExperimentTable::PictureRow& row : table.picture_rows)
            for (std::size_t m = 0; m < row.best.size(); ++m)
                text += start + csv_text(row.material) + "," + csv_number(row.kappa) + ",,," +
                        table.rows[m].model + "," + csv_number(row.best[m]) + ",," +
                        (std::isfinite(row.best[m]) ? "1,1" : "0,1") + settings + "," +
                        csv_text(row.picture) + directions(row, m) + "\n";
        for (const ExperimentTable::Row& row : table.rows) {
            for (std::size_t m = 0; m < table.materials.size(); ++m) {
                const ExperimentTable::Colour& colour = table.colours[m];
                text += start + csv_text(table.materials[m]) + "," + csv_number(colour.kappa) + "," +
                        csv_number(colour.best_2d) + "," + csv_number(colour.best_3d) + "," + row.model +
                        end(row.materials[m], table.pictures[m]);
            }
            text += start + ",,,," + row.model + end(row.all, table.all_pictures);
        }
    }
    return text;
}

}  // namespace

std::string detail::model_title(const std::string& model) {
    std::string title = model;
    if (!find_value<ModelKind>(model)) return title;
    for (char& c : title) c = c == '-' ? ' ' : static_cast<char>(std::toupper(static_cast<unsigned char>(c)));
    return title;
}

std::string detail::kappa_text(double kappa) {
    return std::isfinite(kappa) ? formatted("%.3g", kappa) : "-";
}

std::string detail::percent_text(double value) {
    return std::isfinite(value) ? formatted("%.2f", value) : "-";
}

std::string detail::mean_text(double mean, int pictures, int all) {
    if (!std::isfinite(mean) || pictures == all) return percent_text(mean);
    return percent_text(mean) + " (" + std::to_string(pictures) + "/" + std::to_string(all) + ")";
}

namespace {

/// 0 for 2D fields, 1 for 3D ones, 2 for what is none.
int block_of(const std::string& model) {
    const std::optional<ModelKind> field = find_value<ModelKind>(model);
    return !field ? 2 : is_2d(*field) ? 0 : 1;
}

/// Marks the least mean of each pair, of those over all pictures. Equal as they are shown is equal.
void mark_least(const std::vector<std::vector<const ExperimentTable::Cell*>>& cells,
                const std::vector<int>& all, TableGrid& grid) {
    for (std::size_t pair = 0; pair < all.size(); ++pair) {
        std::string least;
        double value = std::numeric_limits<double>::infinity();
        for (const auto& row : cells) {
            if (row[pair]->pictures != all[pair] || !(row[pair]->mean < value)) continue;
            value = row[pair]->mean;
            least = percent_text(value);
        }
        for (std::size_t r = 0; r < cells.size(); ++r) {
            const ExperimentTable::Cell& cell = *cells[r][pair];
            grid.rows[r].least.push_back(cell.pictures == all[pair] && std::isfinite(value) &&
                                         percent_text(cell.mean) == least);
            grid.partial = grid.partial || (cell.pictures > 0 && cell.pictures < all[pair]);
        }
    }
}

void add_models(const ExperimentTable& table, std::size_t first, std::size_t end, const std::vector<int>& all,
                TableGrid& grid) {
    std::vector<const ExperimentTable::Row*> models;
    for (const ExperimentTable::Row& row : table.rows) models.push_back(&row);
    std::ranges::stable_sort(models, {}, [](const auto* row) { return block_of(row->model); });
    std::vector<std::vector<const ExperimentTable::Cell*>> cells;
    for (std::size_t r = 0; r < models.size(); ++r) {
        const ExperimentTable::Row& model = *models[r];
        if (r > 0 && block_of(models[r - 1]->model) != block_of(model.model)) grid.blocks.push_back(r);
        cells.emplace_back();
        for (std::size_t m = first; m < end; ++m) cells.back().push_back(&model.materials[m]);
        if (all.size() > end - first) cells.back().push_back(&model.all);
        TableGrid::Row row;
        row.model = true;
        row.cells.push_back(model_title(model.model));
        for (std::size_t pair = 0; pair < all.size(); ++pair) {
            const ExperimentTable::Cell& cell = *cells.back()[pair];
            row.cells.push_back(mean_text(cell.mean, cell.pictures, all[pair]));
            // One picture has no deviation from others.
            row.cells.push_back(cell.pictures == 1 ? "" : percent_text(cell.deviation));
        }
        grid.rows.push_back(std::move(row));
    }
    mark_least(cells, all, grid);
    grid.blocks.push_back(grid.rows.size());
}

}  // namespace

TableGrid detail::table_grid(const ExperimentTable& table, std::size_t first, std::size_t end, bool all) {
    TableGrid grid;
    std::vector<int> pictures;
    for (std::size_t m = first; m < end; ++m) {
        pictures.push_back(table.pictures[m]);
        grid.titles.push_back(table.materials[m] + " (" + std::to_string(table.pictures[m]) + ")");
    }
    if (all) {
        pictures.push_back(table.all_pictures);
        grid.titles.push_back("all (" + std::to_string(table.all_pictures) + ")");
    }
    add_models(table, first, end, pictures, grid);
    const auto add = [&](const std::string& title, const auto& text) {
        TableGrid::Row row;
        row.cells.push_back(title);
        for (std::size_t m = first; m < end; ++m)
            row.cells.insert(row.cells.end(), {text(table.colours[m], table.pictures[m]), ""});
        if (all) row.cells.insert(row.cells.end(), {"", ""});
        grid.rows.push_back(std::move(row));
    };
    using Colour = ExperimentTable::Colour;
    add("κ(256)", [](const Colour& c, int) { return kappa_text(c.kappa); });
    add("κ predicts", [](const Colour& c, int) {
        return std::string(!std::isfinite(c.kappa) ? "-" : c.needs_3d ? "gap" : "no gap");
    });
    add("best 2D", [](const Colour& c, int of) { return mean_text(c.best_2d, c.pictures_2d, of); });
    add("best 3D", [](const Colour& c, int of) { return mean_text(c.best_3d, c.pictures_3d, of); });
    add("κ was right", [](const Colour& c, int) {
        if (!std::isfinite(c.best_2d) || !std::isfinite(c.best_3d) || !std::isfinite(c.kappa))
            return std::string("-");
        return std::string(c.needs_3d == c.gap ? "yes" : "no");
    });
    return grid;
}

std::string detail::table_caption(const ExperimentTable& table) {
    std::string text =
        "MEMD* of the best textures in percent, mean and standard deviation over pictures (metric " +
        table.metric + ", marginals " + table.marginals;
    for (const auto& [what, values] :
         {std::pair{"noise", table.noise}, {"gains", table.gains}, {"estimator", table.estimators}})
        if (!values.empty()) text += std::string(", ") + what + " " + values;
    if (!table.configuration.empty()) text += "; configuration '" + table.configuration + "'";
    text += "); a gap is a best 2D that exceeds the best 3D by more than " + percent_text(memd_gap_threshold);
    if (table_grid(table, 0, table.materials.size(), true).partial)
        text += "; (n/N) marks a mean over n of N pictures, the others having no texture of that model";
    return text;
}

std::string detail::table_counts(const ExperimentTable& table) {
    return counted(table.done, "job") + " done, " + std::to_string(table.refused) + " refused, " +
           std::to_string(table.failed) + " failed";
}

std::vector<std::string> detail::table_reasons(const ExperimentTable& table, std::size_t most) {
    std::vector<std::string> lines;
    std::uint64_t left = 0;
    for (const ExperimentTable::Reason& reason : table.reasons) {
        if (lines.size() == most) {
            left += reason.jobs;
            continue;
        }
        std::string models;
        for (const std::string& model : reason.models)
            models += (models.empty() ? "" : ", ") + model_title(model);
        std::string text = reason.text;
        std::ranges::replace(text, '\n', ' ');
        lines.push_back(reason.status + ", " + counted(reason.jobs, "job") + " of " + models + ": " + text);
    }
    if (left > 0) lines.push_back(counted(left, "job") + " more for other reasons; --json lists all");
    return lines;
}

std::string format_tables(const std::vector<ExperimentTable>& tables, TableFormat format) {
    if (format == TableFormat::csv) return csv_of(tables);
    if (tables.empty()) return "no jobs yet\n";
    std::string text;
    for (const ExperimentTable& table : tables) {
        if (!text.empty()) text += "\n";
        text += format == TableFormat::markdown ? markdown_of(table)
                : format == TableFormat::latex  ? latex_of(table)
                                                : text_of(table);
    }
    return text;
}

}  // namespace btfield

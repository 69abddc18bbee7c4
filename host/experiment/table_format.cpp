#include "host/experiment/table_format.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <cstdio>

#include "host/base/text_table.hpp"
#include "host/model/model_names.hpp"

namespace btfield {

using namespace detail;
namespace {

std::string formatted(const char* format, double value) {
    std::array<char, 48> text{};
    std::snprintf(text.data(), text.size(), format, value);
    return text.data();
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
        rows.insert(rows.end(), grid.rows.begin(), grid.rows.end());
        text += "\n" + btfield::detail::table(rows, "lr");
    }
    return text + "\n" + table_counts(table) + "\n";
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
    for (const auto& row : grid.rows) {
        text += "|";
        for (const std::string& cell : row) text += " " + markdown_cell(cell) + " |";
        text += "\n";
    }
    return text + "\n" + table_counts(table) + "\n";
}

std::string latex_text(const std::string& text) {
    std::string escaped;
    for (const char c : text) {
        if (std::string_view("&%$#_{}").find(c) != std::string_view::npos) {
            escaped += std::string("\\") + c;
        } else if (c == '\\') {
            escaped += "\\textbackslash{}";
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

std::string latex_of(const ExperimentTable& table) {
    constexpr std::size_t across = 8;  // as P4
    std::string text = "\\begin{table}\n\\centering\n";
    for (std::size_t first = 0; first == 0 || first < table.materials.size(); first += across) {
        const std::size_t end = std::min(first + across, table.materials.size());
        const TableGrid grid = table_grid(table, first, end, end == table.materials.size());
        text += "\\begin{tabular}{l";
        for (std::size_t i = 0; i < grid.titles.size(); ++i) text += "|rr";
        text += "}\n";
        std::string second = "model";
        for (const std::string& title : grid.titles) {
            text += " & \\multicolumn{2}{c}{" + latex_text(title) + "}";
            second += " & mean & std";
        }
        text += " \\\\\n" + second + " \\\\ \\hline\n";
        for (std::size_t r = 0; r < grid.rows.size(); ++r) {
            if (r == grid.models) text += "\\hline\n";
            std::string line;
            for (const std::string& cell : grid.rows[r])
                line += (line.empty() ? "" : " & ") + latex_text(cell);
            text += line + " \\\\\n";
        }
        text += "\\end{tabular}\n\n";
    }
    return text + "\\caption{" + latex_text(table_caption(table) + ". " + table_counts(table) + ".") +
           "}\n\\end{table}\n";
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
    std::string text = "metric,marginals,material,kappa,best_2d,best_3d,model,mean,std,pictures\n";
    for (const ExperimentTable& table : tables) {
        const std::string start = csv_text(table.metric) + "," + csv_text(table.marginals) + ",";
        const auto end = [](const ExperimentTable::Cell& cell) {
            return "," + csv_number(cell.mean) + "," + csv_number(cell.deviation) + "," +
                   std::to_string(cell.pictures) + "\n";
        };
        for (const ExperimentTable::Row& row : table.rows) {
            for (std::size_t m = 0; m < table.materials.size(); ++m) {
                const ExperimentTable::Colour& colour = table.colours[m];
                text += start + csv_text(table.materials[m]) + "," + csv_number(colour.kappa) + "," +
                        csv_number(colour.best_2d) + "," + csv_number(colour.best_3d) + "," + row.model +
                        end(row.materials[m]);
            }
            text += start + ",,,," + row.model + end(row.all);
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

TableGrid detail::table_grid(const ExperimentTable& table, std::size_t first, std::size_t end, bool all) {
    TableGrid grid;
    grid.models = table.rows.size();
    int pictures = 0;
    for (const int count : table.pictures) pictures += count;
    for (std::size_t m = first; m < end; ++m) {
        grid.titles.push_back(table.materials[m] + " (" + std::to_string(table.pictures[m]) + ")");
    }
    if (all) grid.titles.push_back("all (" + std::to_string(pictures) + ")");
    for (const ExperimentTable::Row& row : table.rows) {
        std::vector<std::string> cells{model_title(row.model)};
        for (std::size_t m = first; m < end; ++m) {
            cells.push_back(percent_text(row.materials[m].mean));
            cells.push_back(percent_text(row.materials[m].deviation));
        }
        if (all) cells.insert(cells.end(), {percent_text(row.all.mean), percent_text(row.all.deviation)});
        grid.rows.push_back(std::move(cells));
    }
    const auto add = [&](const std::string& title, const auto& text) {
        std::vector<std::string> cells{title};
        for (std::size_t m = first; m < end; ++m) cells.insert(cells.end(), {text(table.colours[m]), ""});
        if (all) cells.insert(cells.end(), {"", ""});
        grid.rows.push_back(std::move(cells));
    };
    using Colour = ExperimentTable::Colour;
    add("κ(256)", [](const Colour& c) { return kappa_text(c.kappa); });
    add("κ predicts", [](const Colour& c) {
        return std::string(!std::isfinite(c.kappa) ? "-" : c.needs_3d ? "gap" : "no gap");
    });
    add("best 2D", [](const Colour& c) { return percent_text(c.best_2d); });
    add("best 3D", [](const Colour& c) { return percent_text(c.best_3d); });
    add("κ was right", [](const Colour& c) {
        if (!std::isfinite(c.best_2d) || !std::isfinite(c.kappa)) return std::string("-");
        return std::string(c.needs_3d == c.gap ? "yes" : "no");
    });
    return grid;
}

std::string detail::table_caption(const ExperimentTable& table) {
    return "MEMD* of the best textures in percent, mean and standard deviation over pictures (metric " +
           table.metric + ", marginals " + table.marginals +
           "); a gap is a best 2D that exceeds the best 3D by more than " + percent_text(memd_gap_threshold);
}

std::string detail::table_counts(const ExperimentTable& table) {
    return std::to_string(table.done) + " jobs done, " + std::to_string(table.refused) + " refused, " +
           std::to_string(table.failed) + " failed";
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

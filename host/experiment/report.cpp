#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <limits>
#include <map>
#include <optional>
#include <set>
#include <utility>

#include "btfield/criteria.hpp"
#include "btfield/error.hpp"
#include "btfield/experiment.hpp"
#include "host/base/file_output.hpp"
#include "host/base/text.hpp"
#include "host/experiment/angles.hpp"
#include "host/experiment/direction_map.hpp"
#include "host/experiment/experiment_names.hpp"
#include "host/experiment/picture_place.hpp"
#include "host/experiment/plot.hpp"
#include "host/experiment/results_database.hpp"
#include "host/experiment/scope.hpp"
#include "host/experiment/set_pictures.hpp"
#include "host/experiment/table_format.hpp"
#include "host/experiment/thumbnail.hpp"

namespace btfield {

using namespace detail;

namespace {

constexpr int thumbnail_side = 112;

const char* const style = R"css(
body{font:15px/1.5 system-ui,sans-serif;color:#222;background:#fff;max-width:1180px;margin:2em auto;padding:0 1em}
h1{font-size:1.6em;margin-bottom:.2em}h2{font-size:1.25em;margin-top:2em;border-bottom:1px solid #ccc}
h3{font-size:1em;margin:1.4em 0 .4em}.quiet{color:#666;font-weight:normal}
.wide{overflow-x:auto}table{border-collapse:collapse;font-variant-numeric:tabular-nums}
th,td{padding:.15em .7em;text-align:right;white-space:nowrap}th:first-child,td:first-child{text-align:left}
thead th{border-bottom:1px solid #888}tbody tr:nth-child(even){background:#f4f4f4}tr.colour td{color:#555}
tr.first td{border-top:1px solid #888}td.least{font-weight:bold}
.plots{display:flex;flex-wrap:wrap;gap:1em;margin-top:1.5em}.plots svg{width:420px;max-width:100%}
svg text{font:11px system-ui,sans-serif;fill:#444}svg .title text{font-size:13px;fill:#222}
svg .axis line{stroke:#ddd}svg .disc circle{fill:none;stroke:#ccc}.legend span{margin-right:1.2em;white-space:nowrap}
.legend svg{width:34px;height:10px;vertical-align:middle;margin-right:.4em}
.pictures{display:flex;flex-wrap:wrap;gap:.8em}figure{margin:0;width:130px}
figure img,figure .none{width:112px;height:112px;object-fit:cover;background:#eee;display:block}
figure .none{display:flex;align-items:center;justify-content:center;color:#999;font-size:11px;text-align:center}
figcaption{font-size:12px;line-height:1.35}pre{background:#f4f4f4;padding:1em;overflow-x:auto}
)css";

std::string colour_of(Family family) {
    switch (family) {
        case Family::car:
            return "#0072b2";
        case Family::ma:
            return "#e69f00";
        case Family::msar:
            return "#009e73";
        case Family::mmrf:
            return "#cc79a7";
        case Family::pmrf:
            break;
    }
    return "#d55e00";
}

/// One colour per family, told apart by those who see few; 2D models are dashed.
std::string colour_of(const std::string& model) {
    if (const auto field = find_value<ModelKind>(model)) return colour_of(family(*field));
    if (model == name(ExperimentModel::btf)) return "#888";
    return model == name(ExperimentModel::compound) ? "#000" : "#56b4e9";
}

bool is_dashed(const std::string& model) {
    const auto field = find_value<ModelKind>(model);
    return field && is_2d(*field);
}

bool has_no_order(const std::string& model) {
    const auto known = find_value<ExperimentModel>(model);
    return known && !has_levels(*known);
}

std::string heading(int level, const std::string& text) {
    const std::string tag = "h" + std::to_string(level);
    return "<" + tag + ">" + html_text(text) + "</" + tag + ">\n";
}

std::string paragraph(const std::string& text) {
    return "<p>" + html_text(text) + "</p>\n";
}

std::string table_html(const ExperimentTable& table) {
    const TableGrid grid = table_grid(table, 0, table.materials.size(), true);
    std::string html = "<div class=\"wide\"><table class=\"memd\"><thead><tr><th></th>";
    std::string second = "<tr><th>model</th>";
    for (const std::string& title : grid.titles) {
        html += "<th colspan=\"2\">" + html_text(title) + "</th>";
        second += "<th>mean</th><th>std</th>";
    }
    html += "</tr>" + second + "</tr></thead><tbody>\n";
    for (std::size_t r = 0; r < grid.rows.size(); ++r) {
        const TableGrid::Row& row = grid.rows[r];
        const bool first = std::ranges::find(grid.blocks, r) != grid.blocks.end();
        html += std::string("<tr") +
                (!row.model && first ? " class=\"colour first\""
                 : !row.model        ? " class=\"colour\""
                 : first             ? " class=\"first\""
                                     : "") +
                ">";
        for (std::size_t c = 0; c < row.cells.size(); ++c) {
            const bool least = row.model && c % 2 == 1 && row.least[c / 2];  // of each mean it stands out
            html += (least ? "<td class=\"least\">" : "<td>") + html_text(row.cells[c]) + "</td>";
        }
        html += "</tr>\n";
    }
    return html + "</tbody></table></div>\n";
}

std::string legend(const std::vector<ExperimentTable::Row>& rows) {
    std::string html = "<p class=\"legend\">";
    for (const ExperimentTable::Row& row : rows) {
        html +=
            "<span><svg viewBox=\"0 0 34 10\"><line x1=\"0\" x2=\"34\" y1=\"5\" y2=\"5\" stroke-width=\"2\" "
            "stroke=\"" +
            colour_of(row.model) + "\"" + (is_dashed(row.model) ? " stroke-dasharray=\"5 3\"" : "") +
            "/></svg>" + html_text(model_title(row.model)) + "</span>";
    }
    return html + "</p>\n";
}

/// MEMD* by order, one plot per number of levels: means over pictures of the best over estimators and seeds.
/// Rolls and BTF models, which have neither, are level lines in all of them.
std::string plots_html(Connection& connection, const ExperimentTable& table) {
    std::map<int, std::map<std::string, std::map<int, double>>> means;  // of levels, model, order
    std::set<int> orders;
    Statement query(connection, R"sql(
        SELECT levels, model, "order", avg(best) FROM (
            SELECT levels, model, "order", picture, min(memd_star) AS best FROM scope_jobs
            WHERE status = 'done' AND metric = ?1 AND marginals = ?2 AND instr(?3, ', ' || noise || ',') > 0
                AND instr(?4, ', ' || gains || ',') > 0
                AND (instr(?5, ', ' || estimator || ',') > 0 OR model LIKE '%-car' OR model LIKE '%-ma'
                     OR model IN ('compound', 'roll', 'btf'))
            GROUP BY levels, model, "order", picture)
        GROUP BY levels, model, "order")sql");
    // Of what the table has, and what is not read.
    const auto list = [](const std::string& values) { return ", " + values + ", any,"; };
    query.bind(table.metric).bind(table.marginals).bind(list(table.noise)).bind(list(table.gains));
    query.bind(list(table.estimators));
    while (query.step()) {
        if (has_no_order(query.text(1))) continue;  // of a table of its own
        const int order = static_cast<int>(query.number(2));
        orders.insert(order);
        means[static_cast<int>(query.number(0))][query.text(1)][order] = query.real(3);
    }
    std::vector<std::string> positions;
    positions.reserve(orders.size());
    for (const int order : orders) positions.push_back(std::to_string(order));
    std::string html = "<div class=\"plots\">\n";
    for (const auto& [levels, models] : means) {
        std::vector<PlotLine> lines;
        for (const ExperimentTable::Row& row : table.rows) {
            PlotLine line{model_title(row.model), colour_of(row.model), is_dashed(row.model), {}};
            if (has_no_order(row.model)) {
                line.values.assign(orders.size(), row.all.mean);
                lines.push_back(std::move(line));
                continue;
            }
            const auto found = models.find(row.model);
            if (found == models.end()) continue;
            for (const int order : orders) {
                const auto value = found->second.find(order);
                line.values.push_back(value == found->second.end() ? std::numeric_limits<double>::quiet_NaN()
                                                                   : value->second);
            }
            lines.push_back(std::move(line));
        }
        const std::string title =
            levels == 0 ? "MEMD*, %, levels chosen" : "MEMD*, %, K = " + std::to_string(levels);
        html += line_plot(title, "order of the neighbourhood", positions, lines) + "\n";
    }
    return html + "</div>\n" + legend(table.rows);
}

std::string figure(const std::string& uri, const std::string& missing, const std::string& caption) {
    return "<figure>" +
           (uri.empty() ? "<div class=\"none\">" + html_text(missing) + "</div>"
                        : "<img src=\"" + uri + "\" alt=\"\">") +
           "<figcaption>" + caption + "</figcaption></figure>\n";
}

std::optional<Crop> crop_of(const std::string& text) {
    Crop crop;
    if (std::sscanf(text.c_str(), "%d,%d,%d,%d", &crop.x, &crop.y, &crop.width, &crop.height) != 4) return {};
    return crop;
}

/// Of the picture of a row: of `files`, and what `directions` has of it behind.
std::string file_thumbnail(const PicturePlaces& places, const Statement& file) {
    const auto path = places.picture(file.text(0), file.text(1), file.text(7));
    return path ? thumbnail_uri(*path, crop_of(file.text(2)), file.real(3), thumbnail_side) : std::string();
}

std::string direction_thumbnail(const PicturePlaces& places, const Statement& file, OpenSets& sets) {
    const auto angle = [&](int column) { return from_degrees(file.real(column)); };
    const DirectionSource direction{
        file.text(8), reading_of(file.text(9)), {{angle(10), angle(11)}, {angle(12), angle(13)}}, {}};
    for (const std::filesystem::path& place : places.candidates(file.text(0), file.text(8))) {
        try {
            const Image image = read_direction(sets, place, direction, crop_of(file.text(2)));
            if (sha256_of_values(image) == file.text(7))
                return thumbnail_uri(image, file.real(3), thumbnail_side);
        } catch (const InputError&) {
            continue;  // not there any more
        }
    }
    return {};
}

/// The picture and the best texture of each model, of the scope that was entered.
std::string picture_html(Connection& connection, const PicturePlaces& places, const Statement& file,
                         OpenSets& sets) {
    const std::string picture = file.text(5);
    const double white = file.real(3), kappa = file.real(6);
    std::string html = "<section class=\"picture\"><h3>" + html_text(file.text(1)) +
                       (file.text(2).empty() ? "" : " [" + html_text(file.text(2)) + "]") +
                       " <span class=\"quiet\">" + html_text(file.text(4)) +
                       ", κ(256) = " + kappa_text(kappa) +
                       (std::isfinite(kappa) ? (kappa > Kappa::threshold ? ": 3D" : ": 2D suffices") : "") +
                       "</span></h3><div class=\"pictures\">\n";
    html += figure(file.is_null(8) ? file_thumbnail(places, file) : direction_thumbnail(places, file, sets),
                   "not at hand", "original");
    Statement best(connection, R"sql(
        SELECT best.model, best.marginals, best.metric, memd_star, "order", levels, best.estimators, textures.file FROM (
            SELECT *, ROW_NUMBER() OVER (PARTITION BY model, marginals, metric ORDER BY memd_star, key) AS place
            FROM scope_jobs WHERE status = 'done' AND picture = ?) AS best
        LEFT JOIN textures ON textures.key = best.key
        WHERE place = 1 ORDER BY best.metric, best.marginals = ?, best.marginals, best.model)sql");
    best.bind(picture).bind(any_marginals);
    while (best.step()) {
        const auto texture = best.is_null(7) ? std::nullopt : places.texture(best.text(7));
        const std::string uri = texture ? thumbnail_uri(*texture, {}, white, thumbnail_side) : "";
        const std::int64_t levels = best.number(5);
        std::string caption =
            "<b>" + html_text(model_title(best.text(0))) + "</b> " + percent_text(best.real(3)) + " %";
        if (!has_no_order(best.text(0)))
            caption += "<br>order " + std::to_string(best.number(4)) +
                       (levels == 0 ? "" : ", K " + std::to_string(levels)) + ", " + html_text(best.text(6)) +
                       "<br>marginals " + html_text(best.text(1));
        if (best.text(2) != name(Metric::max)) caption += "<br>metric " + html_text(best.text(2));
        html += figure(uri, best.is_null(7) ? "not kept" : "not at hand", caption);
    }
    return html + "</div></section>\n";
}

std::string configurations_html(Connection& connection) {
    std::string html;
    Statement query(connection, "SELECT name, text, started FROM configurations ORDER BY started, id");
    while (query.step()) {
        html += "<details><summary>" + html_text(query.text(0)) + ", first run " + html_text(query.text(2)) +
                "</summary><pre>" + html_text(query.text(1)) + "</pre></details>\n";
    }
    return html;
}

std::string page_title(const std::vector<std::optional<RecordedConfiguration>>& chosen) {
    std::string title;
    for (const auto& configuration : chosen)
        if (configuration) title += (title.empty() ? "" : ", ") + configuration->name;
    return title.empty() ? "Experiment" : title;
}

/// Tables, plots and pictures of the scope that was entered.
std::string scope_html(Connection& connection, const std::filesystem::path& database,
                       const std::vector<ExperimentTable>& tables, int most_pictures, OpenSets& sets) {
    std::string html;
    for (const ExperimentTable& table : tables) {
        html += heading(2, "Marginals " + table.marginals + ", metric " + table.metric);
        html += paragraph(table_caption(table) + ". " + table_counts(table) + ".");
        std::string reasons;
        for (const std::string& reason : table_reasons(table))
            reasons += "<li>" + html_text(reason) + "</li>\n";
        html += table_html(table) + (reasons.empty() ? "" : "<ul>\n" + reasons + "</ul>\n") +
                plots_html(connection, table) + direction_maps_html(table);
    }
    html += heading(2, "Pictures");
    const PicturePlaces places(connection, database);
    const bool has_directions =
        connection.number("SELECT count(*) FROM sqlite_schema WHERE name = 'directions'") > 0;
    Statement files(connection,
                    std::string(R"sql(
        SELECT places.folder, places.name, places.crop, COALESCE(files.white, 1.0), places.material, places.picture,
               pictures.kappa, COALESCE(files.content, ''))sql") +
                        (has_directions ? R"sql(,
               btf, reading, view_theta, view_phi, light_theta, light_phi
        FROM scope_places AS places LEFT JOIN main.directions AS directions
            ON (directions.folder, directions.name, directions.crop) = (places.folder, places.name, places.crop))sql"
                                        : ", NULL FROM scope_places AS places") +
                        R"sql(
        LEFT JOIN main.files AS files
            ON (files.folder, files.name, files.crop) = (places.folder, places.name, places.crop)
        LEFT JOIN main.pictures AS pictures ON pictures.picture = places.picture
        ORDER BY places.material)sql" +
                        (has_directions ? ", btf, view_theta, view_phi, light_theta, light_phi" : "") +
                        ", places.name, places.crop");
    const std::int64_t count = connection.number("SELECT count(*) FROM scope_places");
    html += paragraph(
        "Upper left corners, pixel for pixel. " +
        (count > most_pictures ? "The first " + std::to_string(most_pictures) + " of " : std::string()) +
        std::to_string(count) + (count == 1 ? " picture." : " pictures."));
    for (int shown = 0; shown < most_pictures && files.step(); ++shown)
        html += picture_html(connection, places, files, sets);
    return html;
}

}  // namespace

void write_experiment_report(const std::filesystem::path& database, const std::filesystem::path& page,
                             int most_pictures, const ExperimentTableOptions& options) {
    const std::string asked = "write the report '" + page.string() + "'";
    std::error_code error;
    if (std::filesystem::equivalent(database, page, error))
        throw InputError(asked, "that is the database", "give the page a name of its own");
    check_output(page, asked);
    Connection connection(database, Connection::Access::read, "read the results '" + database.string() + "'");
    check_results(connection);
    const Transaction one_state(connection, Transaction::Kind::read);

    const auto chosen = chosen_configurations(connection, options);
    const std::string title = page_title(chosen);
    std::string html = "<!DOCTYPE html>\n<html lang=\"en\">\n<head><meta charset=\"utf-8\">" +
                       std::string("<meta name=\"viewport\" content=\"width=device-width\">") + "<title>" +
                       html_text(title) + "</title><style>" + style + "</style></head>\n<body>\n" +
                       heading(1, title);
    html += paragraph(
        "How near models come to the colours of pictures: MEMD* between every picture and the best "
        "texture of each model, as P4 (Havlíček and Haindl, WSCG 2024), section 5. Written by "
        "btfield " BTFIELD_VERSION ".");
    ExperimentTableOptions with_pictures = options;
    with_pictures.by_picture = true;  // for the maps
    OpenSets sets;
    for (const auto& configuration : chosen) {
        enter_scope(connection, configuration);
        if (chosen.size() > 1) html += heading(2, "Configuration " + configuration->name);
        html += scope_html(connection, database, tables_of_scope(connection, configuration, with_pictures),
                           most_pictures, sets);
    }
    html += heading(2, "Configuration") + configurations_html(connection) + "</body>\n</html>\n";
    write_file(page, valid_utf8(html), asked);
}

}  // namespace btfield

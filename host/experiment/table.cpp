#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <iterator>
#include <limits>
#include <map>
#include <optional>
#include <set>
#include <tuple>
#include <utility>

#include "btfield/criteria.hpp"
#include "btfield/error.hpp"
#include "btfield/experiment.hpp"
#include "host/experiment/angles.hpp"
#include "host/experiment/experiment_names.hpp"
#include "host/experiment/results_database.hpp"
#include "host/experiment/scope.hpp"

namespace btfield {

using namespace detail;

namespace {

constexpr double nan = std::numeric_limits<double>::quiet_NaN();

/// What tells tables apart, in this order; empty where it does not.
struct Axis {
    enum : std::size_t { metric, marginals, noise, gains, estimator, count };
};
using Variant = std::array<std::string, Axis::count>;

/// The best texture of a picture.
struct Best {
    double memd = nan;       ///< MEMD*, percent
    double std_ratio = nan;  ///< to the picture
};

struct Material {
    std::map<std::string, std::map<std::string, Best>> best;  ///< of model, of picture
    std::map<std::string, double> kappa;                      ///< of picture
};

/// Jobs whose reasons differ in numbers alone.
struct Reasons {
    std::string example;
    std::set<std::string> models;
    std::uint64_t jobs = 0;
};

struct Contents {
    std::map<std::string, Material> materials;
    std::map<std::pair<std::string, std::string>, Reasons> reasons;  ///< of status, text without numbers
    std::map<std::string, std::uint64_t> counts;                     ///< of status
    std::array<std::set<std::string>, Axis::count> values;           ///< of the jobs
};

/// What a picture is called, and where it is seen and lit from.
struct Named {
    std::string name;
    std::optional<ExperimentDirections> directions;
};

/// The pictures of a configuration.
struct Pictures {
    std::map<std::string, std::set<std::string>> of;             ///< material
    std::map<std::string, std::map<std::string, double>> kappa;  ///< of material, of picture
    /// Of material, of picture: one, or all directions that look the same.
    std::map<std::string, std::map<std::string, std::vector<Named>>> names;
    std::set<std::string> all;
};

/// What is alike in reasons of one kind: figures are not.
std::string without_numbers(const std::string& text) {
    std::string result;
    for (const char c : text) {
        const bool figure = (c >= '0' && c <= '9') || (c == '.' && result.ends_with('#'));
        if (!figure)
            result += c;
        else if (!result.ends_with('#'))
            result += '#';
    }
    return result;
}

ExperimentTable::Cell cell_of(const std::vector<double>& values) {
    ExperimentTable::Cell cell;
    cell.pictures = static_cast<int>(values.size());
    const auto n = static_cast<double>(values.size());
    double sum = 0.0, squares = 0.0;
    for (const double value : values) sum += value;
    cell.mean = values.empty() ? nan : sum / n;
    for (const double value : values) squares += (value - cell.mean) * (value - cell.mean);
    cell.deviation = values.empty() ? nan : std::sqrt(squares / n);
    return cell;
}

double median(std::vector<double> values) {
    if (values.empty()) return nan;
    std::sort(values.begin(), values.end());
    const std::size_t half = values.size() / 2;
    return values.size() % 2 == 1 ? values[half] : 0.5 * (values[half - 1] + values[half]);
}

ExperimentTable::Colour colour_of(const Material& material) {
    ExperimentTable::Colour colour;
    std::vector<double> kappas;
    for (const auto& entry : material.kappa) kappas.push_back(entry.second);
    colour.kappa = median(std::move(kappas));
    colour.needs_3d = colour.kappa > Kappa::threshold;

    std::map<std::string, double> flat, full;  // least MEMD* of picture
    for (const auto& [model, pictures] : material.best) {
        const std::optional<ModelKind> field = find_value<ModelKind>(model);
        if (!field) continue;
        auto& least = is_2d(*field) ? flat : full;
        for (const auto& [picture, best] : pictures) {
            const auto [place, added] = least.emplace(picture, best.memd);
            if (!added) place->second = std::min(place->second, best.memd);
        }
    }
    std::vector<double> flat_values, full_values;  // of pictures that have both
    for (const auto& [picture, value] : flat) {
        if (full.count(picture) == 0) continue;
        flat_values.push_back(value);
        full_values.push_back(full[picture]);
    }
    if (flat_values.empty()) {  // nothing to compare, but to show
        for (const auto& entry : flat) flat_values.push_back(entry.second);
        for (const auto& entry : full) full_values.push_back(entry.second);
    }
    colour.best_2d = cell_of(flat_values).mean;
    colour.best_3d = cell_of(full_values).mean;
    colour.pictures_2d = static_cast<int>(flat_values.size());
    colour.pictures_3d = static_cast<int>(full_values.size());
    colour.gap = colour.best_2d - colour.best_3d > memd_gap_threshold;
    return colour;
}

/// Whether jobs of `general` belong to the table of `special` too: they do not read what tells the two apart.
bool covers(const Variant& general, const Variant& special) {
    for (std::size_t axis = 0; axis < Axis::count; ++axis)
        if (general[axis] != special[axis] && general[axis] != any_marginals) return false;
    return general != special;
}

void add_contents(const Contents& from, Contents& to) {
    for (const auto& [name, material] : from.materials) {
        Material& place = to.materials[name];
        for (const auto& [model, pictures] : material.best)
            place.best[model].insert(pictures.begin(), pictures.end());
    }
    for (const auto& [status, count] : from.counts) to.counts[status] += count;
    for (const auto& [kind, reasons] : from.reasons) {
        Reasons& place = to.reasons[kind];
        if (place.example.empty()) place.example = reasons.example;
        place.models.insert(reasons.models.begin(), reasons.models.end());
        place.jobs += reasons.jobs;
    }
    for (std::size_t axis = 0; axis < Axis::count; ++axis)
        to.values[axis].insert(from.values[axis].begin(), from.values[axis].end());
}

/// What reads no marginals, gains, … belongs to all tables of others that do, or to one of its own.
std::map<Variant, Contents> spread(const std::map<Variant, Contents>& contents) {
    const auto is_general = [&](const Variant& variant) {
        return std::ranges::any_of(contents, [&](const auto& other) { return covers(variant, other.first); });
    };
    std::map<Variant, Contents> tables;
    for (const auto& [variant, content] : contents)
        if (!is_general(variant)) tables.emplace(variant, content);
    for (auto& [variant, content] : tables) {
        for (const auto& [other, general] : contents)
            if (covers(other, variant)) add_contents(general, content);
    }
    return tables;
}

std::string joined(const std::set<std::string>& values) {
    std::string text;
    for (const std::string& value : values)
        if (value != any_marginals) text += (text.empty() ? "" : ", ") + value;
    return text;
}

ExperimentTable::Row row_of(const std::string& model, const std::map<std::string, Material>& materials) {
    ExperimentTable::Row row;
    row.model = model;
    std::map<std::string, double> all;  // a picture that stands under two materials counts once
    for (const auto& entry : materials) {
        std::vector<double> values;
        const auto found = entry.second.best.find(model);
        if (found != entry.second.best.end()) {
            for (const auto& [picture, best] : found->second) {
                values.push_back(best.memd);
                all.emplace(picture, best.memd);
            }
        }
        row.materials.push_back(cell_of(values));
    }
    std::vector<double> values;
    values.reserve(all.size());
    for (const auto& entry : all) values.push_back(entry.second);
    row.all = cell_of(values);
    return row;
}

std::vector<ExperimentTable::Reason> reasons_of(const Contents& contents) {
    std::vector<ExperimentTable::Reason> all;
    for (const auto& [kind, reasons] : contents.reasons) {
        ExperimentTable::Reason& reason = all.emplace_back();
        reason.status = kind.first;
        reason.text = reasons.example;
        for (const ExperimentModel known : values_of<ExperimentModel>())
            if (reasons.models.count(std::string(name(known))) != 0) reason.models.emplace_back(name(known));
        reason.jobs = reasons.jobs;
    }
    std::ranges::stable_sort(all, std::greater{}, &ExperimentTable::Reason::jobs);
    return all;
}

/// Names in their order, directions of a set view by view.
bool row_less(const ExperimentTable::PictureRow& a, const ExperimentTable::PictureRow& b) {
    const auto place = [](const ExperimentTable::PictureRow& row) {
        // The name of a set is before that of the view.
        const bool has = row.directions.has_value();
        const ExperimentDirections at = row.directions.value_or(ExperimentDirections{});
        return std::tuple(has ? row.picture.substr(0, row.picture.rfind(" view ")) : row.picture,
                          at.view.theta, at.view.phi, at.light.theta, at.light.phi);
    };
    const auto first = place(a), second = place(b);
    return first != second ? first < second : a.picture < b.picture;
}

/// Of a table whose other rows are there.
std::vector<ExperimentTable::PictureRow> picture_rows_of(const ExperimentTable& table,
                                                         const std::map<std::string, Material>& materials,
                                                         const Pictures& pictures) {
    std::vector<ExperimentTable::PictureRow> rows;
    for (const auto& [material, names] : pictures.names) {
        const std::size_t first = rows.size();
        for (const auto& [picture, named] : names) {
            ExperimentTable::PictureRow row;
            row.material = material;
            const Material& own = materials.at(material);
            const auto kappa = own.kappa.find(picture);
            row.kappa = kappa == own.kappa.end() ? nan : kappa->second;
            for (const ExperimentTable::Row& model : table.rows) {
                const auto of = own.best.find(model.model);
                const bool has = of != own.best.end() && of->second.count(picture) != 0;
                const Best best = has ? of->second.at(picture) : Best{};
                row.best.push_back(best.memd);
                row.std_ratio.push_back(best.std_ratio);
            }
            for (const Named& one : named) {
                row.picture = one.name;
                row.directions = one.directions;
                rows.push_back(row);
            }
        }
        std::sort(rows.begin() + static_cast<std::ptrdiff_t>(first), rows.end(), row_less);
    }
    return rows;
}

ExperimentTable table_of(const Variant& variant, const Contents& contents, const Pictures& pictures) {
    ExperimentTable table;
    table.metric = variant[Axis::metric];
    table.marginals = variant[Axis::marginals];
    table.noise = joined(contents.values[Axis::noise]);
    table.gains = joined(contents.values[Axis::gains]);
    table.estimators = joined(contents.values[Axis::estimator]);
    const auto count = [&](const char* status) {
        const auto found = contents.counts.find(status);
        return found == contents.counts.end() ? 0 : found->second;
    };
    table.done = count("done");
    table.refused = count("refused");
    table.failed = count("failed");
    std::map<std::string, Material> materials;
    std::set<std::string> models;
    for (const auto& [name, members] : pictures.of) {
        Material& material = materials[name];
        const auto found = contents.materials.find(name);
        if (found != contents.materials.end()) material = found->second;
        const auto kappa = pictures.kappa.find(name);
        if (kappa != pictures.kappa.end()) material.kappa = kappa->second;
        table.materials.push_back(name);
        table.pictures.push_back(static_cast<int>(members.size()));
        table.colours.push_back(colour_of(material));
        for (const auto& entry : material.best) models.insert(entry.first);
    }
    table.all_pictures = static_cast<int>(pictures.all.size());
    for (const ExperimentModel known : values_of<ExperimentModel>()) {
        const std::string model(name(known));
        if (models.count(model) == 0) continue;
        table.rows.push_back(row_of(model, materials));
    }
    table.reasons = reasons_of(contents);
    table.picture_rows = picture_rows_of(table, materials, pictures);
    return table;
}

/// Of the scope that was entered.
Pictures pictures_of(Connection& connection) {
    Pictures pictures;
    const bool has_directions =
        connection.number("SELECT count(*) FROM sqlite_schema WHERE name = 'directions'") > 0;
    Statement query(
        connection,
        std::string("SELECT DISTINCT material, places.picture, kappa, places.name, places.crop, ") +
            (has_directions ? "view_theta, view_phi, light_theta, light_phi" : "NULL, NULL, NULL, NULL") +
            " FROM scope_places AS places"
            " LEFT JOIN main.pictures ON main.pictures.picture = places.picture" +
            (has_directions ? " LEFT JOIN main.directions AS directions ON (directions.folder, "
                              "directions.name, directions.crop) = (places.folder, places.name, places.crop)"
                            : ""));
    while (query.step()) {
        pictures.of[query.text(0)].insert(query.text(1));
        pictures.all.insert(query.text(1));
        const std::string crop = query.text(4);
        Named named{query.text(3) + (crop.empty() ? "" : " [" + crop + "]"), {}};
        if (!query.is_null(5))
            named.directions = {{from_degrees(query.real(5)), from_degrees(query.real(6))},
                                {from_degrees(query.real(7)), from_degrees(query.real(8))}};
        std::vector<Named>& known = pictures.names[query.text(0)][query.text(1)];
        if (known.empty() || named.directions) known.push_back(std::move(named));
        if (!query.is_null(2)) pictures.kappa[query.text(0)][query.text(1)] = query.real(2);
    }
    return pictures;
}

class Reading {
  public:
    explicit Reading(const ExperimentTableOptions& options) : options_(options) {}

    /// Of the scope that was entered.
    [[nodiscard]] std::map<Variant, Contents> contents(Connection& connection) const {
        std::map<Variant, Contents> contents;
        Statement best(connection, R"sql(
            SELECT metric, marginals, noise, gains, estimator, model, material, scope_jobs.picture, min(memd_star),
                   variance_ratio
            FROM scope_jobs JOIN (SELECT DISTINCT material, picture FROM scope_places) AS places
                ON places.picture = scope_jobs.picture
            GROUP BY metric, marginals, noise, gains, estimator, model, material, scope_jobs.picture)sql");
        while (best.step()) {
            auto& models = place(best, contents).materials[best.text(6)].best[best.text(5)];
            if (best.is_null(8)) continue;
            const Best one{best.real(8), std::sqrt(best.real(9))};  // of the row with the minimum
            const auto [at, added] = models.emplace(best.text(7), one);
            if (!added && one.memd < at->second.memd) at->second = one;
        }
        Statement count(connection, R"sql(
            SELECT metric, marginals, noise, gains, estimator, model, status, count(*) FROM scope_jobs
            GROUP BY metric, marginals, noise, gains, estimator, model, status)sql");
        while (count.step())
            place(count, contents).counts[count.text(6)] += static_cast<std::uint64_t>(count.number(7));
        Statement why(connection, R"sql(
            SELECT metric, marginals, noise, gains, estimator, model, status, reason, count(*) FROM scope_jobs
            WHERE status != 'done'
            GROUP BY metric, marginals, noise, gains, estimator, model, status, reason)sql");
        while (why.step()) {
            Reasons& reasons = place(why, contents).reasons[{why.text(6), without_numbers(why.text(7))}];
            if (reasons.example.empty()) reasons.example = why.text(7);
            reasons.models.insert(why.text(5));
            reasons.jobs += static_cast<std::uint64_t>(why.number(8));
        }
        return spread(contents);
    }

  private:
    /// Where the row belongs, whose first columns are the axes and the model.
    [[nodiscard]] Contents& place(const Statement& row, std::map<Variant, Contents>& contents) const {
        Variant values;
        for (std::size_t axis = 0; axis < Axis::count; ++axis)
            values[axis] = row.text(static_cast<int>(axis));
        const auto model = find_value<ExperimentModel>(row.text(Axis::count));
        if (model && has_one_estimator(*model)) values[Axis::estimator] = any_marginals;
        Variant variant = values;
        if (!options_.by_noise) variant[Axis::noise].clear();
        if (!options_.by_gains) variant[Axis::gains].clear();
        if (!options_.by_estimator) variant[Axis::estimator].clear();
        Contents& content = contents[variant];
        for (std::size_t axis = 0; axis < Axis::count; ++axis) content.values[axis].insert(values[axis]);
        return content;
    }

    const ExperimentTableOptions& options_;
};

}  // namespace

std::vector<std::optional<RecordedConfiguration>> detail::chosen_configurations(
    Connection& connection, const ExperimentTableOptions& options) {
    const std::vector<RecordedConfiguration> known = recorded_configurations(connection);
    if (options.all_configurations) {
        if (!known.empty()) return {known.begin(), known.end()};
    } else if (!options.configuration.empty()) {
        const auto found = std::ranges::find(known, options.configuration, &RecordedConfiguration::name);
        if (found != known.end()) return {*found};
        std::string names;
        for (const RecordedConfiguration& configuration : known)
            names += (names.empty() ? "'" : ", '") + configuration.name + "'";
        throw InputError(connection.asked(), "no configuration is called '" + options.configuration + "'",
                         known.empty() ? "the database has none" : "the database has " + names);
    } else if (!known.empty()) {
        return {known.front()};
    }
    return {std::nullopt};
}

std::vector<ExperimentTable> detail::tables_of_scope(
    Connection& connection, const std::optional<RecordedConfiguration>& configuration,
    const ExperimentTableOptions& options) {
    std::vector<ExperimentTable> tables;
    const Pictures pictures = pictures_of(connection);
    for (const auto& [variant, content] : Reading(options).contents(connection)) {
        tables.push_back(table_of(variant, content, pictures));
        if (!options.by_picture) tables.back().picture_rows.clear();
        if (configuration) tables.back().configuration = configuration->name;
    }
    return tables;
}

ExperimentContents experiment_contents(const std::filesystem::path& database) {
    Connection connection(database, Connection::Access::read, "read the results '" + database.string() + "'");
    check_results(connection);
    const Transaction one_state(connection, Transaction::Kind::read);
    ExperimentContents contents;
    for (const RecordedConfiguration& configuration : recorded_configurations(connection)) {
        enter_scope(connection, configuration);
        contents.configurations.push_back(
            {configuration.name, configuration.last_run,
             static_cast<std::uint64_t>(connection.number("SELECT count(*) FROM scope_jobs"))});
    }
    contents.jobs = static_cast<std::uint64_t>(connection.number("SELECT count(*) FROM main.jobs"));
    return contents;
}

std::vector<ExperimentTable> experiment_tables(const std::filesystem::path& database,
                                               const ExperimentTableOptions& options) {
    Connection connection(database, Connection::Access::read, "read the results '" + database.string() + "'");
    check_results(connection);
    const Transaction one_state(connection, Transaction::Kind::read);
    std::vector<ExperimentTable> tables;
    for (const auto& configuration : chosen_configurations(connection, options)) {
        enter_scope(connection, configuration);
        std::ranges::move(tables_of_scope(connection, configuration, options), std::back_inserter(tables));
    }
    return tables;
}

}  // namespace btfield

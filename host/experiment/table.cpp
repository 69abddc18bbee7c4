#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <set>
#include <utility>

#include "btfield/criteria.hpp"
#include "btfield/experiment.hpp"
#include "host/experiment/experiment_names.hpp"
#include "host/experiment/results_database.hpp"

namespace btfield {

using namespace detail;

namespace {

constexpr double nan = std::numeric_limits<double>::quiet_NaN();

/// Metric and marginals.
using Variant = std::pair<std::string, std::string>;

struct Material {
    std::map<std::string, std::map<std::string, double>> best;  ///< of model, of picture
    std::map<std::string, double> kappa;                        ///< of picture
    std::set<std::string> pictures;                             ///< with any job
};

struct Contents {
    std::map<std::string, Material> materials;
    std::map<std::string, std::uint64_t> counts;  ///< of status
};

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
        for (const auto& [picture, value] : pictures) {
            const auto [place, added] = least.emplace(picture, value);
            if (!added) place->second = std::min(place->second, value);
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
    colour.gap = colour.best_2d - colour.best_3d > memd_gap_threshold;
    return colour;
}

/// Rolls belong to the tables of all marginals of their metric, or to one of their own.
void spread_rolls(std::map<Variant, Contents>& contents) {
    std::vector<Variant> spread;
    for (const auto& [variant, rolls] : contents) {
        if (variant.second != any_marginals) continue;
        for (auto& [other, content] : contents) {
            if (other.first != variant.first || other.second == any_marginals) continue;
            for (const auto& [name, material] : rolls.materials) {
                Material& place = content.materials[name];
                place.pictures.insert(material.pictures.begin(), material.pictures.end());
                place.best.insert(material.best.begin(), material.best.end());
            }
            for (const auto& [status, count] : rolls.counts) content.counts[status] += count;
            spread.push_back(variant);
        }
    }
    for (const Variant& variant : spread) contents.erase(variant);
}

ExperimentTable table_of(const Variant& variant, const Contents& contents) {
    ExperimentTable table;
    table.metric = variant.first;
    table.marginals = variant.second;
    const auto count = [&](const char* status) {
        const auto found = contents.counts.find(status);
        return found == contents.counts.end() ? 0 : found->second;
    };
    table.done = count("done");
    table.refused = count("refused");
    table.failed = count("failed");
    std::set<std::string> models;
    for (const auto& [material, content] : contents.materials) {
        table.materials.push_back(material);
        table.pictures.push_back(static_cast<int>(content.pictures.size()));
        table.colours.push_back(colour_of(content));
        for (const auto& entry : content.best) models.insert(entry.first);
    }
    for (const ExperimentModel known : values_of<ExperimentModel>()) {
        const std::string model(name(known));
        if (models.count(model) == 0) continue;
        ExperimentTable::Row row;
        row.model = model;
        std::map<std::string, double> all;  // a picture that stands under two materials counts once
        for (const auto& entry : contents.materials) {
            std::vector<double> values;
            const auto found = entry.second.best.find(model);
            if (found != entry.second.best.end()) {
                for (const auto& [picture, value] : found->second) {
                    values.push_back(value);
                    all.emplace(picture, value);
                }
            }
            row.materials.push_back(cell_of(values));
        }
        std::vector<double> values;
        values.reserve(all.size());
        for (const auto& entry : all) values.push_back(entry.second);
        row.all = cell_of(values);
        table.rows.push_back(std::move(row));
    }
    return table;
}

}  // namespace

std::vector<ExperimentTable> experiment_tables(const std::filesystem::path& database) {
    Connection connection(database, Connection::Access::read, "read the results '" + database.string() + "'");
    check_results(connection);
    const Transaction one_state(connection, Transaction::Kind::read);

    std::map<Variant, Contents> contents;
    Statement best(connection, R"sql(
        SELECT jobs.metric, jobs.marginals, places.material, jobs.picture, jobs.model, min(jobs.memd_star)
        FROM jobs JOIN (SELECT DISTINCT material, picture FROM files) AS places ON places.picture = jobs.picture
        GROUP BY jobs.metric, jobs.marginals, places.material, jobs.picture, jobs.model)sql");
    while (best.step()) {
        Material& material = contents[{best.text(0), best.text(1)}].materials[best.text(2)];
        material.pictures.insert(best.text(3));
        auto& models = material.best[best.text(4)];
        if (!best.is_null(5)) models[best.text(3)] = best.real(5);
    }
    Statement count(connection, R"sql(
        SELECT metric, marginals, status, count(*) FROM jobs WHERE picture IN (SELECT picture FROM files)
        GROUP BY metric, marginals, status)sql");
    while (count.step()) {
        contents[{count.text(0), count.text(1)}].counts[count.text(2)] =
            static_cast<std::uint64_t>(count.number(3));
    }
    spread_rolls(contents);
    Statement kappa(connection, R"sql(
        SELECT DISTINCT files.material, files.picture, pictures.kappa FROM files JOIN pictures USING (picture)
        WHERE pictures.kappa IS NOT NULL)sql");
    while (kappa.step()) {
        for (auto& entry : contents) {
            const auto found = entry.second.materials.find(kappa.text(0));
            if (found != entry.second.materials.end()) found->second.kappa[kappa.text(1)] = kappa.real(2);
        }
    }
    std::vector<ExperimentTable> tables;
    tables.reserve(contents.size());
    for (const auto& [variant, content] : contents) tables.push_back(table_of(variant, content));
    return tables;
}

}  // namespace btfield

// P4's Table 1 from rows that are known, in every format, and the page.

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <regex>
#include <set>
#include <string>
#include <vector>

#include "btfield/error.hpp"
#include "btfield/experiment.hpp"
#include "host/experiment/plot.hpp"
#include "host/experiment/results_database.hpp"
#include "host/experiment/thumbnail.hpp"
#include "tests/experiment_cases.hpp"
#include "tests/json_text.hpp"
#include "tests/run_program.hpp"

namespace btfield {

using namespace detail;

namespace {

namespace fs = std::filesystem;
using test::TemporaryFolder;

std::size_t count_of(const std::string& text, const std::string& part) {
    std::size_t count = 0;
    for (std::size_t at = text.find(part); at != std::string::npos; at = text.find(part, at + 1)) ++count;
    return count;
}

JobResult job(const std::string& picture, ExperimentModel model, int order, double memd_star) {
    JobResult result;
    result.picture = picture;
    result.settings.model = model;
    result.settings.order = order;
    result.metric = "max";
    result.settings_text = settings_text({}, result.settings);
    result.key = picture + std::string(name(model)) + std::to_string(order);
    result.status = std::isnan(memd_star) ? JobStatus::refused : JobStatus::done;
    if (result.status == JobStatus::done) {
        result.memd_star = memd_star;
        result.memd = 2.55 * memd_star;
    } else {
        result.reason = "it does not certify";
    }
    return result;
}

/// Material "a|b, \"c\" & <d>_%" has pictures 1 and 2 (κ 2 and 5), material "e" picture 3 (κ 0.5).
fs::path known_results(const TemporaryFolder& folder) {
    ResultsDatabase database(folder / "known.db", "make it");
    ExperimentConfig config;
    config.name = "known <one>";
    config.text = "{\"a\": \"<&>\"}";
    config.models = {ExperimentModel::car2d, ExperimentModel::car3d, ExperimentModel::ma3d};
    config.orders = {1, 3};
    config.levels = {1};
    std::vector<PictureSource> sources(3);
    for (std::size_t i = 0; i < 3; ++i) {
        sources[i].name = "p" + std::to_string(i + 1) + ".ppm";
        sources[i].file = folder / sources[i].name;
        sources[i].material = i < 2 ? "a|b, \"c\" & <d>_%" : "e";
        sources[i].picture = std::to_string(i + 1);
        test::write_texture(sources[i].file, static_cast<unsigned>(i));
    }
    database.add(config, sources);
    const std::vector<double> kappas{2.0, 5.0, 0.5};
    for (std::size_t i = 0; i < 3; ++i) {
        WorkReport report;
        report.facts = PictureFacts{sources[i].picture, kappas[i], {32, 40}, 3};
        database.add(report);
    }
    WorkReport report;
    report.results = {
        job("1", ExperimentModel::car2d, 1, 6.0), job("1", ExperimentModel::car2d, 3, 4.0),
        job("2", ExperimentModel::car2d, 1, 8.0), job("1", ExperimentModel::car3d, 1, 3.0),
        job("2", ExperimentModel::car3d, 1, 4.0), job("3", ExperimentModel::car2d, 1, 1.0),
        job("3", ExperimentModel::car3d, 1, NAN), job("3", ExperimentModel::ma3d, 1, 1.5),
    };
    report.kept = {{"1", "3d-car", "match", "max", "13d-car1", (folder / "p2.ppm").string()}};
    database.add(report);
    database.close();
    return folder / "known.db";
}

TEST(ExperimentTable, MeansDeviationsAndKappa) {
    const TemporaryFolder folder;
    const std::vector<ExperimentTable> tables = experiment_tables(known_results(folder));
    ASSERT_EQ(tables.size(), 1U);
    const ExperimentTable& table = tables[0];
    EXPECT_EQ(table.metric, "max");
    EXPECT_EQ(table.marginals, "match");
    EXPECT_EQ(table.done, 7U);
    EXPECT_EQ(table.refused, 1U);
    EXPECT_EQ(table.failed, 0U);
    ASSERT_EQ(table.materials.size(), 2U);
    EXPECT_EQ(table.materials[1], "e");
    EXPECT_EQ(table.pictures, (std::vector<int>{2, 1}));
    ASSERT_EQ(table.rows.size(), 3U);
    EXPECT_EQ(table.rows[0].model, "2d-car");
    EXPECT_EQ(table.rows[1].model, "3d-car");
    EXPECT_EQ(table.rows[2].model, "3d-ma");
    // 2D CAR: the best of picture 1 is 4, of picture 2 is 8, of picture 3 is 1.
    EXPECT_DOUBLE_EQ(table.rows[0].materials[0].mean, 6.0);
    EXPECT_DOUBLE_EQ(table.rows[0].materials[0].deviation, 2.0);
    EXPECT_EQ(table.rows[0].materials[0].pictures, 2);
    EXPECT_DOUBLE_EQ(table.rows[0].all.mean, 13.0 / 3.0);
    EXPECT_DOUBLE_EQ(table.rows[0].all.deviation, std::sqrt((16.0 + 64.0 + 1.0) / 3.0 - 169.0 / 9.0));
    EXPECT_DOUBLE_EQ(table.rows[1].materials[0].mean, 3.5);
    EXPECT_EQ(table.rows[1].materials[1].pictures, 0);
    EXPECT_TRUE(std::isnan(table.rows[1].materials[1].mean));
    // κ: median of 2 and 5; the best of 2D are 4 and 8, of 3D 3 and 4.
    EXPECT_DOUBLE_EQ(table.colours[0].kappa, 3.5);
    EXPECT_TRUE(table.colours[0].needs_3d);
    EXPECT_DOUBLE_EQ(table.colours[0].best_2d, 6.0);
    EXPECT_DOUBLE_EQ(table.colours[0].best_3d, 3.5);
    EXPECT_TRUE(table.colours[0].gap);
    EXPECT_FALSE(table.colours[1].needs_3d);
    EXPECT_DOUBLE_EQ(table.colours[1].best_2d, 1.0);
    EXPECT_DOUBLE_EQ(table.colours[1].best_3d, 1.5);
    EXPECT_FALSE(table.colours[1].gap);
}

TEST(ExperimentTable, RowsOfPicturesAndReasons) {
    const TemporaryFolder folder;
    const fs::path database = known_results(folder);
    ASSERT_TRUE(experiment_tables(database)[0].picture_rows.empty());
    ExperimentTableOptions options;
    options.by_picture = true;
    const std::vector<ExperimentTable> tables = experiment_tables(database, options);
    ASSERT_EQ(tables.size(), 1U);
    ASSERT_EQ(tables[0].picture_rows.size(), 3U);
    const ExperimentTable::PictureRow& first = tables[0].picture_rows[0];
    EXPECT_EQ(first.picture, "p1.ppm");
    EXPECT_DOUBLE_EQ(first.kappa, 2.0);
    EXPECT_DOUBLE_EQ(first.best[0], 4.0);
    EXPECT_TRUE(std::isnan(tables[0].picture_rows[2].best[1]));
    ASSERT_EQ(tables[0].reasons.size(), 1U);
    EXPECT_EQ(tables[0].reasons[0].jobs, 1U);
    EXPECT_EQ(tables[0].reasons[0].models, std::vector<std::string>{"3d-car"});
    const auto holds = [&](TableFormat format, const std::string& part) {
        const std::string text = format_tables(tables, format);
        EXPECT_NE(text.find(part), std::string::npos) << part << " in:\n" << text;
    };
    holds(TableFormat::text, "refused, 1 job of 3D CAR: it does not certify\n");
    holds(TableFormat::markdown, "| p3.ppm | e | 0.5 | 1.00 | - | 1.50 |\n");
    holds(TableFormat::latex, "% refused, 1 job of 3D CAR");
    holds(TableFormat::latex, "p3.ppm & e & 0.5 & 1.00 & - & 1.50 \\\\\n");
    holds(TableFormat::csv, ",estimator,picture\n");
    holds(TableFormat::csv, "max,match,e,0.5,,,3d-ma,1.5,,1,1,known <one>,full,match,,p3.ppm\n");
}

TEST(ExperimentTable, Formats) {
    const TemporaryFolder folder;
    const std::vector<ExperimentTable> tables = experiment_tables(known_results(folder));
    const auto holds = [&](TableFormat format, const std::string& part) {
        const std::string text = format_tables(tables, format);
        EXPECT_NE(text.find(part), std::string::npos) << part << " in:\n" << text;
    };
    for (const char* part : {"2D CAR", "6.00", "2.00", "κ(256)", "7 jobs done, 1 refused, 0 failed"}) {
        holds(TableFormat::text, part);
    }
    holds(TableFormat::markdown, "| a\\|b, \"c\" & <d>_% (2) | std |");
    holds(TableFormat::markdown, "| 2D CAR | 6.00 | 2.00 | 1.00 |  | 4.33 | 2.87 |");
    holds(TableFormat::markdown, "| 3D CAR | 3.50 | 0.50 | - | - | 3.50 (2/3) | 0.50 |");
    holds(TableFormat::csv,
          "max,match,\"a|b, \"\"c\"\" & <d>_%\",3.5,6,3.5,2d-car,6,2,2,2,known <one>,full,match,\n");
    holds(TableFormat::csv, "max,match,e,0.5,1,1.5,3d-car,,,0,1,known <one>,full,match,\n");
    holds(TableFormat::text, "(n/N) marks a mean over n of N pictures");
    holds(TableFormat::latex,
          "a\\textbar{}b, \\textquotedbl{}c\\textquotedbl{} \\& \\textless{}d\\textgreater{}\\_\\% (2)");
    holds(TableFormat::latex, "2D CAR & 6.00 & 2.00 & \\textbf{1.00} &  & \\textbf{4.33} & 2.87 \\\\");
    // A mean over fewer pictures is no best one.
    holds(TableFormat::latex, "3D CAR & \\textbf{3.50} & 0.50 & - & - & 3.50 (2/3) & 0.50 \\\\");
    holds(TableFormat::latex, "\\label{tab:memd-known-one-max-match-full-match}");
    holds(TableFormat::latex, "$\\kappa$(256) & 3.5");
    // As many cells in every line of a Markdown table.
    const std::string markdown = format_tables(tables, TableFormat::markdown);
    const std::regex unescaped(R"([^\\]\|)");
    std::size_t at = markdown.find("| model");
    std::ptrdiff_t cells = -1;
    while (markdown[at] == '|') {
        const std::size_t end = markdown.find('\n', at);
        const std::string line = " " + markdown.substr(at, end - at);
        const std::ptrdiff_t count =
            std::distance(std::sregex_iterator(line.begin(), line.end(), unescaped), std::sregex_iterator());
        if (cells >= 0) {
            EXPECT_EQ(count, cells) << line;
        }
        cells = count;
        at = end + 1;
    }
    EXPECT_EQ(cells, 8);
}

/// 2D models, 3D ones and the rest are blocks; every rule and environment is in its place.
TEST(ExperimentTable, LatexIsThatOfBooktabs) {
    const TemporaryFolder folder;
    const std::string text = format_tables(experiment_tables(known_results(folder)), TableFormat::latex);
    const std::regex form(
        R"(% needs \\usepackage\{booktabs\}\n\\begin\{table\}\n\\centering\n)"
        R"(\\begin\{tabular\}\{lrrrrrr\}\n\\toprule\n[^\n]+ \\\\\n)"
        R"(\\cmidrule\(lr\)\{2-3\}\\cmidrule\(lr\)\{4-5\}\\cmidrule\(lr\)\{6-7\}\n)"
        R"(model( & mean & std){3} \\\\\n\\midrule\n2D CAR [^\n]+\n\\midrule\n3D CAR [^\n]+\n3D MA [^\n]+\n)"
        R"(\\midrule\n(?:[^\\\n][^\n]+\n|\$[^\n]+\n){5}\\bottomrule\n\\end\{tabular\}\n\n\\caption\{[^\n]+\}\n)"
        R"(\\label\{[a-z0-9:-]+\}\n\\end\{table\}\n% refused, [^\n]+\n)");
    EXPECT_TRUE(std::regex_match(text, form)) << text;
}

TEST(ExperimentTable, UnfinishedRunsAreMarked) {
    const TemporaryFolder folder;
    ExperimentConfig config;
    config.models = {ExperimentModel::car3d};
    config.orders = config.levels = {1};
    {
        ResultsDatabase database(folder / "r.db", "make it");
        std::vector<PictureSource> sources(6);
        for (std::size_t i = 0; i < sources.size(); ++i) {
            sources[i].name = "p" + std::to_string(i);
            sources[i].file = folder / sources[i].name;
            sources[i].material = "m";
            sources[i].picture = std::to_string(i);
        }
        database.add(config, sources);
        WorkReport report;
        report.results = {job("2", ExperimentModel::car3d, 1, 12.63)};
        database.add(report);
        database.close();
    }
    const std::vector<ExperimentTable> tables = experiment_tables(folder / "r.db");
    ASSERT_EQ(tables.size(), 1U);
    EXPECT_EQ(tables[0].pictures, std::vector<int>{6});
    EXPECT_EQ(tables[0].all_pictures, 6);
    for (const TableFormat format : {TableFormat::text, TableFormat::markdown, TableFormat::latex}) {
        const std::string text = format_tables(tables, format);
        EXPECT_EQ(count_of(text, "12.63 (1/6)"), 3U) << text;  // material, all, best 3D
        EXPECT_EQ(text.find("0.00"), std::string::npos) << "no deviation of one picture: " << text;
        EXPECT_EQ(text.find("textbf"), std::string::npos) << text;
    }
}

/// Two configurations that differ in noise, in one database: never one best-of row.
TEST(ExperimentTable, ConfigurationsStayApart) {
    const TemporaryFolder folder;
    const fs::path path = folder / "r.db";
    std::vector<PictureSource> sources(2);
    for (std::size_t i = 0; i < sources.size(); ++i) {
        sources[i].name = "p" + std::to_string(i);
        sources[i].file = folder / sources[i].name;
        sources[i].material = "m";
        sources[i].picture = std::to_string(i);
    }
    const auto run = [&](const std::string& name, NoiseForm noise, std::size_t pictures, double memd_star) {
        ExperimentConfig config;
        config.name = config.text = name;
        config.models = {ExperimentModel::car3d, ExperimentModel::msar3d};
        config.orders = config.levels = {1};
        config.estimators = {EstimatorChoice::least_squares, EstimatorChoice::maximum_likelihood};
        config.noise = noise;
        ResultsDatabase database(path, "fill it");
        database.add(config, {sources.begin(), sources.begin() + static_cast<std::ptrdiff_t>(pictures)});
        for (std::size_t i = 0; i < pictures; ++i) {
            WorkReport report;
            for (const JobSettings& settings : job_settings(config)) {
                JobResult result = job(sources[i].picture, settings.model, 1, memd_star);
                result.settings = settings;
                result.settings_text = settings_text(config, settings);
                result.key = job_key(result.picture, result.settings_text);
                if (settings.estimator == EstimatorChoice::maximum_likelihood) *result.memd_star += 1.0;
                if (database.jobs_of(result.picture).count(result.key) == 0) report.results.push_back(result);
            }
            database.add(report);
        }
        database.close();
    };
    run("first", NoiseForm::full, 2, 1.0);
    run("second", NoiseForm::diagonal, 1, 5.0);

    std::vector<ExperimentTable> tables = experiment_tables(path);
    ASSERT_EQ(tables.size(), 1U);
    EXPECT_EQ(tables[0].configuration, "second");
    EXPECT_EQ(tables[0].noise, "diagonal");
    EXPECT_EQ(tables[0].estimators, "ls, ml");
    EXPECT_EQ(tables[0].done, 3U);
    EXPECT_EQ(tables[0].all_pictures, 1);
    EXPECT_EQ(tables[0].rows.at(0).all.mean, 5.0);
    EXPECT_NE(format_tables(tables, TableFormat::text).find("noise diagonal"), std::string::npos);

    tables = experiment_tables(path, {.configuration = "first"});
    ASSERT_EQ(tables.size(), 1U);
    EXPECT_EQ(tables[0].rows.at(0).all.mean, 1.0);
    EXPECT_EQ(tables[0].all_pictures, 2);
    EXPECT_EQ(experiment_tables(path, {.all_configurations = true}).size(), 2U);
    EXPECT_THROW(static_cast<void>(experiment_tables(path, {.configuration = "third"})), InputError);

    // CAR models have one estimator: they are in both.
    tables = experiment_tables(path, {.configuration = "first", .by_noise = true, .by_estimator = true});
    ASSERT_EQ(tables.size(), 2U);
    for (const std::size_t t : {0U, 1U}) {
        EXPECT_EQ(tables[t].estimators, t == 0 ? "ls" : "ml");
        EXPECT_EQ(tables[t].noise, "full");
        ASSERT_EQ(tables[t].rows.size(), 2U);
        EXPECT_EQ(tables[t].rows[0].all.mean, 1.0);
        EXPECT_EQ(tables[t].rows[1].all.mean, t == 0 ? 1.0 : 2.0);
        EXPECT_EQ(tables[t].done, 4U);
    }
    const ExperimentContents contents = experiment_contents(path);
    ASSERT_EQ(contents.configurations.size(), 2U);
    EXPECT_EQ(contents.configurations[0].name, "second");
    EXPECT_EQ(contents.configurations[0].jobs, 3U);
    EXPECT_EQ(contents.configurations[1].jobs, 6U);
    EXPECT_EQ(contents.jobs, 9U);
    run("first", NoiseForm::full, 2, 1.0);  // the last run counts, whatever it found done
    EXPECT_EQ(experiment_tables(path).at(0).configuration, "first");
    write_experiment_report(path, folder / "page.html");
    EXPECT_EQ(count_of(test::bytes_of(folder / "page.html"), "<section class=\"picture\">"), 2U);
    write_experiment_report(path, folder / "page.html", 24, {.configuration = "second"});
    EXPECT_EQ(count_of(test::bytes_of(folder / "page.html"), "<section class=\"picture\">"), 1U);
}

TEST(ExperimentTable, EmptyDatabase) {
    const TemporaryFolder folder;
    ResultsDatabase(folder / "empty.db", "make it").close();
    EXPECT_TRUE(experiment_tables(folder / "empty.db").empty());
    EXPECT_EQ(format_tables({}, TableFormat::text), "no jobs yet\n");
    write_experiment_report(folder / "empty.db", folder / "page.html");
    EXPECT_NE(test::bytes_of(folder / "page.html").find("</html>"), std::string::npos);
}

/// One picture: compound models and rolls beside 2D and 3D CAR, marginals match and none; rolls alone in l1.
fs::path twelve_results(const TemporaryFolder& folder) {
    ResultsDatabase database(folder / "twelve.db", "make it");
    PictureSource source;
    source.name = "p.ppm";
    source.file = folder / source.name;
    source.material = "m";
    source.picture = "1";
    test::write_texture(source.file, 1);
    database.add(std::vector{source});
    WorkReport report;
    report.facts = PictureFacts{"1", 5.0, {32, 40}, 3};
    for (const MarginalMode marginals : {MarginalMode::match, MarginalMode::none}) {
        for (const auto& [model, memd_star] : std::vector<std::pair<ExperimentModel, double>>{
                 {ExperimentModel::compound, marginals == MarginalMode::match ? 0.5 : 0.75},
                 {ExperimentModel::car3d, 2.0},
                 {ExperimentModel::car2d, 4.0}}) {
            for (const int order : {1, 2}) {
                JobResult result = job("1", model, order, memd_star + order - 1);
                result.settings.marginals = marginals;
                result.key += name(marginals);
                report.results.push_back(result);
            }
        }
    }
    for (const char* metric : {"max", "l1"}) {
        for (const int seed : {1, 2}) {
            JobResult roll = job("1", ExperimentModel::roll, 0, 0.25 * seed);
            roll.settings.levels = 0;
            roll.metric = metric;
            roll.key = metric + std::to_string(seed);
            report.results.push_back(roll);
        }
    }
    database.add(report);
    database.close();
    return folder / "twelve.db";
}

TEST(ExperimentTable, CompoundAndRollAreRowsAfterTheTen) {
    const TemporaryFolder folder;
    const std::vector<ExperimentTable> tables = experiment_tables(twelve_results(folder));
    ASSERT_EQ(tables.size(), 3U);
    EXPECT_EQ(tables[0].metric, "l1");
    EXPECT_EQ(tables[0].marginals, "any");
    ASSERT_EQ(tables[0].rows.size(), 1U);
    EXPECT_EQ(tables[0].rows[0].model, "roll");
    EXPECT_EQ(tables[0].rows[0].all.mean, 0.25);
    EXPECT_TRUE(std::isnan(tables[0].colours[0].best_2d));
    EXPECT_TRUE(std::isnan(tables[0].colours[0].best_3d));
    for (const std::size_t t : {1U, 2U}) {
        const ExperimentTable& table = tables[t];
        EXPECT_EQ(table.metric, "max");
        EXPECT_EQ(table.marginals, t == 1 ? "match" : "none");
        EXPECT_EQ(table.done, 8U);
        std::vector<std::string> models;
        for (const ExperimentTable::Row& row : table.rows) models.push_back(row.model);
        ASSERT_EQ(models, (std::vector<std::string>{"2d-car", "3d-car", "compound", "roll"}));
        EXPECT_EQ(table.rows[2].all.mean, t == 1 ? 0.5 : 0.75);
        EXPECT_EQ(table.rows[3].all.mean, 0.25);
        EXPECT_EQ(table.rows[3].all.pictures, 1);
        // Of random fields alone.
        EXPECT_EQ(table.colours[0].best_2d, 4.0);
        EXPECT_EQ(table.colours[0].best_3d, 2.0);
        EXPECT_TRUE(table.colours[0].gap);
    }
    for (const TableFormat format : {TableFormat::text, TableFormat::markdown, TableFormat::latex}) {
        const std::string text = format_tables(tables, format);
        EXPECT_NE(text.find("compound"), std::string::npos) << text;
        EXPECT_NE(text.find("roll"), std::string::npos) << text;
        EXPECT_EQ(text.find("nan"), std::string::npos) << text;
    }
    const std::string csv = format_tables(tables, TableFormat::csv);
    EXPECT_NE(csv.find("max,none,m,5,4,2,compound,0.75,0,1,1,,full,match,\n"), std::string::npos) << csv;
    EXPECT_NE(csv.find("l1,any,m,5,,,roll,0.25,0,1,1,,,,\n"), std::string::npos) << csv;
}

/// Every element that opens closes again, in order; nothing is loaded from elsewhere.
void expect_page(const std::string& html) {
    std::vector<std::string> open;
    const std::regex tag(R"(<(/?)([a-z0-9]+)((?:"[^"]*"|[^">])*?)(/?)>)", std::regex::icase);
    const std::set<std::string> alone{"meta", "img", "br"};
    // Long attributes (pictures) are looked at and taken out: std::regex recurses over every character.
    std::string text;
    for (std::size_t at = 0; at < html.size();) {
        const std::size_t start = html.find("data:image/png;base64,", at);
        text += html.substr(at, start - at);
        if (start == std::string::npos) break;
        at = html.find('"', start);
        EXPECT_EQ(html.substr(start + 22, 11), "iVBORw0KGgo") << "no PNG";
    }
    text = std::regex_replace(text, std::regex("<style>[^<]*</style>"), "");
    for (std::sregex_iterator it(text.begin(), text.end(), tag), end; it != end; ++it) {
        const std::string element = (*it)[2];
        if (alone.count(element) == 1 || (*it)[4] == "/") continue;
        if ((*it)[1] != "/") {
            open.push_back(element);
        } else {
            ASSERT_FALSE(open.empty()) << it->str();
            ASSERT_EQ(open.back(), element) << it->str();
            open.pop_back();
        }
    }
    EXPECT_TRUE(open.empty());
    for (const char* elsewhere : {"http:", "https:", "src=\"/", "<script", "<link", "url("}) {
        EXPECT_EQ(html.find(elsewhere), std::string::npos) << elsewhere;
    }
}

TEST(ExperimentTable, PageIsCompleteAndAlone) {
    const TemporaryFolder folder;
    const fs::path database = known_results(folder);
    std::filesystem::remove(folder / "p3.ppm");
    write_experiment_report(database, folder / "page.html");
    const std::string html = test::bytes_of(folder / "page.html");
    expect_page(html);
    EXPECT_EQ(count_of(html, "<section class=\"picture\">"), 3U);
    // Originals of pictures 1 and 2 and one kept texture; picture 3 is gone.
    EXPECT_EQ(count_of(html, "<img "), 3U);
    EXPECT_EQ(count_of(html, ">not at hand<"), 1U);
    EXPECT_EQ(count_of(html, ">not kept<"), 5U);
    EXPECT_EQ(count_of(html, "<table"), 1U);
    EXPECT_EQ(count_of(html, "<path "), 3U);  // a line for each model, one K
    EXPECT_NE(html.find("a|b, &quot;c&quot; &amp; &lt;d&gt;_%"), std::string::npos);
    EXPECT_NE(html.find("known &lt;one&gt;"), std::string::npos);
    write_experiment_report(database, folder / "page.html", 1);
    EXPECT_EQ(count_of(test::bytes_of(folder / "page.html"), "<section class=\"picture\">"), 1U);
    EXPECT_THROW(write_experiment_report(database, folder / "absent" / "page.html"), InputError);
}

TEST(ExperimentTable, PageShowsCompoundAndRoll) {
    const TemporaryFolder folder;
    write_experiment_report(twelve_results(folder), folder / "page.html");
    const std::string html = test::bytes_of(folder / "page.html");
    expect_page(html);
    EXPECT_EQ(count_of(html, "<table"), 3U);
    // Two plots of four lines each, over orders 1 and 2; rolls alone have none.
    EXPECT_EQ(count_of(html, "<path "), 8U);
    EXPECT_EQ(count_of(html, "<circle "), 16U);
    EXPECT_EQ(count_of(html, "nan"), 0U);
    for (const char* model : {"compound", "roll", "3D CAR"})
        EXPECT_NE(html.find("<title>" + std::string(model) + "</title>"), std::string::npos) << model;
    std::set<std::string> colours;
    const std::regex group("<g stroke=\"(#[0-9a-f]+)\"");
    for (std::sregex_iterator it(html.begin(), html.end(), group), end; it != end; ++it)
        colours.insert((*it)[1]);
    EXPECT_EQ(colours.size(), 3U);  // CAR is one family
    // A roll has no order and no levels.
    EXPECT_NE(html.find("<b>roll</b> 0.25 %</figcaption>"), std::string::npos);
    EXPECT_EQ(html.find("order 0"), std::string::npos);
}

/// What the browser makes of the page, as JSON: a script at its end writes it into the document.
nlohmann::json rendered(const fs::path& page, int window_width) {
    std::string html = test::bytes_of(page);
    html.insert(html.rfind("</body>"), R"html(<script>
const all = query => [...document.querySelectorAll(query)];
const box = element => element.getBoundingClientRect();
const table = document.querySelector('table.memd'), plots = document.querySelector('.plots');
const measured = document.createElement('pre');
measured.id = 'measured';
measured.textContent = JSON.stringify({
    images: all('img').map(image => [image.complete, image.naturalWidth, image.naturalHeight, box(image).width]),
    cells: all('table.memd tbody tr').map(row => [...row.cells].map(cell => cell.textContent)),
    plots: all('.plots svg').map(plot => [box(plot).width, box(plot).height, plot.querySelectorAll('path').length]),
    gap: box(plots).top - box(table).bottom,
    colour: getComputedStyle(document.querySelector('td.least')).fontWeight,
    width: document.documentElement.scrollWidth, window: document.documentElement.clientWidth});
document.body.append(measured);
</script>)html");
    const fs::path copy = page.parent_path() / "measured.html";
    std::ofstream(copy) << html;
    const fs::path profile = page.parent_path() / "profile";
    const test::Ended ended = test::run_program(
        {"/usr/bin/env", "chromium", "--headless=new", "--no-sandbox", "--disable-gpu",
         "--disable-dev-shm-usage", "--user-data-dir=" + profile.string(),
         "--window-size=" + std::to_string(window_width) + ",900", "--dump-dom", "file://" + copy.string()});
    EXPECT_EQ(ended.code, 0) << ended.err;
    const std::string start = "<pre id=\"measured\">";
    const std::size_t from = ended.out.find(start);
    if (from == std::string::npos) {
        ADD_FAILURE() << "the browser measured nothing\n" << ended.out << ended.err;
        return {};
    }
    const std::size_t begin = from + start.size();
    return test::parsed(ended.out.substr(begin, ended.out.find("</pre>", begin) - begin));
}

TEST(ExperimentTableLong, PageInABrowser) {
    const TemporaryFolder folder;
    write_experiment_report(known_results(folder), folder / "page.html");
    for (const int width : {1400, 600}) {
        SCOPED_TRACE(width);
        const nlohmann::json page = rendered(folder / "page.html", width);
        ASSERT_TRUE(page.is_object());
        // Three originals and a kept texture, all decoded: 32 x 40 pixels, shown in squares.
        ASSERT_EQ(page["images"].size(), 4U);
        for (const nlohmann::json& image : page["images"])
            EXPECT_EQ(image, nlohmann::json::array({true, 40, 32, 112}));
        ASSERT_EQ(page["plots"].size(), 1U);
        EXPECT_GT(page["plots"][0][0], 100.0);
        EXPECT_GT(page["plots"][0][1], 50.0);
        EXPECT_EQ(page["plots"][0][2], 3);
        EXPECT_GE(page["gap"], 8.0);
        EXPECT_EQ(page["colour"], "700");
        EXPECT_LE(page["width"], page["window"]);  // nothing sticks out: wide tables scroll by themselves
        // 2D CAR: (4 + 8) / 2 over pictures 1 and 2, 1 for picture 3.
        EXPECT_EQ(page["cells"][0][0], "2D CAR");
        EXPECT_EQ(page["cells"][0][1], "6.00");
        EXPECT_EQ(page["cells"][0][3], "1.00");
    }
}

TEST(ExperimentTable, Base64) {  // RFC 4648, section 10
    EXPECT_EQ(base64(""), "");
    EXPECT_EQ(base64("f"), "Zg==");
    EXPECT_EQ(base64("fo"), "Zm8=");
    EXPECT_EQ(base64("foo"), "Zm9v");
    EXPECT_EQ(base64("foob"), "Zm9vYg==");
    EXPECT_EQ(base64("foobar"), "Zm9vYmFy");
    EXPECT_EQ(base64("\xff\xfe\xfd"), "//79");
}

TEST(ExperimentTable, PlotLeavesGaps) {
    const std::string svg =
        line_plot("t", "x", {"1", "2", "3"},
                  {{"whole", "#000", false, {1.0, 2.0, 3.0}}, {"part", "#111", true, {NAN, 2.0, NAN}}});
    EXPECT_EQ(count_of(svg, "<circle "), 4U);
    EXPECT_EQ(count_of(svg, "stroke-dasharray"), 1U);
    EXPECT_EQ(svg.find("nan"), std::string::npos);
    EXPECT_EQ(line_plot("t", "x", {}, {}).find("nan"), std::string::npos);
}

}  // namespace
}  // namespace btfield

#include "host/cli/near_misses.hpp"

#include <algorithm>
#include <cstddef>
#include <numeric>
#include <string_view>

namespace btfield::cli {
namespace {

using Names = std::vector<std::string_view>;

/// Options that people give to commands which do the same in another way, or at another step.
struct NearMiss {
    Names commands;
    Names options;  ///< without dashes
    std::string_view advice;
};

const Names growing{"synth", "btf synth", "btf render", "btf view"};
const Names of_fields{"model",        "order", "neighbourhood", "levels",    "factor",
                      "estimator",    "noise", "gains",         "marginals", "threshold",
                      "significance", "local", "regions",       "borders",   "cluster-on"};
const Names of_growth{"size",         "seed",          "count",  "offset",     "period", "control",
                      "noise-domain", "allow-invalid", "export", "pixel-size", "type",   "compression"};
const Names of_directions{"view", "light", "frames", "shape", "exposure", "gamma"};

/// The first that fits counts.
const std::vector<NearMiss>& near_misses() {
    static const std::vector<NearMiss> all{
        {{"compound fit"}, {"model"}, "compound is the model here, and --local chooses that of its regions"},
        {{"compound fit"},
         {"neighbourhood"},
         "regional models have that of their kind, as large as --order says"},
        {{"compound fit"}, {"clusters"}, "--regions says how many regions there are"},
        {{"fit"},
         {"regions", "borders", "cluster-on", "labels", "save-labels"},
         "models with regions are learnt by 'btfield compound fit'"},
        {{"fit", "btf fit"}, {"local"}, "--model chooses the random field"},
        {{"btf fit"}, {"regions"}, "--clusters says how many, with --model compound or --method segment"},
        {{"btf fit"}, {"joint"}, "all pictures of a BTF are one model by --method joint, the default"},
        {{"fit", "compound fit"},
         {"height", "height-scale", "normal", "normals", "colour", "albedo"},
         "maps of one material are given side by side, with --joint and --roles"},
        {{"fit", "compound fit"},
         {"method", "clusters", "match", "leave-out"},
         "models of many views and lights are fitted by 'btfield btf fit'"},
        {{"fit", "compound fit"},
         {"block", "overlap", "cut-on", "tile", "tiles"},
         "a picture's own patches are laid by 'btfield roll', without a model"},
        {{"fit", "compound fit"},
         of_growth,
         "a fit grows nothing: that is for 'btfield synth MODEL -o IMAGE'"},
        {{"btf fit"},
         of_growth,
         "a fit grows nothing: that is for 'btfield btf synth', 'btf render' and 'btf view'"},
        {{"fit", "compound fit"},
         of_directions,
         "models of many views and lights are fitted by 'btfield btf fit', and seen by 'btfield btf render'"},
        {{"btf fit"}, of_directions, "that is for the model: 'btfield btf synth' and 'btfield btf render'"},
        {{"synth"}, {"labels"}, "--control grows a texture by labels of one's own"},
        {{"synth"},
         {"tile", "tiles", "block", "overlap", "cut-on"},
         "textures of models tile by themselves, and 'btfield roll' lays a picture's own patches"},
        {{"synth"},
         of_directions,
         "models of 'btfield btf fit' are grown by 'btfield btf synth' and 'btf render'"},
        {{"synth"},
         of_fields,
         "it was chosen by 'btfield fit' or 'btfield compound fit' when the model was fitted"},
        {{"btf render"}, {"count"}, "--frames says how many pictures"},
        {{"btf view"}, of_directions, "the page's reader moves views and lights"},
        {{"btf view"}, {"tile"}, "--size is that of the tile"},
        {growing, of_fields, "it was chosen by 'btfield btf fit' when the model was fitted"},
        {{"roll"}, {"count"}, "--tiles says how many"},
        {{"roll"}, {"joint", "roles"}, "several pictures are cut alike anyway"},
        {{"roll"},
         of_fields,
         "patches are laid without a model: 'btfield fit' learns one, and 'btfield synth' grows it"},
    };
    return all;
}

/// "compound fit".
std::string path_of(const CLI::App& command) {
    std::string path = command.get_name();
    for (const CLI::App* parent = command.get_parent(); parent != nullptr && parent->get_parent() != nullptr;
         parent = parent->get_parent())
        path = parent->get_name() + " " + path;
    return path;
}

/// Long names of options that help shows.
std::vector<std::string> option_names(const CLI::App& command) {
    std::vector<std::string> names;
    for (const CLI::Option* option : command.get_options())
        if (!option->get_group().empty())
            names.insert(names.end(), option->get_lnames().begin(), option->get_lnames().end());
    return names;
}

/// Letters that are to be put in, left out or changed.
std::size_t edits(std::string_view a, std::string_view b) {
    std::vector<std::size_t> row(b.size() + 1);
    std::iota(row.begin(), row.end(), std::size_t{0});
    for (std::size_t i = 0; i < a.size(); ++i) {
        std::size_t corner = row[0];
        row[0] = i + 1;
        for (std::size_t j = 0; j < b.size(); ++j) {
            const std::size_t changed = corner + (a[i] == b[j] ? 0 : 1);
            corner = row[j + 1];
            row[j + 1] = std::min({changed, row[j] + 1, corner + 1});
        }
    }
    return row.back();
}

/// The command's option that is spelt nearly so; empty: none.
std::string like(const CLI::App& command, const std::string& option) {
    constexpr std::size_t short_name = 4;
    std::size_t least = option.size() > short_name ? 3 : 2;
    std::string nearest;
    for (const std::string& name : option_names(command)) {
        if (option.size() > 2 && name.starts_with(option)) return name;
        const std::size_t distance = edits(option, name);
        if (distance >= least || name.size() <= distance + 1) continue;
        least = distance;
        nearest = name;
    }
    return nearest;
}

void collect_owners(const CLI::App& command, const std::string& option, std::vector<std::string>& owners) {
    for (const CLI::App* each : command.get_subcommands([](const CLI::App*) { return true; })) {
        // What is forgotten of experiments is chosen by words that mean something else.
        if (each->get_group().empty() || each->get_name() == "forget") continue;
        const std::vector<std::string> names = option_names(*each);
        if (std::ranges::find(names, option) != names.end())
            owners.push_back("'btfield " + path_of(*each) + "'");
        collect_owners(*each, option, owners);
    }
}

std::string advice_about(const CLI::App& command, const CLI::App& whole, const std::string& option) {
    const std::string path = path_of(command);
    for (const NearMiss& miss : near_misses())
        if (std::ranges::count(miss.commands, path) > 0 && std::ranges::count(miss.options, option) > 0)
            return std::string(miss.advice);
    const std::string near = like(command, option);
    if (!near.empty()) return "did you mean --" + near + "?";
    std::vector<std::string> owners;
    collect_owners(whole, option, owners);
    if (owners.empty()) return {};
    constexpr std::size_t most_owners = 4;
    std::string text = "it is an option of " + owners.front();
    for (std::size_t i = 1; i < std::min(owners.size(), most_owners); ++i)
        text += (i + 1 == owners.size() ? " and " : ", ") + owners[i];
    return text + (owners.size() > most_owners ? " and others" : "");
}

}  // namespace

std::string near_command(const CLI::App& parent, const std::string& word) {
    std::size_t least = std::min<std::size_t>(3, (word.size() + 2) / 2);
    std::string nearest;
    for (const CLI::App* each : parent.get_subcommands([](const CLI::App*) { return true; })) {
        const std::size_t distance = edits(word, each->get_name());
        if (each->get_group().empty() || distance == 0 || distance >= least) continue;
        least = distance;
        nearest = each->get_name();
    }
    return nearest;
}

std::string near_miss(const CLI::App& command, const std::vector<std::string>& unknown) {
    const CLI::App* whole = &command;
    while (whole->get_parent() != nullptr) whole = whole->get_parent();
    for (const std::string& word : unknown) {
        const std::size_t first = word.find_first_not_of('-');
        if (first == 0 || first == std::string::npos) continue;
        const std::string option = word.substr(first, word.find('=') - first);
        std::string advice = advice_about(command, *whole, option);
        if (!advice.empty()) return advice;
    }
    return {};
}

}  // namespace btfield::cli

#include "host/model/model_json.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <cerrno>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <memory>
#include <system_error>
#include <utility>

#include "btfield/error.hpp"
#include "btfield/model_file.hpp"
#include "host/analysis/neighbourhood_names.hpp"
#include "host/base/file_output.hpp"
#include "host/base/text.hpp"
#include "host/model/model_names.hpp"
#include "host/pictures/picture_format.hpp"
#include "host/pictures/picture_names.hpp"

namespace btfield::detail {

using namespace json_reading;
using nlohmann::ordered_json;

namespace {

/// What names, spaces of planes, chromaticities, limits, file_bytes and maps came with; files without them
/// say 0.
constexpr int minor_version = 1;
/// A parsed file takes some ten times its size in memory; no model comes near.
constexpr std::size_t largest_file = std::size_t{256} << 20;
constexpr const char* btf_remedy = "that is a BTF: btfield btf info shows it, btfield btf synth grows it";
const char* const regions_remedy =
    "that is a compound model, with regions: give a plain one, as btfield fit makes it";
const char* const plain_remedy =
    "that is a plain model, without regions: btfield compound fit makes one that has them";

// Writing
// ------------------------------------------------------------------------------------------------------

/// JSON has no NaN: numbers that a failed certificate leaves undefined become null.
ordered_json number(double value) {
    return std::isfinite(value) ? ordered_json(value) : ordered_json(nullptr);
}

ordered_json certificate_value(const Certificate& certificate) {
    ordered_json ratios = ordered_json::array();
    for (const double ratio : certificate.variance_ratio) ratios.push_back(number(ratio));
    ordered_json value;
    value["valid"] = certificate.valid;
    value["min_singular"] = number(certificate.min_singular);
    value["zeros"] = certificate.zeros;
    value["variance_ratio"] = std::move(ratios);
    return value;
}

ordered_json part_value(const Model& model) {
    const LinearField& field = linear_field(model);
    ordered_json offsets = ordered_json::array();
    for (const Offset s : field.offsets) offsets.push_back(ordered_json::array({s.row, s.column}));
    ordered_json value;
    value["neighbourhood"] = name(field.kind);
    value["offsets"] = std::move(offsets);
    if (!field.active.empty()) value["active"] = field.active;
    value["coefficients"] = field.coefficients;
    value["noise_covariance"] = field.noise_covariance;
    return value;
}

ordered_json level_value(const LevelModel& level) {
    ordered_json parts = ordered_json::array();
    for (const Model& part : level.models) parts.push_back(part_value(part));
    ordered_json value;
    value["size"] = size_value(level.size);
    value["models"] = std::move(parts);
    value["gain"] = level.gain;
    value["estimator"] = name(level.estimator);
    value["iterations"] = level.iterations;
    value["log_likelihood"] = number(level.log_likelihood);
    value["certificate"] = certificate_value(level.certificate);
    return value;
}

ordered_json maps_value(const std::vector<MaterialMap>& maps) {
    ordered_json value = ordered_json::array();
    for (const MaterialMap& map : maps) {
        ordered_json each;
        each["name"] = valid_utf8(map.name);
        each["role"] = name(map.role);
        each["planes"] = map.planes;
        each["colour_space"] = name(map.space);
        each["type"] = name(map.type);
        each["file_bytes"] = map.file_bytes;
        each["scale"] = map.scale;
        each["directx"] = map.directx;
        if (!map.gains.empty()) each["gains"] = map.gains;
        value.push_back(std::move(each));
    }
    return value;
}

/// Rows of T, or, where planes are of unlike kinds, an object of these and the diagonal of D; or "none".
ordered_json basis_value(const SpectralBasis& basis) {
    if (basis.planes == 0) return "none";
    ordered_json rows = ordered_json::array();
    const auto d = static_cast<std::ptrdiff_t>(basis.planes);
    for (auto row = basis.matrix.begin(); row != basis.matrix.end(); row += d)
        rows.push_back(std::vector<double>(row, row + d));
    if (basis.scale.empty()) return rows;
    ordered_json value;
    value["rows"] = std::move(rows);
    value["scale"] = basis.scale;
    return value;
}

ordered_json marginals_value(const std::vector<Marginal>& marginals) {
    if (marginals.empty()) return "none";
    ordered_json value = ordered_json::array();
    for (const Marginal& marginal : marginals) value.push_back(marginal.values);
    return value;
}

bool holds_object(const ordered_json& value) {
    return value.is_object() ||
           (value.is_array() &&
            std::any_of(value.begin(), value.end(), [](const auto& v) { return holds_object(v); }));
}

/// Objects are indented, arrays of numbers stay on one line. Doubles get the digits that bring them back bit
/// for bit.
void print(const ordered_json& value, const std::string& indent, std::string& out) {
    const std::string inner = indent + "  ";
    const bool lines = holds_object(value);
    const char* separator = "";
    if (value.is_object()) {
        out += '{';
        for (const auto& [key, member] : value.items()) {
            out += separator;
            out += '\n' + inner + ordered_json(key).dump() + ": ";
            print(member, inner, out);
            separator = ",";
        }
        out += '\n' + indent + '}';
    } else if (value.is_array()) {
        out += '[';
        for (const ordered_json& member : value) {
            out += separator;
            if (lines) out += '\n' + inner;
            print(member, inner, out);
            separator = lines ? "," : ", ";
        }
        if (lines) out += '\n' + indent;
        out += ']';
    } else {
        out += value.dump(-1, ' ', false, ordered_json::error_handler_t::replace);
    }
}

// Reading
// ------------------------------------------------------------------------------------------------------

Certificate read_certificate(const json& value, const std::string& where, const Context& context) {
    Object object(value, where, context);
    Certificate certificate;
    certificate.valid = object.get("valid", truth);
    certificate.min_singular = object.get("min_singular", real_or_null);
    certificate.zeros = object.get("zeros", integer);
    certificate.variance_ratio = object.get_list("variance_ratio", real_or_null);
    object.finish();
    return certificate;
}

Model read_part(const json& value, const std::string& where, ModelKind kind, int planes,
                const Context& context) {
    Object object(value, where, context);
    LinearField field;
    field.planes = planes;
    field.kind = object.get_name<NeighbourhoodKind>("neighbourhood");
    field.offsets = object.get_list("offsets", offset);
    field.coefficients = object.get_list("coefficients", real);
    if (object.has("active")) {
        field.active = object.get_list("active", presence);
        if (field.active.empty() != field.coefficients.empty()) {
            fail(context, object.path("active") + " has another length than the coefficients");
        }
    }
    field.noise_covariance = object.get_list("noise_covariance", real);
    object.finish();
    return model_of(family(kind), std::move(field));
}

LevelModel read_level(const json& value, const std::string& where, ModelKind kind, int planes,
                      const Context& context) {
    Object object(value, where, context);
    LevelModel level;
    level.size = object.get("size", size);
    level.models = object.get_list("models", [&](const json& part, const std::string& place, const Context&) {
        return read_part(part, place, kind, is_2d(kind) ? 1 : planes, context);
    });
    level.gain = object.get("gain", real);
    level.estimator = object.get_name<Estimator>("estimator");
    level.iterations = object.get("iterations", integer);
    level.log_likelihood = object.get("log_likelihood", real_or_null);
    level.certificate = object.get("certificate", read_certificate);
    object.finish();
    return level;
}

/// "none", or what `read` makes of the value.
template <typename Read>
void read_station(Object& object, const std::string& key, const Context& context, Read read) {
    const json& value = object.member(key);
    if (value.is_string()) {
        if (value != "none") {
            fail(context, "it needs a feature, '" + key + "', that this btfield does not have", newer_remedy);
        }
        return;
    }
    read(value, object.path(key));
}

MaterialMap read_map(const json& value, const std::string& where, const Context& context) {
    Object object(value, where, context);
    MaterialMap map;
    map.name = object.get("name", text);
    map.role = object.get_name<MapRole>("role");
    map.planes = object.get("planes", integer);
    map.space = object.get_name<ColourSpace>("colour_space");
    map.type = object.get_name<PixelType>("type");
    map.file_bytes = object.get("file_bytes", natural);
    map.scale = object.get("scale", real);
    map.directx = object.get("directx", truth);
    if (object.has("gains")) map.gains = object.get_list("gains", real);
    object.finish();
    return map;
}

SpectralBasis read_basis(const json& value, const std::string& where, const TextureModel& model,
                         const Context& context) {
    SpectralBasis basis;
    basis.planes = model.planes;
    basis.mean = model.mean;
    const auto take_rows = [&](const json& rows, const std::string& place) {
        const auto row_of = [](const json& inner, const std::string& at, const Context& about) {
            return list(inner, at, about, real);
        };
        for (const std::vector<double>& row : list(rows, place, context, row_of)) {
            if (row.size() != static_cast<std::size_t>(std::max(model.planes, 0)))
                fail(context, place + " has a row of another length than 'planes'");
            ++basis.rank;
            basis.matrix.insert(basis.matrix.end(), row.begin(), row.end());
        }
    };
    if (!value.is_object()) {
        take_rows(value, where);
        return basis;
    }
    Object object(value, where, context);
    take_rows(object.member("rows"), object.path("rows"));
    basis.scale = object.get_list("scale", real);
    object.finish();
    return basis;
}

}  // namespace

ordered_json size_value(Size size) {
    return ordered_json::array({size.width, size.height});
}

ordered_json provenance_value(const Provenance& provenance) {
    ordered_json value;
    value["source"] = valid_utf8(provenance.source);
    value["type"] = name(provenance.type);
    value["picture_bytes"] = provenance.picture_bytes;
    value["software"] = provenance.software;
    ordered_json reasons = ordered_json::array();
    for (const std::string& reason : provenance.reasons) reasons.push_back(valid_utf8(reason));
    value["reasons"] = std::move(reasons);
    if (provenance.chromaticities) value["chromaticities"] = *provenance.chromaticities;
    if (provenance.file_bytes > 0) value["file_bytes"] = provenance.file_bytes;
    if (!provenance.limits.empty()) {
        ordered_json limits = ordered_json::array();
        for (const auto& [low, high] : provenance.limits)
            limits.push_back(low && high ? "both" : low ? "low" : high ? "high" : "none");
        value["limits"] = std::move(limits);
    }
    if (!provenance.maps.empty()) value["maps"] = maps_value(provenance.maps);
    return value;
}

ordered_json version_value(bool meaning, const Provenance& provenance) {
    const bool newer = meaning || provenance.chromaticities || !provenance.limits.empty() ||
                       provenance.file_bytes > 0 || !provenance.maps.empty();
    return ordered_json::array({model_format_version, newer ? minor_version : 0});
}

void put_plane_meanings(ordered_json& value, const std::vector<std::string>& names,
                        const std::vector<ColourSpace>& spaces) {
    for (const std::string& each : names) value["names"].push_back(valid_utf8(each));
    for (const ColourSpace each : spaces) value["plane_colour_spaces"].push_back(name(each));
}

ordered_json model_value(const TextureModel& model) {
    ordered_json value;
    value["format"] = texture_format;
    value["version"] = version_value(!model.names.empty() || !model.plane_spaces.empty(), model.provenance);
    value["model"] = name(model.kind);
    value["size"] = size_value(model.size);
    value["planes"] = model.planes;
    value["colour_space"] = name(model.space);
    put_plane_meanings(value, model.names, model.plane_spaces);
    value["factor"] = model.factor;
    value["noise"] = name(model.noise);
    value["mean"] = model.mean;
    value["basis"] = basis_value(model.basis);
    value["marginals"] = marginals_value(model.marginals);
    if (!model.marginals.empty()) value["whitening"] = model.whitening;
    value["provenance"] = provenance_value(model.provenance);
    ordered_json levels = ordered_json::array();
    for (const LevelModel& level : model.levels) levels.push_back(level_value(level));
    value["levels"] = std::move(levels);
    return value;
}

std::string printed(const ordered_json& value) {
    std::string out;
    print(value, "", out);
    return out + '\n';
}

void read_version(Object& object, const std::string& expected, Context& context) {
    if (!object.has("format")) fail(context, "it has no key 'format': it is not a model");
    if (const std::string format = object.get("format", text); format != expected) {
        fail(context,
             "it is not supported: its format is '" + printable(format) + "', not '" + expected + "'",
             format == btf_format        ? btf_remedy
             : format == compound_format ? regions_remedy
             : format == texture_format  ? plain_remedy
                                         : file_remedy);
    }
    const auto [major, minor] = object.get("version", pair);
    const std::string version = std::to_string(major) + "." + std::to_string(minor);
    if (major > model_format_version) {
        fail(context,
             "it is not supported: its format version is " + version + ", and this btfield reads up to " +
                 std::to_string(model_format_version) + "." + std::to_string(minor_version),
             newer_remedy);
    }
    if (major < 1 || minor < 0) fail(context, "its format version " + version + " does not exist");
    context.newer_minor = minor > minor_version;
}

Provenance read_provenance(const json& value, const std::string& where, const Context& context) {
    Object object(value, where, context);
    Provenance provenance;
    provenance.source = object.get("source", text);
    provenance.type = object.get_name<PixelType>("type");
    provenance.picture_bytes = object.get("picture_bytes", natural);
    provenance.software = object.get("software", text);
    provenance.reasons = object.get_list("reasons", text);
    if (object.has("chromaticities")) {
        const std::vector<double> given = object.get_list("chromaticities", real);
        Chromaticities& kept = provenance.chromaticities.emplace();
        if (given.size() != kept.size()) fail(context, object.path("chromaticities") + " has not 8 numbers");
        std::copy(given.begin(), given.end(), kept.begin());
    }
    if (object.has("file_bytes")) provenance.file_bytes = object.get("file_bytes", natural);
    if (object.has("limits")) {
        const auto limit = [](const json& inner, const std::string& place, const Context& about) {
            const std::string word = text(inner, place, about);
            if (word != "none" && word != "low" && word != "high" && word != "both")
                fail(about, place + " '" + printable(word) + "' is none of none, low, high and both");
            return PlaneLimits{word == "low" || word == "both", word == "high" || word == "both"};
        };
        provenance.limits = object.get_list("limits", limit);
    }
    if (object.has("maps")) provenance.maps = object.get_list("maps", read_map);
    object.finish();
    return provenance;
}

std::vector<std::string> read_names(Object& object, int planes, const Context& context) {
    if (!object.has("names")) return {};
    std::vector<std::string> names = object.get_list("names", text);
    if (names.size() != static_cast<std::size_t>(std::max(planes, 0)))
        fail(context, object.path("names") + " has another length than 'planes'");
    return names;
}

std::vector<ColourSpace> read_plane_spaces(Object& object, int planes, const Context& context) {
    if (!object.has("plane_colour_spaces")) return {};
    const std::vector<std::string> words = object.get_list("plane_colour_spaces", text);
    std::vector<ColourSpace> spaces;
    for (const std::string& word : words) {
        const auto known = find_value<ColourSpace>(word);
        if (!known)
            fail(context, object.path("plane_colour_spaces") + " has '" + valid_utf8(word) + "', none of " +
                              words_of<ColourSpace>(", ", " and "));
        spaces.push_back(*known);
    }
    if (spaces.size() != static_cast<std::size_t>(std::max(planes, 0)))
        fail(context, object.path("plane_colour_spaces") + " has another length than 'planes'");
    return spaces;
}

TextureModel model_from(const json& value, const std::string& place, Context context) {
    Object object(value, place, context);
    read_version(object, texture_format, context);
    TextureModel model;
    model.kind = object.get_name<ModelKind>("model");
    model.size = object.get("size", size);
    model.planes = object.get("planes", integer);
    model.space = object.get_name<ColourSpace>("colour_space");
    model.names = read_names(object, model.planes, context);
    model.plane_spaces = read_plane_spaces(object, model.planes, context);
    model.factor = object.get("factor", integer);
    model.noise = object.get_name<NoiseForm>("noise");
    model.mean = object.get_list("mean", real);
    read_station(object, "basis", context, [&](const json& value_, const std::string& where) {
        model.basis = read_basis(value_, where, model, context);
    });
    read_station(object, "marginals", context, [&](const json& value_, const std::string& where) {
        model.marginals =
            list(value_, where, context, [&](const json& inner, const std::string& at, const Context&) {
                return Marginal{list(inner, at, context, real)};
            });
        model.whitening = object.get_list("whitening", real);
    });
    model.provenance = object.get("provenance", read_provenance);
    model.levels =
        object.get_list("levels", [&](const json& level, const std::string& where, const Context&) {
            return read_level(level, where, model.kind, modelled_planes(model), context);
        });
    object.finish();
    try {
        check(model);
    } catch (const InputError& error) {
        fail(context, (place.empty() ? "" : place + ": ") + error.found());
    }
    return model;
}

std::string model_bytes(const std::filesystem::path& path, const std::string& asked,
                        const std::string& learner) {
    const std::unique_ptr<std::FILE, int (*)(std::FILE*)> file(std::fopen(path.c_str(), "rbe"), &std::fclose);
    const auto refuse = [&](int code) {
        throw InputError(asked, std::generic_category().message(code),
                         "give the name of a readable model file");
    };
    if (!file) refuse(errno);
    const auto refuse_large = [&] {
        throw InputError(asked, "it is larger than " + std::to_string(largest_file >> 20) + " MiB",
                         file_remedy);
    };
    std::error_code no_regular_file;  // then its size shows while it is read
    const std::uintmax_t size = std::filesystem::file_size(path, no_regular_file);
    std::string bytes;
    std::array<char, 1 << 16> buffer;
    while (const std::size_t got = std::fread(buffer.data(), 1, buffer.size(), file.get())) {
        if (bytes.empty() && format_of_bytes({buffer.data(), got}))
            throw InputError(asked, "it is a picture, not a model",
                             "learn a model of it first, with " + learner);
        if (!no_regular_file && size > largest_file) refuse_large();
        bytes.append(buffer.data(), got);
        if (bytes.size() > largest_file) refuse_large();
    }
    if (std::ferror(file.get()) != 0) refuse(errno);
    return bytes;
}

bool is_cbor_name(const std::filesystem::path& path) {
    std::string extension = path.extension().string();
    for (char& c : extension) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    return extension == ".btfm";
}

void write_model_value(const std::filesystem::path& path, const ordered_json& value,
                       const std::string& asked) {
    std::string bytes;
    if (is_cbor_name(path))
        ordered_json::to_cbor(value, bytes);
    else
        bytes = printed(value);
    if (bytes.size() > largest_file) {
        throw InputError(asked, "it would be larger than " + std::to_string(largest_file >> 20) + " MiB",
                         "fit fewer planes, levels or offsets");
    }
    write_file(path, bytes, asked);
}

}  // namespace btfield::detail

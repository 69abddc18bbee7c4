#include "btfield/model_file.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <cerrno>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <limits>
#include <memory>
#include <nlohmann/json.hpp>
#include <set>
#include <system_error>
#include <utility>

#include "btfield/error.hpp"
#include "host/analysis/neighbourhood_names.hpp"
#include "host/base/file_output.hpp"
#include "host/base/strict_json.hpp"
#include "host/model/model_names.hpp"
#include "host/pictures/picture_names.hpp"

namespace btfield {

using namespace detail;

namespace {

using nlohmann::json;
using nlohmann::ordered_json;

constexpr int minor_version = 0;
/// A parsed file takes some ten times its size in memory; no model comes near.
constexpr std::size_t largest_file = std::size_t{256} << 20;
const char* const file_remedy = "use a complete model file written by btfield";
const char* const newer_remedy = "install a newer btfield";

// Writing
// ------------------------------------------------------------------------------------------------------

/// JSON has no NaN: numbers that a failed certificate leaves undefined become null.
ordered_json number(double value) {
    return std::isfinite(value) ? ordered_json(value) : ordered_json(nullptr);
}

ordered_json size_value(Size size) {
    return ordered_json::array({size.width, size.height});
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

/// Rows of T, or "none".
ordered_json basis_value(const SpectralBasis& basis) {
    if (basis.planes == 0) return "none";
    ordered_json rows = ordered_json::array();
    const auto d = static_cast<std::ptrdiff_t>(basis.planes);
    for (auto row = basis.matrix.begin(); row != basis.matrix.end(); row += d)
        rows.push_back(std::vector<double>(row, row + d));
    return rows;
}

ordered_json marginals_value(const std::vector<Marginal>& marginals) {
    if (marginals.empty()) return "none";
    ordered_json value = ordered_json::array();
    for (const Marginal& marginal : marginals) value.push_back(marginal.values);
    return value;
}

ordered_json model_value(const TextureModel& model) {
    ordered_json value;
    value["format"] = "btfield";
    value["version"] = ordered_json::array({model_format_version, minor_version});
    value["model"] = name(model.kind);
    value["size"] = size_value(model.size);
    value["planes"] = model.planes;
    value["colour_space"] = name(model.space);
    value["factor"] = model.factor;
    value["noise"] = name(model.noise);
    value["mean"] = model.mean;
    value["basis"] = basis_value(model.basis);
    value["marginals"] = marginals_value(model.marginals);
    if (!model.marginals.empty()) value["whitening"] = model.whitening;
    ordered_json provenance;
    provenance["source"] = model.provenance.source;
    provenance["type"] = name(model.provenance.type);
    provenance["picture_bytes"] = model.provenance.picture_bytes;
    provenance["software"] = model.provenance.software;
    provenance["reasons"] = model.provenance.reasons;
    value["provenance"] = std::move(provenance);
    ordered_json levels = ordered_json::array();
    for (const LevelModel& level : model.levels) levels.push_back(level_value(level));
    value["levels"] = std::move(levels);
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

struct Context {
    std::string asked;
    bool newer_minor = false;  ///< written by a later minor version: unknown keys are additions, not defects
};

[[noreturn]] void fail(const Context& context, const std::string& found, const char* remedy = file_remedy) {
    throw InputError(context.asked, found, remedy);
}

double real(const json& value, const std::string& where, const Context& context) {
    if (!value.is_number()) fail(context, where + " is not a number");
    const double number = value.get<double>();
    if (!std::isfinite(number)) fail(context, where + " is not finite");
    return number;
}

double real_or_null(const json& value, const std::string& where, const Context& context) {
    return value.is_null() ? std::numeric_limits<double>::quiet_NaN() : real(value, where, context);
}

int integer(const json& value, const std::string& where, const Context& context) {
    constexpr int lowest = std::numeric_limits<int>::min(), highest = std::numeric_limits<int>::max();
    if (!value.is_number_integer()) fail(context, where + " is not a whole number");
    const bool too_large = value.is_number_unsigned() && value.get<std::uint64_t>() > std::uint64_t{highest};
    if (too_large || (!value.is_number_unsigned() && value.get<std::int64_t>() < std::int64_t{lowest})) {
        fail(context, where + " is beyond the range of 32-bit numbers");
    }
    return value.get<int>();
}

std::uint64_t natural(const json& value, const std::string& where, const Context& context) {
    if (!value.is_number_unsigned()) fail(context, where + " is not a whole number >= 0");
    return value.get<std::uint64_t>();
}

std::string text(const json& value, const std::string& where, const Context& context) {
    if (!value.is_string()) fail(context, where + " is not a text");
    return value.get<std::string>();
}

const json& array(const json& value, const std::string& where, const Context& context) {
    if (!value.is_array()) fail(context, where + " is not an array");
    return value;
}

std::string element(const std::string& where, std::size_t index) {
    return where + "[" + std::to_string(index) + "]";
}

template <typename Read>
auto list(const json& value, const std::string& where, const Context& context, Read read) {
    array(value, where, context);
    std::vector<decltype(read(value, where, context))> result;
    result.reserve(value.size());
    for (std::size_t i = 0; i < value.size(); ++i)
        result.push_back(read(value[i], element(where, i), context));
    return result;
}

std::array<int, 2> pair(const json& value, const std::string& where, const Context& context) {
    if (array(value, where, context).size() != 2) fail(context, where + " does not have two numbers");
    return {integer(value[0], element(where, 0), context), integer(value[1], element(where, 1), context)};
}

Size size(const json& value, const std::string& where, const Context& context) {
    const auto [width, height] = pair(value, where, context);
    return {height, width};
}

Offset offset(const json& value, const std::string& where, const Context& context) {
    const auto [row, column] = pair(value, where, context);
    return {row, column};
}

std::uint8_t presence(const json& value, const std::string& where, const Context& context) {
    const int number = integer(value, where, context);
    if (number != 0 && number != 1) fail(context, where + " is neither 0 nor 1");
    return static_cast<std::uint8_t>(number);
}

/// An object whose keys are all asked for; finish() refuses those that were not.
class Object {
  public:
    Object(const json& value, std::string where, const Context& context)
        : value_(value), where_(std::move(where)), context_(context) {
        if (!value.is_object())
            fail(context, where_.empty() ? "it is not an object" : where_ + " is not an object");
    }
    [[nodiscard]] bool has(const std::string& key) const { return value_.contains(key); }

    /// Value of the key, read by one of the functions above.
    template <typename Read>
    auto get(const std::string& key, Read read) {
        return read(member(key), path(key), context_);
    }
    template <typename Read>
    auto get_list(const std::string& key, Read read) {
        return list(member(key), path(key), context_, read);
    }
    /// Value of the key, a text that the library has a name for.
    template <typename Enum>
    Enum get_name(const std::string& key) {
        const std::string given = get(key, text);
        if (const auto value = find_value<Enum>(given)) return *value;
        fail(context_, path(key) + " '" + printable(given) + "' is not known",
             context_.newer_minor ? newer_remedy : file_remedy);
    }
    const json& member(const std::string& key) {
        asked_for_.insert(key);
        const auto found = value_.find(key);
        if (found == value_.end()) fail(context_, path(key) + " is missing");
        return *found;
    }
    [[nodiscard]] std::string path(const std::string& key) const {
        return where_.empty() ? key : where_ + "." + key;
    }

    void finish() const {
        if (context_.newer_minor) return;
        for (const auto& [key, value] : value_.items()) {
            if (asked_for_.count(key) == 0) fail(context_, "key '" + path(printable(key)) + "' is not known");
        }
    }

  private:
    const json& value_;
    std::string where_;
    const Context& context_;
    std::set<std::string> asked_for_;
};

void read_version(Object& object, Context& context) {
    if (!object.has("format")) fail(context, "it has no key 'format': it is not a model");
    if (const std::string format = object.get("format", text); format != "btfield") {
        fail(context, "its format is '" + printable(format) + "', not 'btfield'");
    }
    const auto [major, minor] = object.get("version", pair);
    const std::string version = std::to_string(major) + "." + std::to_string(minor);
    if (major > model_format_version) {
        fail(context,
             "its format version is " + version + ", and this btfield reads up to " +
                 std::to_string(model_format_version) + "." + std::to_string(minor_version),
             newer_remedy);
    }
    if (major < 1 || minor < 0) fail(context, "its format version " + version + " does not exist");
    context.newer_minor = minor > minor_version;
}

Certificate read_certificate(const json& value, const std::string& where, const Context& context) {
    Object object(value, where, context);
    Certificate certificate;
    const json& valid = object.member("valid");
    if (!valid.is_boolean()) fail(context, object.path("valid") + " is neither true nor false");
    certificate.valid = valid.get<bool>();
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
    read(value, key);
}

SpectralBasis read_basis(const json& value, const std::string& where, const TextureModel& model,
                         const Context& context) {
    SpectralBasis basis;
    basis.planes = model.planes;
    basis.mean = model.mean;
    for (const std::vector<double>&row :
         list(value, where, context, [&](const json&inner, const std::string&place, const Context&) {
             return list(inner, place, context, real);
         })) {
        if (row.size() != static_cast<std::size_t>(std::max(model.planes, 0)))
            fail(context, where + " has a row of another length than 'planes'");
        ++basis.rank;
        basis.matrix.insert(basis.matrix.end(), row.begin(), row.end());
    }
    return basis;
}

Provenance read_provenance(const json& value, const std::string& where, const Context& context) {
    Object object(value, where, context);
    Provenance provenance;
    provenance.source = object.get("source", text);
    provenance.type = object.get_name<PixelType>("type");
    provenance.picture_bytes = object.get("picture_bytes", natural);
    provenance.software = object.get("software", text);
    provenance.reasons = object.get_list("reasons", text);
    object.finish();
    return provenance;
}

TextureModel model_from(const json& value, Context context) {
    Object object(value, "", context);
    read_version(object, context);
    TextureModel model;
    model.kind = object.get_name<ModelKind>("model");
    model.size = object.get("size", size);
    model.planes = object.get("planes", integer);
    model.space = object.get_name<ColourSpace>("colour_space");
    model.factor = object.get("factor", integer);
    model.noise = object.get_name<NoiseForm>("noise");
    model.mean = object.get_list("mean", real);
    read_station(object, "basis", context, [&](const json& value_, const std::string& where) {
        model.basis = read_basis(value_, where, model, context);
    });
    read_station(object, "marginals", context, [&](const json& value_, const std::string& where) {
        model.marginals =
            list(value_, where, context, [&](const json& inner, const std::string& place, const Context&) {
                return Marginal{list(inner, place, context, real)};
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
        fail(context, error.found());
    }
    return model;
}

std::string quoted(const std::filesystem::path& path) {
    return "'" + path.string() + "'";
}

std::string read_bytes(const std::filesystem::path& path, const std::string& asked) {
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
    if (!no_regular_file && size > largest_file) refuse_large();
    std::string bytes;
    std::array<char, 1 << 16> buffer;
    while (const std::size_t got = std::fread(buffer.data(), 1, buffer.size(), file.get())) {
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

}  // namespace

TextureModel read_model(const std::filesystem::path& path) {
    const std::string asked = "read the model " + quoted(path);
    return model_from(parse_strictly(read_bytes(path, asked), asked), {asked});
}

void write_model(const std::filesystem::path& path, const TextureModel& model) {
    const std::string asked = "write the model " + quoted(path);
    std::string bytes;
    if (is_cbor_name(path)) {
        check(model);
        ordered_json::to_cbor(model_value(model), bytes);
    } else {
        bytes = to_json(model);
    }
    if (bytes.size() > largest_file) {
        throw InputError(asked, "it would be larger than " + std::to_string(largest_file >> 20) + " MiB",
                         "fit fewer planes, levels or offsets");
    }
    write_file(path, bytes, asked);
}

void check_model_writable(const std::filesystem::path& path) {
    check_output(path, "write the model " + quoted(path));
}

std::string to_json(const TextureModel& model) {
    check(model);
    std::string out;
    print(model_value(model), "", out);
    return out + '\n';
}

TextureModel from_json(const std::string& text, const std::string& source) {
    const std::string asked = "read " + source;
    return model_from(parse_strictly(text, asked), {asked});
}

}  // namespace btfield

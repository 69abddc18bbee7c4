#include "host/btf/texture_code.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>
#include <map>
#include <string_view>
#include <utility>

#include "btfield/error.hpp"
#include "host/btf/btf_model_json.hpp"
#include "host/model/model_json.hpp"

namespace btfield::detail {

using namespace json_reading;
using nlohmann::ordered_json;

namespace {

/// All forms together, as often as they are used.
constexpr std::size_t most_form_bytes = std::size_t{256} << 20;

enum class NumberKey {
    none,
    single,  ///< single precision where that loses nothing
    wide,    ///< always double: rows of bases are orthonormal
};

NumberKey kind_of(std::string_view key) {
    static constexpr std::array<std::string_view, 9> singles{
        "mean", "marginals",  "whitening",      "coefficients", "noise_covariance",
        "gain", "iterations", "log_likelihood", "min_singular"};
    if (std::ranges::find(singles, key) != singles.end() || key == "variance_ratio") return NumberKey::single;
    return key == "basis" || key == "rows" || key == "scale" ? NumberKey::wide : NumberKey::none;
}

struct Numbers {
    std::vector<double> values;
    std::vector<bool> wide;
};

double number_of(const json& value) {
    return value.is_null() ? std::numeric_limits<double>::quiet_NaN() : value.get<double>();
}

bool is_number(const json& value) {
    return value.is_null() || value.is_number();
}

json form_of(const json& value, NumberKey kind, Numbers& numbers);

json form_of_object(const json& value, Numbers& numbers) {
    json form = json::object();
    for (const auto& [key, inner] : value.items()) form[key] = form_of(inner, kind_of(key), numbers);
    return form;
}

/// The value without its numbers: null for one, how many there are for a list.
json form_of(const json& value, NumberKey kind, Numbers& numbers) {
    const auto take = [&](const json& number) {
        numbers.values.push_back(number_of(number));
        numbers.wide.push_back(kind == NumberKey::wide);
    };
    if (value.is_object()) return form_of_object(value, numbers);
    const bool numeric = kind != NumberKey::none;
    if (numeric && is_number(value)) {
        take(value);
        return nullptr;
    }
    if (!value.is_array()) return value;
    if (numeric && std::all_of(value.begin(), value.end(), is_number)) {
        for (const json& number : value) take(number);
        return value.size();
    }
    json form = json::array();
    for (const json& inner : value) form.push_back(form_of(inner, kind, numbers));
    return form;
}

bool fits_single(double value) {
    return std::isnan(value) || static_cast<double>(static_cast<float>(value)) == value;
}

template <typename Number, typename Bits>
void put(Number value, std::vector<std::uint8_t>& bytes) {
    for (const std::uint8_t byte : bytes_of_numbers(std::vector{std::bit_cast<Bits>(value)}))
        bytes.push_back(byte);
}

/// \param single  whether all that may be are in single precision
std::vector<std::uint8_t> bytes_of(const Numbers& numbers, bool single) {
    std::vector<std::uint8_t> bytes;
    for (std::size_t i = 0; i < numbers.values.size(); ++i) {
        if (single && !numbers.wide[i])
            put<float, std::uint32_t>(static_cast<float>(numbers.values[i]), bytes);
        else
            put<double, std::uint64_t>(numbers.values[i], bytes);
    }
    return bytes;
}

std::vector<std::uint8_t> bytes_of(const Numbers& numbers) {
    bool single = true;
    for (std::size_t i = 0; i < numbers.values.size(); ++i)
        single = single && (numbers.wide[i] || fits_single(numbers.values[i]));
    return bytes_of(numbers, single);
}

/// Puts numbers back where a form lacks them.
class Filling {
  public:
    Filling(const json& form, const std::vector<std::uint8_t>& bytes, const std::string& place,
            const Context& context)
        : bytes_(&bytes), place_(&place), context_(&context) {
        count(form, NumberKey::none);
        single_ = bytes.size() != 8 * (singles_ + wides_);
        if (single_ && bytes.size() != 4 * singles_ + 8 * wides_)
            fail(context, place + " has " + std::to_string(bytes.size()) +
                              " bytes, which are not the numbers of its form");
        filled_ = fill(form, NumberKey::none);
    }
    [[nodiscard]] const json& filled() const { return filled_; }

  private:
    void add(NumberKey kind, std::size_t numbers) {
        // No text has more numbers than bytes.
        if (numbers > bytes_->size()) fail(*context_, *place_ + " has fewer numbers than its form asks for");
        (kind == NumberKey::wide ? wides_ : singles_) += numbers;
    }
    void count(const json& form, NumberKey kind) {
        if (form.is_object()) {
            for (const auto& [key, inner] : form.items()) count(inner, kind_of(key));
        } else if (form.is_array()) {
            for (const json& inner : form) count(inner, kind);
        } else if (kind != NumberKey::none && form.is_null()) {
            add(kind, 1);
        } else if (kind != NumberKey::none && form.is_number()) {
            add(kind, natural(form, *place_, *context_));
        }
    }
    json next(NumberKey kind, bool whole) {
        double value = 0.0;
        if (single_ && kind != NumberKey::wide) {
            std::uint32_t bits = 0;
            for (unsigned i = 0; i < 4; ++i) bits |= std::uint32_t{(*bytes_)[at_++]} << (8 * i);
            value = static_cast<double>(std::bit_cast<float>(bits));
        } else {
            std::uint64_t bits = 0;
            for (unsigned i = 0; i < 8; ++i) bits |= std::uint64_t{(*bytes_)[at_++]} << (8 * i);
            value = std::bit_cast<double>(bits);
        }
        if (std::isnan(value)) return nullptr;
        if (whole && value >= 0.0 && value < 0x1p53 && value == std::floor(value))
            return static_cast<std::uint64_t>(value);
        return value;
    }
    json fill(const json& form, NumberKey kind, bool whole = false) {
        if (form.is_object()) {
            json result = json::object();
            for (const auto& [key, inner] : form.items())
                result[key] = fill(inner, kind_of(key), key == "iterations");
            return result;
        }
        if (form.is_array()) {
            json result = json::array();
            for (const json& inner : form) result.push_back(fill(inner, kind));
            return result;
        }
        if (kind == NumberKey::none || form.is_string() || form.is_boolean()) return form;
        if (form.is_null()) return next(kind, whole);
        json result = json::array();
        for (auto left = form.get<std::uint64_t>(); left > 0; --left) result.push_back(next(kind, false));
        return result;
    }

    const std::vector<std::uint8_t>* bytes_;
    const std::string* place_;
    const Context* context_;
    std::size_t singles_ = 0, wides_ = 0, at_ = 0;
    bool single_ = true;
    json filled_;
};

TextureModel filled_model(const json& form, const std::vector<std::uint8_t>& bytes, const std::string& place,
                          const Context& context) {
    return model_from(Filling(form, bytes, place, context).filled(), place, context);
}

}  // namespace

TextureModel single_precision(const TextureModel& model) {
    Numbers numbers;
    const json form = form_of_object(json(model_value(model)), numbers);
    try {
        return filled_model(form, bytes_of(numbers, true), "texture", {"round a texture"});
    } catch (const InputError&) {
        return model;
    }
}

std::size_t coded_bytes(const TextureModel& model) {
    Numbers numbers;
    static_cast<void>(form_of_object(json(model_value(model)), numbers));
    return bytes_of(numbers).size();
}

ordered_json texture_value(const TextureModel& model) {
    Numbers numbers;
    const json form = form_of_object(json(model_value(model)), numbers);
    return ordered_json::array({ordered_json(form), ordered_json::binary(bytes_of(numbers))});
}

TextureModel texture_from(const json& value, const std::string& place, const Context& context) {
    if (array(value, place, context).size() != 2) fail(context, place + " is not a form and bytes");
    return filled_model(value[0], bytes_from(value[1], place, context), place, context);
}

ordered_json textures_value(const std::vector<TextureModel>& textures, bool binary) {
    ordered_json forms = ordered_json::array(), coded = ordered_json::array();
    std::map<std::string, std::size_t> known;
    for (const TextureModel& texture : textures) {
        Numbers numbers;
        const json form = form_of_object(json(model_value(texture)), numbers);
        const auto [place, added] = known.try_emplace(form.dump(), forms.size());
        if (added) forms.push_back(ordered_json(form));
        coded.push_back(ordered_json::array({place->second, bytes_value(bytes_of(numbers), binary)}));
    }
    return {{"forms", std::move(forms)}, {"textures", std::move(coded)}};
}

std::vector<TextureModel> textures_from(const json& value, const std::string& place, const Context& context) {
    Object object(value, place, context);
    const json& forms = array(object.member("forms"), object.path("forms"), context);
    const json& coded = array(object.member("textures"), object.path("textures"), context);
    object.finish();
    std::vector<std::size_t> sizes;
    for (const json& form : forms) {
        if (!form.is_object()) fail(context, place + ".forms has one that is not an object");
        sizes.push_back(form.dump(-1, ' ', false, json::error_handler_t::replace).size());
    }
    std::vector<TextureModel> textures;
    std::size_t used = 0;
    for (std::size_t i = 0; i < coded.size(); ++i) {
        const std::string where = element(object.path("textures"), i);
        if (array(coded[i], where, context).size() != 2) fail(context, where + " is not a form and bytes");
        const std::uint64_t form = natural(coded[i][0], where, context);
        if (form >= forms.size()) fail(context, where + " has a form that is not there");
        used += sizes[form];
        if (used > most_form_bytes) fail(context, place + " has more textures than it can have");
        textures.push_back(
            filled_model(forms[form], bytes_from(coded[i][1], where, context), where, context));
    }
    return textures;
}

}  // namespace btfield::detail

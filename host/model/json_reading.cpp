#include "host/model/json_reading.hpp"

#include <cmath>
#include <limits>

#include "btfield/error.hpp"

namespace btfield::detail::json_reading {

void fail(const Context& context, const std::string& found, const char* remedy) {
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

bool truth(const json& value, const std::string& where, const Context& context) {
    if (!value.is_boolean()) fail(context, where + " is neither true nor false");
    return value.get<bool>();
}

const json& array(const json& value, const std::string& where, const Context& context) {
    if (!value.is_array()) fail(context, where + " is not an array");
    return value;
}

std::string element(const std::string& where, std::size_t index) {
    return where + "[" + std::to_string(index) + "]";
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

}  // namespace btfield::detail::json_reading

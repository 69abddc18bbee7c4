#pragma once

// Values that files of all models of BTFs have (docs/model-file.md).

#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>
#include <type_traits>
#include <utility>
#include <variant>
#include <vector>

#include "btfield/btf_measured.hpp"
#include "btfield/btf_model.hpp"
#include "btfield/btf_textures.hpp"
#include "host/base/base64.hpp"
#include "host/model/json_reading.hpp"

namespace btfield::detail {

/// Whole numbers as bytes, lowest first.
template <typename Number>
[[nodiscard]] std::vector<std::uint8_t> bytes_of_numbers(const std::vector<Number>& numbers) {
    std::vector<std::uint8_t> bytes;
    bytes.reserve(numbers.size() * sizeof(Number));
    for (const Number number : numbers) {
        const auto bits = static_cast<std::uint64_t>(static_cast<std::make_unsigned_t<Number>>(number));
        for (std::size_t i = 0; i < sizeof(Number); ++i)
            bytes.push_back(static_cast<std::uint8_t>(bits >> (8 * i) & 255U));
    }
    return bytes;
}

template <typename Number>
[[nodiscard]] std::vector<Number> numbers_of_bytes(const std::vector<std::uint8_t>& bytes) {
    std::vector<Number> numbers(bytes.size() / sizeof(Number));
    for (std::size_t n = 0; n < numbers.size(); ++n) {
        std::uint64_t bits = 0;
        for (std::size_t i = 0; i < sizeof(Number); ++i)
            bits |= static_cast<std::uint64_t>(bytes[n * sizeof(Number) + i]) << (8 * i);
        numbers[n] = static_cast<Number>(bits);
    }
    return numbers;
}

[[nodiscard]] nlohmann::ordered_json bytes_value(std::vector<std::uint8_t> bytes, bool binary);
/// \throws InputError where the value is neither bytes nor text of them
[[nodiscard]] std::vector<std::uint8_t> bytes_from(const nlohmann::json& value, const std::string& where,
                                                   const json_reading::Context& context);

template <typename Number>
[[nodiscard]] nlohmann::ordered_json table_value(const std::vector<Number>& numbers, bool binary) {
    return bytes_value(bytes_of_numbers(numbers), binary);
}

/// \throws InputError where the value has not `count` numbers
template <typename Number>
[[nodiscard]] std::vector<Number> table_from(const nlohmann::json& value, const std::string& where,
                                             const json_reading::Context& context, std::size_t count) {
    const std::vector<std::uint8_t> bytes = bytes_from(value, where, context);
    if (bytes.size() != count * sizeof(Number))
        json_reading::fail(context, where + " has " + std::to_string(bytes.size()) + " bytes, not " +
                                        std::to_string(count * sizeof(Number)));
    return numbers_of_bytes<Number>(bytes);
}

/// Values from 0 on, as halves where all of them are halves, else as floats.
[[nodiscard]] nlohmann::ordered_json means_value(const std::vector<float>& means, bool binary);
[[nodiscard]] std::vector<float> means_from(const nlohmann::json& value, const std::string& where,
                                            const json_reading::Context& context, std::size_t count);

[[nodiscard]] nlohmann::ordered_json directions_value(const std::vector<BtfDirection>& directions);
[[nodiscard]] BtfDirection direction_from(const nlohmann::json& value, const std::string& where,
                                          const json_reading::Context& context);

/// Which of `count` are meant, a bit each, lowest first.
[[nodiscard]] std::vector<std::uint8_t> bits_of(const std::vector<std::size_t>& meant, std::size_t count);
/// Ascending.
[[nodiscard]] std::vector<std::size_t> bits_from(const nlohmann::json& value, const std::string& where,
                                                 const json_reading::Context& context, std::size_t count);

/// Size, colours, white, views and lights, pairs and true lights.
void put_scope(nlohmann::ordered_json& value, const BtfMeasured& model, bool binary);
/// \throws InputError
void read_scope(json_reading::Object& object, BtfMeasured& model, const json_reading::Context& context);
/// How many pictures and bytes the set had.
void put_extent(nlohmann::ordered_json& value, const BtfMeasured& model);
/// \throws InputError
void read_extent(json_reading::Object& object, BtfMeasured& model);

/// Of the key `method`; joint where there is none.
/// \param joint  which kind the caller reads
/// \throws InputError where the file has the other kind
BtfMethod read_btf_method(json_reading::Object& object, bool joint, const json_reading::Context& context);

[[nodiscard]] nlohmann::ordered_json joint_model_value(const BtfModel& model, bool binary);
[[nodiscard]] nlohmann::ordered_json textures_model_value(const BtfTextures& model, bool binary);
/// \throws InputError
[[nodiscard]] std::variant<BtfModel, BtfTextures> btf_from(const nlohmann::json& value,
                                                           const json_reading::Context& context);
/// \throws InputError
[[nodiscard]] BtfModel joint_model_from(const nlohmann::json& value, const json_reading::Context& context);

}  // namespace btfield::detail

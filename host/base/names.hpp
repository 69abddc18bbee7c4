#pragma once

// Words of enumerations: one table for each, read both ways. A room keeps the tables of its enumerations in
// ROOM/..._names.hpp, so that options, files and messages of the rooms behind it take words from there.

#include <array>
#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "btfield/error.hpp"

namespace btfield::detail {

template <typename Enum>
struct Word {
    Enum value;
    std::string_view word;
};

/// Specialised for every enumeration with words:
///     static constexpr std::string_view what = "metric";  // in messages
///     static constexpr auto words = std::to_array<Word<Metric>>({{Metric::max, "max"}, …});
template <typename Enum>
struct Names;

/// In the order in which they are listed for people.
template <typename Enum>
[[nodiscard]] constexpr std::span<const Word<Enum>> names_of() {
    return Names<Enum>::words;
}

/// The values alone.
template <typename Enum>
[[nodiscard]] constexpr auto values_of() {
    std::array<Enum, Names<Enum>::words.size()> values{};
    for (std::size_t i = 0; i < values.size(); ++i) values[i] = Names<Enum>::words[i].value;
    return values;
}

template <typename Enum>
[[nodiscard]] std::string_view word_of(Enum value) {
    for (const Word<Enum>& known : Names<Enum>::words) {
        if (known.value == value) return known.word;
    }
    throw InputError("name a " + std::string(Names<Enum>::what), "there is none of this value",
                     "use one of the declared values");
}

/// Nothing where no value has the word.
template <typename Enum>
[[nodiscard]] constexpr std::optional<Enum> find_value(std::string_view word) {
    for (const Word<Enum>& known : Names<Enum>::words) {
        if (known.word == word) return known.value;
    }
    return std::nullopt;
}

/// "max, l1, l2"
/// \param last separator before the last word; empty = as the others
template <typename Enum>
[[nodiscard]] std::string words_of(std::string_view separator = ", ", std::string_view last = {}) {
    std::string list;
    for (const Word<Enum>& known : Names<Enum>::words) {
        const bool ends = &known == &Names<Enum>::words.back();
        if (!list.empty()) list += ends && !last.empty() ? last : separator;
        list += known.word;
    }
    return list;
}

/// \throws InputError where no value has the word, listing those that exist
template <typename Enum>
[[nodiscard]] Enum value_of(std::string_view word) {
    if (const auto value = find_value<Enum>(word)) return *value;
    throw InputError("find the " + std::string(Names<Enum>::what) + " '" + std::string(word) + "'",
                     "it is not known", "use " + words_of<Enum>());
}

}  // namespace btfield::detail

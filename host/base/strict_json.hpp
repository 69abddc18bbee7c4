#pragma once

/// \file
/// JSON and CBOR texts that nobody has vouched for, into values.

#include <nlohmann/json.hpp>
#include <string>
#include <string_view>

namespace btfield::detail {

/// Parses JSON text, or CBOR when it begins like a CBOR map. Refuses what the usual parsers let pass:
/// repeated keys, nesting beyond 16 levels, numbers that overflow, CBOR tags and indefinite lengths, trailing
/// bytes.
/// \param asked first part of the messages, such as "read 'cork.json'"
/// \throws InputError
[[nodiscard]] nlohmann::json parse_strictly(std::string_view bytes, const std::string& asked);

/// Text from a file, fit for one line on a terminal: control characters become '?', and it is cut to 60
/// bytes.
[[nodiscard]] std::string printable(std::string_view text);

}  // namespace btfield::detail

#pragma once

// What a compiler takes seconds for wherever JSON is read or shown, compiled once.

#include <nlohmann/json.hpp>
#include <string>

namespace btfield::test {

/// Throws where the text is not JSON.
nlohmann::json parsed(const std::string& text);

/// Whether the text is one JSON object.
bool holds_object(const std::string& text);

}  // namespace btfield::test

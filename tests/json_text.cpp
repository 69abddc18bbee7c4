#include "tests/json_text.hpp"

namespace btfield::test {

nlohmann::json parsed(const std::string& text) {
    return nlohmann::json::parse(text);
}

bool holds_object(const std::string& text) {
    return nlohmann::json::parse(text, nullptr, false).is_object();
}

}  // namespace btfield::test

#pragma once

// Values of a model file, read with the place of whatever is wrong in the message.

#include <array>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "btfield/image.hpp"
#include "btfield/neighbourhood.hpp"
#include "host/base/names.hpp"
#include "host/base/strict_json.hpp"

namespace btfield::detail::json_reading {

using nlohmann::json;

inline constexpr const char* file_remedy = "use a complete model file written by btfield";
inline constexpr const char* newer_remedy = "install a newer btfield";

struct Context {
    std::string asked;
    bool newer_minor = false;  ///< written by a later minor version: unknown keys are additions, not defects
};

[[noreturn]] void fail(const Context& context, const std::string& found, const char* remedy = file_remedy);

// Each reads a value and says `where` it is when it is not of the kind.
double real(const json& value, const std::string& where, const Context& context);
double real_or_null(const json& value, const std::string& where, const Context& context);
int integer(const json& value, const std::string& where, const Context& context);
std::uint64_t natural(const json& value, const std::string& where, const Context& context);
std::string text(const json& value, const std::string& where, const Context& context);
bool truth(const json& value, const std::string& where, const Context& context);
const json& array(const json& value, const std::string& where, const Context& context);
std::array<int, 2> pair(const json& value, const std::string& where, const Context& context);
Size size(const json& value, const std::string& where, const Context& context);
Offset offset(const json& value, const std::string& where, const Context& context);
std::uint8_t presence(const json& value, const std::string& where, const Context& context);
std::string element(const std::string& where, std::size_t index);

template <typename Read>
auto list(const json& value, const std::string& where, const Context& context, Read read) {
    array(value, where, context);
    std::vector<decltype(read(value, where, context))> result;
    result.reserve(value.size());
    for (std::size_t i = 0; i < value.size(); ++i)
        result.push_back(read(value[i], element(where, i), context));
    return result;
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

}  // namespace btfield::detail::json_reading

#include "host/base/strict_json.hpp"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <set>
#include <utility>
#include <vector>

#include "btfield/error.hpp"
#include "host/base/text.hpp"

namespace btfield::detail {
namespace {

using nlohmann::json;

constexpr std::size_t deepest = 16;
const char* const remedy = "use a complete model file written by btfield";

/// Receives the parser's events and builds the value; whatever it refuses, it throws.
class Builder {
  public:
    explicit Builder(const std::string& asked) : asked_(asked) {}
    [[nodiscard]] json take() { return std::move(root_); }

    bool null() { return add(nullptr); }
    bool boolean(bool value) { return add(value); }
    bool number_integer(json::number_integer_t value) { return add(value); }
    bool number_unsigned(json::number_unsigned_t value) { return add(value); }
    bool number_float(json::number_float_t value, const std::string&) { return add(value); }
    bool string(std::string& value) {
        check_text(value);
        return add(std::move(value));
    }
    bool binary(json::binary_t& value) { return add(json::binary(std::move(value))); }
    bool start_object(std::size_t) { return open(json::object()); }
    bool key(std::string& value) {
        check_text(value);
        if (open_.back()->contains(value)) fail("key '" + printable(value) + "' is there twice");
        key_ = std::move(value);
        return true;
    }
    bool end_object() { return close(); }
    bool start_array(std::size_t) { return open(json::array()); }
    bool end_array() { return close(); }
    bool parse_error(std::size_t position, const std::string&, const json::exception& error) {
        constexpr int out_of_range = 406;
        if (error.id == out_of_range)
            fail("a number before byte " + std::to_string(position) + " is out of range");
        fail("it is damaged: the text goes wrong at byte " + std::to_string(position));
    }

  private:
    [[noreturn]] void fail(const std::string& found) const { throw InputError(asked_, found, remedy); }

    /// JSON's reader has done it already.
    void check_text(const std::string& value) const {
        if (valid_utf8(value) != value) fail("it is damaged: a text is not UTF-8");
    }

    template <typename Value>
    json* put(Value&& value) {
        if (open_.empty()) {
            root_ = json(std::forward<Value>(value));
            return &root_;
        }
        if (open_.back()->is_array()) {
            open_.back()->push_back(json(std::forward<Value>(value)));
            return &open_.back()->back();
        }
        json& place = (*open_.back())[key_];
        place = json(std::forward<Value>(value));
        return &place;
    }
    template <typename Value>
    bool add(Value&& value) {
        put(std::forward<Value>(value));
        return true;
    }
    // A parent takes no other child while one is open, so that the pointers stay good.
    bool open(json&& value) {
        if (open_.size() == deepest) fail("it is nested deeper than " + std::to_string(deepest) + " levels");
        open_.push_back(put(std::move(value)));
        return true;
    }
    bool close() {
        open_.pop_back();
        return true;
    }

    const std::string& asked_;
    json root_;
    std::vector<json*> open_;
    std::string key_;
};

/// Walks over CBOR without recursion, so that the parser that follows, which recurses into chunks of strings,
/// meets only definite lengths that the bytes can hold.
class CborScan {
  public:
    CborScan(std::string_view bytes, const std::string& asked) : bytes_(bytes), asked_(asked) {}

    void run() {
        // Every outstanding item needs at least one byte, which bounds the count.
        std::uint64_t outstanding = 1;
        while (outstanding > 0) {
            if (outstanding > left()) fail_truncated();
            --outstanding;
            outstanding += item();
        }
        if (left() != 0) fail("it is damaged: " + std::to_string(left()) + " bytes follow its end");
    }

  private:
    [[noreturn]] void fail(const std::string& found) const { throw InputError(asked_, found, remedy); }
    [[noreturn]] void fail_truncated() const {
        fail("it is damaged: the file ends early, after " + std::to_string(bytes_.size()) + " bytes");
    }
    [[nodiscard]] std::uint64_t left() const { return bytes_.size() - position_; }

    std::uint8_t byte() {
        if (left() == 0) fail_truncated();
        return static_cast<std::uint8_t>(bytes_[position_++]);
    }

    /// The number of items inside, which follow.
    std::uint64_t item() {
        const std::size_t at = position_;
        const unsigned head = byte();
        const unsigned type = head >> 5, info = head & 31U;
        if (info > 27) fail("byte " + std::to_string(at) + " begins an item of indefinite or unknown length");
        std::uint64_t argument = info;
        if (info >= 24) {
            argument = 0;
            for (unsigned i = 0; i < (1U << (info - 24)); ++i) argument = argument << 8 | byte();
        }
        switch (type) {
            case 2:
            case 3:
                if (argument > left()) fail_truncated();
                position_ += static_cast<std::size_t>(argument);
                return 0;
            case 4:
                if (argument > left()) fail_truncated();
                return argument;
            case 5:
                if (argument > left() / 2) fail_truncated();
                return 2 * argument;
            case 6:
                fail("byte " + std::to_string(at) + " begins a tag");
            default:
                return 0;
        }
    }

    std::string_view bytes_;
    const std::string& asked_;
    std::size_t position_ = 0;
};

bool begins_cbor_map(std::string_view bytes) {
    return (static_cast<std::uint8_t>(bytes.front()) >> 5) == 5;
}

}  // namespace

json parse_strictly(std::string_view bytes, const std::string& asked) {
    if (bytes.empty()) throw InputError(asked, "it is empty", remedy);
    Builder builder(asked);
    if (begins_cbor_map(bytes)) {
        CborScan(bytes, asked).run();
        json::sax_parse(bytes.begin(), bytes.end(), &builder, json::input_format_t::cbor);
    } else {
        const std::size_t first = bytes.find_first_not_of(" \t\r\n");
        if (first == std::string_view::npos || bytes[first] != '{') {
            throw InputError(asked, "it is not supported: it does not begin like JSON or CBOR", remedy);
        }
        json::sax_parse(bytes.begin(), bytes.end(), &builder);
    }
    return builder.take();
}

std::string printable(std::string_view text) {
    constexpr std::size_t longest = 60;
    std::string result(text.substr(0, longest));
    for (char& c : result) {
        if (static_cast<unsigned char>(c) < 32 || c == 127) c = '?';
    }
    if (text.size() > longest) result += "...";
    return result;
}

}  // namespace btfield::detail

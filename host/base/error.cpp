#include "btfield/error.hpp"

#include <utility>

#include "host/base/text.hpp"

namespace btfield {
namespace {

/// What a file holds may be repeated in a message: it must neither break lines nor command a terminal.
std::string one_line(const std::string& text) {
    std::string line = detail::valid_utf8(text);
    for (char& c : line) {
        const auto byte = static_cast<unsigned char>(c);
        if (byte >= '\t' && byte <= '\r')
            c = ' ';
        else if (byte < 0x20 || byte == 0x7f)
            c = '?';
    }
    while (!line.empty() && line.back() == ' ') line.pop_back();
    return line;
}

}  // namespace

Error::Error(const std::string& asked, const std::string& found, const std::string& remedy)
    : std::runtime_error(one_line(asked) + ": " + one_line(found) + "; " + one_line(remedy)),
      asked_(one_line(asked)),
      found_(one_line(found)),
      remedy_(one_line(remedy)) {}

DeviceError::DeviceError(const std::string& asked, const std::string& found, const std::string& remedy,
                         std::string log)
    : Error(asked, found, remedy), log_(std::move(log)) {}

}  // namespace btfield

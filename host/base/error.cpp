#include "btfield/error.hpp"

#include <utility>

namespace btfield {
namespace {

std::string one_line(std::string text) {
    for (char& c : text) {
        if (c == '\n' || c == '\r' || c == '\v' || c == '\f') c = ' ';
    }
    while (!text.empty() && text.back() == ' ') text.pop_back();
    return text;
}

}  // namespace

Error::Error(std::string asked, std::string found, std::string remedy)
    : std::runtime_error(one_line(asked) + ": " + one_line(found) + "; " + one_line(remedy)),
      asked_(one_line(std::move(asked))),
      found_(one_line(std::move(found))),
      remedy_(one_line(std::move(remedy))) {}

DeviceError::DeviceError(std::string asked, std::string found, std::string remedy, std::string log)
    : Error(std::move(asked), std::move(found), std::move(remedy)), log_(std::move(log)) {}

}  // namespace btfield

#pragma once

#include <map>
#include <string>

namespace btfield::detail {

/// -D definitions that a program is built with, in a fixed order so that equal sets share a cache key.
class BuildParameters {
  public:
    BuildParameters& set(const std::string& name, long long value) {
        definitions_[name] = std::to_string(value);
        return *this;
    }
    /// "-DBTFIELD_A=1 -DBTFIELD_B=2".
    [[nodiscard]] std::string options() const;

  private:
    std::map<std::string, std::string> definitions_;
};

}  // namespace btfield::detail

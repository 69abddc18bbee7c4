#pragma once

// A file that is nowhere but in memory, for readers and writers that want a name.

#include <filesystem>
#include <string>
#include <string_view>

#include "host/base/file_output.hpp"

namespace btfield::detail {

class MemoryFile {
  public:
    /// \param asked  for the message
    explicit MemoryFile(const std::string& asked, std::string_view bytes = {});
    [[nodiscard]] const std::filesystem::path& path() const { return path_; }
    [[nodiscard]] std::string content() const;

  private:
    Descriptor file_;
    std::filesystem::path path_;
    std::string asked_;
};

}  // namespace btfield::detail

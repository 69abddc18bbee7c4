#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace btfield::test {

/// An empty folder of its own for one test, removed with all that is in it.
class TemporaryFolder {
  public:
    TemporaryFolder();
    ~TemporaryFolder();
    TemporaryFolder(const TemporaryFolder&) = delete;
    TemporaryFolder& operator=(const TemporaryFolder&) = delete;

    [[nodiscard]] const std::filesystem::path& path() const { return path_; }
    [[nodiscard]] std::filesystem::path operator/(std::string_view name) const;

    /// Names of all that is in it, hidden files included, sorted.
    [[nodiscard]] std::vector<std::string> names() const;

  private:
    std::filesystem::path path_;
};

std::string bytes_of(const std::filesystem::path& path);

void put_bytes(const std::filesystem::path& path, std::string_view bytes);

}  // namespace btfield::test

#pragma once

/// \file
/// Where the files are that a database names: it may have moved, with them or without.

#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "host/experiment/sqlite.hpp"

namespace btfield::detail {

class PicturePlaces {
  public:
    /// Reads which folders stood where, seen from the database.
    PicturePlaces(Connection& connection, const std::filesystem::path& database);

    /// The picture of a row of `files`: beside the database as it was when it was run, at its path, or under
    /// its name in the database's folder; the first that holds the content.
    /// \param content SHA-256 of the file; empty: any
    [[nodiscard]] std::optional<std::filesystem::path> picture(const std::string& folder,
                                                               const std::string& name,
                                                               const std::string& content) const;
    /// Where a row's picture or set may be, in this order, whatever is there.
    [[nodiscard]] std::vector<std::filesystem::path> candidates(const std::string& folder,
                                                                const std::string& name) const;
    /// A texture that was kept.
    [[nodiscard]] std::optional<std::filesystem::path> texture(const std::string& file) const;

  private:
    [[nodiscard]] std::optional<std::filesystem::path> near(const std::string& folder,
                                                            const std::filesystem::path& name) const;
    std::filesystem::path home_;
    std::map<std::string, std::string> near_;
};

/// The folder as it is written in `places`: a path from the database's folder.
[[nodiscard]] std::string seen_from(const std::filesystem::path& database, const std::string& folder);

}  // namespace btfield::detail

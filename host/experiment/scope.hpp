#pragma once

/// \file
/// Which jobs of a database belong to a configuration: those of its pictures, with its settings.

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "btfield/experiment.hpp"
#include "host/experiment/sqlite.hpp"

namespace btfield::detail {

/// While it lives, a connection that only reads may write temporary tables, which are no part of the
/// database.
class TemporaryWrites {
  public:
    explicit TemporaryWrites(Connection& connection);
    ~TemporaryWrites();
    TemporaryWrites(const TemporaryWrites&) = delete;
    TemporaryWrites& operator=(const TemporaryWrites&) = delete;

  private:
    Connection& connection_;
    bool reads_;
};

/// A configuration that was run into a database.
struct RecordedConfiguration {
    std::string name;
    std::string text;
    std::vector<std::string> ids;  ///< of all folders that it was run from, the last one first
    std::string last_run;
};

/// The one that was run last first. Configurations of one text are one, whatever folders it was run from.
[[nodiscard]] std::vector<RecordedConfiguration> recorded_configurations(Connection& connection);

/// Makes the temporary tables and views, anew each time:
///     scope_places(material, picture, folder, name, crop)   the pictures
///     scope_jobs                                             the rows of `jobs`, with columns noise and
///                                                            gains: their words, or "any" where they are not
///                                                            read
/// \param configuration nothing: all that the database holds
/// \throws InputError when an older version ran the configuration and this one does not understand it
void enter_scope(Connection& connection, const std::optional<RecordedConfiguration>& configuration);

/// Those that the options ask for; nothing where the database has none, and all of it is meant.
/// \throws InputError when none is so named
[[nodiscard]] std::vector<std::optional<RecordedConfiguration>> chosen_configurations(
    Connection& connection, const ExperimentTableOptions& options);

/// The tables of the scope that was entered.
[[nodiscard]] std::vector<ExperimentTable> tables_of_scope(
    Connection& connection, const std::optional<RecordedConfiguration>& configuration,
    const ExperimentTableOptions& options);

/// Whether a name matches a text or a pattern (* ? [...]), whole or by its file name.
[[nodiscard]] bool names_picture(const std::string& pattern, const std::string& name);

}  // namespace btfield::detail

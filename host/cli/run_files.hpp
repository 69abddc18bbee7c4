#pragma once

/// \file
/// What a run reads and what it writes.

#include <cstdint>
#include <filesystem>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "btfield/models.hpp"

namespace btfield::cli {

/// Keeps outputs from replacing what they are made of. Commands name their inputs first and then every file
/// that they will write, before any work is done.
class RunFiles {
  public:
    /// \param overwrite  --overwrite: inputs and sources may be replaced
    /// \param json  --json: standard output takes the report, and so no file
    RunFiles(bool overwrite, bool json) : overwrite_(overwrite), json_(json) {}

    /// \param told  of the file, where it would be replaced
    void reads(const std::filesystem::path& file, std::string told = "the run reads it");
    /// A model, and the picture that it says it was fitted to: a file of that name beside the model is taken
    /// for it, and one of that name and size in the folder of an output; of any size where the model does not
    /// tell it.
    void reads_model(const std::filesystem::path& file, const Provenance& provenance);

    /// Checks one file. Where it is standard output, reports go to standard error from then on.
    /// \throws InputError when it is one of those that are read, by whatever name or link, unless they may
    ///     be replaced
    /// \throws UsageError when it is written already, or is standard output and --json is given
    void writes(const std::filesystem::path& file);
    /// And what holds for pages: they do not replace a picture by mistake.
    /// \throws InputError
    void writes_text(const std::filesystem::path& file);
    /// And what holds for models: they never replace a picture, whether that is told by the new name or by
    /// what the file holds, --overwrite or not.
    /// \throws InputError  also when it cannot be written
    void writes_model(const std::filesystem::path& file);

  private:
    struct Input {
        std::filesystem::path file;
        std::string told;
    };
    struct Source {
        std::filesystem::path model;
        std::string name;
        std::uint64_t bytes = 0;
    };
    void check_replaced(const std::filesystem::path& file) const;

    bool overwrite_, json_;
    std::vector<Input> read_;
    std::set<std::filesystem::path> places_;                   ///< of outputs, links followed
    std::set<std::pair<std::uint64_t, std::uint64_t>> files_;  ///< outputs that are there: device, number
    std::vector<Source> sources_;
};

/// Whether writing to this name is writing to standard output.
[[nodiscard]] bool is_standard_output(const std::filesystem::path& file);

}  // namespace btfield::cli

#pragma once

/// \file
/// What all commands that read or write pictures have in common: their options, and what they tell.

#include <CLI/CLI.hpp>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "btfield/image_io.hpp"
#include "btfield/models.hpp"

namespace btfield::cli {

/// --part, --planes and --keep-values, in a group of their own.
void add_reading(CLI::App& app, ReadOptions& options);

/// --type and, where the command has no add_reading(), --keep-values.
struct WritingArguments {
    std::optional<PixelType> type;
    bool keep_values = false;
    std::optional<int> compression;  ///< of add_compression()
};
void add_writing(CLI::App& app, WritingArguments& arguments, bool with_keep_values);
/// --compression.
void add_compression(CLI::App& app, WritingArguments& arguments);

/// Reads the picture and warns, in one line, of what it is not as the file has it and of transparency.
[[nodiscard]] Picture read_told(const std::filesystem::path& path, const ReadOptions& options);

/// What textures of a model are written with.
[[nodiscard]] WriteOptions write_options(const Provenance& provenance, const WritingArguments& arguments);
/// What a picture's own pixels are written with.
[[nodiscard]] WriteOptions write_options(const Picture& picture, const WritingArguments& arguments);

/// Warnings of what was written, each once however many files had it.
class WrittenRemarks {
  public:
    void add(const std::filesystem::path& path, const WriteReport& report);
    void add(const WrittenRemarks& others);
    /// Warns of each in one line, in the order of the files' names, which may have been written in any.
    void tell() const;

  private:
    struct Told {
        std::string remark;
        std::filesystem::path first;
        int files = 0;
    };
    void add(const Told& told);

    std::vector<Told> told_;
};

/// Warns when numbers of two pictures do not mean the same: they are compared as they are.
void warn_of_unlike_spaces(const std::filesystem::path& a, const Image& one, const std::filesystem::path& b,
                           const Image& other);

}  // namespace btfield::cli

#pragma once

/// \file
/// Names of pictures and of outputs.

#include <filesystem>
#include <optional>
#include <string>

#include "btfield/image.hpp"

namespace btfield::cli {

/// ".png" of "OUT.PNG".
[[nodiscard]] std::string lower_extension(const std::filesystem::path& path);

/// "out.png" becomes "out-07.png" for picture 7 of 12: names sort as the numbers do.
[[nodiscard]] std::filesystem::path numbered(const std::filesystem::path& path, int index, int count);

/// Whether the output is a folder to write into. One that has to be there, for what needs it or because the
/// name ends in '/', is made.
/// \param option named in the message
/// \param several what needs a folder, such as "several pictures"; empty where a file will do
/// \param remedy what to do where it needs one and the name is that of a file
/// \throws UsageError when something else has its name, or the name is that of a file: it ends in an
///     extension
/// \throws InputError when it cannot be made
[[nodiscard]] bool is_output_folder(const std::string& option, const std::string& output,
                                    const std::string& several = {}, const std::string& remedy = {});

/// Of those that this run has made: for a run that failed.
void remove_empty_output_folders() noexcept;

/// Refuses a label picture whose name does not end in .png; empty: there is none.
/// \throws UsageError
/// \throws InputError when it cannot be written
void check_labels_output(const std::filesystem::path& labels, std::optional<Size> size = {});

}  // namespace btfield::cli

#pragma once

/// \file
/// Names of pictures and of outputs.

#include <filesystem>
#include <span>
#include <string>

namespace btfield::cli {

/// ".png" of "OUT.PNG".
[[nodiscard]] std::string lower_extension(const std::filesystem::path& path);

/// "out.png" becomes "out-07.png" for picture 7 of 12: names sort as the numbers do.
[[nodiscard]] std::filesystem::path numbered(const std::filesystem::path& path, int index, int count);

/// Whether the output is a folder to write into.
/// \param option named in the message
/// \param several what needs a folder, such as "several pictures"; empty where a file will do
/// \throws UsageError when it has to be one, for that or because its name ends in '/', and is none
[[nodiscard]] bool is_output_folder(const std::string& option, const std::string& output,
                                    const std::string& several = {});

/// Refuses a label picture that has no name of its own, or none that ends in .png; empty: there is none.
/// \param others files that are read or written
/// \throws UsageError
/// \throws InputError when it cannot be written
void check_labels_output(const std::filesystem::path& labels, std::span<const std::filesystem::path> others);

}  // namespace btfield::cli

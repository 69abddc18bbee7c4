#include "host/cli/output_names.hpp"

#include <system_error>

#include "btfield/image_io.hpp"
#include "host/cli/command.hpp"

namespace btfield::cli {

std::string lower_extension(const std::filesystem::path& path) {
    std::string extension = path.extension().string();
    for (char& c : extension)
        if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
    return extension;
}

std::filesystem::path numbered(const std::filesystem::path& path, int index, int count) {
    const std::string digits = std::to_string(index);
    const std::size_t width = std::to_string(count - 1).size();
    std::filesystem::path name = path.stem();
    name += "-" + std::string(width - digits.size(), '0') + digits;
    name += path.extension();
    return path.parent_path() / name;
}

bool is_output_folder(const std::string& option, const std::string& output, const std::string& several) {
    std::error_code error;
    if (std::filesystem::is_directory(output, error)) return true;
    if (several.empty() && !output.ends_with('/')) return false;
    throw UsageError(option + ": '" + output + "' is no folder" +
                     (several.empty() ? "" : ", as " + several + " need") + "; make one of that name");
}

void check_labels_output(const std::filesystem::path& labels, std::span<const std::filesystem::path> others) {
    if (labels.empty()) return;
    if (lower_extension(labels) != ".png")
        throw UsageError("--save-labels: '" + labels.string() + "' does not end in .png");
    check_writable(labels, 3, PixelType::uint8);
    std::error_code error;
    for (const std::filesystem::path& other : others)
        if (labels == other || std::filesystem::equivalent(labels, other, error))
            throw UsageError("--save-labels: '" + labels.string() + "' is read or written already");
}

}  // namespace btfield::cli

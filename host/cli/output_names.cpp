#include "host/cli/output_names.hpp"

#include <system_error>
#include <vector>

#include "btfield/error.hpp"
#include "btfield/image_io.hpp"
#include "host/cli/command.hpp"

namespace btfield::cli {
namespace {

std::vector<std::filesystem::path> made_folders;  // of this run, those inside others last

/// With those that it lies in.
void make_folder(const std::string& option, const std::filesystem::path& folder) {
    std::error_code error;
    if (folder.empty() || std::filesystem::is_directory(folder, error)) return;
    if (folder.has_filename()) {
        if (folder.parent_path() != folder) make_folder(option, folder.parent_path());
        if (!std::filesystem::create_directory(folder, error) || error)
            throw InputError("make the folder '" + folder.string() + "' of " + option, error.message(),
                             "choose a place that you may write to");
        made_folders.push_back(folder);
    } else {
        make_folder(option, folder.parent_path());  // the name ends in '/'
    }
}

}  // namespace

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

bool is_output_folder(const std::string& option, const std::string& output, const std::string& several,
                      const std::string& remedy) {
    std::error_code error;
    if (std::filesystem::is_directory(output, error)) return true;
    if (several.empty() && !output.ends_with('/')) return false;
    const bool file_name = !output.ends_with('/') && std::filesystem::path(output).has_extension();
    if (file_name || std::filesystem::exists(output, error))
        throw UsageError(option + ": '" + output + "' is no folder" +
                         (several.empty() ? "" : ", as " + several + " need") +
                         (several.empty() || remedy.empty() ? "" : "; " + remedy));
    make_folder(option, std::filesystem::absolute(output).lexically_normal());
    return true;
}

void remove_empty_output_folders() noexcept {
    std::error_code error;
    for (; !made_folders.empty(); made_folders.pop_back())
        std::filesystem::remove(made_folders.back(), error);
}

void check_labels_output(const std::filesystem::path& labels, std::optional<Size> size) {
    if (labels.empty()) return;
    if (lower_extension(labels) != ".png")
        throw UsageError("--save-labels: '" + labels.string() + "' does not end in .png");
    check_writable(labels, 3, PixelType::uint8, {}, size);
}

}  // namespace btfield::cli

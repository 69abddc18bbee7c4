#include "host/cli/output_names.hpp"

#include <string>

namespace btfield::cli {

std::filesystem::path numbered(const std::filesystem::path& path, int index, int count) {
    const std::string digits = std::to_string(index);
    const std::size_t width = std::to_string(count - 1).size();
    std::filesystem::path name = path.stem();
    name += "-" + std::string(width - digits.size(), '0') + digits;
    name += path.extension();
    return path.parent_path() / name;
}

}  // namespace btfield::cli

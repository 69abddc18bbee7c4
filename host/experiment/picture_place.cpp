#include "host/experiment/picture_place.hpp"

#include <utility>

#include "btfield/error.hpp"
#include "host/experiment/sha256.hpp"

namespace btfield::detail {
namespace {

namespace fs = std::filesystem;

bool is_file(const fs::path& path) {
    std::error_code error;
    return fs::is_regular_file(path, error);
}

bool holds(const fs::path& path, const std::string& content) {
    if (!is_file(path)) return false;
    try {
        return content.empty() || sha256_of_file(path) == content;
    } catch (const InputError&) {
        return false;  // not readable
    }
}

/// `folder` ends in a slash where it is that of a picture, not where it is that of a texture.
std::string without_slash(std::string folder) {
    while (folder.size() > 1 && folder.back() == '/') folder.pop_back();
    return folder;
}

}  // namespace

std::string seen_from(const fs::path& database, const std::string& folder) {
    std::error_code error;
    const fs::path home = fs::absolute(database).parent_path();
    fs::path path = fs::relative(folder, home, error);
    if (error || path.empty()) path = fs::path(folder).lexically_relative(home);
    return path.string();
}

PicturePlaces::PicturePlaces(Connection& connection, const fs::path& database)
    : home_(fs::absolute(database).parent_path()) {
    if (connection.number("SELECT count(*) FROM sqlite_schema WHERE name = 'places'") == 0) return;
    Statement query(connection, "SELECT folder, near FROM places");
    while (query.step()) near_.emplace(query.text(0), query.text(1));
}

std::optional<fs::path> PicturePlaces::near(const std::string& folder, const fs::path& name) const {
    const auto found = near_.find(without_slash(folder));
    if (found == near_.end()) return std::nullopt;
    return (home_ / found->second / name).lexically_normal();
}

std::vector<fs::path> PicturePlaces::candidates(const std::string& folder, const std::string& name) const {
    // Names of pictures outside the configuration's folder are whole paths, kept with no folder.
    const fs::path path = fs::path(folder) / name;
    std::vector<fs::path> all;
    if (auto beside =
            folder.empty() ? near(path.parent_path().string(), path.filename()) : near(folder, name))
        all.push_back(std::move(*beside));
    all.push_back(path);
    all.push_back(home_ / (folder.empty() ? path.filename() : fs::path(name)));
    return all;
}

std::optional<fs::path> PicturePlaces::picture(const std::string& folder, const std::string& name,
                                               const std::string& content) const {
    for (const fs::path& candidate : candidates(folder, name))
        if (holds(candidate, content)) return candidate;
    return std::nullopt;
}

std::optional<fs::path> PicturePlaces::texture(const std::string& file) const {
    const fs::path path = file;
    std::optional<fs::path> beside = near(path.parent_path().string(), path.filename());
    if (beside && is_file(*beside)) return beside;
    if (is_file(path)) return path;
    return std::nullopt;
}

}  // namespace btfield::detail

#include "btfield/material.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <cstddef>
#include <set>
#include <string_view>
#include <utility>

#include "btfield/error.hpp"
#include "btfield/pyramid.hpp"
#include "host/base/text.hpp"
#include "host/model/model_check.hpp"
#include "host/relief/half_laplacian.hpp"

namespace btfield {

using namespace detail;

namespace {

using std::size_t;

constexpr const char* asked_join = "join the maps of a material";

/// Share of the slopes' deviation that a height map explains below which it is of another surface.
constexpr double least_correlation = 0.1;
/// Heights of textures go a little beyond the sample's.
constexpr double room_for_heights = 1.25;

struct RoleWord {
    std::string_view word;
    MapRole role;
};
constexpr std::array<RoleWord, 43> role_words{{{"albedo", MapRole::colour},
                                               {"basecolor", MapRole::colour},
                                               {"basecolour", MapRole::colour},
                                               {"color", MapRole::colour},
                                               {"colour", MapRole::colour},
                                               {"col", MapRole::colour},
                                               {"diffuse", MapRole::colour},
                                               {"diff", MapRole::colour},
                                               {"dif", MapRole::colour},
                                               {"normal", MapRole::normal},
                                               {"normals", MapRole::normal},
                                               {"normalgl", MapRole::normal},
                                               {"normaldx", MapRole::normal},
                                               {"nor", MapRole::normal},
                                               {"norm", MapRole::normal},
                                               {"nrm", MapRole::normal},
                                               {"nm", MapRole::normal},
                                               {"nmap", MapRole::normal},
                                               {"normalmap", MapRole::normal},
                                               {"height", MapRole::height},
                                               {"heightmap", MapRole::height},
                                               {"displacement", MapRole::height},
                                               {"disp", MapRole::height},
                                               {"bump", MapRole::height},
                                               {"depth", MapRole::height},
                                               {"roughness", MapRole::roughness},
                                               {"rough", MapRole::roughness},
                                               {"metalness", MapRole::metalness},
                                               {"metallic", MapRole::metalness},
                                               {"metal", MapRole::metalness},
                                               {"ao", MapRole::occlusion},
                                               {"occlusion", MapRole::occlusion},
                                               {"ambientocclusion", MapRole::occlusion},
                                               {"opacity", MapRole::opacity},
                                               {"alpha", MapRole::opacity},
                                               {"mask", MapRole::opacity},
                                               {"gloss", MapRole::other},
                                               {"glossiness", MapRole::other},
                                               {"glossy", MapRole::other},
                                               {"specular", MapRole::other},
                                               {"spec", MapRole::other},
                                               {"emission", MapRole::other},
                                               {"emissive", MapRole::other}}};

/// "Bark012_NormalGL" as bark, 012, normalgl, and normal, gl besides.
std::vector<std::string> words_of(const std::filesystem::path& file) {
    std::vector<std::string> words;
    std::string joined, part;
    const auto end_part = [&] {
        if (!part.empty() && part != joined) words.push_back(part);
        part.clear();
    };
    const auto end_word = [&] {
        end_part();
        if (!joined.empty()) words.push_back(joined);
        joined.clear();
    };
    char before = ' ';
    for (const char c : file.stem().string()) {
        const auto byte = static_cast<unsigned char>(c);
        if (std::isalpha(byte) == 0) {
            end_word();
        } else {
            if (std::isupper(byte) != 0 && std::islower(static_cast<unsigned char>(before)) != 0) end_part();
            joined += static_cast<char>(std::tolower(byte));
            part += static_cast<char>(std::tolower(byte));
        }
        before = c;
    }
    end_word();
    return words;
}

std::optional<MapRole> said_role(const std::filesystem::path& file) {
    std::vector<std::string> words = words_of(file);
    std::reverse(words.begin(), words.end());
    for (const std::string& word : words)
        for (const auto& [known, role] : role_words)
            if (word == known) return role;
    return {};
}

[[noreturn]] void refuse_map(const MapPicture& map, const std::string& found, const std::string& remedy) {
    throw InputError(asked_join, "'" + map.name + "' " + found, remedy);
}

const MapPicture* only_one(std::span<const MapPicture> maps, MapRole role) {
    const MapPicture* found = nullptr;
    for (const MapPicture& map : maps) {
        if (map.role != role) continue;
        if (found != nullptr)
            refuse_map(map, "is a second " + std::string(name(role)) + " map, beside '" + found->name + "'",
                       "leave one out, or give it another role");
        found = &map;
    }
    return found;
}

void check_maps(std::span<const MapPicture> maps) {
    if (maps.empty()) throw InputError(asked_join, "there is no map", "give at least one");
    for (const MapPicture& map : maps) {
        const Image& image = map.picture.image;
        if (image.size() != maps.front().picture.image.size())
            refuse_map(map,
                       "is " + text_of(image.size()) + " pixels, and '" + maps.front().name + "' is " +
                           text_of(maps.front().picture.image.size()),
                       "give maps of one size, registered");
        if (map.role == MapRole::normal && image.planes() != 3)
            refuse_map(map, "has " + counted(image.planes(), "plane") + ", and normals have 3",
                       "give all its planes, or another role");
    }
}

/// A height of one plane: of the three of a grey picture stored as colours, the first.
Image height_plane(const MapPicture& map) {
    const Image& image = map.picture.image;
    for (int p = 1; p < image.planes(); ++p)
        if (!std::ranges::equal(image.plane(p), image.plane(0)))
            refuse_map(map, "has " + counted(image.planes(), "plane") + " that differ, and a height has 1",
                       "give a grey picture, or another role");
    Image plane(image.size(), 1);
    std::ranges::copy(image.plane(0), plane.values().begin());
    return plane;
}

double deviation(const Image& image) {
    double sum = 0.0, squares = 0.0;
    for (const float value : image.values()) {
        sum += static_cast<double>(value);
        squares += static_cast<double>(value) * static_cast<double>(value);
    }
    const auto n = static_cast<double>(image.values().size());
    return std::sqrt(std::max(0.0, squares / n - sum / n * (sum / n)));
}

/// Correlation of two fields of slopes, or of one of their components.
double correlation(std::span<const float> a, std::span<const float> b) {
    double ab = 0.0, aa = 0.0, bb = 0.0;
    for (size_t i = 0; i < a.size(); ++i) {
        const auto x = static_cast<double>(a[i]), y = static_cast<double>(b[i]);
        ab += x * y;
        aa += x * x;
        bb += y * y;
    }
    return aa > 0.0 && bb > 0.0 ? ab / std::sqrt(aa * bb) : 0.0;
}

/// Slopes along one axis may agree and hide that those along the other are the wrong way round.
void check_axes(const MapPicture& normals, const Image& slopes, const Image& of_height) {
    const double x = correlation(slopes.plane(0), of_height.plane(0)),
                 y = correlation(slopes.plane(1), of_height.plane(1));
    if (x > -least_correlation && y > -least_correlation) return;
    const auto text = [](double value) { return std::to_string(value).substr(0, value < 0.0 ? 5 : 4); };
    refuse_map(normals,
               "has slopes that agree with the height's along one axis alone (correlation along x " +
                   text(x) + ", along y " + text(y) + ")",
               y < x ? std::string("its green points the other way: give --convention ") +
                           (normals.directx ? "opengl" : "directx")
                     : "its red points the other way, as in a mirrored map: turn red round (1 - red)");
}

/// The height, in pixels about 0, of which the normals are.
Image height_of(Device& device, const MapPicture& normals, const MapPicture* height, SurfaceEdges edges) {
    const NormalConvention convention =
        normals.directx ? NormalConvention::directx : NormalConvention::opengl;
    const Image slopes = slopes_of_normals(decode_normals(normals.picture, convention)).slopes;
    IntegrationOptions options;
    options.edges = edges;
    if (height != nullptr) {
        Image coarse = height_plane(*height);
        const Image own = slopes_of_height(coarse, edges);
        const double agree = correlation(slopes.values(), own.values());
        if (!(agree > least_correlation))
            refuse_map(*height,
                       "and '" + normals.name + "' tell of different surfaces (correlation of slopes " +
                           std::to_string(agree).substr(0, 5) + ")",
                       agree < -least_correlation ? "light may be low there: invert the height, or take the "
                                                    "normals as DirectX's (--convention directx)"
                                                  : "give maps that belong together, or leave one out");
        check_axes(normals, slopes, own);
        const auto scale = static_cast<float>(height_scale(slopes, coarse, edges));
        double mean = 0.0;
        for (const float value : coarse.values()) mean += static_cast<double>(value);
        mean /= static_cast<double>(coarse.values().size());
        for (float& value : coarse.values()) value = scale * (value - static_cast<float>(mean));
        options.coarse.emplace().height = std::move(coarse);
    }
    return integrate(device, slopes, options);
}

constexpr int pyramid_factor = 2;
/// Gains are 1 at most: what a model errs by adds to the short waves, and the long ones' number is up to
/// chance. Levels with fewer pixels a side say too little, and hold what the model keeps anyway.
constexpr int least_side = 24;
constexpr int most_gains = 6;

int levels_with_gains(Size size) {
    int levels = 0;
    for (int side = std::min(size.height, size.width); side >= least_side && levels < most_gains; side /= 2)
        ++levels;
    return levels;
}

/// Of each Laplacian level, without what its edges spoil where they do not continue each other.
std::vector<double> level_deviations(const std::vector<Image>& levels) {
    constexpr int margin = 4;
    std::vector<double> result;
    for (size_t k = 0; k + 1 < levels.size(); ++k) {
        const Image& level = levels[k];
        result.push_back(
            deviation(level.crop(margin, margin, {level.height() - 2 * margin, level.width() - 2 * margin})));
    }
    return result;
}

Image with_gains(Device& device, const Image& height, const std::vector<double>& gains) {
    std::vector<Image> levels = decompose(device, height, static_cast<int>(gains.size()) + 1, pyramid_factor);
    for (size_t k = 0; k < gains.size(); ++k)
        for (float& value : levels[k].values()) value *= static_cast<float>(gains[k]);
    return collapse(device, levels, pyramid_factor);
}

std::vector<double> gains_between(Device& device, const Image& sample, const Image& texture) {
    const Size least{std::min(sample.height(), texture.height()), std::min(sample.width(), texture.width())};
    const int count = levels_with_gains(least);
    const auto deviations = [&](const Image& height) {
        return level_deviations(decompose(device, height, count + 1, pyramid_factor));
    };
    const std::vector<double> wanted = deviations(sample);
    std::vector<double> gains(static_cast<size_t>(count), 1.0);
    constexpr int steps = 4;  // levels overlap
    for (int step = 0; step < steps; ++step) {
        const std::vector<double> found = deviations(with_gains(device, texture, gains));
        for (size_t k = 0; k < gains.size(); ++k)
            if (found[k] > 0.0) gains[k] = std::min(gains[k] * wanted[k] / found[k], 1.0);
    }
    return gains;
}

void check_planes(std::span<const MaterialMap> maps, const Image& image) {
    int planes = 0;
    for (const MaterialMap& map : maps) planes += map.planes;
    if (planes != image.planes())
        throw InputError("take the maps of a material apart",
                         "the picture has " + counted(image.planes(), "plane") + ", and the maps " +
                             std::to_string(planes),
                         "give a texture of the material's own model");
}

/// Heights in pixels.
bool is_height(const MaterialMap& map) {
    return map.role == MapRole::height && map.planes == 1 && map.scale > 0.0;
}

/// Normals without a height map: (−Δ)^{1/2} of the height that they tell.
bool is_steepness(const MaterialMap& map) {
    return map.role == MapRole::normal && map.planes == 1;
}

Image one_plane(const Image& image, int plane) {
    Image result(image.size(), 1);
    std::ranges::copy(image.plane(plane), result.values().begin());
    return result;
}

/// Planes of a material as they are put together.
struct Planes {
    std::vector<std::span<const float>> values;
    std::vector<std::string> names;
};

/// Grey of a colour map is light too.
ColourSpace space_of(const MapPicture& map) {
    const Image& image = map.picture.image;
    return map.role == MapRole::colour && image.planes() == 1 ? image.plane_space(0) : image.space();
}

void add_planes(Planes& planes, MaterialMap& map, const Image& image) {
    // What normals tell is neither of their planes.
    const std::string stem = valid_utf8(std::filesystem::path(map.name).stem().string()) +
                             (map.role == MapRole::normal ? ".steepness" : "");
    constexpr std::array<const char*, 3> colours{"R", "G", "B"};
    for (int p = 0; p < image.planes(); ++p) {
        planes.values.emplace_back(image.plane(p));
        planes.names.push_back(image.planes() == 1   ? stem
                               : image.planes() == 3 ? stem + "." + colours.at(static_cast<size_t>(p))
                                                     : stem + "." + std::to_string(p));
    }
    map.planes = image.planes();
}

}  // namespace

MapRole role_of_name(const std::filesystem::path& file) {
    return said_role(file).value_or(MapRole::other);
}

std::vector<MapRole> roles_of_names(std::span<const std::filesystem::path> files) {
    std::vector<MapRole> roles;
    MapRole* silent = nullptr;
    size_t silent_ones = 0;
    roles.reserve(files.size());
    for (const std::filesystem::path& file : files) {
        const std::optional<MapRole> said = said_role(file);
        roles.push_back(said.value_or(MapRole::other));
        if (said) continue;
        silent = &roles.back();
        ++silent_ones;
    }
    if (silent_ones == 1 && std::ranges::find(roles, MapRole::colour) == roles.end())
        *silent = MapRole::colour;
    return roles;
}

bool says_directx(const std::filesystem::path& file) {
    for (const std::string& word : words_of(file))
        if (word == "dx" || word == "directx" || word == "normaldx" || word == "d3d") return true;
    return false;
}

Material join_maps(Device& device, std::span<const MapPicture> maps, SurfaceEdges edges) {
    check_maps(maps);
    const MapPicture* const normals = only_one(maps, MapRole::normal);
    const MapPicture* const height = only_one(maps, MapRole::height);
    Material material;
    Image relief;
    double scale = 0.0;
    if (normals != nullptr) {
        relief = height_of(device, *normals, height, edges);
        if (height == nullptr)
            relief = half_laplacian(device.impl(), relief, edges);
        else if (deviation(relief) > 0.0)
            scale = room_for_heights * encoded_height_scale(relief);
        else
            scale = 1.0;
    } else if (height != nullptr) {
        relief = height_plane(*height);
        material.remarks.emplace_back(
            "nothing tells how high the height map is: its values are kept, and no normals are made");
    }
    Planes planes;
    for (const MapPicture& map : maps) {
        MaterialMap& kept = material.maps.emplace_back();
        kept.name = map.name;
        kept.role = map.role;
        const bool told = map.role == MapRole::normal || map.role == MapRole::height;
        if (!told) kept.space = space_of(map);
        kept.type = map.picture.type;
        kept.file_bytes = map.picture.file_bytes;
        kept.directx = map.directx && map.role == MapRole::normal;
        if (map.role == MapRole::normal && height != nullptr) continue;  // told by the height
        if (told) kept.scale = scale;
        add_planes(planes, kept, told ? relief : map.picture.image);
    }
    material.image = Image(maps.front().picture.image.size(), static_cast<int>(planes.values.size()));
    for (size_t p = 0; p < planes.values.size(); ++p)
        std::ranges::copy(planes.values[p], material.image.plane(static_cast<int>(p)).begin());
    material.image.set_names(planes.names);
    std::vector<ColourSpace> spaces;
    for (const MaterialMap& map : material.maps)
        spaces.insert(spaces.end(), static_cast<size_t>(map.planes),
                      map.role == MapRole::colour ? map.space : ColourSpace::unspecified);
    material.image.set_plane_spaces(spaces);
    const std::string defect = defect_of(material.maps, material.image.planes());
    if (!defect.empty()) throw InputError(asked_join, defect, "rename a file, or leave one out");
    return material;
}

void match_relief(Device& device, std::vector<MaterialMap>& maps, const Image& material,
                  const Image& texture) {
    check_planes(maps, material);
    check_planes(maps, texture);
    int plane = 0;
    for (MaterialMap& map : maps) {
        if (is_height(map))
            map.gains = gains_between(device, one_plane(material, plane), one_plane(texture, plane));
        plane += map.planes;
    }
}

std::vector<Image> split_maps(Device& device, std::span<const MaterialMap> maps, const Image& image,
                              SurfaceEdges edges) {
    check_planes(maps, image);
    std::vector<Image> result;
    std::optional<Image> normals;
    int first = 0;
    for (const MaterialMap& map : maps) {
        Image& own = result.emplace_back(image.size(), std::max(map.planes, 1), map.space);
        for (int p = 0; p < map.planes; ++p) std::ranges::copy(image.plane(first + p), own.plane(p).begin());
        if (is_steepness(map)) own = inverse_half_laplacian(device.impl(), own, edges);
        if (is_height(map) && !map.gains.empty()) own = with_gains(device, own, map.gains);
        if (is_height(map) || is_steepness(map)) normals = normals_of_slopes(slopes_of_height(own, edges));
        first += map.planes;
    }
    for (size_t m = 0; m < maps.size(); ++m)
        if (maps[m].role == MapRole::normal && normals) result[m] = *normals;
    return result;
}

}  // namespace btfield

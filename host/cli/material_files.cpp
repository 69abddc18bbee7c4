#include "host/cli/material_files.hpp"

#include <algorithm>
#include <cmath>
#include <set>
#include <span>
#include <system_error>
#include <utility>

#include "btfield/error.hpp"
#include "btfield/material.hpp"
#include "host/base/file_output.hpp"
#include "host/base/text.hpp"
#include "host/cli/command.hpp"
#include "host/cli/modelled_picture.hpp"
#include "host/cli/options.hpp"
#include "host/cli/output_names.hpp"
#include "host/cli/report.hpp"
#include "host/model/model_names.hpp"
#include "host/relief/relief_names.hpp"

namespace btfield::cli {
namespace {

namespace fs = std::filesystem;

bool is_relief(const MaterialMap& map) {
    return map.role == MapRole::normal || (map.role == MapRole::height && map.scale > 0.0);
}

}  // namespace

void add_joint(CLI::App& app, JointArguments& arguments) {
    const std::string group = "Materials";
    app.add_flag(
           "--joint", arguments.joint,
           "the pictures are maps of one material, registered: one model of all, from which synth grows "
           "all")
        ->group(group);
    const std::string words = detail::words_of<MapRole>("|");
    const auto read = [&arguments, words](const std::vector<std::string>& texts) {
        arguments.roles.clear();
        for (const std::string& text : texts) {
            const auto role = detail::find_value<MapRole>(text);
            if (!role) throw CLI::ValidationError("--roles", "'" + text + "' is none of " + words);
            arguments.roles.push_back(*role);
        }
    };
    app.add_option_function<std::vector<std::string>>(
           "--roles", read,
           "what the maps are, in their order: " + detail::words_of<MapRole>(", ") +
               " (default: by their names)")
        ->delimiter(',')
        ->type_name("ROLE,...")
        ->group(group);
    add_choice(app, "--convention", arguments.normals,
               "which way green points in the normal map: up or down (default: by its name, else opengl)")
        ->group(group);
}

void check_joint(const JointArguments& arguments, std::size_t pictures) {
    if (!arguments.joint && (!arguments.roles.empty() || arguments.normals))
        throw UsageError(std::string(arguments.roles.empty() ? "--convention" : "--roles") +
                         " goes with --joint");
    if (!arguments.roles.empty() && arguments.roles.size() != pictures)
        throw UsageError("--roles: there are " + std::to_string(arguments.roles.size()) + " for " +
                         std::to_string(pictures) + " pictures");
}

bool are_maps(const std::vector<fs::path>& pictures) {
    const std::vector<MapRole> each = roles_of_names(pictures);
    std::set<MapRole> roles(each.begin(), each.end());
    std::set<fs::path> folders;
    for (const fs::path& picture : pictures) folders.insert(picture.parent_path());
    const bool relief = roles.contains(MapRole::normal) || roles.contains(MapRole::height);
    roles.erase(MapRole::other);
    return relief && roles.size() > 1 && folders.size() == 1;
}

void hint_at_joint(const JointArguments& arguments, const std::vector<std::string>& pictures) {
    if (!arguments.joint && are_maps({pictures.begin(), pictures.end()}))
        warn(
            "these look like maps of one material; --joint models them as one, and their textures stay "
            "registered (docs/materials.md)");
}

std::string remedy_for_one_model(const std::vector<std::string>& pictures) {
    return are_maps({pictures.begin(), pictures.end()})
               ? "these look like maps of one material: --joint makes one model of them"
               : "give a folder, such as models/, or --joint where they are maps of one material";
}

void refuse_folders(const std::vector<std::string>& pictures) {
    for (const std::string& each : pictures) {
        std::error_code error;
        if (!fs::is_directory(each, error)) continue;
        const std::set<std::string> extensions{".png", ".jpg", ".jpeg", ".tif", ".tiff", ".exr", ".hdr"};
        std::vector<fs::path> inside;
        for (const fs::directory_entry& entry : fs::directory_iterator(each, error))
            if (extensions.contains(lower_extension(entry.path()))) inside.push_back(entry.path());
        const bool maps = are_maps(inside);
        if (fs::exists(fs::path(each) / "btf.json", error))
            throw InputError("fit '" + each + "'", "it is a folder, with a BTF",
                             "btfield btf fit takes it, as in: btfield btf fit " + each + " -o MODEL.btfm");
        const std::string all = (fs::path(each) / "").string() + "*";
        throw InputError("fit '" + each + "'",
                         maps ? "it is a folder, with maps of one material" : "it is a folder",
                         maps ? "give its maps with --joint, as in: btfield fit " + all + " --joint -o MODEL"
                              : "give the pictures in it, as in: btfield fit " + all + " -o FOLDER/");
    }
}

void warn_of_no_normals(const std::string& file, const Picture& picture) {
    if (picture.image.planes() != 3) return;
    const Image& image = picture.image;
    if (picture.type == PixelType::half || picture.type == PixelType::float32) return;  // coded either way
    constexpr float length_slack = 0.3F;
    std::size_t others = 0;
    for (std::size_t n = 0; n < area(image.size()); ++n) {
        const auto component = [&](int p) { return 2.0F * image.plane(p)[n] - 1.0F; };
        const float x = component(0), y = component(1), z = component(2);
        if (!(z > 0.0F) || std::abs(std::sqrt(x * x + y * y + z * z) - 1.0F) > length_slack) ++others;
    }
    const double share = static_cast<double>(others) / static_cast<double>(area(image.size()));
    if (share > 0.5)
        warn("'" + file + "' does not look like a normal map: " + std::to_string(std::lround(100.0 * share)) +
             " % of its values are no unit vectors that point up");
}

JointPicture read_joint(Device& device, const std::vector<std::string>& files,
                        const JointArguments& arguments, const ReadOptions& options) {
    std::vector<MapPicture> maps;
    const std::vector<MapRole> roles = arguments.roles.empty()
                                           ? roles_of_names(std::vector<fs::path>(files.begin(), files.end()))
                                           : arguments.roles;
    if (arguments.normals && std::ranges::find(roles, MapRole::normal) == roles.end())
        throw UsageError("--convention: none of the maps is a normal map; --roles says what maps are");
    for (std::size_t i = 0; i < files.size(); ++i) {
        MapPicture& map = maps.emplace_back();
        map.name = fs::path(files[i]).filename().string();
        map.role = roles[i];
        map.directx =
            arguments.normals ? *arguments.normals == NormalConvention::directx : says_directx(map.name);
        ReadOptions reading = options;
        reading.keep_values = options.keep_values || map.role != MapRole::colour;  // numbers, no colours
        map.picture = read_told(files[i], reading);
        if (map.role == MapRole::normal) warn_of_no_normals(files[i], map.picture);
    }
    Material material = join_maps(device, maps);
    for (const std::string& remark : material.remarks) warn(remark);
    JointPicture result;
    result.picture.type = maps.front().picture.type;
    result.picture.image = std::move(material.image);
    result.provenance = provenance_of(files.front(), result.picture);
    result.provenance.picture_bytes = 0;
    for (const MapPicture& map : maps)
        result.provenance.picture_bytes += static_cast<std::uint64_t>(map.picture.image.values().size()) *
                                           static_cast<std::uint64_t>(bytes_per_value(map.picture.type));
    result.provenance.maps = std::move(material.maps);
    // Heights in pixels have no limits that a file would know.
    std::size_t plane = 0;
    for (const MaterialMap& map : result.provenance.maps)
        for (int p = 0; p < map.planes; ++p, ++plane)
            if (is_relief(map) && !result.provenance.limits.empty()) result.provenance.limits[plane] = {};
    return result;
}

MaterialFiles::MaterialFiles(const Provenance& provenance, const fs::path& model, fs::path folder,
                             const WritingArguments& writing, std::optional<NormalConvention> normals,
                             ExportArguments exports)
    : maps_(provenance.maps),
      limits_(provenance.limits),
      model_(detail::valid_utf8(model.filename().string())),
      folder_(std::move(folder)),
      writing_(writing),
      normals_(normals),
      exports_(std::move(exports)) {}

PixelType MaterialFiles::type_of(const MaterialMap& map) const {
    const bool floats = writing_.type == PixelType::half || writing_.type == PixelType::float32;
    if (is_relief(map)) return floats && map.role == MapRole::height ? PixelType::float32 : PixelType::uint16;
    if (map.role == MapRole::height && !writing_.type && map.type == PixelType::uint8)
        return PixelType::uint16;  // 256 steps would show
    return writing_.type.value_or(map.type);
}

NormalConvention MaterialFiles::convention(const MaterialMap& map) const {
    return normals_.value_or(map.directx ? NormalConvention::directx : NormalConvention::opengl);
}

std::vector<fs::path> MaterialFiles::names(std::optional<int> number, int count) const {
    std::vector<fs::path> result;
    for (const MaterialMap& map : maps_) {
        const PixelType type = type_of(map);
        const bool floats = type == PixelType::half || type == PixelType::float32;
        const int planes = map.role == MapRole::normal ? 3 : map.planes;
        const char* extension = floats ? ".exr" : planes == 1 || planes == 3 ? ".png" : ".tif";
        const fs::path name = folder_ / fs::path(map.name).stem().concat(extension);
        result.push_back(number ? numbered(name, *number, count) : name);
    }
    return result;
}

void MaterialFiles::check(const std::vector<fs::path>& names, Size size) const {
    for (std::size_t m = 0; m < maps_.size(); ++m)
        check_writable(names[m], maps_[m].role == MapRole::normal ? 3 : maps_[m].planes, maps_[m].type,
                       type_of(maps_[m]), size);
}

std::uintmax_t MaterialFiles::write(Device& device, PictureBatch& pictures,
                                    const std::vector<fs::path>& names, const Image& texture,
                                    SurfaceEdges edges, const std::optional<Crop>& window,
                                    const ExportedMaterial& material, WrittenRemarks& remarks) const {
    std::vector<Image> images = split_maps(device, maps_, texture, edges);
    std::uintmax_t clamped = 0;
    std::size_t plane = 0;
    for (std::size_t m = 0; m < maps_.size(); ++m) {
        const MaterialMap& map = maps_[m];
        Image& image = images[m];
        if (window) image = image.window(window->y, window->x, {window->height, window->width});
        WriteOptions how;
        how.source = map.type;
        how.type = type_of(map);
        how.compression = writing_.compression;
        how.keep_values = writing_.keep_values || map.role != MapRole::colour;
        const auto planes = static_cast<std::size_t>(map.planes);
        if (!limits_.empty() && planes > 0 && !is_relief(map))
            how.limits.assign(limits_.begin() + static_cast<std::ptrdiff_t>(plane),
                              limits_.begin() + static_cast<std::ptrdiff_t>(plane + planes));
        plane += planes;
        if (map.role == MapRole::normal) image = encode_normals(image, convention(map));
        if (map.role == MapRole::height && map.scale > 0.0 && how.type == PixelType::uint16)
            image = encode_height(image, map.scale);
        const WriteReport report = pictures.write(names[m], image, how);
        clamped += report.clamped_pixels;
        remarks.add(names[m], report);
        if (map.role == MapRole::normal && convention(map) == NormalConvention::directx)
            for (float& green : image.plane(1)) green = 1.0F - green;
    }
    write_pictures(pictures, material, images);
    return clamped;
}

ExportedMaterial MaterialFiles::exported(std::optional<int> number, int count, Size size,
                                         bool tileable) const {
    const std::vector<fs::path> files = names(number, count);
    const fs::path stem = fs::path(model_).stem();
    ExportedMaterial material{.model = model_,
                              .name = number ? numbered(stem, *number, count).string() : stem.string(),
                              .size = size,
                              .tileable = tileable,
                              .pixel_size = exports_.pixel_size,
                              .maps = {}};
    for (std::size_t m = 0; m < maps_.size(); ++m) {
        const MaterialMap& map = maps_[m];
        ExportedMap& each = material.maps.emplace_back();
        each.file = files[m].filename().string();
        each.role = map.role;
        each.planes = map.role == MapRole::normal ? 3 : map.planes;
        const PixelType type = type_of(map);
        each.floats = type == PixelType::half || type == PixelType::float32;
        each.directx = map.role == MapRole::normal && convention(map) == NormalConvention::directx;
        if (map.role == MapRole::height) each.scale = each.floats && map.scale > 0.0 ? 1.0 : map.scale;
    }
    return material;
}

MaterialFiles::Exports MaterialFiles::exports(std::optional<int> number, int count) const {
    Exports files;
    const ExportedMaterial material = exported(number, count, {1, 1}, false);
    if (exports_.wants(MaterialExport::gltf)) {
        files.texts.push_back(folder_ / (material.name + ".gltf"));
        files.texts.push_back(folder_ / (material.name + ".bin"));
        const GltfPictures pictures = gltf_pictures(material);
        for (const std::string& file : {pictures.colour, pictures.normal, pictures.packed})
            if (!file.empty()) files.pictures.push_back(folder_ / file);
    }
    if (exports_.wants(MaterialExport::blender)) files.texts.push_back(folder_ / (material.name + ".py"));
    return files;
}

void MaterialFiles::write_pictures(PictureBatch& batch, const ExportedMaterial& material,
                                   const std::vector<Image>& images) const {
    if (!exports_.wants(MaterialExport::gltf)) return;
    const GltfPictures pictures = gltf_pictures(material);
    const auto write = [&](const std::string& file, const Image& image, PixelType type, bool keep) {
        WriteOptions how;
        how.source = type;
        how.type = type;
        how.compression = writing_.compression;
        how.keep_values = keep;
        static_cast<void>(batch.write(folder_ / file, image, how));
    };
    const auto image_of = [&](MapRole role) -> const Image& {
        return images[static_cast<std::size_t>(material.find(role) - material.maps.data())];
    };
    if (!pictures.colour.empty()) write(pictures.colour, image_of(MapRole::colour), PixelType::uint8, false);
    if (!pictures.normal.empty()) write(pictures.normal, image_of(MapRole::normal), PixelType::uint16, true);
    if (!pictures.packed.empty())
        write(pictures.packed, packed_for_gltf(material, images), PixelType::uint8, true);
}

std::vector<std::string> MaterialFiles::write_exports(const ExportedMaterial& material) const {
    std::vector<std::string> remarks;
    const auto write = [&](const char* extension, const std::string& bytes) {
        const fs::path file = folder_ / (material.name + extension);
        detail::write_file(file, bytes, "write '" + file.string() + "'");
    };
    if (exports_.wants(MaterialExport::gltf)) {
        const GltfFiles files = gltf_files(material);
        write(".bin", files.buffer);
        write(".gltf", files.text);
        for (const std::string& file : left_out_of_gltf(material))
            remarks.push_back("'" + file + "' is not in the glTF file, which has no place for it");
    }
    if (exports_.wants(MaterialExport::blender)) write(".py", blender_program(material));
    return remarks;
}

void MaterialFiles::write_side_file(Size size, bool tileable) const {
    Json all = Json::array();
    const std::vector<fs::path> files = names({}, 1);
    for (std::size_t m = 0; m < maps_.size(); ++m) {
        const MaterialMap& map = maps_[m];
        Json object;
        object["file"] = files[m].filename().string();
        object["role"] = name(map.role);
        object["type"] = name(type_of(map));
        if (map.role == MapRole::normal) object["convention"] = std::string(detail::word_of(convention(map)));
        if (map.role == MapRole::height && map.scale > 0.0) {
            object["unit"] = "pixel";
            object["scale"] = map.scale;
            object["mid_grey"] = 32768;
            object["white"] = 65535;
        }
        all.push_back(std::move(object));
    }
    Json object;
    object["size"] = size_json(size);
    object["tileable"] = tileable;
    if (exports_.pixel_size) object["pixel_size_mm"] = *exports_.pixel_size;
    object["axes"] = "x right, y up, z to the viewer";
    object["slopes"] = "central differences";
    object["maps"] = std::move(all);
    const fs::path file = side_file();
    detail::write_file(file, object.dump(2, ' ', false, Json::error_handler_t::replace) + "\n",
                       "write '" + file.string() + "'");
}

}  // namespace btfield::cli

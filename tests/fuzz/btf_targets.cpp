// BTFs: single files of all kinds, names of pictures and the file beside them.

#include <cmath>

#include "btfield/btf_set.hpp"
#include "btfield/btf_textures.hpp"
#include "btfield/error.hpp"
#include "host/btf/picture_folder.hpp"
#include "host/btf/side_file.hpp"
#include "tests/btf_bytes.hpp"
#include "tests/example_model.hpp"
#include "tests/fuzz/fuzz_target.hpp"
#include "tests/fuzz/zip_bytes.hpp"
#include "tests/places.hpp"
#include "tests/temporary_folder.hpp"

namespace btfield::test {
namespace {

/// The set, and a picture of each end.
void read_set(std::string_view bytes) {
    const BtfSet set = BtfSet::open(file_with(bytes));
    const std::vector<BtfPair> pairs = set.pictures();
    demand(!pairs.empty(), "a set without pictures");
    demand(pairs.size() + set.missing().size() == set.views().size() * set.lights().size(),
           "pictures are lost");
    for (const BtfDirection& d : set.views()) demand(d.theta >= 0.0 && d.theta < 1.5708, "a view is below");
    // What is as large as its file by far takes long and shows no more.
    if (area(set.size()) * static_cast<std::size_t>(set.planes()) > (1U << 20U)) return;
    for (const BtfPair& pair : {pairs.front(), pairs.back()}) {
        const Image image = set.picture(pair.view, pair.light);
        demand(image.size() == set.size() && image.planes() == set.planes(), "a picture of another size");
        for (const float value : image.values()) demand(std::isfinite(value), "a value that is not finite");
    }
}

std::vector<std::string> ubo2014_seeds() {
    std::vector<std::string> seeds;
    for (const char* signature :
         {"!FMF06FC", "!FMF06FCR", "!FMF12FCER", "!DFMF08FCR", "!PVF06FC", "!PVF06FCR", "!BDIF06R2!"})
        for (const bool by_pixel : {false, true}) {
            Ubo2014Case what;
            what.signature = signature;
            what.by_pixel = by_pixel;
            what.version = static_cast<std::uint32_t>(1 + seeds.size() % 4);
            what.compression = by_pixel ? 2 : 0;
            seeds.push_back(ubo2014_bytes(what));
        }
    Ubo2014Case old;
    old.signature = "!PVF06FC";
    old.old_pvf = true;
    seeds.push_back(ubo2014_bytes(old));
    return seeds;
}

std::vector<std::string> utia_seeds() {
    return {tbig_bytes(2), tbig_bytes(4, 2), big_bytes(2), big_bytes(4), mif_bytes(2), mif_bytes(4)};
}

/// Two views of two lights, one of them missing, 3 x 2 pixels in grey, and what lies beside them.
std::vector<std::string> zip_seeds() {
    const std::string picture = "P5 3 2 255\nabcdef";
    const std::vector<std::pair<std::string, std::string>> files{
        {"set/btf.json", R"({"format": "btfield-btf", "version": 1, "exposure": 0.5})"},
        {"set/tv000_pv000/tl000_pl000_tv000_pv000.pgm", picture},
        {"set/tv000_pv000/tl045_pl060_tv000_pv000.pgm", picture},
        {"set/tv030_pv090/00003 tl045 pl060 tv030 pv090.pgm", picture},
        {"set/read me.txt", "a set"}};
    return {zip_bytes(files, false), zip_bytes(files, true)};
}

void read_names(std::string_view bytes) {
    const detail::NamedAngles angles = detail::angles_of_name(bytes);
    for (const auto& angle : {angles.tl, angles.pl, angles.tv, angles.pv})
        demand(!angle || std::isfinite(*angle), "an angle that is not finite");
    if (!bytes.starts_with('{')) return;
    const detail::SideFile side = detail::parse_side_file(bytes, "read the bytes");
    demand(side.exposure > 0.0, "an exposure that is not above 0");
}

std::vector<std::string> name_seeds() {
    return {
        "00008 tl000 pl000 tv030 pv030", "tv22.5_pv-90.25_tl7.5_pl-180",
        R"({"format": "btfield-btf", "version": 1, "exposure": 0.5, "white": 100, "height": "height.exr"})"};
}

void read_model_of_either_kind(std::string_view bytes) {
    const std::variant<BtfModel, BtfTextures> model = read_any_btf(file_with(bytes));
    const auto* textures = std::get_if<BtfTextures>(&model);
    if (textures == nullptr) return;
    const TemporaryFolder folder;
    write_btf_textures(folder / "a.btfm", *textures);
    const std::string once = bytes_of(folder / "a.btfm");
    write_btf_textures(folder / "a.btfm", read_btf_textures(folder / "a.btfm"));
    demand(bytes_of(folder / "a.btfm") == once, "a model that was read changes when it is read again");
}

std::vector<std::string> textures_seeds() {
    BtfTextures model;
    model.size = {37, 45};
    model.colours = 3;
    model.views = {{}, {0.5, 1.0}};
    model.lights = {{}, {0.3, 2.0}, {1.0, 4.0}};
    model.pairs = {{0, 0}, {0, 1}, {1, 0}, {1, 2}};
    for (const BtfPair& pair : model.pairs)
        model.true_lights.push_back(model.lights[static_cast<std::size_t>(pair.light)]);
    model.true_lights[1].phi += 0.1;
    model.textures = {example_model(ModelKind::msar3d, 3, 2), example_model(ModelKind::car2d, 3, 1)};
    model.sources = {0, 3};
    model.texture_means.assign(6, 0.25F);
    model.labels = {0, 0, 1, 1};
    model.means.assign(12, 0.5F);
    model.contrasts.assign(12, 100);
    std::vector<std::string> seeds;
    const TemporaryFolder folder;
    for (const BtfMatch match : {BtfMatch::means, BtfMatch::none}) {
        model.match = match;
        if (match == BtfMatch::none) {
            model.means.clear();
            model.contrasts.clear();
        }
        for (const char* name : {"a.json", "a.btfm"}) {
            write_btf_textures(folder / name, model);
            seeds.push_back(bytes_of(folder / name));
        }
    }
    return seeds;
}

}  // namespace

std::vector<FuzzTarget> btf_targets() {
    return {{"btf-ubo2014", &read_set, &ubo2014_seeds},
            {"btf-utia", &read_set, &utia_seeds},
            {"btf-zip", &read_set, &zip_seeds, &repair_zip},
            {"btf-names", &read_names, &name_seeds},
            {"btf-textures", &read_model_of_either_kind, &textures_seeds}};
}

}  // namespace btfield::test

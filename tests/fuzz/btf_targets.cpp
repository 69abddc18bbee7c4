// BTFs: single files of all kinds, names of pictures and the file beside them.

#include <cmath>

#include "btfield/btf_set.hpp"
#include "btfield/error.hpp"
#include "host/btf/picture_folder.hpp"
#include "host/btf/side_file.hpp"
#include "tests/btf_bytes.hpp"
#include "tests/fuzz/fuzz_target.hpp"

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

}  // namespace

std::vector<FuzzTarget> btf_targets() {
    return {{"btf-ubo2014", &read_set, &ubo2014_seeds},
            {"btf-utia", &read_set, &utia_seeds},
            {"btf-names", &read_names, &name_seeds}};
}

}  // namespace btfield::test

#include "btfield/btf_set.hpp"

#include <algorithm>
#include <optional>
#include <string>
#include <system_error>
#include <utility>

#include "btfield/error.hpp"
#include "host/base/text.hpp"
#include "host/btf/byte_file.hpp"
#include "host/btf/containers.hpp"
#include "host/btf/picture_folder.hpp"
#include "host/btf/ubo2014.hpp"

namespace btfield {

using namespace detail;

namespace {

using std::size_t;

constexpr const char* use_set = "use a BTF";

int strided(int count, int stride) {
    return (count + stride - 1) / stride;
}

void check_description(const BtfDescription& d) {
    const size_t pairs = d.views.size() * d.lights.size();
    const auto refuse = [](const std::string& found) {
        throw InputError(use_set, found, "describe the pictures as they are");
    };
    if (pairs == 0) refuse("it has no view or no light");
    if (d.size.height < 1 || d.size.width < 1 || d.planes < 1) refuse("its pictures have no pixels");
    if (!d.names.empty() && d.names.size() != static_cast<size_t>(d.planes))
        refuse("there are names, but not one for each plane");
    if (!d.true_lights.empty() && d.true_lights.size() != pairs)
        refuse("there are true lights, but not one for each view and light");
    if (!d.present.empty() && d.present.size() != pairs)
        refuse("it does not say of each view and light whether there is a picture");
}

void check_options(const BtfOptions& options, Size size) {
    if (options.pixel_stride < 1 || options.view_stride < 1 || options.light_stride < 1)
        throw InputError(use_set, "a stride is below 1", "take every picture and pixel with 1");
    if (!options.crop) return;
    const Crop& c = *options.crop;
    if (c.x < 0 || c.y < 0 || c.width < 1 || c.height < 1 || c.x > size.width - c.width ||
        c.y > size.height - c.height)
        throw InputError(use_set,
                         "the crop " + std::to_string(c.x) + "," + std::to_string(c.y) + "," +
                             std::to_string(c.width) + "," + std::to_string(c.height) +
                             " leaves pictures of " + text_of(size) + " pixels",
                         "give one inside");
}

std::vector<BtfDirection> every(const std::vector<BtfDirection>& all, int stride) {
    std::vector<BtfDirection> result;
    for (size_t i = 0; i < all.size(); i += static_cast<size_t>(stride)) result.push_back(all[i]);
    return result;
}

template <typename Value>
std::vector<Value> every_pair(const std::vector<Value>& all, size_t lights, const BtfOptions& options) {
    std::vector<Value> result;
    if (all.empty()) return result;
    for (size_t v = 0; v < all.size() / lights; v += static_cast<size_t>(options.view_stride))
        for (size_t l = 0; l < lights; l += static_cast<size_t>(options.light_stride))
            result.push_back(all[v * lights + l]);
    return result;
}

/// The part of a picture that is asked for.
Image taken(Image image, const BtfOptions& options) {
    const int step = options.pixel_stride;
    if (!options.crop && step == 1) return image;
    const Crop c = options.crop.value_or(Crop{0, 0, image.width(), image.height()});
    if (step == 1) return image.crop(c.y, c.x, {c.height, c.width});
    Image result({strided(c.height, step), strided(c.width, step)}, image.planes(), image.space());
    result.set_names(image.names());
    for (int p = 0; p < image.planes(); ++p)
        for (int r = 0; r < result.height(); ++r)
            for (int k = 0; k < result.width(); ++k)
                result.at(p, r, k) = image.at(p, c.y + r * step, c.x + k * step);
    return result;
}

std::shared_ptr<const BtfSource> open_source(const std::filesystem::path& path, const BtfOptions& options) {
    const std::string asked = "open the BTF '" + path.string() + "'";
    std::error_code error;
    if (std::filesystem::is_directory(path, error)) return open_picture_folder(path, options);
    const ByteFile file(path, asked);
    std::string head(std::min<std::uint64_t>(file.size(), 16), '\0');
    file.read(0, head.data(), head.size());
    if (head.starts_with("PK\3\4") || head.starts_with("PK\5\6")) return open_picture_folder(path, options);
    if (is_ubo2014(head)) return open_ubo2014(path);
    if (const std::optional<Container> kind = container_of(head, file.size()))
        return open_container(path, *kind);
    throw InputError(
        asked, "it is of no known format",
        "give a folder or zip archive of pictures, or a .btf, TBIG, BIG or MIF file (docs/btf.md)");
}

}  // namespace

BtfSource::~BtfSource() = default;

std::string BtfSource::stamp(int, int) const {
    return {};
}

BtfSet::BtfSet(std::shared_ptr<const BtfSource> source, const BtfOptions& options)
    : source_(std::move(source)), options_(options), description_(source_->description()) {
    check_description(description_);
    check_options(options_, description_.size);
    const size_t lights = description_.lights.size();
    const Crop c = options_.crop.value_or(Crop{0, 0, description_.size.width, description_.size.height});
    description_.size = {strided(c.height, options_.pixel_stride), strided(c.width, options_.pixel_stride)};
    description_.views = every(description_.views, options_.view_stride);
    description_.lights = every(description_.lights, options_.light_stride);
    description_.true_lights = every_pair(description_.true_lights, lights, options_);
    description_.present = every_pair(description_.present, lights, options_);
    if (description_.height.planes() == 1) {
        description_.height = taken(std::move(description_.height), options_);
        for (float& value : description_.height.values()) value /= static_cast<float>(options_.pixel_stride);
    }
}

BtfSet BtfSet::open(const std::filesystem::path& path, const BtfOptions& options) {
    std::error_code error;
    if (!std::filesystem::exists(path, error))
        throw InputError("open the BTF '" + path.string() + "'", "there is no such file or folder",
                         "check the name");
    return BtfSet(open_source(path, options), options);
}

BtfDirection BtfSet::light(int view, int light) const {
    if (description_.true_lights.empty()) return description_.lights[static_cast<size_t>(light)];
    return description_
        .true_lights[static_cast<size_t>(view) * description_.lights.size() + static_cast<size_t>(light)];
}

bool BtfSet::has(int view, int light) const {
    return description_.present.empty() ||
           description_.present[static_cast<size_t>(view) * description_.lights.size() +
                                static_cast<size_t>(light)] != 0;
}

std::vector<BtfPair> BtfSet::pictures() const {
    std::vector<BtfPair> result;
    for (int v = 0; v < static_cast<int>(views().size()); ++v)
        for (int l = 0; l < static_cast<int>(lights().size()); ++l)
            if (has(v, l)) result.push_back({v, l});
    return result;
}

std::vector<BtfPair> BtfSet::missing() const {
    std::vector<BtfPair> result;
    for (int v = 0; v < static_cast<int>(views().size()); ++v)
        for (int l = 0; l < static_cast<int>(lights().size()); ++l)
            if (!has(v, l)) result.push_back({v, l});
    return result;
}

Image BtfSet::picture(int view, int light) const {
    const auto refuse = [&](const std::string& found) {
        throw InputError(
            "read the picture of view " + std::to_string(view) + " and light " + std::to_string(light), found,
            "ask for one that is there");
    };
    if (view < 0 || light < 0 || view >= static_cast<int>(views().size()) ||
        light >= static_cast<int>(lights().size()))
        refuse("there are " + counted(views().size(), "view") + " and " + counted(lights().size(), "light"));
    if (!has(view, light)) refuse("it is missing");
    Image image = source_->picture(view * options_.view_stride, light * options_.light_stride);
    const Size whole = source_->description().size;
    if (image.size() != whole || image.planes() != planes())
        throw InputError(
            "read the picture of view " + std::to_string(view) + " and light " + std::to_string(light),
            "it has " + text_of(image.size()) + " pixels and " + counted(image.planes(), "plane") +
                ", the set " + text_of(whole) + " and " + std::to_string(planes()),
            "give pictures of one size and kind");
    return taken(std::move(image), options_);
}

std::string BtfSet::stamp(int view, int light) const {
    return source_->stamp(view * options_.view_stride, light * options_.light_stride);
}

}  // namespace btfield

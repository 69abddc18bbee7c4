#include "host/btf/picture_folder.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <charconv>
#include <cmath>
#include <memory>
#include <utility>
#include <vector>

#include "btfield/error.hpp"
#include "host/base/text.hpp"
#include "host/btf/direction_grid.hpp"
#include "host/btf/picture_coding.hpp"
#include "host/btf/picture_store.hpp"
#include "host/btf/side_file.hpp"

namespace btfield::detail {
namespace {

namespace fs = std::filesystem;
using std::size_t;

std::string small_letters(std::string text) {
    for (char& c : text) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    return text;
}

bool is_jpeg(const fs::path& file) {
    const std::string extension = small_letters(file.extension().string());
    return extension == ".jpg" || extension == ".jpeg" || extension == ".jpe";
}

bool may_be_picture(const fs::path& file) {
    static constexpr std::array extensions{".png", ".jpg", ".jpeg", ".jpe", ".tif", ".tiff",
                                           ".exr", ".hdr", ".pgm",  ".ppm", ".pnm"};
    const std::string extension = small_letters(file.extension().string());
    return std::ranges::any_of(extensions, [&](const char* e) { return extension == e; });
}

bool is_word(char c) {
    return std::isalnum(static_cast<unsigned char>(c)) != 0;
}

/// The angles of a picture's own name, and of its folder's where they are not there.
NamedAngles angles_of_file(const fs::path& file) {
    NamedAngles angles = angles_of_name(file.stem().string());
    if (angles.complete() || !(angles.tl || angles.tv)) return angles;
    const NamedAngles folder = angles_of_name(file.parent_path().filename().string());
    for (auto member : {&NamedAngles::tl, &NamedAngles::pl, &NamedAngles::tv, &NamedAngles::pv})
        if (!(angles.*member)) angles.*member = folder.*member;
    return angles;
}

std::string format_of(const fs::path& file, const NamedAngles& angles, int planes) {
    const std::string extension = small_letters(file.extension().string());
    if (extension == ".hdr") return "atrium";
    if (is_jpeg(file) && angles.numbered) return "ubo2003";
    const bool view_first = !angles.light_first && !angles.spaced && !angles.numbered;
    if (extension == ".exr" && (planes > 3 || view_first)) return "spectral";
    if ((extension == ".png" || extension == ".exr") && angles.light_first && !angles.spaced) return "utia";
    return "pictures";
}

class PictureFolder : public BtfSource {
  public:
    PictureFolder(const fs::path& path, const BtfOptions& options)
        : asked_("open the BTF '" + path.string() + "'"),
          store_(open_store(path, asked_)),
          decoder_(options) {
        std::vector<NamedAngles> angles;
        list(angles);
        std::vector<MeasuredPair> pairs;
        for (size_t i = 0; i < pictures_.size(); ++i) {
            const StoredFile& file = store_->files()[pictures_[i]];
            const NamedAngles& a = angles[i];
            pairs.push_back({{radians(*a.tv), radians(*a.pv)},
                             {radians(*a.tl), radians(*a.pl)},
                             "'" + printable_path(file.name) + "'"});
            description_.bytes += file.bytes;
        }
        picture_of_ = arrange(pairs, asked_, description_);
        const SideFile side = read_side_file();
        decoder_.set_exposure(side.exposure);
        side_stamp_ = std::to_string(side.exposure) + (side.white ? " " + std::to_string(*side.white) : "");
        const fs::path& first = store_->files()[pictures_.front()].name;
        const Image image = decoder_(store_->read(pictures_.front(), decoder_.reading(first)), first);
        description_.size = image.size();
        description_.planes = image.planes();
        description_.space = image.space();
        description_.names = image.names();
        description_.format = format_of(first, angles.front(), image.planes());
        description_.white = side.white.value_or(image.space() == ColourSpace::xyz ? 100.0 : 1.0);
        if (!side.height.empty()) take_height(side.height);
    }

    [[nodiscard]] const BtfDescription& description() const override { return description_; }

    [[nodiscard]] Image picture(int view, int light) const override {
        const size_t at = static_cast<size_t>(view) * description_.lights.size() + static_cast<size_t>(light);
        const size_t number = pictures_[static_cast<size_t>(picture_of_[at])];
        const fs::path& file = store_->files()[number].name;
        Image image = decoder_(store_->read(number, decoder_.reading(file)), file);
        if (image.size() != description_.size || image.planes() != description_.planes)
            throw InputError("read '" + printable_path(file) + "' for a BTF",
                             "it has " + btfield::detail::text_of(image.size()) + " pixels and " +
                                 counted(image.planes(), "plane") + ", '" +
                                 printable_path(store_->files()[pictures_.front()].name) + "' " +
                                 btfield::detail::text_of(description_.size) + " and " +
                                 std::to_string(description_.planes),
                             "give pictures of one size and kind");
        return image;
    }

    [[nodiscard]] std::string stamp(int view, int light) const override {
        const size_t at = static_cast<size_t>(view) * description_.lights.size() + static_cast<size_t>(light);
        const std::string file = store_->stamp(pictures_[static_cast<size_t>(picture_of_[at])]);
        return file.empty() ? file : file + " " + side_stamp_;
    }

  private:
    /// Names in archives are foreign bytes.
    [[nodiscard]] static std::string printable_path(const fs::path& path) {
        return valid_utf8(path.string());
    }

    [[nodiscard]] SideFile read_side_file() const {
        const int found = store_->find(side_file_name);
        if (found < 0) return {};
        const StoredFile& file = store_->files()[static_cast<size_t>(found)];
        const std::string asked = "read '" + printable_path(file.name) + "'";
        if (file.bytes > (1U << 20U)) throw InputError(asked, "it is no side file of a BTF", "remove it");
        return parse_side_file(store_->content(static_cast<size_t>(found)), asked);
    }

    void take_height(const std::string& name) {
        const int found = store_->find(name);
        const std::string asked = "read '" + valid_utf8(name) + "' for the range map of a BTF";
        if (found < 0) throw InputError(asked, "it is not there", "put it beside btf.json, or remove that");
        ReadOptions reading;
        reading.keep_values = true;
        description_.height = store_->read(static_cast<size_t>(found), reading).image;
        if (description_.height.size() != description_.size || description_.height.planes() != 1)
            throw InputError(asked,
                             "it has " + btfield::detail::text_of(description_.height.size()) +
                                 " pixels and " + counted(description_.height.planes(), "plane") +
                                 ", the pictures " + btfield::detail::text_of(description_.size),
                             "give a map of one plane and their size");
    }

    void list(std::vector<NamedAngles>& all) {
        size_t others = 0;
        for (size_t i = 0; i < store_->files().size(); ++i) {
            const fs::path& file = store_->files()[i].name;
            if (!may_be_picture(file)) continue;
            const NamedAngles angles = angles_of_file(file);
            if (angles.complete()) {
                pictures_.push_back(i);
                all.push_back(angles);
            } else if (file.filename() != height_file_name) {
                ++others;
            }
        }
        if (pictures_.empty())
            throw InputError(asked_,
                             others == 0
                                 ? "there are no pictures in it"
                                 : "no name of its " + counted(others, "picture") + " tells directions",
                             "give a folder of pictures named as tl045_pl060_tv030_pv090.png");
        if (others > 0)
            description_.remarks.push_back(counted(others, "picture") +
                                           (others == 1 ? " whose name tells" : " whose names tell") +
                                           " no directions " + (others == 1 ? "is" : "are") + " left out");
    }

    std::string asked_;
    std::unique_ptr<PictureStore> store_;
    BtfDecoder decoder_;
    std::string side_stamp_;  ///< what btf.json does to values
    BtfDescription description_;
    std::vector<size_t> pictures_;  ///< of the store's files
    std::vector<int> picture_of_;   ///< of these
};

}  // namespace

NamedAngles angles_of_name(std::string_view stem) {
    const std::string text = small_letters(std::string(stem));
    NamedAngles angles;
    size_t first_light = text.size(), first_view = text.size(), first = text.size();
    for (size_t at = 0; at + 2 < text.size(); ++at) {
        if (at > 0 && is_word(text[at - 1])) continue;
        const std::string_view key = std::string_view(text).substr(at, 2);
        std::optional<double>* to = key == "tl"   ? &angles.tl
                                    : key == "pl" ? &angles.pl
                                    : key == "tv" ? &angles.tv
                                    : key == "pv" ? &angles.pv
                                                  : nullptr;
        if (to == nullptr || *to) continue;
        double value = 0.0;
        const char* const begin = text.data() + at + 2;
        const auto [stop, error] =
            std::from_chars(begin, text.data() + text.size(), value, std::chars_format::fixed);
        if (error != std::errc{} || !std::isfinite(value)) continue;
        if (stop != text.data() + text.size() && is_word(*stop)) continue;
        *to = value;
        first = std::min(first, at);
        (key[1] == 'l' ? first_light : first_view) = std::min(key[1] == 'l' ? first_light : first_view, at);
    }
    angles.light_first = first_light < first_view;
    angles.numbered =
        first > 0 && first < text.size() && std::isdigit(static_cast<unsigned char>(text.front())) != 0;
    angles.spaced = text.find(' ') != std::string::npos;
    return angles;
}

std::shared_ptr<const BtfSource> open_picture_folder(const fs::path& path, const BtfOptions& options) {
    return std::make_shared<PictureFolder>(path, options);
}

}  // namespace btfield::detail

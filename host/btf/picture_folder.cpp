#include "host/btf/picture_folder.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <charconv>
#include <cmath>
#include <map>
#include <system_error>
#include <utility>
#include <vector>

#include "btfield/error.hpp"
#include "host/base/text.hpp"
#include "host/btf/direction_grid.hpp"
#include "host/btf/picture_coding.hpp"
#include "host/btf/side_file.hpp"
#include "host/pictures/picture_format.hpp"

namespace btfield::detail {
namespace {

namespace fs = std::filesystem;
using std::size_t;

/// How deep pictures may lie: SET/MATERIAL/VIEW/PICTURE.
constexpr int deepest = 4;

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
    if (extension == ".exr" && planes > 3) return "spectral";
    if ((extension == ".png" || extension == ".exr") && angles.light_first && !angles.spaced) return "utia";
    return "pictures";
}

class PictureFolder : public BtfSource {
  public:
    PictureFolder(const fs::path& folder, const BtfOptions& options) : decoder_(options) {
        const std::string asked = "open the BTF '" + folder.string() + "'";
        list(folder, asked);
        std::vector<MeasuredPair> pairs;
        for (const Named& each : found_) {
            const NamedAngles& a = each.angles;
            pairs.push_back({{radians(*a.tv), radians(*a.pv)},
                             {radians(*a.tl), radians(*a.pl)},
                             "'" + each.file.string() + "'"});
            description_.bytes += each.bytes;
        }
        picture_of_ = arrange(pairs, asked, description_);
        const SideFile side = read_side_file(folder);
        decoder_.set_exposure(side.exposure);
        const Named& first = found_.front();
        const Image image = decoder_(read_picture(first.file, decoder_.reading(first.file)), first.file);
        description_.size = image.size();
        description_.planes = image.planes();
        description_.space = image.space();
        description_.names = image.names();
        description_.format = format_of(first.file, first.angles, image.planes());
        description_.white = side.white.value_or(image.space() == ColourSpace::xyz ? 100.0 : 1.0);
        if (!side.height.empty()) take_height(folder / side.height);
        for (Named& each : found_) files_.push_back(std::move(each.file));
        found_.clear();
    }

    [[nodiscard]] const BtfDescription& description() const override { return description_; }

    [[nodiscard]] Image picture(int view, int light) const override {
        const size_t at = static_cast<size_t>(view) * description_.lights.size() + static_cast<size_t>(light);
        const fs::path& file = files_[static_cast<size_t>(picture_of_[at])];
        Image image = decoder_(read_picture(file, decoder_.reading(file)), file);
        if (image.size() != description_.size || image.planes() != description_.planes)
            throw InputError("read '" + file.string() + "' for a BTF",
                             "it has " + btfield::detail::text_of(image.size()) + " pixels and " +
                                 counted(image.planes(), "plane") + ", '" + files_.front().string() + "' " +
                                 btfield::detail::text_of(description_.size) + " and " +
                                 std::to_string(description_.planes),
                             "give pictures of one size and kind");
        return image;
    }

  private:
    struct Named {
        fs::path file;
        NamedAngles angles;
        std::uintmax_t bytes = 0;
    };

    [[nodiscard]] static SideFile read_side_file(const fs::path& folder) {
        std::error_code error;
        const fs::path file = folder / side_file_name;
        if (!fs::is_regular_file(file, error)) return {};
        const std::string asked = "read '" + file.string() + "'";
        if (fs::file_size(file, error) > (1U << 20U) || error)
            throw InputError(asked, "it is no side file of a BTF", "remove it");
        return parse_side_file(file_content(file), asked);
    }

    void take_height(const fs::path& file) {
        ReadOptions reading;
        reading.keep_values = true;
        description_.height = read_picture(file, reading).image;
        if (description_.height.size() != description_.size || description_.height.planes() != 1)
            throw InputError("read '" + file.string() + "' for the range map of a BTF",
                             "it has " + btfield::detail::text_of(description_.height.size()) +
                                 " pixels and " + counted(description_.height.planes(), "plane") +
                                 ", the pictures " + btfield::detail::text_of(description_.size),
                             "give a map of one plane and their size");
    }

    void list(const fs::path& folder, const std::string& asked) {
        std::error_code error;
        size_t others = 0;
        fs::recursive_directory_iterator at(folder, error);
        for (const fs::recursive_directory_iterator end; !error && at != end; at.increment(error)) {
            if (at.depth() >= deepest) at.disable_recursion_pending();
            std::error_code ignored;
            if (!may_be_picture(at->path()) || !at->is_regular_file(ignored)) continue;
            NamedAngles angles = angles_of_file(at->path());
            if (!angles.complete()) {
                if (at->path().filename() != height_file_name) ++others;
                continue;
            }
            const std::uintmax_t bytes = at->file_size(ignored);
            found_.push_back({at->path(), angles, ignored ? 0 : bytes});
        }
        if (error)
            throw InputError(asked, "it cannot be listed: " + error.message(), "check its permissions");
        if (found_.empty())
            throw InputError(asked,
                             others == 0
                                 ? "there are no pictures in it"
                                 : "no name of its " + counted(others, "picture") + " tells directions",
                             "give a folder of pictures named as tl045_pl060_tv030_pv090.png");
        if (others > 0)
            description_.remarks.push_back(counted(others, "picture") +
                                           (others == 1 ? " whose name tells" : " whose names tell") +
                                           " no directions " + (others == 1 ? "is" : "are") + " left out");
        std::ranges::sort(found_, {}, &Named::file);
    }

    BtfDecoder decoder_;
    BtfDescription description_;
    std::vector<Named> found_;
    std::vector<fs::path> files_;
    std::vector<int> picture_of_;
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

std::shared_ptr<const BtfSource> open_picture_folder(const fs::path& folder, const BtfOptions& options) {
    std::error_code error;
    if (!fs::is_directory(folder, error))
        throw InputError("open the BTF '" + folder.string() + "'", "it is no folder",
                         "give a folder of pictures named as tl045_pl060_tv030_pv090.png");
    return std::make_shared<PictureFolder>(folder, options);
}

}  // namespace btfield::detail

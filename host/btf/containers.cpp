#include "host/btf/containers.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "btfield/error.hpp"
#include "host/base/file_output.hpp"
#include "host/base/half.hpp"
#include "host/base/parallel.hpp"
#include "host/base/text.hpp"
#include "host/btf/byte_file.hpp"
#include "host/btf/direction_grid.hpp"
#include "host/pictures/colour.hpp"

namespace btfield::detail {
namespace {

using std::size_t;
using std::uint64_t;
using namespace std::string_view_literals;

constexpr std::string_view big_magic = "BIG\0\0\0\0\0"sv, mif_magic = "MIF FILE"sv;
/// Against counts that a damaged file claims.
constexpr uint64_t longest_side = 1U << 16U, most_planes = 1024, most_pictures = 1U << 24U;

/// Numbers of chunks. BIG and TBIG have the same things under others.
struct ChunkNumbers {
    std::int64_t width, height, planes, images, type, data, space, directions, tiles;
};
constexpr ChunkNumbers tbig_numbers{1, 2, 3, 4, 5, 6, 8, 14, 20};
constexpr ChunkNumbers big_numbers{4, 3, 5, 1, 7, 8, 9, 16, 2};
constexpr std::int64_t half_type = 2, float_type = 4;
constexpr std::int64_t srgb_space = 1, rgb_space = 2, xyz_space = 3;
constexpr uint64_t mif_half = 9, mif_float = 10;

/// Marks angles in the XML text of a MIF, where its format has no place for them: four numbers to a picture.
constexpr std::string_view angles_begin = "<btfield-angles>", angles_end = "</btfield-angles>";

/// What a file says of its pictures.
struct Contents {
    uint64_t width = 0, height = 0, planes = 0, images = 0, tiles = 1;
    ColourSpace space = ColourSpace::unspecified;
    bool coded = false;  ///< sRGB
    Scalar scalar = Scalar::half;
    std::vector<float> angles;  ///< θi φi θv φv of each picture; empty: it does not say
    std::vector<uint64_t> at;   ///< where each begins

    [[nodiscard]] uint64_t values() const { return width * height * planes; }
};

void check_shape(const Contents& c, const ByteFile& file) {
    const auto refuse = [&](uint64_t found, const char* what) {
        file.refuse("it claims " + std::to_string(found) + " " + what);
    };
    if (c.width < 1 || c.width > longest_side) refuse(c.width, "columns");
    if (c.height < 1 || c.height > longest_side) refuse(c.height, "rows");
    if (c.planes < 1 || c.planes > most_planes) refuse(c.planes, "planes");
    if (c.images < 1 || c.images > most_pictures) refuse(c.images, "pictures");
    if (c.tiles < 1 || c.tiles > most_pictures) refuse(c.tiles, "tiles");
}

/// A whole number of 4 or 8 bytes.
std::int64_t whole_number(ByteCursor cursor, uint64_t length, const ByteFile& file, std::int64_t id) {
    if (length == 8) return cursor.take<std::int64_t>("a chunk");
    if (length == 4) return cursor.take<std::int32_t>("a chunk");
    file.refuse("chunk " + std::to_string(id) + " has " + std::to_string(length) +
                " bytes and is to be a number");
}

struct Chunks {
    Contents contents;
    std::int64_t type = 0, space = 0;
    uint64_t data_at = 0, data_bytes = 0;
};

void read_chunks(ByteCursor cursor, const ByteFile& file, const ChunkNumbers& numbers, Chunks& chunks) {
    Contents& c = chunks.contents;
    while (cursor.left() > 0) {
        const auto id = cursor.take<std::int64_t>("a chunk");
        const auto length = cursor.take<uint64_t>("a chunk");
        const ByteCursor inside = cursor;
        cursor.skip(length, ("chunk " + std::to_string(id)).c_str());
        const auto number = [&] { return whole_number(inside, length, file, id); };
        const auto size = [&] { return static_cast<uint64_t>(number()); };
        if (id == numbers.width) c.width = size();
        if (id == numbers.height) c.height = size();
        if (id == numbers.planes) c.planes = size();
        if (id == numbers.images) c.images = size();
        if (id == numbers.tiles) c.tiles = size();
        if (id == numbers.type) chunks.type = number();
        if (id == numbers.space) chunks.space = number();
        if (id == numbers.directions) {
            ByteCursor angles = inside;
            if (length % (4 * sizeof(float)) != 0)
                file.refuse("its directions have " + std::to_string(length) + " bytes");
            c.angles = angles.take<float>(length / sizeof(float), "its directions");
        }
        if (id == numbers.data) {
            chunks.data_at = inside.at();
            chunks.data_bytes = length;
        }
    }
}

Contents big_contents(const ByteFile& file, Container kind) {
    Chunks chunks;
    const bool big = kind == Container::big;
    read_chunks(ByteCursor(file, big ? big_magic.size() : 0), file, big ? big_numbers : tbig_numbers, chunks);
    Contents& c = chunks.contents;
    check_shape(c, file);
    if (chunks.type < 0)
        throw InputError(file.asked(), "its pictures have values of several types",
                         "convert it to halves or floats");
    // Bytes of a value: what the data have room for.
    const uint64_t values = c.values();
    const uint64_t pictures = c.images * c.tiles;
    const uint64_t width = pictures > chunks.data_bytes / values ? 0 : chunks.data_bytes / values / pictures;
    if ((width != 1 && width != 2 && width != 4) || width * values * pictures != chunks.data_bytes)
        file.refuse("its data have " + std::to_string(chunks.data_bytes) + " bytes for " +
                    std::to_string(pictures) + " pictures of " + std::to_string(values) + " values");
    if ((chunks.type == half_type && width != 2) || (chunks.type == float_type && width != 4))
        file.refuse("its values are said to be of type " + std::to_string(chunks.type) + " and have " +
                    std::to_string(width) + " bytes");
    c.scalar = static_cast<Scalar>(width);
    c.coded = chunks.space == srgb_space;
    if (c.planes == 3) c.space = chunks.space == xyz_space ? ColourSpace::xyz : ColourSpace::linear;
    for (uint64_t i = 0; i < c.images; ++i) c.at.push_back(chunks.data_at + i * c.tiles * values * width);
    return c;
}

/// The numbers between our marks in an XML text.
std::vector<float> angles_of_text(const std::string& xml, const ByteFile& file) {
    const size_t begin = xml.find(angles_begin), end = xml.find(angles_end);
    std::vector<float> angles;
    if (begin == std::string::npos || end == std::string::npos || end < begin) return angles;
    const std::string numbers = xml.substr(begin + angles_begin.size(), end - begin - angles_begin.size());
    const char* at = numbers.c_str();
    while (*at != '\0') {
        char* stop = nullptr;
        const float value = std::strtof(at, &stop);
        if (stop == at) break;
        angles.push_back(value);
        at = stop;
    }
    if (angles.size() % 4 != 0) file.refuse("its XML text has " + std::to_string(angles.size()) + " angles");
    return angles;
}

Contents mif_contents(const ByteFile& file) {
    Contents c;
    c.space = ColourSpace::xyz;
    ByteCursor cursor(file, mif_magic.size());
    cursor.skip(2 * sizeof(uint64_t), "its header");
    std::vector<std::pair<uint64_t, uint64_t>> pictures;  // number, place
    while (cursor.left() > 0) {
        const auto type = cursor.take<uint64_t>("a chunk"), length = cursor.take<uint64_t>("a chunk");
        ByteCursor inside = cursor;
        cursor.skip(length, "a chunk");
        if (type == 1 && length <= (1U << 28U)) {
            std::vector<float> angles = angles_of_text(inside.text(length, "its XML text"), file);
            if (!angles.empty()) c.angles = std::move(angles);
        }
        if (type != 0) continue;
        const auto number = inside.take<uint64_t>("a picture");
        static_cast<void>(inside.take<uint64_t>("a picture"));  // flags
        const auto dtype = inside.take<uint64_t>("a picture");
        Contents own;
        own.images = 1;
        own.height = inside.take<uint64_t>("a picture");
        own.width = inside.take<uint64_t>("a picture");
        own.planes = inside.take<uint64_t>("a picture");
        check_shape(own, file);
        if (dtype != mif_half && dtype != mif_float)
            file.refuse("a picture has the type " + std::to_string(dtype) +
                        ", neither half (9) nor float (10)");
        own.scalar = dtype == mif_half ? Scalar::half : Scalar::float32;
        if (own.values() * static_cast<uint64_t>(own.scalar) + 6 * sizeof(uint64_t) > length)
            file.refuse("a picture has " + std::to_string(length) + " bytes for " +
                        std::to_string(own.values()) + " values");
        if (!pictures.empty() && (own.height != c.height || own.width != c.width || own.planes != c.planes ||
                                  own.scalar != c.scalar))
            file.refuse("its pictures differ in size, planes or type");
        c.height = own.height;
        c.width = own.width;
        c.planes = own.planes;
        c.scalar = own.scalar;
        pictures.emplace_back(number, inside.at());
    }
    std::ranges::sort(pictures);
    c.images = pictures.empty() ? 0 : pictures.back().first + 1;
    check_shape(c, file);
    // Numbers beyond those whose directions are known.
    if (c.images > std::max<uint64_t>(uint64_t{81} * 81, c.angles.size() / 4))
        file.refuse("it has a picture of the number " + std::to_string(c.images - 1) +
                    " and does not tell its directions");
    if (c.planes != 3) c.space = ColourSpace::unspecified;
    c.at.assign(static_cast<size_t>(c.images), 0);
    for (size_t i = 0; i < pictures.size(); ++i) {
        if (i > 0 && pictures[i].first == pictures[i - 1].first)
            file.refuse("it has picture " + std::to_string(pictures[i].first) + " twice");
        c.at[static_cast<size_t>(pictures[i].first)] = pictures[i].second;
    }
    return c;
}

/// Directions of each picture that is there.
std::vector<MeasuredPair> pairs_of(const Contents& c, const ByteFile& file, std::vector<uint64_t>& places) {
    std::vector<MeasuredPair> pairs;
    const std::vector<BtfDirection> table = btf_directions_81();
    const uint64_t side = table.size();
    if (c.angles.empty() && c.images != side * side)
        throw InputError(
            file.asked(),
            "it has " + std::to_string(c.images) + " pictures and does not tell their directions",
            "give a set of 81 x 81 pictures, or one with directions");
    if (!c.angles.empty() && c.angles.size() != 4 * c.images)
        file.refuse("it has directions of " + std::to_string(c.angles.size() / 4) + " pictures, not " +
                    std::to_string(c.images));
    float steepest = 0.0F;
    for (size_t i = 0; i < c.angles.size(); i += 2) steepest = std::max(steepest, c.angles[i]);
    // Nothing is seen from 90 degrees: what is beyond π/2 is no radians.
    const double unit = steepest > 1.5708F ? radians(1.0) : 1.0;
    for (uint64_t i = 0; i < c.images; ++i) {
        if (c.at[i] == 0) continue;
        MeasuredPair& pair = pairs.emplace_back();
        pair.what = "picture " + std::to_string(i);
        places.push_back(c.at[i]);
        if (c.angles.empty()) {
            pair.view = table[i / side];
            pair.light = table[i % side];
        } else {
            const float* angle = c.angles.data() + 4 * i;
            const auto at = [&](int k) { return static_cast<double>(angle[k]) * unit; };
            pair.light = {at(0), at(1)};
            pair.view = {at(2), at(3)};
        }
    }
    return pairs;
}

class ContainerSource : public BtfSource {
  public:
    ContainerSource(ByteFile file, Container kind) : file_(std::move(file)) {
        contents_ = kind == Container::mif ? mif_contents(file_) : big_contents(file_, kind);
        std::vector<uint64_t> places;
        const std::vector<MeasuredPair> pairs = pairs_of(contents_, file_, places);
        contents_.at = std::move(places);
        contents_.angles = {};
        description_.format = kind == Container::tbig ? "tbig" : kind == Container::big ? "big" : "mif";
        description_.size = {static_cast<int>(contents_.height), static_cast<int>(contents_.width)};
        description_.planes = static_cast<int>(contents_.planes);
        description_.space = contents_.space;
        if (contents_.space == ColourSpace::xyz) description_.white = 100.0;
        description_.bytes = file_.size();
        picture_of_ = arrange(pairs, file_.asked(), description_);
        if (contents_.tiles > 1)
            description_.remarks.push_back("it has " + std::to_string(contents_.tiles) +
                                           " tiles of each picture, of which the first is taken");
    }
    [[nodiscard]] const BtfDescription& description() const override { return description_; }
    [[nodiscard]] std::string stamp(int, int) const override { return file_.stamp(); }
    [[nodiscard]] Image picture(int view, int light) const override {
        const size_t at = static_cast<size_t>(view) * description_.lights.size() + static_cast<size_t>(light);
        const uint64_t place = contents_.at[static_cast<size_t>(picture_of_[at])],
                       values = contents_.values();
        std::vector<float> mixed(static_cast<size_t>(values));
        read_scalars(file_, place, contents_.scalar, mixed.data(), values);
        Image image(description_.size, description_.planes, description_.space);
        const auto planes = static_cast<size_t>(contents_.planes);
        for (size_t p = 0; p < planes; ++p) {
            const std::span<float> to = image.plane(static_cast<int>(p));
            for (size_t i = 0; i < to.size(); ++i) to[i] = mixed[i * planes + p];
        }
        if (contents_.coded)
            for (float& value : image.values())
                value = static_cast<float>(srgb_decoded(static_cast<double>(value)));
        return image;
    }

  private:
    ByteFile file_;
    Contents contents_;
    BtfDescription description_;
    std::vector<int> picture_of_;
};

/// A picture as the container has colours: XYZ whose white is 100, which is all that MIF knows.
Image stored(Image image, Container kind, double white) {
    if (image.planes() != 3) return image;
    if (kind == Container::mif) convert(image, ColourSpace::xyz);
    if (image.space() == ColourSpace::xyz && white != 100.0)
        for (float& value : image.values()) value *= static_cast<float>(100.0 / white);
    return image;
}

/// Values of one picture, plane fastest.
std::string packed(const Image& image, PixelType type, const std::string& asked) {
    const auto planes = static_cast<size_t>(image.planes()), pixels = area(image.size());
    const bool half = type == PixelType::half;
    std::string bytes(planes * pixels * (half ? 2 : 4), '\0');
    for (size_t p = 0; p < planes; ++p) {
        const std::span<const float> from = image.plane(static_cast<int>(p));
        for (size_t i = 0; i < pixels; ++i) {
            const float value = from[i];
            const std::uint16_t narrow = half_of_float(value);
            if (!std::isfinite(half ? float_of_half(narrow) : value))
                throw InputError(asked, "a value is " + std::to_string(value), "write type float");
            char* to = bytes.data() + (i * planes + p) * (half ? 2 : 4);
            if (half)
                std::memcpy(to, &narrow, 2);
            else
                std::memcpy(to, &value, 4);
        }
    }
    return bytes;
}

/// θi φi θv φv of each picture, in degrees.
std::vector<float> angles_of(const BtfSet& set, const std::vector<BtfPair>& pairs) {
    std::vector<float> angles;
    for (const BtfPair& pair : pairs) {
        const BtfDirection light = set.light(pair.view, pair.light),
                           view = set.views()[static_cast<size_t>(pair.view)];
        for (const double angle : {light.theta, light.phi, view.theta, view.phi})
            angles.push_back(static_cast<float>(degrees(angle)));
    }
    return angles;
}

void write_head(ByteWriter& to, Container kind, const BtfSet& set, const std::vector<BtfPair>& pairs,
                PixelType type) {
    const std::vector<float> angles = angles_of(set, pairs);
    if (kind == Container::mif) {
        std::string xml = "<mif>" + std::string(angles_begin);
        char number[32];
        for (const float angle : angles) {
            std::snprintf(number, sizeof number, " %.9g", static_cast<double>(angle));
            xml += number;
        }
        xml += std::string(angles_end) + "</mif>";
        const uint64_t picture = uint64_t{6} * 8 + area(set.size()) * static_cast<uint64_t>(set.planes()) *
                                                       static_cast<uint64_t>(bytes_per_value(type));
        to.text(mif_magic);
        to.value(uint64_t{24} + 16 + xml.size() + pairs.size() * (16 + picture));
        to.value(uint64_t{1});
        to.value(uint64_t{1});
        to.value(uint64_t{xml.size()});
        to.text(xml);
        return;
    }
    const bool big = kind == Container::big;
    const ChunkNumbers& n = big ? big_numbers : tbig_numbers;
    if (big) to.text(big_magic);
    const auto chunk = [&](std::int64_t id, std::int64_t value) {
        to.value(id);
        to.value(std::int64_t{8});
        to.value(value);
    };
    chunk(n.width, set.size().width);
    chunk(n.height, set.size().height);
    chunk(n.planes, set.planes());
    chunk(n.images, static_cast<std::int64_t>(pairs.size()));
    chunk(n.tiles, 1);
    chunk(n.type, type == PixelType::half ? half_type : float_type);
    chunk(n.space, set.space() == ColourSpace::xyz ? xyz_space : rgb_space);
    to.value(n.directions);
    to.value(static_cast<std::int64_t>(angles.size() * sizeof(float)));
    to.bytes(angles.data(), angles.size() * sizeof(float));
    to.value(n.data);
    to.value(static_cast<std::int64_t>(pairs.size() * area(set.size()) * static_cast<size_t>(set.planes()) *
                                       static_cast<size_t>(bytes_per_value(type))));
}

}  // namespace

std::optional<Container> container_of(std::string_view head, uint64_t bytes) {
    if (head.starts_with(big_magic)) return Container::big;
    if (head.starts_with(mif_magic)) return Container::mif;
    // TBIG says nothing of itself: a chunk that it knows, of a length that is there.
    if (head.size() < 16) return std::nullopt;
    std::int64_t id = 0, length = 0;
    std::memcpy(&id, head.data(), 8);
    std::memcpy(&length, head.data() + 8, 8);
    if (id < 1 || id > 20 || length < 0 || static_cast<uint64_t>(length) > bytes - 16) return std::nullopt;
    return Container::tbig;
}

std::shared_ptr<const BtfSource> open_container(const std::filesystem::path& path, Container kind) {
    return std::make_shared<ContainerSource>(ByteFile(path, "read '" + path.string() + "'"), kind);
}

void write_container(const std::filesystem::path& path, Container kind, const BtfSet& set, PixelType type,
                     const std::function<void(uint64_t)>& next) {
    const std::string asked = "write '" + path.string() + "'";
    FileOutput output(path, asked);
    ByteWriter to(output.descriptor(), asked);
    const std::vector<BtfPair> pairs = set.pictures();
    write_head(to, kind, set, pairs, type);
    constexpr size_t at_once = 32;
    for (size_t first = 0; first < pairs.size(); first += at_once) {
        std::vector<std::string> packs(std::min(at_once, pairs.size() - first));
        for_each_block(static_cast<int>(packs.size()), [&](int i) {
            const auto [v, l] = pairs[first + static_cast<size_t>(i)];
            packs[static_cast<size_t>(i)] = packed(stored(set.picture(v, l), kind, set.white()), type, asked);
        });
        for (size_t i = 0; i < packs.size(); ++i) {
            if (kind == Container::mif) {
                to.value(uint64_t{0});
                to.value(uint64_t{6} * 8 + packs[i].size());
                for (const uint64_t each :
                     {uint64_t{first + i}, uint64_t{0}, type == PixelType::half ? mif_half : mif_float,
                      static_cast<uint64_t>(set.size().height), static_cast<uint64_t>(set.size().width),
                      static_cast<uint64_t>(set.planes())})
                    to.value(each);
            }
            to.text(packs[i]);
        }
        next(first + packs.size());
    }
    output.commit();
}

}  // namespace btfield::detail

#include "host/btf/ubo2014_header.hpp"

#include <array>
#include <cmath>
#include <string_view>

#include "btfield/error.hpp"
#include "host/btf/ubo2014.hpp"

namespace btfield::detail {
namespace {

struct Signature {
    std::string_view text;
    Ubo2014Kind kind;
    bool rotations;
};

/// Longer ones first: some begin like others.
constexpr std::array<Signature, 7> signatures{{{"!DFMF08FCR", Ubo2014Kind::dfmf, true},
                                               {"!FMF12FCER", Ubo2014Kind::fmf12, true},
                                               {"!BDIF06R2!", Ubo2014Kind::bdi, false},
                                               {"!FMF06FCR", Ubo2014Kind::fmf06, true},
                                               {"!PVF06FCR", Ubo2014Kind::pvf, true},
                                               {"!FMF06FC", Ubo2014Kind::fmf06, false},
                                               {"!PVF06FC", Ubo2014Kind::pvf, false}}};
constexpr std::int32_t old_pvf = 301074;
/// Against counts that a damaged file claims.
constexpr std::uint32_t most_channels = 1024, longest_side = 1U << 16U;

const Signature* signature_of(std::string_view head) {
    for (const Signature& signature : signatures)
        if (head.starts_with(signature.text)) return &signature;
    return nullptr;
}

void read_meta(ByteCursor& cursor, const ByteFile& file, Ubo2014Header& header) {
    const std::uint64_t begin = cursor.at();
    const auto size = cursor.take<std::uint32_t>("its meta data");
    header.version = cursor.take<std::uint32_t>("its meta data");
    cursor.skip(std::uint64_t{3} * 80, "its meta data");
    header.pixels_per_mm = cursor.take<float>("its meta data");
    cursor.skip(3 * sizeof(float), "its meta data");
    std::uint32_t channels = 3;
    if (header.version > 1) header.cosine = cursor.take<std::uint32_t>("its meta data") != 0;
    if (header.version > 2) cursor.skip(cursor.take<std::uint32_t>("its meta data"), "its XML text");
    if (header.version > 3) {
        channels = cursor.take<std::uint32_t>("its channels");
        if (channels < 1 || channels > most_channels)
            file.refuse("it claims " + std::to_string(channels) + " channels");
        for (std::uint32_t c = 0; c < channels; ++c)
            header.channels.push_back(
                cursor.text(cursor.take<std::uint32_t>("its channels"), "its channels"));
    } else {
        header.channels.resize(channels);
    }
    if (cursor.at() - begin != size)
        file.refuse("its meta data claim " + std::to_string(size) + " bytes and have " +
                    std::to_string(cursor.at() - begin));
}

BtfDirection take_direction(ByteCursor& cursor) {
    const auto theta = static_cast<double>(cursor.take<float>("its directions"));
    return {theta, static_cast<double>(cursor.take<float>("its directions"))};
}

void read_sampling(ByteCursor& cursor, const ByteFile& file, Ubo2014Header& header) {
    const auto views = cursor.take<std::uint32_t>("its directions");
    header.first.push_back(0);
    for (std::uint32_t v = 0; v < views; ++v) {
        header.views.push_back(take_direction(cursor));
        const auto count = cursor.take<std::uint32_t>("its directions");
        if (count > cursor.left() / (2 * sizeof(float))) file.refuse("the file ends within its directions");
        std::vector<BtfDirection>& lights = header.lights.emplace_back();
        for (std::uint32_t l = 0; l < count; ++l) lights.push_back(take_direction(cursor));
        header.first.push_back(header.first.back() + count);
    }
    if (header.pictures() == 0) file.refuse("it has no view or no light");
    if (header.pictures() > (1U << 24U))
        file.refuse("it claims " + std::to_string(header.pictures()) + " pictures");
}

void read_size(ByteCursor& cursor, const ByteFile& file, Ubo2014Header& header) {
    header.width = cursor.take<std::uint32_t>("the size of its pictures");
    header.height = cursor.take<std::uint32_t>("the size of its pictures");
    if (header.width < 1 || header.height < 1 || header.width > longest_side || header.height > longest_side)
        file.refuse("its pictures claim " + std::to_string(header.width) + " x " +
                    std::to_string(header.height) + " pixels");
}

}  // namespace

bool is_ubo2014(std::string_view head) {
    return signature_of(head) != nullptr;
}

Ubo2014Header read_ubo2014_header(ByteCursor& cursor, const ByteFile& file) {
    std::string head(std::min<std::uint64_t>(file.size(), 16), '\0');
    file.read(0, head.data(), head.size());
    const Signature* signature = signature_of(head);
    if (signature == nullptr) file.refuse("it is no .btf of UBO2014");
    cursor.skip(signature->text.size(), "its signature");
    Ubo2014Header header;
    header.kind = signature->kind;
    header.rotations = signature->rotations;
    if (header.kind == Ubo2014Kind::pvf) {
        ByteCursor ahead = cursor;
        header.old = ahead.take<std::int32_t>("its meta data") == old_pvf;
        if (header.old) {
            cursor = ahead;
            header.components = cursor.take<std::uint32_t>("its header");
            read_size(cursor, file, header);
            header.view_slots = cursor.take<std::uint32_t>("its header");
            header.channels.resize(3);
            read_sampling(cursor, file, header);
            return header;
        }
    }
    read_meta(cursor, file, header);
    read_sampling(cursor, file, header);
    read_size(cursor, file, header);
    if (header.rotations) skip_rotations(cursor);
    return header;
}

void skip_rotations(ByteCursor& cursor) {
    const auto count = cursor.take<std::uint32_t>("its rotations");
    cursor.skip(count, 9 * sizeof(float), "its rotations");
}

}  // namespace btfield::detail

#include "host/pictures/oiio/picture_encode.hpp"

#include <OpenImageIO/filesystem.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdio>
#include <memory>
#include <set>
#include <system_error>
#include <type_traits>
#include <vector>

#include "btfield/error.hpp"
#include "host/pictures/channels.hpp"
#include "host/pictures/oiio/oiio_handle.hpp"
#include "host/pictures/picture_description.hpp"
#include "host/pictures/pixel_values.hpp"

namespace btfield::detail {
namespace {

/// Where a codec writes. Codecs treat a full disk each in their way: one ends the process, one prints, one
/// leaves out the end and reports success. So none of them sees it: writing always seems to work, and error()
/// tells afterwards.
class OutputFile final : public OIIO::Filesystem::IOProxy {
  public:
    explicit OutputFile(const std::filesystem::path& path)
        : IOProxy(path.string(), Write), file_(std::fopen(path.c_str(), "w+b"), &std::fclose) {
        if (!file_) code_ = errno;
    }
    const char* proxytype() const override { return "btfield"; }
    /// The codec's wish; the file is closed by finish().
    void close() override {}
    bool seek(int64_t offset) override {
        m_pos = offset;
        return true;
    }
    std::size_t read(void* buffer, std::size_t size) override {
        const std::size_t got = pread(buffer, size, m_pos);
        m_pos += static_cast<int64_t>(got);
        return got;
    }
    std::size_t write(const void* buffer, std::size_t size) override {
        pwrite(buffer, size, m_pos);
        m_pos += static_cast<int64_t>(size);
        return size;
    }
    std::size_t pread(void* buffer, std::size_t size, int64_t offset) override {
        return go_to(offset, false) ? std::fread(buffer, 1, size, file_.get()) : 0;
    }
    std::size_t pwrite(const void* buffer, std::size_t size, int64_t offset) override {
        if (go_to(offset, true)) {
            if (std::fwrite(buffer, 1, size, file_.get()) != size) code_ = errno;
            at_ = offset + static_cast<int64_t>(size);
            end_ = std::max(end_, at_);
        }
        return size;
    }
    std::size_t size() const override { return static_cast<std::size_t>(end_); }

    /// Closes the file; 0 when all that was ever written is in it, else the system's error code.
    int finish() {
        if (file_ && std::fclose(file_.release()) != 0 && code_ == 0) code_ = errno;
        return code_;
    }

  private:
    /// Positions the stream, which keeps what follows on without a jump in its buffer.
    bool go_to(int64_t offset, bool to_write) {
        if (code_ != 0) return false;
        if (at_ == offset && to_write) return true;
        at_ = -1;  // after reading, the stream must be positioned anew before it writes
        if (::fseeko(file_.get(), offset, SEEK_SET) != 0) code_ = errno;
        return code_ == 0;
    }
    std::unique_ptr<std::FILE, int (*)(std::FILE*)> file_;
    int64_t at_ = 0;
    int64_t end_ = 0;
    int code_ = 0;
};

OIIO::TypeDesc::BASETYPE codec_type(PixelType type) {
    switch (type) {
        case PixelType::uint8:
            return OIIO::TypeDesc::UINT8;
        case PixelType::uint16:
            return OIIO::TypeDesc::UINT16;
        case PixelType::half:
            return OIIO::TypeDesc::HALF;
        case PixelType::float32:
            break;
    }
    return OIIO::TypeDesc::FLOAT;
}

/// Of planes without names: they sort as the numbers do.
std::vector<std::string> numbered_names(int count) {
    std::vector<std::string> names;
    const std::size_t digits = std::to_string(count - 1).size();
    for (int p = 0; p < count; ++p) {
        const std::string number = std::to_string(p);
        names.push_back("plane" + std::string(digits - number.size(), '0') + number);
    }
    return names;
}

/// As EXR takes them: none empty, none twice, up to 255 bytes.
std::vector<std::string> exr_names(const std::vector<std::string>& names) {
    std::vector<std::string> result = numbered_names(static_cast<int>(names.size()));
    const std::set<std::string> reserved(result.begin(), result.end());
    std::set<std::string> taken;
    for (std::size_t p = 0; p < names.size(); ++p) {
        const std::string name = names[p].substr(0, names[p].find('\0'));
        const bool good = !name.empty() && name.size() <= 255 && !reserved.contains(name);
        if (good && taken.insert(name).second) result[p] = name;
    }
    return result;
}

/// Red, green and blue before other planes.
bool leads_with_colours(const Image& image) {
    if (image.planes() < 4) return false;
    const ColourSpace first = image.plane_space(0);
    return (first == ColourSpace::linear || first == ColourSpace::srgb) && image.plane_space(1) == first &&
           image.plane_space(2) == first;
}

std::string compression_of(const Storage& storage) {
    if (storage.format == PictureFormat::jpeg) return "jpeg:98";
    if (storage.compression == 0) return "none";
    if (storage.format == PictureFormat::exr && storage.compression)
        return "zip:" + std::to_string(*storage.compression);
    return "zip";
}

OIIO::ImageSpec spec_for(const Image& image, const Storage& storage) {
    OIIO::ImageSpec spec(image.width(), image.height(), image.planes(),
                         OIIO::TypeDesc(codec_type(storage.type)));
    constexpr std::array<const char*, 3> letters{"R", "G", "B"};
    // Neutral names: the codec's own would make the second of two or the fourth plane an alpha. EXR sorts by
    // name.
    const bool colour =
        image.planes() == 3 && (image.space() != ColourSpace::unspecified || storage.chromaticities);
    const bool exr = storage.format == PictureFormat::exr;
    if (exr && !image.names().empty()) {
        spec.channelnames = exr_names(image.names());
    } else if (image.planes() == 1) {
        spec.channelnames = {"Y"};
    } else if (colour || (image.planes() == 3 && storage.format != PictureFormat::exr)) {
        spec.channelnames.assign(letters.begin(), letters.end());
    } else {
        spec.channelnames = numbered_names(image.planes());
        if (exr && leads_with_colours(image)) std::copy_n(letters.begin(), 3, spec.channelnames.begin());
    }
    spec.alpha_channel = -1;
    spec.z_channel = -1;

    if (colour) {
        if (image.space() == ColourSpace::srgb) spec.attribute("oiio:ColorSpace", "sRGB");
        if (image.space() == ColourSpace::linear) spec.attribute("oiio:ColorSpace", "Linear");
        if (image.space() == ColourSpace::xyz) {
            spec.attribute("chromaticities", OIIO::TypeDesc(OIIO::TypeDesc::FLOAT, 8),
                           xyz_chromaticities.data());
        } else if (exr && storage.chromaticities) {
            std::array<float, 8> given{};
            std::ranges::transform(*storage.chromaticities, given.begin(),
                                   [](double v) { return static_cast<float>(v); });
            spec.attribute("chromaticities", OIIO::TypeDesc(OIIO::TypeDesc::FLOAT, 8), given.data());
        }
    }
    const std::string description = description_of(image, storage, spec.channelnames);
    if (!description.empty()) spec.attribute("ImageDescription", description);
    spec.attribute("jpeg:subsampling", "4:4:4");
    spec.attribute("Compression", compression_of(storage));
    if (storage.compression.value_or(0) > 0) spec.attribute("tiff:zipquality", *storage.compression);
    spec.attribute("tiff:half", 1);
    spec.attribute("tiff:write_exif", 0);
    spec.attribute("DateTime", "");  // the same picture makes the same file
    return spec;
}

template <class T>
T stored(float value) {
    if constexpr (std::is_integral_v<T>) {
        return to_integer<T>(value);
    } else {
        return T(value);
    }
}

template <class T>
bool write_rows(OIIO::ImageOutput& output, const Image& image, bool no_sign) {
    const auto width = static_cast<std::size_t>(image.width());
    const auto planes = static_cast<std::size_t>(image.planes());
    std::vector<T> strip(width * planes * static_cast<std::size_t>(std::min(strip_rows, image.height())));
    for (int y = 0; y < image.height(); y += strip_rows) {
        const int y_end = std::min(y + strip_rows, image.height());
        const std::size_t first = static_cast<std::size_t>(y) * width;
        const std::size_t count = static_cast<std::size_t>(y_end - y) * width;
        for (std::size_t p = 0; p < planes; ++p) {
            const auto values = image.plane(static_cast<int>(p)).subspan(first, count);
            for (std::size_t i = 0; i < count; ++i) {
                strip[i * planes + p] = stored<T>(no_sign ? std::max(values[i], 0.0F) : values[i]);
            }
        }
        if (!output.write_scanlines(y, y_end, 0, OIIO::BaseTypeFromC<T>::value, strip.data())) return false;
    }
    return true;
}

bool write_rows(OIIO::ImageOutput& output, const Image& image, const Storage& storage) {
    const bool no_sign = storage.format == PictureFormat::hdr;
    switch (storage.type) {
        case PixelType::uint8:
            return write_rows<unsigned char>(output, image, no_sign);
        case PixelType::uint16:
            return write_rows<unsigned short>(output, image, no_sign);
        case PixelType::half:
            return write_rows<half>(output, image, no_sign);
        case PixelType::float32:
            break;
    }
    return write_rows<float>(output, image, no_sign);
}

}  // namespace

void encode_picture(const std::filesystem::path& path, const Image& image, const Storage& storage,
                    const std::string& asked) {
    OutputFile file(path);
    const Writer output(OIIO::ImageOutput::create(std::string(codec_name(storage.format))).release());
    if (!output) throw InputError(asked, OIIO::geterror(), "install OpenImageIO with this format");
    OIIO::ImageSpec spec = spec_for(image, storage);
    OIIO::Filesystem::IOProxy* proxy = &file;
    spec.attribute("oiio:ioproxy", OIIO::TypeDesc::PTR, &proxy);
    const bool opened = output->open(path.string(), spec);
    const bool stored = opened && write_rows(*output, image, storage);
    const bool closed = output->close();
    if (const int code = file.finish(); code != 0) {
        throw InputError(asked, std::generic_category().message(code),
                         "free some space or choose another place");
    }
    if (!stored || !closed || output->has_error()) {
        throw InputError(asked, message_of(*output, "the codec gave up"), "choose another format or size");
    }
}

}  // namespace btfield::detail

#include "btfield/btf_output.hpp"

#include <algorithm>
#include <numeric>
#include <optional>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

#include "btfield/error.hpp"
#include "host/base/file_output.hpp"
#include "host/base/parallel.hpp"
#include "host/base/text.hpp"
#include "host/btf/btf_names.hpp"
#include "host/btf/containers.hpp"
#include "host/btf/fmf_output.hpp"
#include "host/btf/memory_file.hpp"
#include "host/btf/picture_coding.hpp"
#include "host/btf/picture_factors.hpp"
#include "host/btf/side_file.hpp"
#include "host/pictures/picture_codec.hpp"
#include "host/pictures/picture_format.hpp"
#include "host/pictures/stored_picture.hpp"

namespace btfield {

using namespace detail;

namespace {

namespace fs = std::filesystem;
using std::size_t;

std::string asked_of(const fs::path& path) {
    return "write the BTF '" + path.string() + "'";
}

void make_folder(const fs::path& folder) {
    std::error_code error;
    fs::create_directories(folder, error);
    if (error)
        throw InputError("make the folder '" + folder.string() + "'", error.message(),
                         "choose a place that you may write to");
}

std::optional<Container> container_for(BtfFormat format) {
    if (format == BtfFormat::tbig) return Container::tbig;
    if (format == BtfFormat::big) return Container::big;
    if (format == BtfFormat::mif) return Container::mif;
    return std::nullopt;
}

/// Of all pictures together.
bool is_file(BtfFormat format) {
    return container_for(format) || format == BtfFormat::fmf;
}

PixelType type_of_container(const BtfWriteOptions& options) {
    return options.type.value_or(PixelType::half);
}

/// Pictures that are written between two calls of progress.
constexpr size_t pictures_at_once = 64;

bool is_zip_name(const fs::path& path) {
    std::string extension = path.extension().string();
    for (char& c : extension)
        if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
    return extension == ".zip";
}

/// Pictures of a set as files, encoded several at a time.
class EncodedPictures {
  public:
    EncodedPictures(const BtfSet& set, const BtfWriteOptions& options, const std::string& asked)
        : set_(set), options_(options), encoder_(set.description(), options, asked), pairs_(set.pictures()) {}

    [[nodiscard]] std::vector<std::string> names() const {
        std::vector<std::string> names;
        for (const auto& [v, l] : pairs_)
            names.push_back(encoder_
                                .name(set_.views()[static_cast<size_t>(v)], set_.light(v, l),
                                      static_cast<size_t>(v) * set_.lights().size() + static_cast<size_t>(l))
                                .generic_string());
        return names;
    }
    /// Asked for in order.
    std::string content(size_t number) {
        if (number >= first_ + batch_.size()) encode(number);
        std::string bytes = std::move(batch_[number - first_]);
        report_.bytes += bytes.size();
        ++report_.pictures;
        if (options_.progress && report_.pictures % pictures_at_once == 0)
            options_.progress(report_.pictures, pairs_.size());
        return bytes;
    }
    [[nodiscard]] const BtfWriteReport& report() const { return report_; }

  private:
    void encode(size_t first) {
        first_ = first;
        batch_.assign(std::min(pictures_at_once, pairs_.size() - first), {});
        std::vector<std::uintmax_t> clamped(batch_.size());
        for_each_block(static_cast<int>(batch_.size()), [&](int i) {
            const auto at = static_cast<size_t>(i);
            const auto [v, l] = pairs_[first + at];
            const std::string asked = "write a picture of a BTF";
            const MemoryFile file(asked);
            clamped[at] = encoder_.write(file.path(), set_.picture(v, l), asked);
            batch_[at] = file.content();
        });
        report_.clamped_pixels += std::accumulate(clamped.begin(), clamped.end(), std::uintmax_t{0});
    }

    const BtfSet& set_;
    const BtfWriteOptions& options_;
    BtfEncoder encoder_;
    std::vector<BtfPair> pairs_;
    size_t first_ = 0;
    std::vector<std::string> batch_;
    BtfWriteReport report_;
};

std::string height_bytes(const Image& height, const std::string& asked) {
    const MemoryFile file(asked);
    const Storage storage = storage_for(height_file_name, 1, PixelType::float32, PixelType::float32, asked);
    store_picture(file.path(), height, storage, asked);
    return file.content();
}

BtfWriteReport write_archive(const fs::path& path, const BtfSet& set, const BtfWriteOptions& options) {
    const std::string asked = asked_of(path);
    EncodedPictures pictures(set, options, asked);
    std::vector<std::string> names{side_file_name};
    const bool with_height = set.description().height.planes() == 1;
    if (with_height) names.emplace_back(height_file_name);
    const size_t before = names.size();
    for (std::string& name : pictures.names()) names.push_back(std::move(name));
    FileOutput output(path, asked);
    picture_codec(asked).write_archive(
        output.descriptor(), names,
        [&](size_t i) {
            if (i == 0) return side_file_text(set.description(), options.exposure);
            return i < before ? height_bytes(set.description().height, asked) : pictures.content(i - before);
        },
        asked);
    output.commit();
    return pictures.report();
}

BtfWriteReport write_file(const fs::path& path, const BtfSet& set, const BtfWriteOptions& options) {
    const std::optional<Container> kind = container_for(options.format);
    BtfWriteReport report;
    report.pictures = set.pictures().size();
    const std::uint64_t all = report.pictures * (kind ? 1 : factor_readings);
    const auto next = [&](std::uint64_t done) {
        if (options.progress) options.progress(done, all);
    };
    if (kind) {
        write_container(path, *kind, set, type_of_container(options), next);
    } else {
        const FmfReport fmf = write_fmf(path, set, type_of_container(options), options.components, next);
        report.components = fmf.components;
        report.relative_error = fmf.relative_error;
    }
    std::error_code error;
    const std::uintmax_t bytes = fs::file_size(path, error);
    report.bytes = error ? 0 : bytes;
    return report;
}

}  // namespace

std::string_view name(BtfFormat format) {
    return word_of(format);
}

void check_btf_output(const fs::path& path, const BtfDescription& set, const BtfWriteOptions& options) {
    if (options.components < 1)
        throw InputError(asked_of(path), counted(options.components, "component") + " were asked for",
                         "give a number from 1 on");
    if (is_file(options.format)) {
        const std::string asked = asked_of(path);
        if (options.exposure != 1.0)
            throw InputError(asked, "the exposure is not 1, and such a file has no place to say so",
                             "write it with exposure 1");
        if (type_of_container(options) != PixelType::half && type_of_container(options) != PixelType::float32)
            throw InputError(asked, "such a file holds half or float values", "choose one of these types");
        check_output(path, asked);
        return;
    }
    const BtfEncoder encoder(set, options, asked_of(path));
    if (is_zip_name(path)) {
        check_output(path, asked_of(path));
        return;
    }
    std::error_code error;
    if (fs::exists(path, error) && !fs::is_directory(path, error))
        throw InputError(asked_of(path), "a file has that name", "give the name of a folder");
    if (fs::is_directory(path, error)) check_output(path / side_file_name, asked_of(path));
}

BtfWriteReport write_btf(const fs::path& path, const BtfSet& set, const BtfWriteOptions& options) {
    check_btf_output(path, set.description(), options);
    if (is_file(options.format)) return write_file(path, set, options);
    if (is_zip_name(path)) return write_archive(path, set, options);
    const BtfEncoder encoder(set.description(), options, asked_of(path));
    make_folder(path);
    write_side_file(path, set.description(), options.exposure);
    const std::vector<BtfPair> pairs = set.pictures();
    std::vector<std::uintmax_t> clamped(pairs.size()), bytes(pairs.size());
    for (size_t v = 0; v < set.views().size(); ++v) {
        const fs::path folder = path / encoder.name(set.views()[v], set.lights()[0], 0).parent_path();
        make_folder(folder);
    }
    for (size_t first = 0; first < pairs.size(); first += pictures_at_once) {
        const size_t count = std::min(pictures_at_once, pairs.size() - first);
        for_each_block(static_cast<int>(count), [&](int i) {
            const size_t at = first + static_cast<size_t>(i);
            const auto [v, l] = pairs[at];
            const fs::path file =
                path / encoder.name(set.views()[static_cast<size_t>(v)], set.light(v, l),
                                    static_cast<size_t>(v) * set.lights().size() + static_cast<size_t>(l));
            const std::string asked = "write '" + file.string() + "'";
            FileOutput output(file, asked);
            clamped[at] = encoder.write(output.temporary(), set.picture(v, l), asked);
            output.commit(false);
            std::error_code error;
            const std::uintmax_t size = fs::file_size(file, error);
            bytes[at] = error ? 0 : size;
        });
        if (options.progress) options.progress(first + count, pairs.size());
    }
    return {pairs.size(), std::accumulate(bytes.begin(), bytes.end(), std::uintmax_t{0}),
            std::accumulate(clamped.begin(), clamped.end(), std::uintmax_t{0}), 0, 0.0};
}

}  // namespace btfield

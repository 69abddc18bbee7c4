#include "host/cli/picture_options.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <string_view>

#include "btfield/material.hpp"
#include "host/cli/options.hpp"
#include "host/cli/report.hpp"
#include "host/pictures/picture_names.hpp"

namespace btfield::cli {
namespace {

const char* const group = "Pictures";

std::string quoted_path(const std::filesystem::path& path) {
    return "'" + path.string() + "'";
}

}  // namespace

void add_reading(CLI::App& app, ReadOptions& options) {
    app.add_option("--part", options.part,
                   "which of several pictures in a file: its number from 0, or its name (default: the only "
                   "one that is no reduced copy)")
        ->type_name("N|NAME")
        ->group(group);
    app.add_option("--planes", options.planes,
                   "planes to read, by channel name, layer or number from 0 (default: all but alpha)")
        ->delimiter(',')
        ->allow_extra_args(false)
        ->type_name("NAME,...")
        ->group(group);
    app.add_flag("--keep-values", options.keep_values,
                 "take numbers as they are stored: no conversion of colours")
        ->group(group);
}

void add_writing(CLI::App& app, WritingArguments& arguments, bool with_keep_values) {
    const std::string words = detail::words_of<PixelType>("|");
    app.add_option_function<std::string>(
           "--type",
           [&arguments, words](const std::string& text) {
               arguments.type = detail::find_value<PixelType>(text);
               if (!arguments.type)
                   throw CLI::ValidationError("--type", "'" + text + "' is none of " + words);
           },
           "type of values in the file (default: as the picture's, as far as the format holds it)")
        ->type_name(words)
        ->group(group);
    if (with_keep_values)
        app.add_flag("--keep-values", arguments.keep_values,
                     "write numbers as the model has them: neither encoded nor made linear for the format")
            ->group(group);
}

void add_compression(CLI::App& app, WritingArguments& arguments) {
    add_int(app, "--compression", arguments.compression, 0, 9,
            "effort of lossless compression in PNG, TIFF and EXR, 0 to 9 (default: 1 in PNG)")
        ->group(group);
}

/// Whether a file's name says that its one plane is measured, not seen. Words that photographs have in their
/// names too (metal, rough, mask) say nothing.
bool names_a_map(const std::filesystem::path& path) {
    std::string stem = path.stem().string();
    std::ranges::transform(stem, stem.begin(),
                           [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
    constexpr std::array<std::string_view, 6> words{"roughness", "metalness", "metallic",
                                                    "occlusion", "opacity",   "normal"};
    return role_of_name(path) == MapRole::height || std::ranges::any_of(words, [&](std::string_view word) {
               return stem.find(word) != std::string::npos;
           });
}

Picture read_told(const std::filesystem::path& path, const ReadOptions& options) {
    Picture picture = read_picture(path, options);
    if (picture.image.planes() == 1 && names_a_map(path)) picture.image.set_plane_spaces({});
    std::string text;
    for (const std::string& remark : picture.remarks) text += (text.empty() ? "" : "; ") + remark;
    if (std::ranges::any_of(picture.alpha, [](float a) { return a != 1.0F; }))
        text += std::string(text.empty() ? "" : "; ") +
                "it is partly transparent, and transparency is not modelled";
    if (!text.empty()) warn(quoted_path(path) + ": " + text);
    return picture;
}

WriteOptions write_options(const Provenance& provenance, const WritingArguments& arguments) {
    return {provenance.type,           arguments.type,    arguments.keep_values,
            provenance.chromaticities, provenance.limits, arguments.compression};
}

WriteOptions write_options(const Picture& picture, const WritingArguments& arguments) {
    return {picture.type,
            arguments.type,
            arguments.keep_values,
            picture.chromaticities,
            plane_limits(picture.image),
            arguments.compression};
}

void WrittenRemarks::add(const std::filesystem::path& path, const WriteReport& report) {
    for (const std::string& remark : report.remarks) add(Told{remark, path, 1});
}

void WrittenRemarks::add(const WrittenRemarks& others) {
    for (const Told& told : others.told_) add(told);
}

void WrittenRemarks::add(const Told& told) {
    const auto known = std::ranges::find(told_, told.remark, &Told::remark);
    if (known == told_.end()) {
        told_.push_back(told);
    } else {
        known->first = std::min(known->first, told.first);
        known->files += told.files;
    }
}

void WrittenRemarks::tell() const {
    std::vector<Told> ordered = told_;
    std::ranges::stable_sort(ordered, {}, &Told::first);
    for (const Told& told : ordered) {
        const std::string more =
            told.files > 1 ? " and " + std::to_string(told.files - 1) + " more" : std::string();
        warn(quoted_path(told.first) + more + ": " + told.remark);
    }
}

void warn_of_unlike_spaces(const std::filesystem::path& a, const Image& one, const std::filesystem::path& b,
                           const Image& other) {
    const ColourSpace first = one.plane_space(0), second = other.plane_space(0);
    if (first == second || first == ColourSpace::unspecified || second == ColourSpace::unspecified) return;
    warn(quoted_path(a) + " has " + std::string(name(first)) + " values and " + quoted_path(b) + " " +
         std::string(name(second)) +
         " ones, and numbers are compared as they are; formats of one kind, or "
         "synth --keep-values, give the same");
}

}  // namespace btfield::cli

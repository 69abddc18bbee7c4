#include "host/cli/modelled_picture.hpp"

#include <cstdint>
#include <set>
#include <string>
#include <system_error>

#include "btfield/error.hpp"
#include "btfield/model_file.hpp"
#include "host/cli/output_names.hpp"

namespace btfield::cli {
namespace {

/// A model under a picture's name is a slip of the hand, and would replace a picture of that name.
bool is_picture_name(const std::filesystem::path& path) {
    static const std::set<std::string> extensions{".png", ".jpg", ".jpeg", ".tif", ".tiff", ".exr",
                                                  ".hdr", ".pgm", ".ppm",  ".pnm", ".bmp",  ".gif"};
    return extensions.contains(lower_extension(path));
}

}  // namespace

void check_model_output(const std::filesystem::path& output) {
    if (is_picture_name(output))
        throw InputError("write the model '" + output.string() + "'", "that is the name of a picture",
                         "end the name in .json or .btfm");
    check_model_writable(output);
}

void check_model_output(const std::filesystem::path& output, const std::filesystem::path& picture) {
    std::error_code error;
    if (std::filesystem::equivalent(output, picture, error))
        throw InputError("write the model '" + output.string() + "'", "that is the picture",
                         "give the model a name of its own");
    check_model_output(output);
}

Provenance provenance_of(const std::filesystem::path& path, const Picture& picture) {
    Provenance result;
    result.source = path.filename().string();
    result.type = picture.type;
    result.picture_bytes = static_cast<std::uint64_t>(picture.image.values().size()) *
                           static_cast<std::uint64_t>(bytes_per_value(picture.type));
    result.software = "btfield " BTFIELD_VERSION;
    result.chromaticities = picture.chromaticities;
    return result;
}

}  // namespace btfield::cli
